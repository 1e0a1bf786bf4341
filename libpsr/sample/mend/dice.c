#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/mem.h"
#include "base/vec.h"
#include "candidates.h"
#include "base/direction.h"
#include "psr/error.h"
#include "places.h"
#include "surface/texture.h"
#include "sample/thin/cover.h"

/* Primitives are diced as in [G] 9.2.1 and [Cook87], though only to test what is there: places on them are this many
 * pixels apart. */
#define STEP 0.33
#define THIN_STEP 0.25 /* on what is thin, at the finest level, which is to be adequate */

/* Columns of places on a triangle as large as a pixel: at coarser levels, of such ones' places one a cell is enough. */
#define SMALL 3

/* Where between the lines of such a grid they are, by round: what is smaller than a step shows in one of them. */
static const double SHIFT[] = { 0.5, 0.99, 0.25, 0.75 };
#define N_SHIFTS (int)(sizeof SHIFT / sizeof *SHIFT)

#define CHEAP 7 /* an offer that opens no block, by what offers cost */

/* What was found of some primitives. */
struct chunk {
	struct spots thin, rest;
	struct spot_cells thin_cells; /* that have a place on something thin, whose other sides need no test; */
	struct spot_cells rest_cells; /* and one on a small triangle */
	int failed;
};

struct job {
	const struct level *level;
	struct chunk *chunk;
	uint32_t n_prims;
	int round;
};

static double step_of(const struct level *level, int is_thin)
{
	return (is_thin && level->finer == NULL ? THIN_STEP : STEP) * level->ds;
}

/* On what is narrow, samples are chosen only after it was tested: no triangle of them is to be looked for. */
static int is_covered(const struct level *level, const struct surface_spot *spot)
{
	if ((level->sides[spot->surface & ~SHEET_BACK] & SIDE_NARROW) != 0)
		return cover_is_near(&level->cover, spot->p, spot->n, LEVEL_NEAR * level->ds);
	return offer_is_covered(level, spot);
}

/* What is thin is tested on one of its sides, for both. */
static int is_any_side_seen(const struct level *level, const struct surface_spot *spot)
{
	float back[3];

	v3f_scale(back, spot->n, -1);
	return seen_is(&level->seen, spot->p, spot->n) || seen_is(&level->seen, spot->p, back);
}

/* Tests a place, on all sides that are seen; that of one whose primitive is known to be hidden need not be asked for
 * until more was seen. is_small: at a coarser level, on a triangle of which one place in a cell is enough. */
static void test_place(const struct job *job, uint32_t prim, const float p[3], int is_small, struct chunk *chunk)
{
	static const float NO_WAY[3] = { 0, 0, 0 };
	const struct level *level = job->level;
	uint8_t sides = level->sides[prim];
	const float *front = ray_scene_normal(level->scene, prim);
	int is_two_sided = level_material(level, prim)->two_sided != 0, is_thin = level_is_thin(level, prim);
	int is_side_seen = 0, rc = PSR_OK;

	if (is_thin && spot_cells_has(&chunk->thin_cells, p, NO_WAY))
		return;
	for (int back = 0; back <= is_two_sided; back++) {
		uint8_t seen = back ? SIDE_BACK_SEEN : SIDE_FRONT_SEEN, hidden = back ? SIDE_BACK_HIDDEN : SIDE_FRONT_HIDDEN;
		struct surface_spot spot = { .surface = prim | (back ? SHEET_BACK : 0) };

		if (job->round == 0 && !is_thin && (sides & hidden) != 0 && (sides & seen) == 0)
			continue;
		/* What is kept for the front counts. */
		if (back && is_side_seen && level_is_two_sided(level, prim, p, front))
			continue;
		v3f_set(spot.p, p[0], p[1], p[2]);
		v3f_scale(spot.n, front, back ? -1 : 1);
		if (is_small && !is_thin && spot_cells_has(&chunk->rest_cells, p, spot.n)) {
			is_side_seen = 1;
			continue;
		}
		is_side_seen = is_thin ? (sides & seen) != 0 || is_any_side_seen(level, &spot)
		                       : seen_is(&level->seen, spot.p, spot.n);
		if (is_side_seen && is_thin)
			rc = spot_cells_add(&chunk->thin_cells, p, NO_WAY);
		else if (is_side_seen && is_small)
			rc = spot_cells_add(&chunk->rest_cells, p, spot.n);
		if (rc == PSR_OK && is_side_seen && !is_covered(level, &spot))
			rc = spots_add(is_thin ? &chunk->thin : &chunk->rest, &spot);
		chunk->failed |= rc != PSR_OK;
	}
}

static void dice_triangle(const struct job *job, uint32_t prim, struct chunk *chunk)
{
	const struct level *level = job->level;
	const double shift = SHIFT[job->round % N_SHIFTS];
	int can_be_absent = level_material(level, prim)->alpha != PSR_ALPHA_OPAQUE, longest = 0, n_columns, is_small;
	double corner[3][3], side[3], e[3], height, foot, step = step_of(level, level_is_thin(level, prim));

	ray_scene_corners(level->scene, prim, corner);
	for (int i = 0; i < 3; i++) {
		v3d_sub(e, corner[(i + 1) % 3], corner[i]);
		side[i] = v3d_length(e);
		longest = side[i] > side[longest] ? i : longest;
	}
	/* The longest side is the base: from corner `longest` to the next. */
	const double *a = corner[longest], *b = corner[(longest + 1) % 3], *c = corner[(longest + 2) % 3];
	double ab[3], ac[3], cross[3];

	v3d_sub(ab, b, a);
	v3d_sub(ac, c, a);
	v3d_cross(cross, ab, ac);
	height = v3d_length(cross) / side[longest];
	/* Columns stand on it, as high as the triangle is there: one that is thinner than a step is tested all along. */
	foot = v3d_dot(ab, ac) / (side[longest] * side[longest]);
	n_columns = (int)ceil(side[longest] / step);
	n_columns = n_columns > 1 ? n_columns : 1;
	is_small = n_columns <= SMALL && level->finer != NULL;
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
			if (can_be_absent && ray_scene_is_absent(level->scene, prim, w[1], w[2]))
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
	const struct level *level = job->level;
	const double shift = SHIFT[job->round % N_SHIFTS] - 0.5;
	const struct psr_mesh *mesh = level->mesh;
	const float *n = ray_scene_normal(level->scene, prim);
	double radius = (double)mesh->point_radius[prim - mesh->n_triangles] / level->surface->scale,
		   step = STEP * level->ds;
	int reach = (int)(radius / step);
	double center[3], frame[3][3], normal[3] = { (double)n[0], (double)n[1], (double)n[2] };

	v3d_normalize(normal, normal);
	psr_direction_frame(normal, frame);
	ray_scene_center(level->scene, prim, center);
	for (int i = -reach; i <= reach; i++) {
		for (int k = -reach; k <= reach; k++) {
			float p[3];
			double x = (i + shift) * step, y = (k + shift) * step;

			if (x * x + y * y > radius * radius)
				continue;
			for (int a = 0; a < 3; a++)
				p[a] = (float)(center[a] + x * frame[0][a] + y * frame[1][a]);
			test_place(job, prim, p, 0, chunk);
		}
	}
}

#define CHUNK 2048

static void dice_chunk(int i, void *userdata)
{
	struct job *job = userdata;
	const struct psr_mesh *mesh = job->level->mesh;
	uint32_t end = ((uint32_t)i + 1) * CHUNK < job->n_prims ? ((uint32_t)i + 1) * CHUNK : job->n_prims;
	struct chunk *chunk = &job->chunk[i];

	chunk->failed = spot_cells_init(&chunk->thin_cells, step_of(job->level, 1)) != PSR_OK
	                || spot_cells_init(&chunk->rest_cells, STEP * job->level->ds) != PSR_OK;
	for (uint32_t prim = (uint32_t)i * CHUNK; prim < end && !chunk->failed; prim++) {
		const float *n = ray_scene_normal(job->level->scene, prim);

		if ((n[0] == 0 && n[1] == 0 && n[2] == 0) || (job->level->sides[prim] & SIDE_BEHIND) != 0)
			continue;
		if (prim < mesh->n_triangles)
			dice_triangle(job, prim, chunk);
		else
			dice_disc(job, prim, chunk);
	}
	spot_cells_fini(&chunk->thin_cells);
	spot_cells_fini(&chunk->rest_cells);
}

/* Places for which offers are found at once, by all threads. */
#define WINDOW 2048
#define PART 32

struct window {
	struct level *level;
	const struct surface_spot *spot;
	struct offers *offers;
	uint8_t *is_covered;
	int n;
};

static void look_for_offers(int i, void *userdata)
{
	struct window *window = userdata;

	for (int k = i * PART; k < (i + 1) * PART && k < window->n; k++)
		window->is_covered[k] = (uint8_t)offer_look(window->level, &window->spot[k], &window->offers[k]);
}

/* In a fixed order, one at a time. What costs more than `most` is left, and asked for. */
static int cover_window(const struct window *window, float most, struct surface_spot *left, size_t *n_left)
{
	int rc = PSR_OK;

	for (int k = 0; rc == PSR_OK && k < window->n; k++) {
		int is_left = 0;

		if (!window->is_covered[k] && !offer_is_superfluous(window->level, &window->spot[k], &window->offers[k]))
			rc = offer_take(window->level, &window->spot[k], &window->offers[k], most, &is_left);
		if (is_left) {
			offer_ask(window->level, &window->offers[k]);
			left[(*n_left)++] = window->spot[k];
		}
	}
	return rc;
}

static int cover_spots(struct level *level, struct surface_spot *spot, size_t *n, float most)
{
	struct window window = { .level = level };
	size_t n_left = 0;
	int rc = PSR_OK;

	window.offers = psr_alloc_array(WINDOW, sizeof *window.offers);
	window.is_covered = psr_alloc_array(WINDOW, 1);
	if (window.offers == NULL || window.is_covered == NULL)
		rc = PSR_ERR_MEMORY;
	for (size_t done = 0; rc == PSR_OK && done < *n; done += (size_t)window.n) {
		window.spot = spot + done;
		window.n = (int)(*n - done < WINDOW ? *n - done : WINDOW);
		psr_pool_for(level->pool, (window.n + PART - 1) / PART, look_for_offers, &window);
		rc = cover_window(&window, most, spot, &n_left);
	}
	*n = n_left;
	psr_free(window.offers);
	psr_free(window.is_covered);
	return rc;
}

static size_t join_spots(const struct job *job, int n_chunks, int are_thin, struct surface_spot *spot)
{
	size_t n = 0;

	for (int i = 0; i < n_chunks; i++) {
		const struct spots *spots = are_thin ? &job->chunk[i].thin : &job->chunk[i].rest;

		if (spot != NULL && spots->n != 0)
			memcpy(spot + n, spots->spot, spots->n * sizeof *spot);
		n += spots->n;
	}
	return n;
}

/* First what is thin; then what blocks that are there can cover; then new ones are opened, those first that most of the
 * rest could use. */
static int cover_chunks(struct level *level, const struct job *job, int n_chunks)
{
	size_t n = join_spots(job, n_chunks, 1, NULL);
	struct surface_spot *spot = psr_alloc_array(n + join_spots(job, n_chunks, 0, NULL), sizeof *spot);
	int rc = spot != NULL ? PSR_OK : PSR_ERR_MEMORY;

	if (rc == PSR_OK && n != 0) {
		join_spots(job, n_chunks, 1, spot);
		rc = thin_cover(level, spot, &n);
	}
	if (rc == PSR_OK) {
		n += join_spots(job, n_chunks, 0, spot + n);
		rc = cover_spots(level, spot, &n, CHEAP);
	}
	if (rc == PSR_OK)
		rc = cover_spots(level, spot, &n, INFINITY);
	psr_free(spot);
	return rc;
}

int dice_surface(struct level *level, int round)
{
	struct job job = { .level = level, .n_prims = level->mesh->n_triangles + level->mesh->n_points, .round = round };
	int n_chunks = (int)((job.n_prims + CHUNK - 1) / CHUNK), rc = PSR_OK;

	job.chunk = calloc((size_t)n_chunks, sizeof *job.chunk);
	if (job.chunk == NULL)
		return PSR_ERR_MEMORY;
	psr_pool_for(level->pool, n_chunks, dice_chunk, &job);
	for (int i = 0; i < n_chunks; i++)
		rc = job.chunk[i].failed ? PSR_ERR_MEMORY : rc;
	if (rc == PSR_OK)
		rc = cover_chunks(level, &job, n_chunks);
	for (int i = 0; i < n_chunks; i++) {
		free(job.chunk[i].thin.spot);
		free(job.chunk[i].rest.spot);
	}
	free(job.chunk);
	return rc;
}

int dice_cover(struct level *level, const struct surface_spot *spot)
{
	struct offers offers;
	int is_left;

	offer_find(level, spot, &offers);
	return offer_take(level, spot, &offers, INFINITY, &is_left);
}
