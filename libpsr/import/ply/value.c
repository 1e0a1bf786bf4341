#define _GNU_SOURCE
#include <string.h>
#include "ply.h"

static int is_space(uint8_t c)
{
	return c == ' ' || (c >= '\t' && c <= '\r');
}

/* Finds the next word of text; returns its length, 0 at the end. */
static size_t next_word(struct ply_cursor *c, const uint8_t **word)
{
	while (c->at < c->end && is_space(*c->at))
		c->at++;
	*word = c->at;
	while (c->at < c->end && !is_space(*c->at))
		c->at++;
	return (size_t)(c->at - *word);
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

		return n > 0 && import_number(x, word, n, c->locale);
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
