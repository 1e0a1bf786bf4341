#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "base/mem.h"
#include "level.h"
#include "psr/error.h"
#include "sample/mend/mend.h"
#include "sample/visible/look_out.h"
#include "sample/visible/sides.h"

/* pixels; ownership sees one normal in each cell of the field */
#define FIELD_PIXELS 3

#define N_STEPS (N_PROJECTIONS / 2 + 4)
#define MOST_ROUNDS 7

static void report(const struct level_progress *progress, unsigned done)
{
	if (progress != NULL)
		progress->on_step(done, N_STEPS, progress->userdata);
}

static struct keeper keeper_of(struct level *level)
{
	return (struct keeper){ .sampling = &level->sampling, .visible = &level->visible, .sides = level->sides,
		                    .finer = level->finer != NULL ? &level->finer->kept : NULL, .sheets = level->sheets,
		                    .kept = &level->kept };
}

static int mark_thin(struct level *level)
{
	level->thin = psr_alloc_array(sampling_n_prims(&level->sampling), 1);
	if (level->thin == NULL)
		return PSR_ERR_MEMORY;
	thin_mark(level->thin, &level->sampling, level->finer != NULL ? level->finer->thin : NULL);
	level->sampling.thin = level->thin;
	return PSR_OK;
}

static int look(struct level *level)
{
	const struct sampling *sampling = &level->sampling;
	int rc;

	if (level->finer != NULL)
		return visible_set_coarsen(&level->visible, &level->finer->visible);
	rc = visible_set_init(&level->visible, sampling->ds);
	if (rc == PSR_OK)
		rc = visible_set_look(&level->visible, sampling->scene, VISIBLE_ENOUGH, sampling->pool);
	return rc == PSR_OK ? look_out(&level->visible, sampling) : rc;
}

static int trace(struct level *level, const struct level_progress *progress)
{
	int rc = PSR_OK;

	for (unsigned i = 0; rc == PSR_OK && i < N_PROJECTIONS; i += 2) {
		struct sheets *sheets = &level->sheets[i];

		rc = sheets_trace(sheets, sheets + 1, &level->sampling, &level->sampling.projection[i]);
		level->n_rays += sheets->n_rays;
		level->n_patches += sheets[0].n_patches + sheets[1].n_patches;
		report(progress, i / 2 + 2);
	}
	return rc;
}

static int own(struct level *level)
{
	const struct owner_finds finds = { &level->field, &level->visible, level->sides };
	int rc = field_init(&level->field, FIELD_PIXELS * level->sampling.ds);

	return rc == PSR_OK ? owner_mark(&level->ownership, &finds, &level->sampling, level->sheets) : rc;
}

int level_own(struct level *level, const struct level_progress *progress)
{
	const uint32_t n_prims = sampling_n_prims(&level->sampling);
	double started = clock_seconds();
	int rc = mark_thin(level);

	level->sides = psr_alloc_array(n_prims, 1);
	if (level->sides == NULL)
		return PSR_ERR_MEMORY;
	memset(level->sides, 0, n_prims);
	if (rc == PSR_OK)
		rc = look(level);
	report(progress, 1);
	if (rc == PSR_OK)
		rc = trace(level, progress);
	level->seconds_rays = clock_seconds() - started;
	return rc == PSR_OK ? own(level) : rc;
}

void level_merge(struct level *level)
{
	owner_merge(&level->ownership, &level->sampling, level->sheets, &level->field);
}

int level_keep(struct level *level)
{
	const struct keeper keeper = keeper_of(level);
	int rc = kept_init(&level->kept, level->sampling.ds);

	return rc == PSR_OK ? keep_owned(&keeper, &level->ownership) : rc;
}

int level_mend(struct level *level)
{
	const struct keeper keeper = keeper_of(level);

	return mend_surface(&keeper, &level->field, 0);
}

int level_make(struct level *level, const struct level_progress *progress)
{
	int rc = level_own(level, progress);

	report(progress, N_STEPS - 2);
	if (rc == PSR_OK) {
		level_merge(level);
		rc = level_keep(level);
	}
	report(progress, N_STEPS - 1);
	if (rc == PSR_OK)
		rc = level_mend(level);
	report(progress, N_STEPS);
	return rc;
}

/* A place that no earlier view had seen is seldom alone: it is added to the visible set, more views look for such
 * places, and the surface is mended again. */
static int add_missing(struct level *level, const struct adequacy *found, int round)
{
	const struct keeper keeper = keeper_of(level);
	uint64_t n_unseen = 0;
	int rc = PSR_OK;

	for (uint64_t i = 0; i < found->n_missing; i++)
		n_unseen += !visible_set_has(&level->visible, found->place[i].p, found->place[i].n);
	if (2 * ADEQUACY_FEW * n_unseen > found->n_trials)
		rc = visible_set_look(&level->visible, level->sampling.scene, (uint64_t)VISIBLE_ENOUGH << 2 * round,
		                      level->sampling.pool);
	for (uint64_t i = 0; rc == PSR_OK && i < found->n_missing; i++) {
		const struct place *place = &found->place[i];

		sides_note(level->sides, place->surface, 1);
		rc = visible_set_add(&level->visible, place->p, place->n);
		if (rc == PSR_OK)
			rc = mend_place(&keeper, &level->field, place);
	}
	keep_look_again(&keeper);
	return rc == PSR_OK ? mend_surface(&keeper, &level->field, round) : rc;
}

static double share(const struct adequacy *found)
{
	return (double)found->n_missing / (double)(found->n_trials + 1);
}

/* Enough, or not better by a fifth than two rounds ago: rounds do not find the rest. */
static int is_over(const struct adequacy *found, int round, double before_last)
{
	return ADEQUACY_FEW * found->n_missing < found->n_trials || round == MOST_ROUNDS
	       || (round > 2 && share(found) > 0.8 * before_last);
}

int level_reach(struct adequacy *out, struct level *level)
{
	uint64_t n = level->kept.n / 2;
	double before[2] = { 0, 0 };
	int rc = PSR_OK;

	n = n < 100000 ? 100000 : n > 250000 ? 250000 : n;
	for (int round = 1; rc == PSR_OK; round++) {
		/* The first two rounds may stop early: either is the last only if it is enough. */
		rc = adequacy_measure(out, &level->sampling, &level->kept, (uint64_t)round, n, round <= 2);
		if (rc != PSR_OK || is_over(out, round, before[0]))
			break;
		before[0] = before[1];
		before[1] = share(out);
		rc = add_missing(level, out, round);
		free(out->place);
		out->place = NULL;
	}
	free(out->place);
	out->place = NULL;
	return rc;
}

void level_trim(struct level *level)
{
	for (int i = 0; i < N_PROJECTIONS; i++)
		sheets_fini(&level->sheets[i]);
	psr_free(level->sides);
	level->sides = NULL;
	field_fini(&level->field);
	ownership_fini(&level->ownership);
}

void level_fini(struct level *level)
{
	level_trim(level);
	psr_free(level->thin);
	visible_set_fini(&level->visible);
	kept_fini(&level->kept);
	memset(level, 0, sizeof *level);
}
