#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/mem.h"
#include "base/random.h"
#include "base/vec.h"
#include "adequacy.h"
#include "surface/area.h"
#include "base/direction.h"
#include "psr/error.h"
#include "places.h"
#include "surface/texture.h"

#define CHUNK 4096
#define BATCH 64
#define PARTS 8       /* of the trials: after each it may be clear that too many are missing */
#define FEW 15000     /* one missing in so many is good enough */
#define FARTHEST 4    /* pixels around a place in which its surface is looked for, at grazing angles */
#define BACK 0.0125f  /* as the renderer's: what faces away by less than normals are quantised to still counts */

static void draw_direction(uint64_t *random, double d[3])
{
	double length2;

	do {
		for (int k = 2; k >= 0; k--)
			d[k] = random_in(random, -1, 1);
		length2 = v3d_dot(d, d);
	} while (!(length2 <= 1 && length2 > 1e-4));
	v3d_scale(d, d, 1 / sqrt(length2));
}

struct chunk {
	uint64_t n_trials;
	struct spots missing;
	int failed;
};

struct job {
	const struct level *level;
	const double *area; /* of all primitives up to this one */
	uint32_t n_prims;
	uint64_t seed;
	struct chunk *chunk;
	int first_chunk; /* of those that are run now */
};

struct trial {
	struct surface_spot spot;
	double view[3]; /* unit, towards the viewer */
	double cosine;
	float axis[3][3]; /* of the pixel: its sides, and the view */
};

/* 0: this draw is no trial. */
static int draw_trial(const struct job *job, uint64_t index, struct trial *trial)
{
	uint64_t random = (job->seed << 40) + index * UINT64_C(0x632be59bd9b4e019);
	const struct level *level = job->level;
	uint32_t prim = area_find(job->area, job->n_prims, random_in(&random, 0, job->area[job->n_prims - 1]));
	const float *n = ray_scene_normal(level->scene, prim);
	double u = random_in(&random, 0, 1), v = random_in(&random, 0, 1), p[3], along, aside[3], up[3];
	int is_back;

	if (u + v > 1) {
		u = 1 - u;
		v = 1 - v;
	}
	draw_direction(&random, trial->view);
	draw_direction(&random, aside);
	along = trial->view[0] * (double)n[0] + trial->view[1] * (double)n[1] + trial->view[2] * (double)n[2];
	is_back = along < 0;
	trial->cosine = fabs(along);
	if ((is_back && !level_material(level, prim)->two_sided) || random_in(&random, 0, 1) > trial->cosine)
		return 0;
	if (prim < level->mesh->n_triangles) {
		double corner[3][3];

		if (ray_scene_is_absent(level->scene, prim, u, v))
			return 0;
		ray_scene_corners(level->scene, prim, corner);
		for (int k = 0; k < 3; k++)
			p[k] = (1 - u - v) * corner[0][k] + u * corner[1][k] + v * corner[2][k];
	} else {
		ray_scene_center(level->scene, prim, p);
	}
	v3d_cross(up, trial->view, aside);
	if (v3d_normalize(up, up) < 1e-3)
		return 0;
	v3d_cross(aside, up, trial->view);
	for (int k = 0; k < 3; k++) {
		trial->axis[0][k] = (float)aside[k];
		trial->axis[1][k] = (float)up[k];
		trial->axis[2][k] = (float)trial->view[k];
		trial->spot.p[k] = (float)p[k];
		trial->spot.n[k] = is_back ? -n[k] : n[k];
	}
	trial->spot.surface = prim | (is_back ? SHEET_BACK : 0);
	return 1;
}

static int is_hit(const struct trial *trial, const struct cover_point *point, float half, float tolerance)
{
	const float *n = psr_direction_table()[point->normal];
	float d[3];

	v3f_sub(d, point->position, trial->spot.p);
	return fabsf(v3f_dot(d, trial->axis[0])) <= half && fabsf(v3f_dot(d, trial->axis[1])) <= half
	       && v3f_dot(d, trial->axis[2]) >= -tolerance && (point->two_sided || v3f_dot(n, trial->axis[2]) > -BACK);
}

static int is_any_hit(const struct level *level, const struct trial *trial, double radius)
{
	double cosine = trial->cosine > 0.03 ? trial->cosine : 0.03;
	float half = (float)(level->ds / 2),
		  tolerance = (float)(level->ds * (1 + 1.5 * sqrt(1 - cosine * cosine) / cosine));
	uint32_t first[COVER_MOST_AROUND];
	int n_cells = cover_around(&level->cover, trial->spot.p, radius, first);

	for (int c = 0; c < n_cells; c++)
		for (uint32_t i = first[c]; i != COVER_NONE; i = level->cover.point[i].next)
			if (is_hit(trial, &level->cover.point[i], half, tolerance))
				return 1;
	return 0;
}

static int is_missing(const struct level *level, const struct trial *trial)
{
	double reach = 0.75 / (trial->cosine > 0.1 ? trial->cosine : 0.1);

	if (is_any_hit(level, trial, 0.75 * level->ds))
		return 0;
	return !is_any_hit(level, trial, (reach < FARTHEST ? reach : FARTHEST) * level->ds);
}

/* Looked at from outside, as one-sided faces let rays through that come from behind them. */
static void look_at(const struct level *level, const struct trial *trial, int n, uint8_t *is_visible)
{
	struct ray ray[BATCH];
	uint8_t is_hidden[BATCH];

	for (int i = 0; i < n; i++) {
		for (int k = 0; k < 3; k++) {
			ray[i].origin[k] = (double)trial[i].spot.p[k] + 3 * trial[i].view[k];
			ray[i].direction[k] = -trial[i].view[k];
		}
	}
	ray_scene_occluded(level->scene, ray, n, 3 - 0.01 * level->ds, is_hidden);
	for (int i = 0; i < n; i++)
		is_visible[i] = !is_hidden[i];
}

static int run_batch(const struct level *level, struct chunk *chunk, const struct trial *trial, int n)
{
	uint8_t is_visible[BATCH];

	look_at(level, trial, n, is_visible);
	for (int i = 0; i < n; i++) {
		chunk->n_trials += is_visible[i];
		if (is_visible[i] && is_missing(level, &trial[i]) && spots_add(&chunk->missing, &trial[i].spot) != PSR_OK)
			return PSR_ERR_MEMORY;
	}
	return PSR_OK;
}

static void run_chunk(int i, void *userdata)
{
	struct job *job = userdata;
	const uint64_t first = (uint64_t)(job->first_chunk + i) * CHUNK;
	struct chunk *chunk = &job->chunk[job->first_chunk + i];
	struct trial trial[BATCH];
	int n = 0;

	for (uint64_t k = first; k < first + CHUNK && !chunk->failed; k++) {
		n += draw_trial(job, k, &trial[n]);
		if (n == BATCH || k + 1 == first + CHUNK) {
			chunk->failed = run_batch(job->level, chunk, trial, n) != PSR_OK;
			n = 0;
		}
	}
}

static int join_chunks(struct adequacy *out, struct chunk *chunk, int n_chunks)
{
	uint64_t n = 0;

	memset(out, 0, sizeof *out);
	for (int i = 0; i < n_chunks; i++) {
		if (chunk[i].failed)
			return PSR_ERR_MEMORY;
		out->n_trials += chunk[i].n_trials;
		out->n_missing += chunk[i].missing.n;
	}
	out->spot = malloc((out->n_missing + 1) * sizeof *out->spot);
	if (out->spot == NULL)
		return PSR_ERR_MEMORY;
	for (int i = 0; i < n_chunks; n += chunk[i].missing.n, i++)
		if (chunk[i].missing.n != 0)
			memcpy(out->spot + n, chunk[i].missing.spot, chunk[i].missing.n * sizeof *out->spot);
	return PSR_OK;
}

/* Whether as many are missing of the first chunks as may be of all. */
static int are_too_many(const struct chunk *chunk, int n_done, int n_chunks)
{
	uint64_t n_trials = 0, n_missing = 0;

	for (int i = 0; i < n_done; i++) {
		n_trials += chunk[i].n_trials;
		n_missing += chunk[i].missing.n;
	}
	return FEW * n_missing * (uint64_t)n_done >= n_trials * (uint64_t)n_chunks;
}

/* Returns how many chunks were run. */
static int run_chunks(struct job *job, int n_chunks, int can_stop)
{
	int n_done = 0;

	for (int part = 1; part <= PARTS; part++) {
		job->first_chunk = n_done;
		n_done = n_chunks * part / PARTS;
		psr_pool_for(job->level->pool, n_done - job->first_chunk, run_chunk, job);
		if (can_stop && n_done > 0 && are_too_many(job->chunk, n_done, n_chunks))
			break;
	}
	return n_done;
}

/* can_stop: makes fewer trials where that many show already that too many are missing. */
static int measure(struct adequacy *out, const struct level *level, uint64_t seed, uint64_t n_trials, int can_stop)
{
	/* About a quarter of the draws are trials: half by the angle, and half of these are visible. */
	int n_chunks = (int)((4 * n_trials + CHUNK - 1) / CHUNK), rc = PSR_OK;
	struct job job = { .level = level, .n_prims = level->mesh->n_triangles + level->mesh->n_points, .seed = seed };
	double *area = psr_alloc_array(job.n_prims, sizeof *area);

	job.chunk = calloc((size_t)n_chunks, sizeof *job.chunk);
	if (area == NULL || job.chunk == NULL)
		rc = PSR_ERR_MEMORY;
	if (rc == PSR_OK) {
		area_sum(level, job.n_prims, area);
		job.area = area;
		rc = join_chunks(out, job.chunk, run_chunks(&job, n_chunks, can_stop));
	}
	for (int i = 0; job.chunk != NULL && i < n_chunks; i++)
		free(job.chunk[i].missing.spot);
	free(job.chunk);
	psr_free(area);
	return rc;
}

int adequacy_measure(struct adequacy *out, const struct level *level, uint64_t seed, uint64_t n_trials)
{
	return measure(out, level, seed, n_trials, 0);
}

#define MOST_ROUNDS 7

/* What a view found that none of those before had seen is seldom alone: it is put down as seen, views look for more of
 * that kind, and the surface is diced again. */
static int add_missing(struct level *level, const struct adequacy *found, int round)
{
	uint64_t n_unseen = 0;
	int rc = PSR_OK;

	for (uint64_t i = 0; i < found->n_missing; i++)
		n_unseen += !seen_is(&level->seen, found->spot[i].p, found->spot[i].n);
	if (2 * FEW * n_unseen > found->n_trials)
		rc = seen_look(&level->seen, level->scene, (uint64_t)SEEN_ENOUGH << 2 * round, level->pool);
	for (uint64_t i = 0; rc == PSR_OK && i < found->n_missing; i++) {
		const struct surface_spot *spot = &found->spot[i];

		level->sides[spot->surface & ~SHEET_BACK] |=
			(spot->surface & SHEET_BACK) != 0 ? SIDE_BACK_SEEN : SIDE_FRONT_SEEN;
		rc = seen_add(&level->seen, spot->p, spot->n);
		if (rc == PSR_OK)
			rc = dice_cover(level, spot);
	}
	keep_look_again(level);
	return rc == PSR_OK ? dice_surface(level, round) : rc;
}

static double share(const struct adequacy *found)
{
	return (double)found->n_missing / (double)(found->n_trials + 1);
}

/* Enough, or no better than two rounds ago by a fifth: the rest is what this way of looking does not find. */
static int is_over(const struct adequacy *found, int round, double before_last)
{
	return FEW * found->n_missing < found->n_trials || round == MOST_ROUNDS
	       || (round > 2 && share(found) > 0.8 * before_last);
}

int adequacy_reach(struct adequacy *out, struct level *level)
{
	uint64_t n = level->cover.n_points / 2;
	double before[2] = { 0, 0 };
	int rc = PSR_OK;

	n = n < 100000 ? 100000 : n > 250000 ? 250000 : n;
	for (int round = 1; rc == PSR_OK; round++) {
		/* Of the first two, what is not enough cannot be the last. */
		rc = measure(out, level, (uint64_t)round, n, round <= 2);
		if (rc != PSR_OK || is_over(out, round, before[0]))
			break;
		before[0] = before[1];
		before[1] = share(out);
		rc = add_missing(level, out, round);
		free(out->spot);
		out->spot = NULL;
	}
	free(out->spot);
	out->spot = NULL;
	return rc;
}
