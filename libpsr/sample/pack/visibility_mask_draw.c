#include <assert.h>
#include <math.h>
#include <string.h>
#include "base/mem.h"
#include "psr/error.h"
#include "render/block.h"
#include "visibility_mask_draw.h"

#define MOST_SIDE 4000 /* its square is below 2^24, with margins */
#define MARGIN (MASK_PICTURE_REACH + 1) /* pixels */
#define CHUNK 16 /* samples */

/* Steps of the lattice: the distance of samples on a surface tilted by 25 degrees. Smaller pixels have holes, and a
 * sample behind a hole counts as seen. */
#define PIXEL 1.11f

static int alloc_points(struct mask_points *points, size_t n)
{
	points->x = psr_alloc_array(n, sizeof *points->x);
	points->y = psr_alloc_array(n, sizeof *points->y);
	points->z = psr_alloc_array(n, sizeof *points->z);
	points->normal = psr_alloc_array(n, sizeof *points->normal);
	return points->x != NULL && points->y != NULL && points->z != NULL && points->normal != NULL ? PSR_OK
	                                                                                             : PSR_ERR_MEMORY;
}

int mask_points_init(struct mask_points *points, const struct psr_blocks *blocks)
{
	float reach2 = 0;

	memset(points, 0, sizeof *points);
	points->blocks = blocks;
	if (alloc_points(points, blocks->n_samples + MASK_POINTS_BEYOND) != PSR_OK) {
		mask_points_fini(points);
		return PSR_ERR_MEMORY;
	}
	for (uint32_t b = 0; b < blocks->n_blocks; b++) {
		uint32_t k = psr_blocks_attr_first(blocks, b);

		for (uint64_t left = blocks->mask[b]; left != 0; left &= left - 1, k++) {
			float p[3], length2;

			block_position(blocks, b, (uint32_t)__builtin_ctzll(left), p);
			points->x[k] = p[0];
			points->y[k] = p[1];
			points->z[k] = p[2];
			length2 = p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
			reach2 = length2 > reach2 ? length2 : reach2;
			points->normal[k] = (blocks->flags[b] & PSR_BLOCK_TWO_SIDED) != 0
			                                    || (psr_blocks_traits(blocks, b) & PSR_BLOCK_BENT) != 0
			                            ? PSR_DIRECTIONS
			                            : (uint16_t)PSR_ATTR_NORMAL(blocks->attr[k]);
		}
	}
	for (size_t k = blocks->n_samples; k < blocks->n_samples + MASK_POINTS_BEYOND; k++) {
		points->x[k] = points->y[k] = points->z[k] = 0;
		points->normal[k] = PSR_DIRECTIONS;
	}
	points->reach = sqrtf(reach2);
	return PSR_OK;
}

void mask_points_fini(struct mask_points *points)
{
	psr_free(points->x);
	psr_free(points->y);
	psr_free(points->z);
	psr_free(points->normal);
}

int mask_level_init(struct mask_level *level, const struct mask_points *points, unsigned which)
{
	const struct psr_blocks *b = points->blocks;

	memset(level, 0, sizeof *level);
	level->block = psr_alloc_array(b->n_blocks, sizeof *level->block);
	level->run = psr_alloc_array(b->n_blocks, sizeof *level->run);
	if (level->block == NULL || level->run == NULL) {
		mask_level_fini(level);
		return PSR_ERR_MEMORY;
	}
	for (uint32_t i = 0; i < b->n_blocks; i++) {
		float spacing = b->projection[b->block_projection[i]].spacing * (float)(1u << psr_blocks_level(b, i));
		uint32_t first = psr_blocks_attr_first(b, i), n = (uint32_t)__builtin_popcountll(b->mask[i]);

		if (psr_blocks_level(b, i) != which)
			continue;
		level->block[level->n_blocks++] = i;
		level->spacing = spacing > level->spacing ? spacing : level->spacing;
		if (psr_blocks_is_sheer(b, i)) /* hides nothing */
			continue;
		if (level->n_runs == 0 || level->run[level->n_runs - 1][1] != first)
			level->run[level->n_runs++][0] = first;
		level->run[level->n_runs - 1][1] = first + n;
	}
	return PSR_OK;
}

void mask_level_fini(struct mask_level *level)
{
	psr_free(level->block);
	psr_free(level->run);
}

int mask_picture_init(struct mask_picture *picture, const struct mask_points *points, const struct mask_level *level)
{
	const float pixel = PIXEL * level->spacing, across = 2 * points->reach / pixel;
	size_t n;

	memset(picture, 0, sizeof *picture);
	picture->side = (across < MOST_SIDE ? (int)across + 1 : MOST_SIDE) + 2 * MARGIN + 2;
	picture->scale = across < MOST_SIDE ? 1 / pixel : MOST_SIDE / (2 * points->reach);
	n = 2 * (size_t)picture->side * (size_t)picture->side;
	picture->nearest = psr_alloc_array(n, sizeof *picture->nearest);
	picture->row = psr_alloc_array(n, sizeof *picture->row);
	picture->farthest = psr_alloc_array(n, sizeof *picture->farthest);
	if (picture->nearest == NULL || picture->row == NULL || picture->farthest == NULL) {
		mask_picture_fini(picture);
		return PSR_ERR_MEMORY;
	}
	return PSR_OK;
}

void mask_picture_fini(struct mask_picture *picture)
{
	psr_free(picture->nearest);
	psr_free(picture->row);
	psr_free(picture->farthest);
}

static void aim(struct mask_picture *picture, const struct mask_points *points, const double axis[3], uint32_t seed)
{
	const float(*direction)[3] = psr_direction_table();
	double basis[3][3];

	psr_direction_basis(axis, basis);
	for (int i = 0; i < 9; i++)
		picture->basis[i / 3][i % 3] = (float)basis[i / 3][i % 3];
	for (int i = 0; i < PSR_DIRECTIONS; i++) {
		const float *n = direction[i], *v = picture->basis[2];
		float g = n[0] * v[0] + n[1] * v[1] + n[2] * v[2];

		picture->faces[i] = (uint8_t)((g >= -BACK_SINE) | (g <= BACK_SINE) << 1);
	}
	picture->faces[PSR_DIRECTIONS] = 3;
	for (int k = 0; k < 2; k++) {
		uint32_t part = seed * (k == 0 ? 0x9e3779b9u : 0x7f4a7c15u);

		picture->offset[k] = picture->scale * points->reach + MARGIN + (float)(part >> 16) * 0x1p-16f;
	}
}

/* Pixels and heights of a fixed number of samples, so that the compiler does four at a time. Indices of pixels are
 * below 2^24, exact in floats. */
static void project(const struct mask_picture *picture, const struct mask_points *points, uint32_t first,
                    int32_t at[restrict CHUNK], float height[restrict CHUNK])
{
	const float(*f)[3] = picture->basis;
	const float *restrict x = points->x + first, *restrict y = points->y + first, *restrict z = points->z + first;
	const float ux = f[0][0] * picture->scale, uy = f[0][1] * picture->scale, uz = f[0][2] * picture->scale;
	const float vx = f[1][0] * picture->scale, vy = f[1][1] * picture->scale, vz = f[1][2] * picture->scale;
	const float hx = f[2][0], hy = f[2][1], hz = f[2][2];
	const float u0 = picture->offset[0], v0 = picture->offset[1], side = (float)picture->side;

	for (int i = 0; i < CHUNK; i++) {
		int32_t u = (int32_t)(ux * x[i] + uy * y[i] + uz * z[i] + u0);
		int32_t v = (int32_t)(vx * x[i] + vy * y[i] + vz * z[i] + v0);

		at[i] = (int32_t)((float)v * side + (float)u);
		height[i] = hx * x[i] + hy * y[i] + hz * z[i];
	}
}

_Static_assert(MASK_PICTURE_REACH == 2, "five strides are written out below");

static float least(float a, float b)
{
	return a < b ? a : b;
}

/* out[i]: the smallest within MASK_PICTURE_REACH strides of in[i], where all of these are in 0..n-1. A fixed number at
 * a time, as above. */
static void least_around(float *restrict out, const float *restrict in, int n, int stride)
{
	const int end = n - 2 * stride;
	int first = 2 * stride;

	for (; first < end; first += CHUNK) {
		/* the last ones are done twice */
		const int at = first + CHUNK <= end ? first : end - CHUNK;
		const float *p = in + at;

		for (int i = 0; i < CHUNK; i++)
			out[at + i] = least(least(least(p[i - 2 * stride], p[i - stride]), least(p[i], p[i + stride])),
			                    p[i + 2 * stride]);
	}
}

/* A row has two numbers a pixel, one for each end. */
static void spread(const struct mask_picture *picture)
{
	const int n = 2 * picture->side * picture->side;

	least_around(picture->row, picture->nearest, n, 2);
	for (int i = 0; i < 2 * MASK_PICTURE_REACH; i++)
		picture->row[i] = picture->row[n - 1 - i] = -INFINITY;
	least_around(picture->farthest, picture->row, n, 2 * picture->side);
}

void mask_picture_draw(struct mask_picture *picture, const struct mask_points *points, const struct mask_level *level,
                   const double axis[3], uint32_t seed)
{
	aim(picture, points, axis, seed);
	for (int i = 0; i < 2 * picture->side * picture->side; i++)
		picture->nearest[i] = -INFINITY;
	for (uint32_t r = 0; r < level->n_runs; r++) {
		for (uint32_t first = level->run[r][0], end = level->run[r][1]; first < end; first += CHUNK) {
			const uint32_t n = end - first < CHUNK ? end - first : CHUNK;
			int32_t at[CHUNK];
			float height[CHUNK];

			project(picture, points, first, at, height);
			for (uint32_t k = 0; k < n; k++) {
				const uint8_t faces = picture->faces[points->normal[first + k]];
				const float h0 = (faces & 1) != 0 ? height[k] : -INFINITY,
							h1 = (faces & 2) != 0 ? -height[k] : -INFINITY;
				float *nearest = &picture->nearest[2 * at[k]];

				assert(at[k] > picture->side && at[k] < picture->side * (picture->side - 1) - 1);
				nearest[0] = h0 > nearest[0] ? h0 : nearest[0];
				nearest[1] = h1 > nearest[1] ? h1 : nearest[1];
			}
		}
	}
	spread(picture);
}

int mask_picture_sees(const struct mask_picture *picture, const struct mask_points *points, uint32_t block, int end)
{
	const struct psr_blocks *b = points->blocks;
	const uint32_t end_of_block = psr_blocks_attr_first(b, block) + (uint32_t)__builtin_popcountll(b->mask[block]);

	for (uint32_t first = psr_blocks_attr_first(b, block); first < end_of_block; first += CHUNK) {
		const uint32_t n = end_of_block - first < CHUNK ? end_of_block - first : CHUNK;
		int32_t at[CHUNK];
		float height[CHUNK];

		project(picture, points, first, at, height);
		for (uint32_t k = 0; k < n; k++)
			if ((picture->faces[points->normal[first + k]] >> end & 1) != 0
			    && (end == 0 ? height[k] : -height[k]) >= picture->farthest[2 * at[k] + end])
				return 1;
	}
	return 0;
}
