#include <math.h>
#include <stdlib.h>
#include "base/mem.h"
#include "base/vec.h"
#include "surface/area.h"
#include "base/direction.h"
#include "psr/error.h"
#include "look_out.h"
#include "sample/mend/places.h"
#include "surface/texture.h"

#define PLACE_AREA 2.25 /* square pixels: a place for each cell of what was seen */
#define BATCH 64  /* rays from a side of each place, */
#define AGAIN 3   /* and so many times as many near what they found: what fewer miss shows in one of several hundred */
#define AROUND 2  /* times that cells are made twice as wide, to tell what is near that: 6 pixels */
#define NEAR 3    /* times that cells are made twice as wide, to tell what is near: 12 pixels */
#define CHUNK 4096

struct chunk {
	struct spots open, shut; /* from which rays got outside, and from which none did so far */
	int failed;
};

struct job {
	const struct level *level;
	const double *area; /* of all primitives up to this one */
	double step;        /* of area, from place to place */
	uint32_t n_prims;
	uint64_t n_places;
	struct seen near;   /* what was seen, in wider cells */
	struct seen around; /* what rays got outside from */
	struct chunk *chunk;
};

/* SplitMix64 (Steele, Lea, Flood 2014), by counter. */
static uint64_t draw_bits(uint64_t *state)
{
	uint64_t z = *state += UINT64_C(0x9e3779b97f4a7c15);

	z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
	z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
	return z ^ z >> 31;
}

static double draw(uint64_t *state)
{
	return (double)(draw_bits(state) >> 11) * 0x1p-53;
}

/* Towards where a side of a surface shows, as often as it looks large from there: a point of the unit sphere around n,
 * added to n. One in each of BATCH parts of the sphere, in an order in which the next is near. */
static void draw_view(uint64_t *state, int part, const float n[3], double view[3])
{
	const unsigned n_drawn = PSR_DIRECTIONS / BATCH, drawn = (unsigned)(draw_bits(state) % n_drawn);
	const float *direction = psr_direction_table()[(unsigned)part * n_drawn + drawn];

	for (int k = 0; k < 3; k++)
		view[k] = (double)direction[k] + (double)n[k];
	if (v3d_normalize(view, view) < 1e-3)
		v3d_set(view, (double)n[0], (double)n[1], (double)n[2]);
}

/* Looked at from outside, as one-sided faces let rays through that come from behind them. */
static int is_open(const struct level *level, const struct surface_spot *spot, int batches, uint64_t *state)
{
	struct ray ray[BATCH];
	uint8_t is_hidden[BATCH];

	for (int batch = 0; batch < batches; batch++) {
		for (int i = 0; i < BATCH; i++) {
			double view[3];

			draw_view(state, i, spot->n, view);
			for (int k = 0; k < 3; k++) {
				ray[i].origin[k] = (double)spot->p[k] + 3 * view[k];
				ray[i].direction[k] = -view[k];
			}
		}
		ray_scene_occluded(level->scene, ray, BATCH, 3 - 0.01 * level->ds, is_hidden);
		for (int i = 0; i < BATCH; i++)
			if (!is_hidden[i])
				return 1;
	}
	return 0;
}

static int look_at(const struct job *job, uint32_t prim, uint64_t *state, struct chunk *chunk)
{
	const struct level *level = job->level;
	const float *n = ray_scene_normal(level->scene, prim);
	double p[3];

	if (prim < level->mesh->n_triangles) {
		double u = draw(state), v = draw(state), corner[3][3];

		if (u + v > 1) {
			u = 1 - u;
			v = 1 - v;
		}
		if (ray_scene_is_absent(level->scene, prim, u, v))
			return PSR_OK;
		ray_scene_corners(level->scene, prim, corner);
		for (int k = 0; k < 3; k++)
			p[k] = (1 - u - v) * corner[0][k] + u * corner[1][k] + v * corner[2][k];
	} else {
		ray_scene_center(level->scene, prim, p);
	}
	for (int is_back = 0; is_back <= (level_material(level, prim)->two_sided != 0); is_back++) {
		struct surface_spot spot = { .surface = prim | (is_back ? SHEET_BACK : 0) };

		for (int k = 0; k < 3; k++) {
			spot.p[k] = (float)p[k];
			spot.n[k] = is_back ? -n[k] : n[k];
		}
		if (!seen_is(&level->seen, spot.p, spot.n) && seen_is(&job->near, spot.p, spot.n)
		    && spots_add(is_open(level, &spot, 1, state) ? &chunk->open : &chunk->shut, &spot) != PSR_OK)
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
		const double x = ((double)k + draw(&state)) * job->step;

		while (prim + 1 < job->n_prims && job->area[prim] <= x)
			prim++;
		chunk->failed = look_at(job, prim, &state, chunk) != PSR_OK;
	}
}

/* What is open shows from all of its neighborhood: there it is looked more closely. */
static void look_again(int i, void *userdata)
{
	const struct job *job = userdata;
	struct chunk *chunk = &job->chunk[i];
	uint64_t state = ~(uint64_t)i * UINT64_C(0x632be59bd9b4e019);

	chunk->open.n = 0;
	for (size_t k = 0; k < chunk->shut.n && !chunk->failed; k++) {
		const struct surface_spot *spot = &chunk->shut.spot[k];

		if (seen_is(&job->around, spot->p, spot->n) && !seen_is(&job->level->seen, spot->p, spot->n)
		    && is_open(job->level, spot, AGAIN, &state))
			chunk->failed = spots_add(&chunk->open, spot) != PSR_OK;
	}
}

static int add_open(struct seen *seen, const struct chunk *chunk, int n_chunks)
{
	int rc = PSR_OK;

	for (int i = 0; rc == PSR_OK && i < n_chunks; i++) {
		rc = chunk[i].failed ? PSR_ERR_MEMORY : PSR_OK;
		for (size_t k = 0; rc == PSR_OK && k < chunk[i].open.n; k++)
			rc = seen_add(seen, chunk[i].open.spot[k].p, chunk[i].open.spot[k].n);
	}
	return rc;
}

/* Cells made twice as wide so many times. seen_fini() either way. */
static int widen(struct seen *wide, const struct seen *seen, int times)
{
	int rc = seen_coarsen(wide, seen);

	for (int i = 1; rc == PSR_OK && i < times; i++) {
		struct seen finer = *wide;

		rc = seen_coarsen(wide, &finer);
		seen_fini(&finer);
	}
	return rc;
}

static int look_twice(struct level *level, struct job *job, int n_chunks)
{
	struct seen open = { .table = NULL };
	int rc = widen(&job->near, &level->seen, NEAR);

	if (rc == PSR_OK)
		psr_pool_for(level->pool, n_chunks, look_at_chunk, job);
	if (rc == PSR_OK)
		rc = add_open(&level->seen, job->chunk, n_chunks);
	if (rc == PSR_OK)
		rc = seen_init(&open, level->ds);
	if (rc == PSR_OK)
		rc = add_open(&open, job->chunk, n_chunks);
	if (rc == PSR_OK)
		rc = widen(&job->around, &open, AROUND);
	seen_fini(&open);
	if (rc != PSR_OK)
		return rc;
	psr_pool_for(level->pool, n_chunks, look_again, job);
	return add_open(&level->seen, job->chunk, n_chunks);
}

int seen_look_out(struct level *level)
{
	struct job job = { .level = level, .n_prims = level->mesh->n_triangles + level->mesh->n_points };
	double *area = psr_alloc_array(job.n_prims, sizeof *area);
	int rc = area == NULL ? PSR_ERR_MEMORY : PSR_OK, n_chunks = 0;

	if (rc == PSR_OK) {
		area_sum(level, job.n_prims, area);
		job.area = area;
		job.n_places = (uint64_t)(area[job.n_prims - 1] / (PLACE_AREA * level->ds * level->ds)) + 1;
		job.step = area[job.n_prims - 1] / (double)job.n_places;
		n_chunks = (int)((job.n_places + CHUNK - 1) / CHUNK);
		job.chunk = calloc((size_t)n_chunks, sizeof *job.chunk);
		rc = job.chunk == NULL ? PSR_ERR_MEMORY : look_twice(level, &job, n_chunks);
	}
	for (int i = 0; job.chunk != NULL && i < n_chunks; i++) {
		free(job.chunk[i].open.spot);
		free(job.chunk[i].shut.spot);
	}
	free(job.chunk);
	seen_fini(&job.near);
	seen_fini(&job.around);
	psr_free(area);
	return rc;
}
