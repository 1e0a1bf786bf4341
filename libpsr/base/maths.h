/* The transcendental functions of frames, with the same bits on every machine, unlike libm: additions, multiplications
 * and true division in one order. */
#ifndef PSR_BASE_MATHS_H
#define PSR_BASE_MATHS_H

#include <stdint.h>
#include <string.h>

#define PSR_DEGREE (3.14159265358979323846 / 180) /* radians */

/* Computes sin and cos of 0 <= a <= pi; absolute error below 1e-15. */
void psr_sincos(double a, double *s, double *c);

static inline float psr_float_from_bits(uint32_t bits)
{
	float f;
	memcpy(&f, &bits, sizeof f);
	return f;
}

static inline uint32_t psr_bits_from_float(float f)
{
	uint32_t bits;
	memcpy(&bits, &f, sizeof bits);
	return bits;
}

/* Splits 2^exponent into two factors, since it may not fit a float: x * factor[0] * factor[1] is exact unless the
 * result does not fit. */
static inline void psr_power_factors(float factor[2], int exponent)
{
	const int clamped = exponent < -252 ? -252 : exponent > 254 ? 254 : exponent, half = clamped / 2;

	factor[0] = psr_float_from_bits((uint32_t)(127 + half) << 23);
	factor[1] = psr_float_from_bits((uint32_t)(127 + clamped - half) << 23);
}

/* Selects by bits, not branches, so that loops become vectors. */
static inline float psr_choose(int condition, float yes, float no)
{
	const uint32_t mask = 0u - (uint32_t)(condition != 0);
	return psr_float_from_bits((psr_bits_from_float(yes) & mask) | (psr_bits_from_float(no) & ~mask));
}

static inline float psr_where(int condition, float value)
{
	return psr_float_from_bits(psr_bits_from_float(value) & (0u - (uint32_t)(condition != 0)));
}

/* Returns the largest integer <= x; |x| < 2^31. Compiles to a truncation and a compare where the ISA has no
 * rounding. */
static inline int32_t psr_floor_int(float x)
{
	int32_t i = (int32_t)x;
	return i - (x < (float)i);
}

#endif
