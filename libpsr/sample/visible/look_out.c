#include <math.h>
#include <stdlib.h>
#include "base/direction.h"
#include "base/mem.h"
#include "base/random.h"
#include "base/vec.h"
#include "look_out.h"
#include "places.h"
#include "psr/error.h"
#include "ray/area.h"

#define PLACE_AREA 2.25 /* square pixels: a place for each cell of the visible set */
#define BATCH 64  /* rays from a side of each place, */
#define AGAIN 3   /* times as many near places that they found: a few hundred rays find most */
#define AROUND 2  /* doublings of a cell, to 6 pixels: the size of "around" */
#define NEAR 3    /* doublings of a cell, to 12 pixels: the size of "near" */
#define CHUNK 4096

struct chunk {
	struct places open, shut; /* a ray got outside; none did so far */
	int failed;
};

struct job {
	const struct sampling *sampling;
	struct visible_set *set;
	const double *area; /* of all primitives up to this one */
	double step;        /* of area, from place to place */
	uint32_t n_prims;
	uint64_t n_places;
	struct visible_set near;   /* places seen, in wider cells */
	struct visible_set around; /* places from which rays got outside */
	struct chunk *chunk;
};

/* A direction from a surface, as likely as the surface looks large from there: n plus a point of the unit sphere, one
 * in each of BATCH parts, so that rays in a row are near to each other. */
static void draw_view(uint64_t *state, int part, const float n[3], double view[3])
{
	const unsigned n_drawn = PSR_DIRECTIONS / BATCH, drawn = (unsigned)(random_next(state) % n_drawn);
	const float *direction = psr_direction_table()[(unsigned)part * n_drawn + drawn];

	for (int k = 0; k < 3; k++)
		view[k] = (double)direction[k] + (double)n[k];
	if (v3d_normalize(view, view) < 1e-3)
		v3d_set(view, (double)n[0], (double)n[1], (double)n[2]);
}

static int is_open(const struct sampling *sampling, const struct place *place, int batches, uint64_t *state)
{
	struct ray ray[BATCH];
	uint8_t is_hidden[BATCH];

	for (int batch = 0; batch < batches; batch++) {
		for (int i = 0; i < BATCH; i++) {
			double view[3];

			draw_view(state, i, place->n, view);
			place_ray(place, view, &ray[i]);
		}
		ray_scene_occluded(sampling->scene, ray, BATCH, PLACE_AWAY - 0.01 * sampling->ds, is_hidden);
		for (int i = 0; i < BATCH; i++)
			if (!is_hidden[i])
				return 1;
	}
	return 0;
}

static int look_at(const struct job *job, uint32_t prim, uint64_t *state, struct chunk *chunk)
{
	const struct sampling *sampling = job->sampling;
	double p[3], u = 0, v = 0;

	if (prim < sampling->mesh->n_triangles) {
		u = random_in(state, 0, 1);
		v = random_in(state, 0, 1);
	}
	if (!area_point(sampling->scene, prim, u, v, p))
		return PSR_OK;
	for (int is_back = 0; is_back <= (sampling_material(sampling, prim)->two_sided != 0); is_back++) {
		struct place place = { .p = { (float)p[0], (float)p[1], (float)p[2] },
			                   .surface = prim | (is_back ? SURFACE_BACK : 0) };

		sampling_normal(sampling, place.surface, place.n);
		if (!visible_set_has(job->set, place.p, place.n) && visible_set_has(&job->near, place.p, place.n)
		    && places_add(is_open(sampling, &place, 1, state) ? &chunk->open : &chunk->shut, &place) != PSR_OK)
			return PSR_ERR_MEMORY;
	}
	return PSR_OK;
}

static void look_at_chunk(int i, void *userdata)
{
	const struct job *job = userdata;
	const uint64_t first = (uint64_t)i * CHUNK, end = first + CHUNK < job->n_places ? first + CHUNK : job->n_places;
	struct chunk *chunk = &job->chunk[i];
	uint32_t prim = area_find(job->area, job->n_prims, (double)first * job->step);

	for (uint64_t k = first; k < end && !chunk->failed; k++) {
		uint64_t state = k * UINT64_C(0x632be59bd9b4e019);
		const double x = ((double)k + random_in(&state, 0, 1)) * job->step;

		while (prim + 1 < job->n_prims && job->area[prim] <= x)
			prim++;
		chunk->failed = look_at(job, prim, &state, chunk) != PSR_OK;
	}
}

/* Tries shut places near open ones with more rays. */
static void look_again(int i, void *userdata)
{
	const struct job *job = userdata;
	struct chunk *chunk = &job->chunk[i];
	uint64_t state = ~(uint64_t)i * UINT64_C(0x632be59bd9b4e019);

	chunk->open.n = 0;
	for (size_t k = 0; k < chunk->shut.n && !chunk->failed; k++) {
		const struct place *place = &chunk->shut.place[k];

		if (visible_set_has(&job->around, place->p, place->n) && !visible_set_has(job->set, place->p, place->n)
		    && is_open(job->sampling, place, AGAIN, &state))
			chunk->failed = places_add(&chunk->open, place) != PSR_OK;
	}
}

static int add_open(struct visible_set *set, const struct chunk *chunk, int n_chunks)
{
	int rc = PSR_OK;

	for (int i = 0; rc == PSR_OK && i < n_chunks; i++) {
		rc = chunk[i].failed ? PSR_ERR_MEMORY : PSR_OK;
		for (size_t k = 0; rc == PSR_OK && k < chunk[i].open.n; k++)
			rc = visible_set_add(set, chunk[i].open.place[k].p, chunk[i].open.place[k].n);
	}
	return rc;
}

/* Doubles cells so many times. visible_set_fini() either way. */
static int widen(struct visible_set *wide, const struct visible_set *set, int times)
{
	int rc = visible_set_coarsen(wide, set);

	for (int i = 1; rc == PSR_OK && i < times; i++) {
		struct visible_set finer = *wide;

		rc = visible_set_coarsen(wide, &finer);
		visible_set_fini(&finer);
	}
	return rc;
}

static int look_twice(struct job *job, int n_chunks)
{
	struct visible_set open = { .n_views = 0 };
	int rc = widen(&job->near, job->set, NEAR);

	if (rc == PSR_OK)
		psr_pool_for(job->sampling->pool, n_chunks, look_at_chunk, job);
	if (rc == PSR_OK)
		rc = add_open(job->set, job->chunk, n_chunks);
	if (rc == PSR_OK)
		rc = visible_set_init(&open, job->sampling->ds);
	if (rc == PSR_OK)
		rc = add_open(&open, job->chunk, n_chunks);
	if (rc == PSR_OK)
		rc = widen(&job->around, &open, AROUND);
	visible_set_fini(&open);
	if (rc != PSR_OK)
		return rc;
	psr_pool_for(job->sampling->pool, n_chunks, look_again, job);
	return add_open(job->set, job->chunk, n_chunks);
}

int look_out(struct visible_set *set, const struct sampling *sampling)
{
	struct job job = { .sampling = sampling, .set = set, .n_prims = sampling_n_prims(sampling) };
	double *area = psr_alloc_array(job.n_prims, sizeof *area);
	int rc = area == NULL ? PSR_ERR_MEMORY : PSR_OK, n_chunks = 0;

	if (rc == PSR_OK) {
		area_sum(sampling->scene, sampling->mesh, sampling->surface->scale, area);
		job.area = area;
		job.n_places = (uint64_t)(area[job.n_prims - 1] / (PLACE_AREA * sampling->ds * sampling->ds)) + 1;
		job.step = area[job.n_prims - 1] / (double)job.n_places;
		n_chunks = (int)((job.n_places + CHUNK - 1) / CHUNK);
		job.chunk = calloc((size_t)n_chunks, sizeof *job.chunk);
		rc = job.chunk == NULL ? PSR_ERR_MEMORY : look_twice(&job, n_chunks);
	}
	for (int i = 0; job.chunk != NULL && i < n_chunks; i++) {
		free(job.chunk[i].open.place);
		free(job.chunk[i].shut.place);
	}
	free(job.chunk);
	visible_set_fini(&job.near);
	visible_set_fini(&job.around);
	psr_free(area);
	return rc;
}
