#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include "base/mem.h"
#include "base/vec.h"
#include "cone.h"
#include "render/render.h"
#include "visibility_mask.h"
#include "visibility_mask_draw.h"

#define NOBODY UINT32_MAX
#define MARGIN 2
#define BATCH 16 /* views */
#define NEIGHBOURS 1.0 /* steps of the lattice */
#define MOST_SIDE 8192
#define NEAREST_EYE 1.05 /* from the middle of the unit sphere */
#define FURTHEST_EYE 8.0
#define FAR_AWAY 4.0 /* from any place: outside of the unit sphere */

struct eye {
	double place[3], basis[3][3], distance;
	int is_perspective;
};

struct picture {
	int side;
	float *nearest;
	uint32_t *winner; /* sample */
};

struct job {
	const struct mask_points *points;
	const struct mask_level *level;
	const struct ray_scene *scene;
	const uint32_t *block_of; /* of each sample */
	int first_view;
	uint64_t limit;                               /* pixels to look at, of each view */
	uint64_t n_seen[BATCH], n_lost[BATCH];
	atomic_int next, failed;
};

/* xorshift64*, 0 <= x < 1 */
static double next_random(uint64_t *state)
{
	*state ^= *state >> 12;
	*state ^= *state << 25;
	*state ^= *state >> 27;
	return (double)(*state * UINT64_C(2685821657736338717) >> 11) * 0x1p-53;
}

static void place_eye(struct eye *eye, int which)
{
	uint64_t state = UINT64_C(0x9e3779b97f4a7c15) * (uint64_t)(which + 1);
	double v[3];

	do
		for (int k = 0; k < 3; k++)
			v[k] = 2 * next_random(&state) - 1;
	while (v3d_dot(v, v) > 1 || v3d_normalize(v, v) < 0.01);
	eye->is_perspective = which & 1;
	eye->distance = NEAREST_EYE / (1 - next_random(&state) * (1 - NEAREST_EYE / FURTHEST_EYE));
	v3d_scale(eye->place, v, eye->distance);
	psr_direction_basis(v, eye->basis);
}

/* The direction from a sample to the eye. */
static void to_eye_from(const struct eye *eye, const float p[3], float v[3])
{
	for (int k = 0; k < 3; k++)
		v[k] = (float)(eye->is_perspective ? eye->place[k] - (double)p[k] : eye->basis[2][k]);
}

static int cone_says(const struct psr_blocks *blocks, uint32_t block, const struct eye *eye)
{
	float place[3];

	for (int i = 0; i < 3; i++)
		place[i] = (float)(eye->is_perspective ? eye->place[i] : eye->basis[2][i]);
	return cone_culls(blocks, block, place, eye->is_perspective);
}

static int is_away(const struct mask_points *points, uint32_t block, uint32_t k, const float v[3])
{
	const float *n = psr_direction_table()[PSR_ATTR_NORMAL(points->blocks->attr[k])];
	float g = n[0] * v[0] + n[1] * v[1] + n[2] * v[2];

	if ((points->blocks->flags[block] & PSR_BLOCK_TWO_SIDED) != 0
	    || (psr_blocks_traits(points->blocks, block) & PSR_BLOCK_BENT) != 0)
		return 0;
	return g < 0 && g * g > BACK_SINE * BACK_SINE * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

/* Draws the nearest sample of each pixel. */
static void draw(const struct job *job, const struct eye *eye, struct picture *picture)
{
	const struct psr_blocks *b = job->points->blocks;
	double nearest = eye->distance - 1, focal = 1 / (double)job->level->spacing;
	float middle = (float)picture->side / 2;

	for (int i = 0; i < picture->side * picture->side; i++) {
		picture->nearest[i] = INFINITY;
		picture->winner[i] = NOBODY;
	}
	for (uint32_t i = 0; i < job->level->n_blocks; i++) {
		uint32_t block = job->level->block[i], first = psr_blocks_attr_first(b, block);
		uint32_t end = first + (uint32_t)__builtin_popcountll(b->mask[block]);

		if ((psr_blocks_traits(b, block) & PSR_BLOCK_BENT) != 0 && cone_says(b, block, eye))
			continue; /* all of the block faces away */
		for (uint32_t k = first; k < end; k++) {
			const float p[3] = { job->points->x[k], job->points->y[k], job->points->z[k] };
			float v[3], u[2], depth;
			double c[3], q[3] = { (double)p[0], (double)p[1], (double)p[2] };
			int at;

			to_eye_from(eye, p, v);
			if (is_away(job->points, block, k, v))
				continue;
			m3d_apply(c, (const double(*)[3])eye->basis, q);
			depth = (float)(eye->distance - c[2]);
			for (int a = 0; a < 2; a++)
				u[a] = middle + (float)(c[a] * focal * (eye->is_perspective ? nearest / (double)depth : 1));
			if (!(u[0] >= 0 && u[1] >= 0 && u[0] < (float)picture->side && u[1] < (float)picture->side))
				continue;
			at = (int)u[1] * picture->side + (int)u[0];
			if (depth < picture->nearest[at]) {
				picture->nearest[at] = depth;
				picture->winner[at] = k;
			}
		}
	}
}

static int is_culled(const struct mask_points *points, uint32_t block, uint32_t k, const struct eye *eye)
{
	const struct psr_blocks *b = points->blocks;
	const float p[3] = { points->x[k], points->y[k], points->z[k] };
	float v[3];
	unsigned triangle;

	if (cone_says(b, block, eye))
		return 1;
	if (b->visibility_mask == NULL)
		return 0;
	to_eye_from(eye, p, v);
	triangle = psr_direction_encode(v) >> 8;
	return (b->visibility_mask[psr_blocks_visibility(b, block)][triangle >> 6] >> (triangle & 63) & 1) == 0;
}

/* Whether a ray from the eye meets nothing before the sample, or a surface no farther from the sample than its
 * neighbours are. */
static int is_open(const struct job *job, uint32_t k, const struct eye *eye)
{
	const double p[3] = { (double)job->points->x[k], (double)job->points->y[k], (double)job->points->z[k] };
	double distance = eye->is_perspective ? 0 : FAR_AWAY;
	struct ray ray;
	struct ray_hit hit;

	if (eye->is_perspective) {
		v3d_sub(ray.direction, p, eye->place);
		distance = v3d_normalize(ray.direction, ray.direction);
	} else {
		v3d_scale(ray.direction, eye->basis[2], -1);
	}
	v3d_add_scaled(ray.origin, p, -distance, ray.direction);
	ray_scene_trace(job->scene, &ray, 1, 0, &hit);
	return hit.prim == RAY_NONE || hit.t >= distance - NEIGHBOURS * (double)job->level->spacing;
}

static void look(const struct job *job, const struct eye *eye, const struct picture *picture, uint64_t *n_seen,
                 uint64_t *n_lost)
{
	*n_seen = *n_lost = 0;
	for (int i = 0; i < picture->side * picture->side && *n_seen < job->limit; i++) {
		uint32_t k = picture->winner[i];

		if (k == NOBODY)
			continue;
		++*n_seen;
		if (is_culled(job->points, job->block_of[k], k, eye) && is_open(job, k, eye))
			++*n_lost;
	}
}

static void draw_views(int thread, void *userdata)
{
	struct job *job = userdata;
	double side = ceil(2 * (double)job->points->reach / (double)job->level->spacing) + 2 * MARGIN;
	struct picture picture = { .side = side < MOST_SIDE ? (int)side : MOST_SIDE };
	size_t n = (size_t)picture.side * (size_t)picture.side;

	(void)thread;
	picture.nearest = psr_alloc_array(n, sizeof *picture.nearest);
	picture.winner = psr_alloc_array(n, sizeof *picture.winner);
	if (picture.nearest != NULL && picture.winner != NULL) {
		for (int i; (i = atomic_fetch_add(&job->next, 1)) < BATCH;) {
			struct eye eye;

			place_eye(&eye, job->first_view + i);
			draw(job, &eye, &picture);
			look(job, &eye, &picture, &job->n_seen[i], &job->n_lost[i]);
		}
	} else {
		atomic_store(&job->failed, 1);
	}
	psr_free(picture.nearest);
	psr_free(picture.winner);
}

/* Batch after batch, and only as many pixels of the last view as are needed. */
static int look_at(struct job *job, uint64_t n_trials, struct psr_pool *pool, uint64_t *n_lost)
{
	uint64_t n_left = n_trials;

	for (*n_lost = 0; n_left > 0; job->first_view += BATCH) {
		uint64_t before = n_left;

		job->limit = n_left;
		atomic_store(&job->next, 0);
		psr_pool_for(pool, psr_pool_threads(pool), draw_views, job);
		for (int i = 0; i < BATCH && !atomic_load(&job->failed); i++) {
			if (job->n_seen[i] > n_left) { /* later views are drawn again, and not counted */
				job->limit = n_left;
				atomic_store(&job->next, i);
				draw_views(0, job);
				if (atomic_load(&job->failed))
					break;
			}
			n_left -= job->n_seen[i];
			*n_lost += job->n_lost[i];
			if (n_left == 0)
				return PSR_OK;
		}
		if (atomic_load(&job->failed))
			return PSR_ERR_MEMORY;
		if (n_left == before)
			break; /* all samples face away from everywhere */
	}
	return PSR_OK;
}

int visibility_mask_lost(const struct psr_blocks *blocks, const struct ray_scene *scene, uint64_t n_trials,
                    struct psr_pool *pool, uint64_t *n_lost)
{
	struct mask_points points = { 0 };
	struct mask_level level = { 0 };
	struct job job = { .points = &points, .level = &level, .scene = scene };
	uint32_t *block_of = psr_alloc_array(blocks->n_samples, sizeof *block_of);
	int rc = block_of != NULL ? mask_points_init(&points, blocks) : PSR_ERR_MEMORY;

	if (rc == PSR_OK)
		rc = mask_level_init(&level, &points, 0);
	if (rc == PSR_OK) {
		for (uint32_t b = 0; b < blocks->n_blocks; b++)
			for (int i = 0; i < __builtin_popcountll(blocks->mask[b]); i++)
				block_of[psr_blocks_attr_first(blocks, b) + (uint32_t)i] = b;
		job.block_of = block_of;
		rc = look_at(&job, n_trials, pool, n_lost);
	}
	mask_points_fini(&points);
	mask_level_fini(&level);
	psr_free(block_of);
	return rc;
}
