#include <stdlib.h>
#include <string.h>
#include <time.h>
#include "base/mem.h"
#include "level.h"
#include "psr/error.h"
#include "sample/visible/look_out.h"
#include "sample/thin/cover.h"

/* Pieces of the surface this many pixels wide have one normal, as far as ownership goes. */
#define FIELD_PIXELS 3

static double now(void)
{
	struct timespec t;

	clock_gettime(CLOCK_MONOTONIC, &t);
	return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

struct steps {
	unsigned done, total;
	void (*on_progress)(unsigned done, unsigned total, void *userdata);
	void *userdata;
};

static void step(struct steps *steps)
{
	steps->done++;
	if (steps->on_progress != NULL)
		steps->on_progress(steps->done, steps->total, steps->userdata);
}

static int prepare(struct level *level, const struct psr_projection *projection)
{
	uint32_t n_prims = level->mesh->n_triangles + level->mesh->n_points;
	int rc;

	level->sheets = calloc(level->n_projections, sizeof *level->sheets);
	level->sides = psr_alloc_array(n_prims, 1);
	rc = level->sheets == NULL || level->sides == NULL ? PSR_ERR_MEMORY : PSR_OK;
	if (rc == PSR_OK) {
		memset(level->sides, 0, n_prims);
		thin_mark(level, projection);
		thin_mark_narrow(level);
	}
	if (rc == PSR_OK)
		rc = field_init(&level->field, FIELD_PIXELS * level->ds);
	if (rc == PSR_OK)
		rc = cover_init(&level->cover, level->ds);
	if (rc == PSR_OK)
		rc = level->finer_seen != NULL ? seen_coarsen(&level->seen, level->finer_seen)
		                               : seen_init(&level->seen, level->ds);
	if (rc == PSR_OK && level->finer_seen == NULL)
		rc = seen_look(&level->seen, level->scene, SEEN_ENOUGH, level->pool);
	if (rc == PSR_OK && level->finer_seen == NULL)
		rc = seen_look_out(level);
	return rc;
}

static int trace(struct level *level, const struct psr_projection *projection, struct steps *steps)
{
	double started = now();
	int rc = prepare(level, projection);

	step(steps);
	for (unsigned i = 0; rc == PSR_OK && i < level->n_projections; i += 2) {
		rc = sheets_trace(&level->sheets[i], &level->sheets[i + 1], level->scene, level->mesh, level->sides,
		                  &projection[i], level->pool);
		level->n_rays += level->sheets[i].n_rays;
		level->n_patches += level->sheets[i].n_patches + level->sheets[i + 1].n_patches;
		step(steps);
	}
	level->seconds_rays = now() - started;
	return rc;
}

int level_own(struct level *level, const struct psr_projection *projection)
{
	struct steps none = { 0 };
	int rc = trace(level, projection, &none);

	return rc == PSR_OK ? owner_mark(level) : rc;
}

int level_make(struct level *level, const struct psr_projection *projection,
               void (*on_progress)(unsigned done, unsigned total, void *userdata), void *userdata)
{
	struct steps steps = { 0, level->n_projections / 2 + 4, on_progress, userdata };
	int rc = trace(level, projection, &steps);

	if (rc == PSR_OK)
		rc = owner_mark(level);
	step(&steps);
	if (rc == PSR_OK) {
		merge_patches(level);
		rc = keep_owned(level);
	}
	step(&steps);
	if (rc == PSR_OK)
		rc = dice_surface(level, 0);
	step(&steps);
	return rc;
}

void level_fini(struct level *level)
{
	for (unsigned i = 0; level->sheets != NULL && i < level->n_projections; i++)
		sheets_fini(&level->sheets[i]);
	free(level->sheets);
	psr_free(level->sides);
	field_fini(&level->field);
	seen_fini(&level->seen);
	cover_fini(&level->cover);
	level->sheets = NULL;
	level->sides = NULL;
}
