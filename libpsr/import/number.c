#define _GNU_SOURCE
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "import.h"

#define MAX_NUMBER 128 /* characters; a double has 17 digits */

/* Leaves to strtod: many digits, large exponents, "nan", "inf", and Microsoft's 1.#QNAN. */
static int parse_rare(const uint8_t *word, size_t n, locale_t locale, double *x)
{
	char text[MAX_NUMBER + 1], *end;

	if (n == 0 || n > MAX_NUMBER)
		return 0;
	memcpy(text, word, n);
	text[n] = '\0';
	if (strpbrk(text, "xX( \t\n\v\f\r") != NULL) /* strtod takes more than numbers of decimals */
		return 0;
	*x = strtod_l(text, &end, locale);
	if (*end == '#') {
		*x = NAN;
		return 1;
	}
	return end == text + n;
}

/* Digits up to 2^53 and powers of ten up to 10^22 are exact doubles, so that their product or quotient is the nearest
 * double (W. Clinger, "How to read floating point numbers accurately", 1990). */
int import_number(double *x, const uint8_t *word, size_t n, locale_t locale)
{
	static const double ten[] = { 1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
		                          1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22 };
	size_t i = n > 0 && (word[0] == '-' || word[0] == '+');
	uint64_t digits = 0;
	int exponent = 0, n_digits = 0, power = 0, down;

	for (; i < n && word[i] >= '0' && word[i] <= '9' && n_digits < 18; i++, n_digits++)
		digits = digits * 10 + (uint64_t)(word[i] - '0');
	if (i < n && word[i] == '.')
		for (i++; i < n && word[i] >= '0' && word[i] <= '9' && n_digits < 18; i++, n_digits++, exponent--)
			digits = digits * 10 + (uint64_t)(word[i] - '0');
	if (n_digits > 0 && i + 1 < n && (word[i] == 'e' || word[i] == 'E')) {
		i++;
		down = word[i] == '-';
		i += i + 1 < n && (word[i] == '-' || word[i] == '+');
		for (; i < n && word[i] >= '0' && word[i] <= '9' && power < 1000; i++)
			power = power * 10 + (word[i] - '0');
		exponent += down ? -power : power;
	}
	if (i < n || n_digits == 0 || digits > UINT64_C(1) << 53 || exponent > 22 || exponent < -22)
		return parse_rare(word, n, locale, x);
	*x = exponent < 0 ? (double)digits / ten[-exponent] : (double)digits * ten[exponent];
	if (word[0] == '-')
		*x = -*x;
	return 1;
}
