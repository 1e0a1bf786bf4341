/* Differential points: batches of words, unpacked as dpoint_unpack() does, in loops that compilers turn into vectors.
 * Groups are small where edges bend or deltas change, so that points of several fill a batch. */
#ifndef PSR_SIMD_LOOPS_POINTS_UNPACK_H
#define PSR_SIMD_LOOPS_POINTS_UNPACK_H

#include "base/maths.h"
#include "simd/warp.h"

#define POINTS_VECTOR 16 /* lanes of the widest vector: steps go on to a multiple, lists may be written so far beyond */
#define POINTS_BATCH 128 /* points */
#define POINTS_ROOM (POINTS_BATCH + POINTS_VECTOR)

/* Lengths are inner units. */
struct points_unpacked {
	uint32_t n;
	/* Listed: halves of words, the attributes' normal, a step of the group's box. */
	_Alignas(64) uint32_t low[POINTS_ROOM], high[POINTS_ROOM], normal[POINTS_ROOM];
	float step[3][POINTS_ROOM];
	/* Looked up: the middle of the normal's triangle, cosine and sine of the angle. */
	float center[3][POINTS_ROOM], turn[2][POINTS_ROOM];
	float lambda[2][POINTS_ROOM]; /* the second once unpacked: rho */
	/* Unpacked. */
	float at[3][POINTS_ROOM]; /* from the low corner of the group's box */
	float axis[3][3][POINTS_ROOM];
};

/* Lanes that a step covers. */
static inline uint32_t points_lanes(uint32_t n)
{
	return (n + POINTS_VECTOR - 1) / POINTS_VECTOR * POINTS_VECTOR;
}

/* Sets n values of a list, of which others follow: writes whole vectors. */
static inline void points_repeat(float *to, float value, uint32_t n)
{
	for (uint32_t first = 0; first < n; first += POINTS_VECTOR)
		for (uint32_t i = 0; i < POINTS_VECTOR; i++)
			to[first + i] = value;
}

/* Lists a word; steps are the caller's. Prefetches what points_look_up() reads once all are listed. */
static inline void points_list(struct points_unpacked *p, uint32_t i, const struct warp_points *points,
                               const struct dpoint_word *word)
{
	const uint64_t place = word->place;

	p->low[i] = (uint32_t)place;
	p->high[i] = (uint32_t)(place >> 32);
	p->normal[i] = PSR_ATTR_NORMAL(word->attr);
	__builtin_prefetch(points->direction[p->normal[i]]);
}

static inline void points_look_up(struct points_unpacked *p, const struct warp_points *points)
{
	for (uint32_t i = 0; i < p->n; i++) {
		const float *center = points->direction[p->normal[i]];
		const float *turn = points->tables->turn[p->high[i] >> (DPOINT_ANGLE_AT - 32) & 127];

		for (int k = 0; k < 3; k++)
			p->center[k][i] = center[k];
		p->turn[0][i] = turn[0];
		p->turn[1][i] = turn[1];
		p->lambda[0][i] = points->tables->lambda[p->high[i] >> (DPOINT_LAMBDA_AT - 32) & 255];
	}
}

_Static_assert(DPOINT_PLACE_BITS == 12 && DPOINT_FINE_AT == 36 && DPOINT_FINE_BITS == 3 && DPOINT_RHO_AT == 57,
               "as points_unpack() takes halves apart");

static inline void points_unpack(struct points_unpacked *p, const struct warp_points *points)
{
	const uint32_t lanes = points_lanes(p->n);

	points_look_up(p, points);
	for (uint32_t i = 0; i < lanes; i++) {
		const uint32_t low = p->low[i], high = p->high[i];

		p->at[0][i] = (float)(int32_t)(low & DPOINT_PLACE_STEPS) * p->step[0][i];
		p->at[1][i] = (float)(int32_t)(low >> 12 & DPOINT_PLACE_STEPS) * p->step[1][i];
		p->at[2][i] = (float)(int32_t)((low >> 24 | high << 8) & DPOINT_PLACE_STEPS) * p->step[2][i];
		p->lambda[1][i] = (float)((int32_t)(high >> 25) - DPOINT_RHO_STEPS) / DPOINT_RHO_STEPS;
	}
	for (uint32_t i = 0; i < lanes; i++) {
		const uint32_t high = p->high[i];
		const float fine[2] = { ((float)(int32_t)(high >> 4 & 7) - DPOINT_FINE_MIDDLE) * DPOINT_FINE_STEP,
			                    ((float)(int32_t)(high >> 7 & 7) - DPOINT_FINE_MIDDLE) * DPOINT_FINE_STEP };
		const float center[3] = { p->center[0][i], p->center[1][i], p->center[2][i] };
		float x[3], y[3], u[3], n[3];

		dpoint_fine_normal(n, center, fine);
		dpoint_tangents(x, y, n);
		for (int k = 0; k < 3; k++) {
			u[k] = p->turn[0][i] * x[k] + p->turn[1][i] * y[k];
			p->axis[0][k][i] = u[k];
			p->axis[2][k][i] = n[k];
		}
		p->axis[1][0][i] = n[1] * u[2] - n[2] * u[1];
		p->axis[1][1][i] = n[2] * u[0] - n[0] * u[2];
		p->axis[1][2][i] = n[0] * u[1] - n[1] * u[0];
	}
}

#endif
