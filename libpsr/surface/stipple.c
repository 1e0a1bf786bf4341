#include <math.h>
#include <stdint.h>
#include "stipple.h"

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
	return opacity <= (float)(uint32_t)sum * 0x1p-32f;
}
