#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/direction.h"
#include "base/vec.h"
#include "candidates.h"
#include "dice.h"
#include "psr/error.h"
#include "sample/visible/buried.h"
#include "sample/visible/sides.h"

#define STEP 0.33      /* pixels between places */
#define THIN_STEP 0.25 /* on thin primitives of the finest level, which is to be adequate */

/* Columns of places on a triangle of a pixel: at coarser levels one place a cell tests such triangles. */
#define SMALL 3

/* Places between grid lines, by round: a gap smaller than a step shows in one of the rounds. */
static const double SHIFT[] = { 0.5, 0.99, 0.25, 0.75 };
#define N_SHIFTS (int)(sizeof SHIFT / sizeof *SHIFT)

/* The places found on some primitives. */
struct chunk {
	struct places thin, rest;
	struct place_cells thin_cells; /* cells with a place on a thin primitive: its other sides need no test; */
	struct place_cells rest_cells; /* cells with one on a small triangle */
	int failed;
};

struct job {
	const struct keeper *keeper;
	const struct sampling *sampling;
	const struct field *field;
	struct chunk *chunk;
	uint32_t n_prims;
	int round;
};

static double step_of(const struct sampling *sampling, int is_thin)
{
	return (is_thin && sampling->level == 0 ? THIN_STEP : STEP) * sampling->ds;
}

static uint8_t thin_of(const struct sampling *sampling, uint32_t prim)
{
	return sampling->thin != NULL ? sampling->thin[prim] : 0;
}

/* Samples of narrow primitives are chosen after the test: they have no lattice triangles. */
static int is_covered(const struct job *job, const struct place *place)
{
	if ((thin_of(job->sampling, place->surface & ~SURFACE_BACK) & THIN_NARROW) != 0)
		return kept_covers(job->keeper->kept, place->p, place->n, KEPT_NEAR * job->sampling->ds);
	return candidates_cover(job->keeper, job->field, place);
}

/* A thin primitive is tested on one side, for both. */
static int is_any_side_seen(const struct visible_set *visible, const struct place *place)
{
	float back[3];

	v3f_scale(back, place->n, -1);
	return visible_set_has(visible, place->p, place->n) || visible_set_has(visible, place->p, back);
}

/* Tests a place on all sides that views have seen; in round 0 not on sides of hidden primitives. is_small: one place a
 * cell is enough for the triangle. */
static void test_place(const struct job *job, uint32_t prim, const float p[3], int is_small, struct chunk *chunk)
{
	static const float NO_WAY[3] = { 0, 0, 0 };
	const struct sampling *sampling = job->sampling;
	uint8_t sides = job->keeper->sides[prim];
	const float *front = ray_scene_normal(sampling->scene, prim);
	int is_two_sided = sampling_material(sampling, prim)->two_sided != 0, is_thin = sampling_is_thin(sampling, prim);
	int is_side_seen = 0, rc = PSR_OK;

	if (is_thin && place_cells_has(&chunk->thin_cells, p, NO_WAY))
		return;
	for (int back = 0; back <= is_two_sided; back++) {
		uint8_t seen = back ? SIDE_BACK_SEEN : SIDE_FRONT_SEEN, hidden = back ? SIDE_BACK_HIDDEN : SIDE_FRONT_HIDDEN;
		struct place place = { .surface = prim | (back ? SURFACE_BACK : 0) };

		if (job->round == 0 && !is_thin && (sides & hidden) != 0 && (sides & seen) == 0)
			continue;
		/* Samples kept for the front count for the back, too. */
		if (back && is_side_seen && keep_is_two_sided(job->keeper, prim, p, front))
			continue;
		v3f_set(place.p, p[0], p[1], p[2]);
		v3f_scale(place.n, front, back ? -1 : 1);
		if (is_small && !is_thin && place_cells_has(&chunk->rest_cells, p, place.n)) {
			is_side_seen = 1;
			continue;
		}
		is_side_seen = is_thin ? (sides & seen) != 0 || is_any_side_seen(job->keeper->visible, &place)
		                       : visible_set_has(job->keeper->visible, place.p, place.n);
		if (is_side_seen && is_thin)
			rc = place_cells_add(&chunk->thin_cells, p, NO_WAY);
		else if (is_side_seen && is_small)
			rc = place_cells_add(&chunk->rest_cells, p, place.n);
		if (rc == PSR_OK && is_side_seen && !is_covered(job, &place)
		    && (is_thin || !is_buried(sampling->scene, job->keeper->visible->ds, place.p, place.n)))
			rc = places_add(is_thin ? &chunk->thin : &chunk->rest, &place);
		chunk->failed |= rc != PSR_OK;
	}
}

static void dice_triangle(const struct job *job, uint32_t prim, struct chunk *chunk)
{
	const struct sampling *sampling = job->sampling;
	const double shift = SHIFT[job->round % N_SHIFTS];
	int can_be_absent = sampling_material(sampling, prim)->alpha != PSR_ALPHA_OPAQUE, longest = 0, n_columns, is_small;
	double corner[3][3], side[3], e[3], ab[3], ac[3], cross[3], height, foot;
	const double step = step_of(sampling, sampling_is_thin(sampling, prim));

	ray_scene_corners(sampling->scene, prim, corner);
	for (int i = 0; i < 3; i++) {
		v3d_sub(e, corner[(i + 1) % 3], corner[i]);
		side[i] = v3d_length(e);
		longest = side[i] > side[longest] ? i : longest;
	}
	/* The longest side is the base: from corner `longest` to the next. */
	v3d_sub(ab, corner[(longest + 1) % 3], corner[longest]);
	v3d_sub(ac, corner[(longest + 2) % 3], corner[longest]);
	v3d_cross(cross, ab, ac);
	height = v3d_length(cross) / side[longest];
	/* Columns stand on it, as high as the triangle: one thinner than a step is tested all along. */
	foot = v3d_dot(ab, ac) / (side[longest] * side[longest]);
	n_columns = (int)ceil(side[longest] / step);
	n_columns = n_columns > 1 ? n_columns : 1;
	is_small = n_columns <= SMALL && sampling->level != 0;
	for (int col = 0; col < n_columns; col++) {
		double x = (col + shift) / n_columns, top = x < foot ? x / foot : (1 - x) / (1 - foot);
		int n = (int)ceil(height * top / step);

		n = n > 1 ? n : 1;
		for (int i = 0; i < n; i++) {
			double w[3], t = (i + shift) / n * top;
			float p[3];

			w[(longest + 2) % 3] = t;
			w[(longest + 1) % 3] = x - t * foot;
			w[longest] = 1 - x - t * (1 - foot);
			if (can_be_absent && ray_scene_is_absent(sampling->scene, prim, w[1], w[2]))
				continue;
			for (int k = 0; k < 3; k++)
				p[k] = (float)(w[0] * corner[0][k] + w[1] * corner[1][k] + w[2] * corner[2][k]);
			test_place(job, prim, p, is_small, chunk);
		}
	}
}

/* A disc: the crossings of a square grid around its centre. */
static void dice_disc(const struct job *job, uint32_t prim, struct chunk *chunk)
{
	const struct sampling *sampling = job->sampling;
	const double shift = SHIFT[job->round % N_SHIFTS] - 0.5;
	const struct psr_mesh *mesh = sampling->mesh;
	const float *n = ray_scene_normal(sampling->scene, prim);
	double radius = (double)mesh->point_radius[prim - mesh->n_triangles] / sampling->surface->scale,
		   step = STEP * sampling->ds;
	int reach = (int)(radius / step);
	double center[3], basis[3][3], normal[3] = { (double)n[0], (double)n[1], (double)n[2] };

	v3d_normalize(normal, normal);
	psr_direction_basis(normal, basis);
	ray_scene_center(sampling->scene, prim, center);
	for (int i = -reach; i <= reach; i++) {
		for (int k = -reach; k <= reach; k++) {
			float p[3];
			double x = (i + shift) * step, y = (k + shift) * step;

			if (x * x + y * y > radius * radius)
				continue;
			for (int a = 0; a < 3; a++)
				p[a] = (float)(center[a] + x * basis[0][a] + y * basis[1][a]);
			test_place(job, prim, p, 0, chunk);
		}
	}
}

#define CHUNK 2048

static void dice_chunk(int i, void *userdata)
{
	struct job *job = userdata;
	const struct sampling *sampling = job->sampling;
	uint32_t end = ((uint32_t)i + 1) * CHUNK < job->n_prims ? ((uint32_t)i + 1) * CHUNK : job->n_prims;
	struct chunk *chunk = &job->chunk[i];

	chunk->failed = place_cells_init(&chunk->thin_cells, step_of(sampling, 1)) != PSR_OK
	                || place_cells_init(&chunk->rest_cells, STEP * sampling->ds) != PSR_OK;
	for (uint32_t prim = (uint32_t)i * CHUNK; prim < end && !chunk->failed; prim++) {
		const float *n = ray_scene_normal(sampling->scene, prim);

		if ((n[0] == 0 && n[1] == 0 && n[2] == 0) || (thin_of(sampling, prim) & THIN_BEHIND) != 0)
			continue;
		if (prim < sampling->mesh->n_triangles)
			dice_triangle(job, prim, chunk);
		else
			dice_disc(job, prim, chunk);
	}
	place_cells_fini(&chunk->thin_cells);
	place_cells_fini(&chunk->rest_cells);
}

static void append(struct places *places, const struct places *more)
{
	if (more->n != 0)
		memcpy(places->place + places->n, more->place, more->n * sizeof *places->place);
	places->n += more->n;
}

static int join_chunks(struct places *places, size_t *n_thin, const struct chunk *chunk, int n_chunks)
{
	for (int i = 0; i < n_chunks; i++) {
		if (chunk[i].failed)
			return PSR_ERR_MEMORY;
		places->capacity += chunk[i].thin.n + chunk[i].rest.n;
	}
	places->place = malloc((places->capacity + 1) * sizeof *places->place);
	if (places->place == NULL)
		return PSR_ERR_MEMORY;
	for (int i = 0; i < n_chunks; i++)
		append(places, &chunk[i].thin);
	*n_thin = places->n;
	for (int i = 0; i < n_chunks; i++)
		append(places, &chunk[i].rest);
	return PSR_OK;
}

int dice(struct places *places, size_t *n_thin, const struct keeper *keeper, const struct field *field, int round)
{
	struct job job = { .keeper = keeper, .sampling = keeper->sampling, .field = field, .round = round };
	int n_chunks, rc;

	*places = (struct places){ .place = NULL };
	*n_thin = 0;
	job.n_prims = sampling_n_prims(keeper->sampling);
	n_chunks = (int)((job.n_prims + CHUNK - 1) / CHUNK);
	job.chunk = calloc((size_t)n_chunks, sizeof *job.chunk);
	if (job.chunk == NULL)
		return PSR_ERR_MEMORY;
	psr_pool_for(keeper->sampling->pool, n_chunks, dice_chunk, &job);
	rc = join_chunks(places, n_thin, job.chunk, n_chunks);
	for (int i = 0; i < n_chunks; i++) {
		free(job.chunk[i].thin.place);
		free(job.chunk[i].rest.place);
	}
	free(job.chunk);
	return rc;
}
