#include <assert.h>
#include "octree.h"
#include "base/direction.h"

/* sqrt(3): from corner to corner of a cube of edge 1. */
#define DIAGONAL 1.7320508075688772

double octree_offset(unsigned step)
{
	assert(step < OCTREE_OFFSETS);
	return DIAGONAL * (((double)step + 0.5) / OCTREE_OFFSETS - 0.5);
}

unsigned octree_offset_step(double offset)
{
	const double step = (offset / DIAGONAL + 0.5) * OCTREE_OFFSETS;

	return step >= OCTREE_OFFSETS - 1 ? OCTREE_OFFSETS - 1 : step > 0.0 ? (unsigned)step : 0; /* NaN: 0 */
}

uint16_t octree_mean_normal(const uint16_t *normal, unsigned n)
{
	const float(*direction)[3] = psr_direction_table();
	double sum[3] = { 0.0, 0.0, 0.0 };
	unsigned differ = 0;

	/* Cells of clouds have one normal, which is its own mean. */
	for (unsigned i = 1; i < n; i++)
		differ |= (unsigned)(normal[i] ^ normal[0]);
	if (differ == 0)
		return normal[0];
	for (unsigned i = 0; i < n; i++)
		for (int c = 0; c < 3; c++)
			sum[c] += (double)direction[normal[i]][c];
	const float mean[3] = { (float)sum[0], (float)sum[1], (float)sum[2] };

	return psr_direction_encode(mean);
}

void octree_mean_color(uint8_t mean[3], const uint8_t (*color)[3], unsigned n)
{
	/* 65536 / n, rounded up: exact for sums of up to 8 bytes and n / 2. */
	static const uint32_t part[9] = { 0, 65536, 32768, 21846, 16384, 13108, 10923, 9363, 8192 };
	uint32_t sum[3] = { n / 2, n / 2, n / 2 };

	for (unsigned i = 0; i < n; i++)
		for (int c = 0; c < 3; c++)
			sum[c] += color[i][c];
	for (int c = 0; c < 3; c++)
		mean[c] = (uint8_t)(sum[c] * part[n] >> 16);
}

unsigned octree_mean_offset(unsigned code, uint16_t mean, const uint16_t *normal, const uint8_t *offset)
{
	/* Where octants are from the middle of their node, in edges of theirs. */
	static const double octant[8][3] = {
		{ -0.5, -0.5, -0.5 }, { 0.5, -0.5, -0.5 }, { -0.5, 0.5, -0.5 }, { 0.5, 0.5, -0.5 },
		{ -0.5, -0.5, 0.5 },  { 0.5, -0.5, 0.5 },  { -0.5, 0.5, 0.5 },  { 0.5, 0.5, 0.5 },
	};
	const float(*direction)[3] = psr_direction_table(), *along = direction[mean];
	double sum = 0.0;
	int n = 0;

	for (unsigned left = code; left != 0; left &= left - 1, n++) {
		const double *half = octant[__builtin_ctz(left)], far = octree_offset(offset[n]);
		const float *own = direction[normal[n]];

		for (int c = 0; c < 3; c++)
			sum += (double)along[c] * (half[c] + far * (double)own[c]);
	}
	return octree_offset_step(sum / (2 * n));
}
