#include <math.h>
#include <stdint.h>
#include "stipple.h"

/* Samples are drawn as wide as they are apart, which narrows holes in proportion to their perimeter, share * (1 -
 * share). So fewer cells are solid than the opacity says: opacity = share + GROWTH * share * (1 - share). Panes of
 * 0.25, 0.5 and 0.75 measure 0.27, 0.51 and 0.74 in passes 1 to 3 at magnifications of 0.5 to 2.7. */
#define GROWTH 0.6f

static float share_of(float opacity)
{
	const float b = 1 + GROWTH;

	return (b - sqrtf(b * b - 4 * GROWTH * opacity)) / (2 * GROWTH);
}

int stipple_is_open(float opacity, const double p[3], double cell)
{
	/* Multiples of the powers of 1 / 1.2207440846, the root of x^4 = x + 1, spread evenly along all three axes. */
	static const uint64_t step[3] = { 3518319155, 2882110345, 2360945575 };
	/* Faces of built things lie on round coordinates: cells do not begin there. */
	static const double offset[3] = { 0.3719, 0.6143, 0.2357 };
	uint64_t sum = 0;

	if (!(opacity > 0) || opacity >= 1)
		return !(opacity > 0);
	for (int k = 0; k < 3; k++)
		sum += (uint64_t)(int64_t)floor(p[k] / cell + offset[k]) * step[k];
	return share_of(opacity) <= (float)(uint32_t)sum * 0x1p-32f;
}
