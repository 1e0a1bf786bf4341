#define _GNU_SOURCE
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "ply.h"

#define MAX_NUMBER 128 /* characters; 17 digits say all of a double */

static int is_space(uint8_t c)
{
	return c == ' ' || (c >= '\t' && c <= '\r');
}

/* The next word of text, at *word; 0 at the end. */
static size_t next_word(struct ply_cursor *c, const uint8_t **word)
{
	while (c->at < c->end && is_space(*c->at))
		c->at++;
	*word = c->at;
	while (c->at < c->end && !is_space(*c->at))
		c->at++;
	return (size_t)(c->at - *word);
}

/* What is left to C's own: many digits, large exponents, "nan", "inf", and Microsoft's 1.#QNAN. */
static int parse_rare(const uint8_t *word, size_t n, locale_t locale, double *x)
{
	char text[MAX_NUMBER + 1], *end;

	if (n == 0 || n > MAX_NUMBER)
		return 0;
	memcpy(text, word, n);
	text[n] = '\0';
	if (strpbrk(text, "xX(") != NULL)
		return 0;
	*x = strtod_l(text, &end, locale);
	if (*end == '#') {
		*x = NAN;
		return 1;
	}
	return end == text + n;
}

/* Digits of at most 2^53 and a power of ten of at most 10^22 are exact doubles, so that their product or quotient is
 * the nearest to what is written (W. Clinger, "How to read floating point numbers accurately", 1990). */
static int parse_number(const uint8_t *word, size_t n, locale_t locale, double *x)
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

static uint64_t bits_of(const struct ply_cursor *c, size_t size)
{
	uint64_t bits = 0;

	for (size_t i = 0; i < size; i++)
		bits |= (uint64_t)c->at[i] << 8 * (c->format == PLY_LITTLE ? i : size - 1 - i);
	return bits;
}

int ply_value(struct ply_cursor *c, enum ply_type type, double *x)
{
	const size_t size = ply_type_size(type);
	const uint8_t *word;
	uint64_t bits;
	uint32_t low;
	float single;

	if (c->format == PLY_ASCII) {
		size_t n = next_word(c, &word);

		return n > 0 && parse_number(word, n, c->locale, x);
	}
	if ((size_t)(c->end - c->at) < size)
		return 0;
	bits = bits_of(c, size);
	c->at += size;
	low = (uint32_t)bits;
	switch (type) {
	case PLY_INT8:
		*x = (double)(int)(low ^ 0x80) - 0x80;
		break;
	case PLY_INT16:
		*x = (double)(int)(low ^ 0x8000) - 0x8000;
		break;
	case PLY_INT32:
		*x = (double)(low ^ 0x80000000) - 2147483648.0;
		break;
	case PLY_FLOAT:
		memcpy(&single, &low, sizeof single);
		*x = (double)single;
		break;
	case PLY_DOUBLE:
		memcpy(x, &bits, sizeof *x);
		break;
	default:
		*x = (double)low;
	}
	return 1;
}

int ply_skip(struct ply_cursor *c, enum ply_type type, uint64_t n)
{
	const size_t size = ply_type_size(type);
	const uint8_t *word;

	if (c->format == PLY_ASCII) {
		while (n > 0 && next_word(c, &word) > 0)
			n--;
		return n == 0;
	}
	if (n > (uint64_t)(c->end - c->at) / size)
		return 0;
	c->at += n * size;
	return 1;
}
