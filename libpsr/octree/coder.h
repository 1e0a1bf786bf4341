/* An adaptive binary arithmetic coder: integers alone, the same bytes on every machine. One function codes a bit in
 * both directions, so a model is written once. Probabilities have 16 bits: of a 1. */
#ifndef PSR_OCTREE_CODER_H
#define PSR_OCTREE_CODER_H

#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

struct coder {
	uint8_t *bytes;       /* coding: of malloc(), which the caller frees; decoding: the caller's, only read */
	size_t n, room;       /* bytes written or read; room, or all bytes that there are to read */
	uint64_t low;
	uint32_t range, code;
	uint64_t held;        /* bytes that a carry may still change: the first, then 255s */
	uint8_t first;
	int has_failed;       /* coding: no memory; decoding: read behind the end */
};

static inline void coder_begin(struct coder *c)
{
	*c = (struct coder){ .range = UINT32_MAX };
}

static inline void coder_put_byte(struct coder *c, uint8_t byte)
{
	if (c->n == c->room) {
		const size_t room = c->room + c->room / 2 + 4096;
		uint8_t *grown = c->has_failed ? NULL : realloc(c->bytes, room);

		if (grown == NULL) {
			c->has_failed = 1;
			return;
		}
		c->bytes = grown;
		c->room = room;
	}
	c->bytes[c->n++] = byte;
}

static inline void coder_shift(struct coder *c)
{
	/* No carry reaches the first byte of all, so that may be 255 by itself. */
	if (c->held == 0 || c->low < 0xff000000u || c->low >> 32 != 0) {
		const uint8_t carry = (uint8_t)(c->low >> 32);

		if (c->held > 0)
			coder_put_byte(c, (uint8_t)(c->first + carry));
		for (; c->held > 1; c->held--)
			coder_put_byte(c, (uint8_t)(0xff + carry));
		c->first = (uint8_t)(c->low >> 24);
		c->held = 0;
	}
	c->held++;
	c->low = (c->low & 0x00ffffff) << 8;
}

static inline void coder_end(struct coder *c)
{
	for (int i = 0; i < 5; i++)
		coder_shift(c);
}

static inline uint8_t coder_get_byte(struct coder *c)
{
	if (c->n < c->room)
		return c->bytes[c->n++];
	c->has_failed = 1;
	return 0;
}

static inline void coder_open(struct coder *c, const uint8_t *bytes, size_t n)
{
	*c = (struct coder){ .bytes = (uint8_t *)(uintptr_t)bytes, .room = n, .range = UINT32_MAX };
	for (int i = 0; i < 4; i++)
		c->code = c->code << 8 | coder_get_byte(c);
}

/* Returns whether the stream ended where it should, and as coder_end() ends it: with all of `low`, from which `code`
 * counts. So no bit may have another value. */
static inline int coder_is_at_end(const struct coder *c)
{
	return !c->has_failed && c->n == c->room && c->code == 0;
}

/* Codes a bit whose probability to be 1 is p / 65536, 1..65535. Decoding ignores `bit`. Returns the bit. is_decoding is
 * a constant of the caller. */
static inline __attribute__((always_inline)) unsigned coder_bit(struct coder *c, int is_decoding, uint32_t p,
                                                                unsigned bit)
{
	const uint32_t bound = (uint32_t)((uint64_t)c->range * p >> 16);

	uint32_t none; /* all bits for a 0: a branch would often be foretold wrongly */

	if (is_decoding)
		bit = c->code < bound;
	none = bit - 1u;
	if (is_decoding)
		c->code -= bound & none;
	else
		c->low += bound & none;
	c->range = bound + ((c->range - 2 * bound) & none);
	while (c->range < 1u << 24) {
		c->range <<= 8;
		if (is_decoding)
			c->code = c->code << 8 | coder_get_byte(c);
		else
			coder_shift(c);
	}
	return bit;
}

/* Codes a bit by a probability that learns from it: by a part of 2^-rate of what it was wrong, rate 4 or 5. It starts
 * as CODER_EVEN, and stays above 14 and below 65521 by itself. */
#define CODER_EVEN 32768
static inline __attribute__((always_inline)) unsigned coder_adaptive(struct coder *c, int is_decoding, uint16_t *p,
                                                                     unsigned rate, unsigned bit)
{
	bit = coder_bit(c, is_decoding, *p, bit);
	*p = (uint16_t)(bit ? *p + ((65535 - *p) >> rate) : *p - (*p >> rate));
	return bit;
}

/* What a probability of 22 bits above a count of 10 becomes after a bit: what it was wrong by goes into it by
 * part[count] / 2^14, and the count goes up by `more`. Modulo 2^32. */
#define CODER_COUNTED_EVEN (UINT32_C(1) << 31)
static inline uint32_t coder_count(uint32_t was)
{
	return was & 1023;
}

static inline __attribute__((always_inline)) uint32_t coder_learn(uint32_t was, const uint32_t *part, uint32_t more,
                                                                  unsigned bit)
{
	const int32_t wrong = (int32_t)(bit << 22) - (int32_t)(was >> 10);

	return was + (((uint32_t)(wrong >> 4) * part[coder_count(was)]) & ~1023u) + more;
}

#endif
