#include <assert.h>
#include <math.h>
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

/* Returns the length of the mean of unit normals. */
static double mean_length(const uint16_t *normal, unsigned n)
{
	const float(*direction)[3] = psr_direction_table();
	double sum[3] = { 0.0, 0.0, 0.0 }, most = 0.0;
	unsigned differ = 0;

	for (unsigned i = 1; i < n; i++)
		differ |= (unsigned)(normal[i] ^ normal[0]);
	if (differ == 0)
		return 1.0;
	for (unsigned i = 0; i < n; i++) {
		const float *d = direction[normal[i]];

		for (int c = 0; c < 3; c++)
			sum[c] += (double)d[c];
		most += sqrt((double)d[0] * (double)d[0] + (double)d[1] * (double)d[1] + (double)d[2] * (double)d[2]);
	}
	return sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]) / most;
}

#define METAL 31       /* steps of what a material has of metal, */
#define REFLECTANCE 30 /* of the root of the reflectance of all else, */
#define ROUGH 255      /* of roughness */

struct material_sums {
	unsigned metallic, shut, rest, reflected; /* rest: not metal; reflected: steps of reflectance, squared, of that */
	double mirrored, width2, plain_width2;
};

static void add_material(struct material_sums *sums, uint32_t material)
{
	const unsigned metallic = material & METAL, rest = METAL - metallic, code = material >> 5 & 31;
	const unsigned root = code < REFLECTANCE ? code : REFLECTANCE, reflected = rest * root * root;
	const double roughness = (material >> 16) * (1.0 / ROUGH), width2 = roughness * roughness * (roughness * roughness);
	const double mirrored = metallic * (REFLECTANCE * REFLECTANCE) + reflected;

	sums->metallic += metallic;
	sums->shut += material >> 10 & 63;
	sums->rest += rest;
	sums->reflected += reflected;
	sums->mirrored += mirrored;
	sums->width2 += mirrored * width2;
	sums->plain_width2 += width2;
}

/* Unlit children count where they are more than half, and alone; else the others do. */
uint32_t octree_mean_material(const struct octree *tree, uint64_t first, unsigned n)
{
	struct material_sums sums = { 0 };
	uint32_t one = OCTREE_UNLIT, differ = 0;
	unsigned n_lit = 0;
	double length;

	for (unsigned i = 0; i < n; i++) {
		const uint32_t material = octree_material(tree, first + i);

		if (material == OCTREE_UNLIT)
			continue;
		if (n_lit++ == 0)
			one = material;
		differ |= material ^ one;
		add_material(&sums, material);
	}
	if (2 * n_lit < n)
		return OCTREE_UNLIT;
	length = tree->normal != NULL && sums.mirrored > 0.0 ? mean_length(tree->normal + first, n) : 1.0;
	if (differ == 0 && !(length < 1.0))
		return one;
	double width2 = sums.mirrored > 0.0 ? sums.width2 / sums.mirrored : sums.plain_width2 / n_lit;
	if (length < 1.0)
		width2 += 2.0 * (1.0 - length) / length; /* NaN and infinity: 1 */
	const double roughness = width2 < 1.0 ? sqrt(sqrt(width2)) : 1.0;
	const double root = sums.rest > 0 ? sqrt((double)sums.reflected / sums.rest) : (double)(one >> 5 & 31);
	return (sums.metallic + n_lit / 2) / n_lit | (uint32_t)(root + 0.5) << 5 | (sums.shut + n_lit / 2) / n_lit << 10
	       | (uint32_t)(roughness * ROUGH + 0.5) << 16;
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
