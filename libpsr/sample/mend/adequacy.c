#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "adequacy.h"
#include "base/direction.h"
#include "base/mem.h"
#include "base/random.h"
#include "base/vec.h"
#include "psr/error.h"
#include "ray/area.h"

#define CHUNK 4096
#define BATCH 64
#define PARTS 8       /* measuring may stop after each of so many parts of the trials */
#define FARTHEST 4    /* pixels around a place that are searched at grazing angles */
#define BACK 0.0125f  /* as the renderer's: facing away by less than a step of normals still counts */

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
	struct places missing;
	int failed;
};

struct job {
	const struct sampling *sampling;
	const struct kept *kept;
	const double *area; /* of all primitives up to this one */
	uint32_t n_prims;
	uint64_t seed;
	struct chunk *chunk;
	int first_chunk; /* of this run */
};

struct trial {
	struct place place;
	double view[3]; /* unit, towards the viewer */
	double cosine;
	float axis[3][3]; /* of the pixel: its sides, and the view */
};

/* 0: this draw is no trial. */
static int draw_trial(const struct job *job, uint64_t index, struct trial *trial)
{
	uint64_t random = (job->seed << 40) + index * UINT64_C(0x632be59bd9b4e019);
	const struct sampling *sampling = job->sampling;
	uint32_t prim = area_find(job->area, job->n_prims, random_in(&random, 0, job->area[job->n_prims - 1]));
	const float *n = ray_scene_normal(sampling->scene, prim);
	double u = random_in(&random, 0, 1), v = random_in(&random, 0, 1), p[3], along, aside[3], up[3];
	int is_back;

	draw_direction(&random, trial->view);
	draw_direction(&random, aside);
	along = trial->view[0] * (double)n[0] + trial->view[1] * (double)n[1] + trial->view[2] * (double)n[2];
	is_back = along < 0;
	trial->cosine = fabs(along);
	if ((is_back && !sampling_material(sampling, prim)->two_sided) || random_in(&random, 0, 1) > trial->cosine
	    || !area_point(sampling->scene, prim, u, v, p))
		return 0;
	v3d_cross(up, trial->view, aside);
	if (v3d_normalize(up, up) < 1e-3)
		return 0;
	v3d_cross(aside, up, trial->view);
	for (int k = 0; k < 3; k++) {
		trial->axis[0][k] = (float)aside[k];
		trial->axis[1][k] = (float)up[k];
		trial->axis[2][k] = (float)trial->view[k];
		trial->place.p[k] = (float)p[k];
		trial->place.n[k] = is_back ? -n[k] : n[k];
	}
	trial->place.surface = prim | (is_back ? SURFACE_BACK : 0);
	return 1;
}

static int is_hit(const struct trial *trial, const struct kept_sample *sample, float half, float tolerance)
{
	const float *n = psr_direction_table()[sample->normal];
	float d[3];

	v3f_sub(d, sample->position, trial->place.p);
	return fabsf(v3f_dot(d, trial->axis[0])) <= half && fabsf(v3f_dot(d, trial->axis[1])) <= half
	       && v3f_dot(d, trial->axis[2]) >= -tolerance && (sample->two_sided || v3f_dot(n, trial->axis[2]) > -BACK);
}

static int is_any_hit(const struct job *job, const struct trial *trial, double radius)
{
	const double ds = job->sampling->ds, cosine = trial->cosine > 0.03 ? trial->cosine : 0.03;
	float half = (float)(ds / 2), tolerance = (float)(ds * (1 + 1.5 * sqrt(1 - cosine * cosine) / cosine));
	uint32_t first[GRID_MOST_AROUND];
	int n_cells = grid_around(&job->kept->grid, trial->place.p, radius, first);

	for (int c = 0; c < n_cells; c++)
		for (uint32_t i = first[c]; i != GRID_NONE; i = job->kept->sample[i].next)
			if (is_hit(trial, &job->kept->sample[i], half, tolerance))
				return 1;
	return 0;
}

static int is_missing(const struct job *job, const struct trial *trial)
{
	double reach = 0.75 / (trial->cosine > 0.1 ? trial->cosine : 0.1);

	if (is_any_hit(job, trial, 0.75 * job->sampling->ds))
		return 0;
	return !is_any_hit(job, trial, (reach < FARTHEST ? reach : FARTHEST) * job->sampling->ds);
}

static void look_at(const struct sampling *sampling, const struct trial *trial, int n, uint8_t *is_visible)
{
	struct ray ray[BATCH];
	uint8_t is_hidden[BATCH];

	for (int i = 0; i < n; i++)
		place_ray(&trial[i].place, trial[i].view, &ray[i]);
	ray_scene_occluded(sampling->scene, ray, n, PLACE_AWAY - 0.01 * sampling->ds, is_hidden);
	for (int i = 0; i < n; i++)
		is_visible[i] = !is_hidden[i];
}

static int run_batch(const struct job *job, struct chunk *chunk, const struct trial *trial, int n)
{
	uint8_t is_visible[BATCH];

	look_at(job->sampling, trial, n, is_visible);
	for (int i = 0; i < n; i++) {
		chunk->n_trials += is_visible[i];
		if (is_visible[i] && is_missing(job, &trial[i]) && places_add(&chunk->missing, &trial[i].place) != PSR_OK)
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
			chunk->failed = run_batch(job, chunk, trial, n) != PSR_OK;
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
	out->place = malloc((out->n_missing + 1) * sizeof *out->place);
	if (out->place == NULL)
		return PSR_ERR_MEMORY;
	for (int i = 0; i < n_chunks; n += chunk[i].missing.n, i++)
		if (chunk[i].missing.n != 0)
			memcpy(out->place + n, chunk[i].missing.place, chunk[i].missing.n * sizeof *out->place);
	return PSR_OK;
}

/* Whether the first chunks already miss as many places as all chunks together may. */
static int are_too_many(const struct chunk *chunk, int n_done, int n_chunks)
{
	uint64_t n_trials = 0, n_missing = 0;

	for (int i = 0; i < n_done; i++) {
		n_trials += chunk[i].n_trials;
		n_missing += chunk[i].missing.n;
	}
	return ADEQUACY_FEW * n_missing * (uint64_t)n_done >= n_trials * (uint64_t)n_chunks;
}

/* Returns how many chunks were run. */
static int run_chunks(struct job *job, int n_chunks, int can_stop)
{
	int n_done = 0;

	for (int part = 1; part <= PARTS; part++) {
		job->first_chunk = n_done;
		n_done = n_chunks * part / PARTS;
		psr_pool_for(job->sampling->pool, n_done - job->first_chunk, run_chunk, job);
		if (can_stop && n_done > 0 && are_too_many(job->chunk, n_done, n_chunks))
			break;
	}
	return n_done;
}

int adequacy_measure(struct adequacy *out, const struct sampling *sampling, const struct kept *kept, uint64_t seed,
                     uint64_t n_trials, int can_stop)
{
	/* About a quarter of the draws are trials: half by the angle, and half of these are visible. */
	int n_chunks = (int)((4 * n_trials + CHUNK - 1) / CHUNK), rc = PSR_OK;
	struct job job = { .sampling = sampling, .kept = kept, .n_prims = sampling_n_prims(sampling), .seed = seed };
	double *area = psr_alloc_array(job.n_prims, sizeof *area);

	job.chunk = calloc((size_t)n_chunks, sizeof *job.chunk);
	if (area == NULL || job.chunk == NULL)
		rc = PSR_ERR_MEMORY;
	if (rc == PSR_OK) {
		area_sum(sampling->scene, sampling->mesh, sampling->surface->scale, area);
		job.area = area;
		rc = join_chunks(out, job.chunk, run_chunks(&job, n_chunks, can_stop));
	}
	for (int i = 0; job.chunk != NULL && i < n_chunks; i++)
		free(job.chunk[i].missing.place);
	free(job.chunk);
	psr_free(area);
	return rc;
}
