#include <assert.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include "base/mem.h"
#include "base/vec.h"
#include "visibility_mask.h"
#include "visibility_mask_draw.h"

#define TRIANGLE_LEVEL 2
#define FINER 2 /* levels, of the directions */
#define MOST_LEVEL 3
#define MOST_WORDS 8

/* Directions at the corners of triangles belong to them all, however they are rounded. */
#define ON_EDGE 1e-9

/* Views from both ends of an axis. */
struct axis {
	double direction[3];
	uint64_t triangles[2][MOST_WORDS]; /* the triangles that hold each end */
};

struct job {
	const struct mask_points *points;
	const struct mask_level *level;
	size_t words; /* of a mask */
	uint64_t *mask;
	const struct axis *axis;
	int n_axes;
	atomic_int next, failed;
};

static void planes_of(int level, unsigned triangle, double plane[3][3])
{
	double corner[3][3];

	psr_direction_corners(level, triangle, corner);
	for (int i = 0; i < 3; i++) {
		v3d_cross(plane[i], corner[(i + 1) % 3], corner[(i + 2) % 3]);
		v3d_normalize(plane[i], plane[i]);
		if (v3d_dot(plane[i], corner[i]) < 0)
			v3d_scale(plane[i], plane[i], -1);
	}
}

static void add_triangles(struct axis *axis, int level)
{
	for (unsigned t = 0; t < 8u << 2 * level; t++) {
		double plane[3][3];
		uint64_t inside[2] = { 1, 1 };

		planes_of(level, t, plane);
		for (int i = 0; i < 3; i++) {
			double side = v3d_dot(plane[i], axis->direction);

			inside[0] &= side >= -ON_EDGE;
			inside[1] &= side <= ON_EDGE;
		}
		for (int end = 0; end < 2; end++)
			axis->triangles[end][t >> 6] |= inside[end] << (t & 63);
	}
}

static int compare_axes(const void *a, const void *b)
{
	const double *x = ((const struct axis *)a)->direction, *y = ((const struct axis *)b)->direction;

	for (int k = 0; k < 3; k++)
		if (x[k] != y[k])
			return x[k] < y[k] ? -1 : 1;
	return 0;
}

/* Keeps of each pair of opposite directions the one whose first number other than 0 is positive. */
static int is_end_0(const double v[3])
{
	for (int k = 0; k < 3; k++)
		if (v[k] != 0)
			return v[k] > 0;
	return 0;
}

/* Finds the corners of all triangles that are FINER levels finer; of opposite ones only one. */
static int make_axes(struct axis *axis, int level)
{
	int n = 0, n_kept = 0;

	for (unsigned t = 0; t < 8u << 2 * (level + FINER); t++) {
		double corner[3][3];

		psr_direction_corners(level + FINER, t, corner);
		for (int i = 0; i < 3; i++) {
			if (!is_end_0(corner[i]))
				continue;
			memset(&axis[n], 0, sizeof *axis);
			v3d_set(axis[n++].direction, corner[i][0], corner[i][1], corner[i][2]);
		}
	}
	qsort(axis, (size_t)n, sizeof *axis, compare_axes);
	for (int i = 0; i < n; i++)
		if (n_kept == 0 || compare_axes(&axis[n_kept - 1], &axis[i]) != 0)
			axis[n_kept++] = axis[i];
	for (int i = 0; i < n_kept; i++)
		add_triangles(&axis[i], level);
	return n_kept;
}

static void look(const struct job *job, const struct mask_picture *picture, const struct axis *axis)
{
	for (uint32_t k = 0; k < job->level->n_blocks; k++) {
		uint32_t block = job->level->block[k];

		for (int end = 0; end < 2; end++) {
			const uint64_t *triangles = axis->triangles[end];
			uint64_t *mask = job->mask + job->words * block, lacks = 0;

			for (size_t w = 0; w < job->words; w++)
				lacks |= triangles[w] & ~__atomic_load_n(&mask[w], __ATOMIC_RELAXED);
			if (lacks == 0 || !mask_picture_sees(picture, job->points, block, end))
				continue;
			for (size_t w = 0; w < job->words; w++)
				__atomic_fetch_or(&mask[w], triangles[w], __ATOMIC_RELAXED);
		}
	}
}

static void draw_axes(int thread, void *userdata)
{
	struct job *job = userdata;
	struct mask_picture *picture = malloc(sizeof *picture);

	(void)thread;
	if (picture == NULL || mask_picture_init(picture, job->points, job->level) != PSR_OK) {
		free(picture);
		atomic_store(&job->failed, 1);
		return;
	}
	for (int i; (i = atomic_fetch_add(&job->next, 1)) < job->n_axes;) {
		mask_picture_draw(picture, job->points, job->level, job->axis[i].direction, (uint32_t)i);
		look(job, picture, &job->axis[i]);
	}
	mask_picture_fini(picture);
	free(picture);
}

static int mask_level(struct job *job, unsigned which, struct psr_pool *pool)
{
	struct mask_level level;
	int rc = mask_level_init(&level, job->points, which);

	job->level = &level;
	if (rc == PSR_OK && level.n_blocks > 0) {
		atomic_store(&job->next, 0);
		psr_pool_for(pool, psr_pool_threads(pool), draw_axes, job);
		rc = atomic_load(&job->failed) ? PSR_ERR_MEMORY : PSR_OK;
	}
	mask_level_fini(&level);
	return rc;
}

int visibility_mask_make_at(const struct psr_blocks *blocks, int level, size_t words, struct psr_pool *pool,
                            uint64_t *mask)
{
	struct mask_points points;
	struct axis *axis = psr_alloc_array((size_t)3 * 8 << 2 * (level + FINER), sizeof *axis);
	struct job job = { .points = &points, .words = words, .mask = mask, .axis = axis };
	int rc = axis != NULL ? mask_points_init(&points, blocks) : PSR_ERR_MEMORY;

	assert(level >= 0 && level <= MOST_LEVEL && words <= MOST_WORDS && 64 * words >= 8u << 2 * level);
	memset(mask, 0, blocks->n_blocks * words * sizeof *mask);
	if (rc == PSR_OK) {
		job.n_axes = make_axes(axis, level);
		for (unsigned which = 0; which < blocks->n_levels && rc == PSR_OK; which++)
			rc = mask_level(&job, which, pool);
		mask_points_fini(&points);
	}
	psr_free(axis);
	return rc;
}

int visibility_mask_make(const struct psr_blocks *blocks, struct psr_pool *pool, uint64_t (*mask)[2])
{
	return visibility_mask_make_at(blocks, TRIANGLE_LEVEL, 2, pool, mask[0]);
}

int visibility_mask_is_full(uint32_t n_blocks, const uint64_t (*mask)[2])
{
	for (uint32_t i = 0; i < n_blocks; i++)
		if ((mask[i][0] & mask[i][1]) != UINT64_MAX)
			return 0;
	return 1;
}
