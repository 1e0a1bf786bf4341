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

/* x^y for 0 <= x <= 1 and 1 <= y <= 2^16, for highlights. Relative error below 3e-7 * (1 - y ln x); results below 2^-60
 * are 0.
 *
 * log2 x = e + log2 m with m in [sqrt 1/2, sqrt 2), as an odd series in s = (m - 1) / (m + 1), which is exact at x = 1,
 * where large exponents need it; 2^t by its series on [-1/2, 1/2]. Truncation errors: 2 s^13 / 13 / ln 2 < 2e-11 (s <=
 * 0.172), (ln 2 / 2)^8 / 8! < 6e-9.
 *
 * Two halves, for loops of their own: y log2 x, or -60 where the result is 0; and the power of two. */
static inline float psr_power_exponent(float x, float y)
{
	uint32_t bits = psr_bits_from_float(x);
	int32_t e = (int32_t)((bits - 0x3f3504f3u) >> 23 << 23) >> 23;
	float m = psr_float_from_bits(bits - ((uint32_t)e << 23));
	float s = (m - 1.0f) / (m + 1.0f);
	float q = s * s;
	float p = 0.26230813f;              /* 2 / (11 ln 2) */
	p = p * q + 0.32059890f;            /* 2 / (9 ln 2) */
	p = p * q + 0.41219858f;            /* 2 / (7 ln 2) */
	p = p * q + 0.57707802f;            /* 2 / (5 ln 2) */
	p = p * q + 0.96179669f;            /* 2 / (3 ln 2) */
	p = p * q + 2.88539008f;            /* 2 / ln 2 */
	float power = ((float)e + s * p) * y;
	return psr_choose((power > -60.0f) & (bits >= 0x00800000), power, -60.0f);
}

static inline float psr_power_of_two(float t)
{
	int32_t n = psr_floor_int(t + 0.5f);
	float f = t - (float)n;
	float p = 1.5252733e-5f;            /* (ln 2)^7 / 7! */
	p = p * f + 1.5403530e-4f;
	p = p * f + 1.3333558e-3f;
	p = p * f + 9.6181291e-3f;
	p = p * f + 5.5504109e-2f;
	p = p * f + 2.4022651e-1f;
	p = p * f + 6.9314718e-1f;
	p = p * f + 1.0f;
	float result = p * psr_float_from_bits((uint32_t)(n + 127) << 23);
	return psr_where(t > -60.0f, result);
}

static inline float psr_power(float x, float y)
{
	return psr_power_of_two(psr_power_exponent(x, y));
}

#endif
