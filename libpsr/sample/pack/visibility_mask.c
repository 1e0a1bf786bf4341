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

/* Directions at the corners of triangles belong to them all, whatever they are rounded to. */
#define ON_EDGE 1e-9

/* An axis of which both ends are looked from. */
struct view {
	double axis[3];
	uint64_t triangles[2][MOST_WORDS]; /* of each end: for which it counts */
};

struct job {
	const struct vpoints *points;
	const struct vlevel *level;
	size_t words; /* of a mask */
	uint64_t *mask;
	const struct view *view;
	int n_views;
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

static void add_triangles(struct view *view, int level)
{
	for (unsigned t = 0; t < 8u << 2 * level; t++) {
		double plane[3][3];
		uint64_t inside[2] = { 1, 1 };

		planes_of(level, t, plane);
		for (int i = 0; i < 3; i++) {
			double side = v3d_dot(plane[i], view->axis);

			inside[0] &= side >= -ON_EDGE;
			inside[1] &= side <= ON_EDGE;
		}
		for (int end = 0; end < 2; end++)
			view->triangles[end][t >> 6] |= inside[end] << (t & 63);
	}
}

static int compare_views(const void *a, const void *b)
{
	const double *x = ((const struct view *)a)->axis, *y = ((const struct view *)b)->axis;

	for (int k = 0; k < 3; k++)
		if (x[k] != y[k])
			return x[k] < y[k] ? -1 : 1;
	return 0;
}

/* Directions that come in pairs: of each the one whose first number that is not 0 is above. */
static int is_end_0(const double v[3])
{
	for (int k = 0; k < 3; k++)
		if (v[k] != 0)
			return v[k] > 0;
	return 0;
}

/* The corners of all triangles that are FINER than those of a level, each pair once. */
static int make_views(struct view *view, int level)
{
	int n = 0, n_kept = 0;

	for (unsigned t = 0; t < 8u << 2 * (level + FINER); t++) {
		double corner[3][3];

		psr_direction_corners(level + FINER, t, corner);
		for (int i = 0; i < 3; i++) {
			if (!is_end_0(corner[i]))
				continue;
			memset(&view[n], 0, sizeof *view);
			v3d_set(view[n++].axis, corner[i][0], corner[i][1], corner[i][2]);
		}
	}
	qsort(view, (size_t)n, sizeof *view, compare_views);
	for (int i = 0; i < n; i++)
		if (n_kept == 0 || compare_views(&view[n_kept - 1], &view[i]) != 0)
			view[n_kept++] = view[i];
	for (int i = 0; i < n_kept; i++)
		add_triangles(&view[i], level);
	return n_kept;
}

static void look(const struct job *job, const struct vpicture *picture, const struct view *view)
{
	for (uint32_t k = 0; k < job->level->n_blocks; k++) {
		uint32_t block = job->level->block[k];

		for (int end = 0; end < 2; end++) {
			const uint64_t *triangles = view->triangles[end];
			uint64_t *mask = job->mask + job->words * block, lacks = 0;

			for (size_t w = 0; w < job->words; w++)
				lacks |= triangles[w] & ~__atomic_load_n(&mask[w], __ATOMIC_RELAXED);
			if (lacks == 0 || !vpicture_sees(picture, job->points, block, end))
				continue;
			for (size_t w = 0; w < job->words; w++)
				__atomic_fetch_or(&mask[w], triangles[w], __ATOMIC_RELAXED);
		}
	}
}

static void draw_views(int thread, void *userdata)
{
	struct job *job = userdata;
	struct vpicture *picture = malloc(sizeof *picture);

	(void)thread;
	if (picture == NULL || vpicture_init(picture, job->points, job->level) != PSR_OK) {
		free(picture);
		atomic_store(&job->failed, 1);
		return;
	}
	for (int i; (i = atomic_fetch_add(&job->next, 1)) < job->n_views;) {
		vpicture_draw(picture, job->points, job->level, job->view[i].axis, (uint32_t)i);
		look(job, picture, &job->view[i]);
	}
	vpicture_fini(picture);
	free(picture);
}

static int mask_level(struct job *job, unsigned which, struct psr_pool *pool)
{
	struct vlevel level;
	int rc = vlevel_init(&level, job->points, which);

	job->level = &level;
	if (rc == PSR_OK && level.n_blocks > 0) {
		atomic_store(&job->next, 0);
		psr_pool_for(pool, psr_pool_threads(pool), draw_views, job);
		rc = atomic_load(&job->failed) ? PSR_ERR_MEMORY : PSR_OK;
	}
	vlevel_fini(&level);
	return rc;
}

int visibility_masks_at(const struct psr_blocks *blocks, int level, size_t words, struct psr_pool *pool, uint64_t *mask)
{
	struct vpoints points;
	struct view *view = psr_alloc_array((size_t)3 * 8 << 2 * (level + FINER), sizeof *view);
	struct job job = { .points = &points, .words = words, .mask = mask, .view = view };
	int rc = view != NULL ? vpoints_init(&points, blocks) : PSR_ERR_MEMORY;

	assert(level >= 0 && level <= MOST_LEVEL && words <= MOST_WORDS && 64 * words >= 8u << 2 * level);
	memset(mask, 0, blocks->n_blocks * words * sizeof *mask);
	if (rc == PSR_OK) {
		job.n_views = make_views(view, level);
		for (unsigned which = 0; which < blocks->n_levels && rc == PSR_OK; which++)
			rc = mask_level(&job, which, pool);
		vpoints_fini(&points);
	}
	psr_free(view);
	return rc;
}

int visibility_masks(const struct psr_blocks *blocks, struct psr_pool *pool, uint64_t (*mask)[2])
{
	return visibility_masks_at(blocks, TRIANGLE_LEVEL, 2, pool, mask[0]);
}

int visibility_is_full(uint32_t n_blocks, const uint64_t (*mask)[2])
{
	for (uint32_t i = 0; i < n_blocks; i++)
		if ((mask[i][0] & mask[i][1]) != UINT64_MAX)
			return 0;
	return 1;
}
