/* Random numbers, the same everywhere if no expression draws two of them: SplitMix64 (Steele, Lea, Flood 2014). Any
 * seed will do. */
#ifndef PSR_BASE_RANDOM_H
#define PSR_BASE_RANDOM_H

#include <stdint.h>

static inline uint64_t random_next(uint64_t *state)
{
	uint64_t z = *state += 0x9e3779b97f4a7c15u;

	z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
	z = (z ^ z >> 27) * 0x94d049bb133111ebu;
	return z ^ z >> 31;
}

/* Uniform in [low, high). */
static inline double random_in(uint64_t *state, double low, double high)
{
	return low + (high - low) * ((double)(random_next(state) >> 11) / 9007199254740992.0);
}

/* Uniform in 0..n-1. */
static inline uint32_t random_below(uint64_t *state, uint32_t n)
{
	return (uint32_t)((random_next(state) >> 32) * n >> 32);
}

#endif
