#include <math.h>
#include <string.h>
#include "base/direction.h"
#include "base/maths.h"
#include "base/vec.h"
#include "model/blocks.h"
#include "sampling.h"

/* Pixels between two sides that one sample stands for. Views along a thicker plate's rim see one side beyond the
 * samples of the other: at 0.75 in 1 of 5,000 pixels of the kittyhawk. */
#define THICKNESS 0.6

#define NARROW 0.5 /* pixels */

#define PAST 0.001 /* pixels behind a hit where the search goes on */

#define DISC_RAYS 32
#define DISC_WHOLE 28 /* rays that meet a surface where a disc counts as whole; a leaf may bend away from the others */

#define PI 3.14159265358979323846

#define CHUNK 1024
#define BATCH 64

/* Places of a triangle that are tested: its middle, and near its corners. */
static const double PLACE[4][3] = { { 1.0 / 3, 1.0 / 3, 1.0 / 3 },
	                                { 0.8, 0.1, 0.1 },
	                                { 0.1, 0.8, 0.1 },
	                                { 0.1, 0.1, 0.8 } };
#define N_PLACES 4

/* A ray outwards from THICKNESS behind a place. */
static void aim(const struct sampling *sampling, uint32_t prim, const double place[3], struct ray *ray)
{
	const float *n = ray_scene_normal(sampling->scene, prim);
	double corner[3][3];

	ray_scene_corners(sampling->scene, prim, corner);
	for (int k = 0; k < 3; k++) {
		ray->direction[k] = (double)n[k];
		ray->origin[k] = place[0] * corner[0][k] + place[1] * corner[1][k] + place[2] * corner[2][k]
		                 - THICKNESS * sampling->ds * (double)n[k];
	}
}

/* Finds another face of the same look, met from outside. */
static int is_other_side(const struct sampling *sampling, uint32_t prim, const struct ray_hit *hit)
{
	return hit->prim != prim && !hit->is_back
	       && texture_material(sampling->mesh, hit->prim) == texture_material(sampling->mesh, prim);
}

struct job {
	const struct sampling *sampling;
	const uint8_t *finer;
	uint8_t *thin;
};

/* Whether a primitive faces the even one of the two projections along the line that it faces best: that one owns thin
 * things. */
static int is_sampled_side(const struct sampling *sampling, uint32_t prim)
{
	const float *n = ray_scene_normal(sampling->scene, prim);
	float most = 0;

	for (int q = 0; q < N_PROJECTIONS; q += 2) {
		float g = v3f_dot(sampling->projection[q].axis[2], n);

		most = fabsf(g) > fabsf(most) ? g : most;
	}
	return most >= 0;
}

struct part {
	int n;
	uint32_t prim[BATCH];
	uint8_t is_behind[BATCH]; /* what is sampled, wherever it was looked */
};

/* Keeps the primitives that are thin at one place. Rays go on behind faces of another look: leaves grow through each
 * other. */
static void keep_thin(const struct sampling *sampling, struct part *part, const double place[3])
{
	const double length = THICKNESS * sampling->ds;
	struct ray ray[BATCH];
	struct ray_hit hit[BATCH];
	double done[BATCH] = { 0 };
	struct part left = *part;

	for (int i = 0; i < left.n; i++)
		aim(sampling, left.prim[i], place, &ray[i]);
	part->n = 0;
	while (left.n != 0) {
		int n = 0;

		ray_scene_trace_near(sampling->scene, ray, left.n, 0, length, hit);
		for (int i = 0; i < left.n; i++) {
			double at = done[i] + hit[i].t;

			if (hit[i].prim == RAY_NONE || !(at < length))
				continue;
			if (is_other_side(sampling, left.prim[i], &hit[i])) {
				part->prim[part->n] = left.prim[i];
				part->is_behind[part->n++] = left.is_behind[i] && is_sampled_side(sampling, hit[i].prim);
				continue;
			}
			left.prim[n] = left.prim[i];
			left.is_behind[n] = left.is_behind[i];
			done[n] = at + PAST * sampling->ds;
			v3d_add_scaled(ray[n].origin, ray[i].origin, done[n] - done[i], ray[i].direction);
			for (int k = 0; k < 3; k++)
				ray[n].direction[k] = ray[i].direction[k];
			n++;
		}
		left.n = n;
	}
}

static int is_narrow(const struct sampling *sampling, uint32_t prim)
{
	double corner[3][3], side[3][3], cross[3], longest = 0;

	ray_scene_corners(sampling->scene, prim, corner);
	for (int k = 0; k < 3; k++) {
		v3d_sub(side[k], corner[(k + 1) % 3], corner[k]);
		longest = fmax(longest, v3d_length(side[k]));
	}
	v3d_cross(cross, side[0], side[1]);
	return v3d_length(cross) < NARROW * sampling->ds * longest;
}

static void mark_chunk(int i, void *userdata)
{
	const struct job *job = userdata;
	const struct sampling *sampling = job->sampling;
	uint32_t first = (uint32_t)i * CHUNK, end = first + CHUNK, prim = first;

	end = end < sampling->mesh->n_triangles ? end : sampling->mesh->n_triangles;
	while (prim < end) {
		struct part part = { .n = 0 };

		for (; prim < end && part.n < BATCH; prim++) {
			const float *n = ray_scene_normal(sampling->scene, prim);

			if (job->finer != NULL && job->finer[prim] != 0) {
				job->thin[prim] = job->finer[prim] & (THIN | THIN_BEHIND);
			} else if (sampling->surface->is_plain[texture_material(sampling->mesh, prim)]
			           && (n[0] != 0 || n[1] != 0 || n[2] != 0)) {
				part.prim[part.n] = prim;
				part.is_behind[part.n++] = !is_sampled_side(sampling, prim);
			}
		}
		for (int k = 0; k < N_PLACES && part.n != 0; k++)
			keep_thin(sampling, &part, PLACE[k]);
		for (int k = 0; k < part.n; k++)
			job->thin[part.prim[k]] = (uint8_t)(THIN | (part.is_behind[k] ? THIN_BEHIND : 0));
	}
	for (prim = first; prim < end; prim++)
		if (job->thin[prim] != 0 && is_narrow(sampling, prim))
			job->thin[prim] = THIN | THIN_NARROW;
}

void thin_mark(uint8_t *thin, const struct sampling *sampling, const uint8_t *finer)
{
	struct job job = { sampling, finer, thin };

	memset(thin, 0, sampling_n_prims(sampling));
	if (sampling->mesh->color == NULL)
		psr_pool_for(sampling->pool, (int)((sampling->mesh->n_triangles + CHUNK - 1) / CHUNK), mark_chunk, &job);
}

uint8_t thin_opacity(const struct sampling *sampling, const float p[3], const float n[3])
{
	const double axis[3] = { (double)n[0], (double)n[1], (double)n[2] }, turn = 2.399963229728653; /* the golden angle */
	const double depth = THICKNESS * sampling->ds;
	struct ray ray[DISC_RAYS];
	uint8_t is_met[DISC_RAYS];
	double basis[3][3];
	int n_met = 0;

	psr_direction_basis(axis, basis);
	for (int i = 0; i < DISC_RAYS; i++) {
		const double r = 0.5 * sampling->ds * sqrt((i + 0.5) / DISC_RAYS);
		const double angle = fmod(i * turn, 2 * PI), above = angle <= PI ? 1 : -1;
		double s, c;

		psr_sincos(above > 0 ? angle : 2 * PI - angle, &s, &c);
		for (int k = 0; k < 3; k++) {
			ray[i].direction[k] = -axis[k];
			ray[i].origin[k] = (double)p[k] + r * (c * basis[0][k] + above * s * basis[1][k]) + depth * axis[k];
		}
	}
	ray_scene_occluded(sampling->scene, ray, DISC_RAYS, 2 * depth, is_met);
	for (int i = 0; i < DISC_RAYS; i++)
		n_met += is_met[i];
	return n_met >= DISC_WHOLE ? PSR_OPAQUE : (uint8_t)((n_met > 0 ? n_met : 1) * PSR_OPAQUE / DISC_RAYS);
}
