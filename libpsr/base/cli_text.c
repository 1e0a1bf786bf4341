#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "cli.h"

#define NUMBER_TEXT 64

/* Returns the length of the decimal number at the beginning of text, or 0. Takes no spaces, hex, inf or nan. */
static size_t number_length(const char *text)
{
	const char *at = text;
	size_t n_digits = 0;

	if (*at == '+' || *at == '-')
		at++;
	for (; isdigit((unsigned char)*at); at++)
		n_digits++;
	if (*at == '.')
		for (at++; isdigit((unsigned char)*at); at++)
			n_digits++;
	if (n_digits == 0)
		return 0;
	if (*at == 'e' || *at == 'E') {
		const char *exponent = at + 1 + (at[1] == '+' || at[1] == '-');

		if (isdigit((unsigned char)*exponent)) {
			for (at = exponent; isdigit((unsigned char)*at);)
				at++;
		}
	}
	return (size_t)(at - text);
}

static int read_real(const char **text, double *v)
{
	char copy[NUMBER_TEXT], *end;
	size_t length = number_length(*text);

	if (length == 0 || length >= sizeof copy)
		return 0;
	memcpy(copy, *text, length);
	copy[length] = '\0';
	*v = strtod(copy, &end);
	if (*end != '\0' || !isfinite(*v))
		return 0;
	*text += length;
	return 1;
}

static int finish(const char *at, const char **end)
{
	if (end == NULL)
		return *at == '\0';
	*end = at;
	return 1;
}

int psr_parse_real(const char *text, double *v, const char **end, struct psr_error *err)
{
	const char *at = text;
	double read;

	if (!read_real(&at, &read) || !finish(at, end))
		return psr_fail(err, PSR_ERR_ARG, "'%.80s' is not a finite decimal number such as 1.5", text);
	*v = read;
	return PSR_OK;
}

int psr_parse_vec3(const char *text, double v[3], const char **end, struct psr_error *err)
{
	const char *at = text;
	double read[3];
	int ok = 1;

	for (int i = 0; i < 3 && ok; i++) {
		ok = read_real(&at, &read[i]);
		if (ok && i < 2)
			ok = *at++ == ',';
	}
	if (!ok || !finish(at, end))
		return psr_fail(err, PSR_ERR_ARG, "'%.80s' is not three finite numbers with commas between, such as 0,1.5,-2",
		                text);
	memcpy(v, read, sizeof read);
	return PSR_OK;
}

int psr_parse_color(const char *text, uint8_t rgb[3], const char **end, struct psr_error *err)
{
	unsigned value = 0;
	int ok = text[0] == '#';

	for (int i = 1; i <= 6 && ok; i++) {
		ok = isxdigit((unsigned char)text[i]) != 0;
		value = value << 4 | (unsigned)(isdigit((unsigned char)text[i]) ? text[i] - '0' : (text[i] | 32) - 'a' + 10);
	}
	if (!ok || !finish(text + 7, end))
		return psr_fail(err, PSR_ERR_ARG, "'%.80s' is not a color such as #80c0ff", text);
	for (int i = 0; i < 3; i++)
		rgb[i] = (uint8_t)(value >> (16 - 8 * i));
	return PSR_OK;
}

size_t psr_edit_distance(const char *a, size_t n_a, const char *b)
{
	size_t n_b = strlen(b), row[64];

	if (n_a > 63 || n_b > 63)
		return n_a + n_b;
	for (size_t j = 0; j <= n_b; j++)
		row[j] = j;
	for (size_t i = 1; i <= n_a; i++) {
		size_t diagonal = row[0];

		row[0] = i;
		for (size_t j = 1; j <= n_b; j++) {
			size_t best = diagonal + (a[i - 1] != b[j - 1]);

			diagonal = row[j];
			if (row[j] + 1 < best)
				best = row[j] + 1;
			if (row[j - 1] + 1 < best)
				best = row[j - 1] + 1;
			row[j] = best;
		}
	}
	return row[n_b];
}
