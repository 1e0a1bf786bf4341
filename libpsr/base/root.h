/* Light without a clamp in 16 bits, for means: 4096 times its root.
 *
 * The square of a code is the light in units of 2^-24, so a sum of squares is exact in integers. A code is off by half,
 * the light of one by 1/20 of a code of 8-bit sRGB at most. Codes end just below 256, 4^PSR_MAX_PASS: as one of so many
 * sub-pixels that much alone makes a pixel white. */
#ifndef PSR_BASE_ROOT_H
#define PSR_BASE_ROOT_H

#include <stdint.h>

#define PSR_ROOT_BITS 24
#define PSR_ROOT_MOST 255.99f

/* NaN and what is below 0 give 0. */
static inline uint16_t psr_root_of_light(float light)
{
	light = light > 0 ? light : 0;
	light = light < PSR_ROOT_MOST ? light : PSR_ROOT_MOST;
	return (uint16_t)(int32_t)(__builtin_sqrtf(light) * 4096.0f + 0.5f);
}

static inline float psr_light_of_root(uint16_t root)
{
	const float part = (float)root * (1 / 4096.0f);

	return part * part;
}

#endif
