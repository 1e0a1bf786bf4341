/* Normals of differential points by [K] (6), where the lines of sight meet the quadrics: at the depths of the words. */
#ifndef PSR_SIMD_LOOPS_POINTS_SHADE_H
#define PSR_SIMD_LOOPS_POINTS_SHADE_H

#include "points_unpack.h"
#include "simd/strip.h"
#include "strip_parts.h"

_Static_assert(STRIP <= POINTS_BATCH && STRIP_PADDING <= POINTS_VECTOR, "a strip's points are a batch");

/* Pixels that follow each other often show one point, which is unpacked once. */
struct points_runs {
	struct points_unpacked p;
	uint32_t id[STRIP + 1 + POINTS_VECTOR];
	const struct dpoint_lean *lean[POINTS_ROOM];
	int has_lean;
	float begin[3][POINTS_ROOM];            /* the eye from the point */
	uint32_t run[STRIP + POINTS_VECTOR];    /* of a pixel */
	/* By pixel. */
	float at[3][STRIP + POINTS_VECTOR], axis[3][3][STRIP + POINTS_VECTOR], lambda[2][STRIP + POINTS_VECTOR];
};

/* Tells the runs of pixels, and their ids; returns the last one. Sets of instructions may have a way of their own, which
 * may write POINTS_VECTOR values beyond. */
static inline uint32_t points_find_runs(uint32_t *run, uint32_t *id_of_run, const uint32_t *id, uint32_t first,
                                        uint32_t end)
{
	uint32_t n = 0;

	for (uint32_t i = first; i < end; i++) {
		n += i > first && id[i] != id[i - 1];
		id_of_run[n] = id[i];
		run[i] = n;
	}
	return n;
}

#ifndef POINTS_FIND_RUNS
#define POINTS_FIND_RUNS points_find_runs
#endif

static inline void list_runs(struct points_runs *to, const struct strip_pixels *p, const struct warp_instance *in,
                             uint32_t first, uint32_t end)
{
	const struct warp_points *points = in->points;
	const struct dpoint_set *set = points->model->set;
	const uint32_t n = POINTS_FIND_RUNS(to->run, to->id, p->id, first, end);

	to->p.n = n + 1;
	to->has_lean = 0;
	for (uint32_t r = 0; r <= n; r++) {
		const struct dpoint_group *g = &set->group[to->id[r] / PSR_BLOCK_SAMPLES - in->first_slot];

		points_list(&to->p, r, points, &set->word[g->first + to->id[r] % PSR_BLOCK_SAMPLES]);
		to->lean[r] = dpoint_lean_of(set, g, to->id[r] % PSR_BLOCK_SAMPLES);
		to->has_lean |= to->lean[r] != NULL;
		for (int c = 0; c < 3; c++) {
			to->p.step[c][r] = g->box.step[c];
			to->begin[c][r] = (float)(points->eye[c] - (double)g->box.low[c]);
		}
	}
	points_unpack(&to->p, points);
	for (int c = 0; c < 3; c++)
		for (uint32_t r = 0; r <= n; r++)
			to->begin[c][r] -= to->p.at[c][r];
}

#define POINTS_LISTS 14 /* of what is spread */

/* Sets values of pixels to those of their runs, list by list. Sets of instructions may have a way of their own, which
 * may write POINTS_VECTOR values beyond. */
static inline void points_spread(float *const to[POINTS_LISTS], const float *const from[POINTS_LISTS],
                                 const uint32_t *run, uint32_t first, uint32_t end)
{
	for (int k = 0; k < POINTS_LISTS; k++)
		for (uint32_t i = first; i < end; i++)
			to[k][i] = from[k][run[i]];
}

#ifndef POINTS_SPREAD
#define POINTS_SPREAD points_spread
#endif

static inline void spread_runs(struct points_runs *runs, uint32_t first, uint32_t end)
{
	float *to[POINTS_LISTS];
	const float *from[POINTS_LISTS];
	int n = 0;

	for (int k = 0; k < 3; k++) {
		to[n] = runs->at[k];
		from[n++] = runs->begin[k];
		for (int c = 0; c < 3; c++) {
			to[n] = runs->axis[k][c];
			from[n++] = runs->p.axis[k][c];
		}
	}
	for (int k = 0; k < 2; k++) {
		to[n] = runs->lambda[k];
		from[n++] = runs->p.lambda[k];
	}
	POINTS_SPREAD(to, from, runs->run, first, end);
}

/* local: where a line of sight meets the point's plane, along u and v. */
static inline void add_lean(float n[2], const struct dpoint_lean *lean, const float local[2])
{
	for (int c = 0; c < 2; c++)
		n[c] += (float)lean->at[c] * DPOINT_LEAN_STEP
		        + (dpoint_lean_by(lean->by[c][0]) * local[0] + dpoint_lean_by(lean->by[c][1]) * local[1]);
}

/* Surface normals of points that lean are those of their planes. */
static void find_planes(struct strip *strip, const struct points_runs *of, const float turn[3][3], uint32_t first,
                        uint32_t end)
{
	for (uint32_t i = first; i < end; i++) {
		const float x = of->axis[2][0][i], y = of->axis[2][1][i], z = of->axis[2][2][i];

		if (of->lean[of->run[i]] == NULL)
			continue;
		strip->gx[i] = (turn[0][0] * x + turn[0][1] * y) + turn[0][2] * z;
		strip->gy[i] = (turn[1][0] * x + turn[1][1] * y) + turn[1][2] * z;
		strip->gz[i] = (turn[2][0] * x + turn[2][1] * y) + turn[2][2] * z;
	}
}

/* has_lean: a constant of the caller. */
static inline __attribute__((always_inline)) void resolve_runs(struct strip *strip, const struct strip_view *view,
                                                               const struct warp_instance *in,
                                                               const struct points_runs *of, uint32_t first,
                                                               uint32_t end, int has_lean)
{
	const struct warp_points *points = in->points;
	const struct strip_pixels *p = strip->pixels;
	const int perspective = view->perspective;
	const float y = (float)p->y + 0.5f - points->center[1], center_x = points->center[0];
	float depth[STRIP];

	for (uint32_t i = first; i < end; i++)
		depth[i] = psr_word_z(p->word[p->x[i]]);
	for (uint32_t i = first; i < end; i++) {
		const float x = (float)(int32_t)(p->x0 + p->x[i]) + 0.5f - center_x, z = depth[i];
		const float wide = psr_choose(perspective, z, 1);
		float away[3], normal[3], n[3], local[2];

		for (int k = 0; k < 3; k++)
			away[k] = of->at[k][i] + (wide * (x * points->right[k] + y * points->down[k]) + z * points->forward[k]);
		for (int k = 0; k < 2; k++)
			local[k] = (of->axis[k][0][i] * away[0] + of->axis[k][1][i] * away[1]) + of->axis[k][2][i] * away[2];
		dpoint_normal_at(n, of->lambda[0][i], of->lambda[1][i], local[0], local[1]);
		if (has_lean && of->lean[of->run[i]] != NULL)
			add_lean(n, of->lean[of->run[i]], local);
		for (int k = 0; k < 3; k++)
			normal[k] = (n[0] * of->axis[0][k][i] + n[1] * of->axis[1][k][i]) + of->axis[2][k][i];
		const float unit = 1 / __builtin_sqrtf((normal[0] * normal[0] + normal[1] * normal[1]) + normal[2] * normal[2]);
		const float nx = (in->turn[0][0] * normal[0] + in->turn[0][1] * normal[1]) + in->turn[0][2] * normal[2];
		const float ny = (in->turn[1][0] * normal[0] + in->turn[1][1] * normal[1]) + in->turn[1][2] * normal[2];
		const float nz = (in->turn[2][0] * normal[0] + in->turn[2][1] * normal[1]) + in->turn[2][2] * normal[2];

		strip->nx[i] = nx * unit;
		strip->ny[i] = ny * unit;
		strip->nz[i] = nz * unit;
	}
}

static void points_resolve(struct strip *strip, const struct strip_view *view, const struct warp_instance *in,
                           uint32_t first, uint32_t end)
{
	struct points_runs of;

	list_runs(&of, strip->pixels, in, first, end);
	spread_runs(&of, first, end);
	if (of.has_lean)
		resolve_runs(strip, view, in, &of, first, end, 1);
	else
		resolve_runs(strip, view, in, &of, first, end, 0);
	strip_copy_normals(strip, view, first, end);
	if (of.has_lean)
		find_planes(strip, &of, in->turn, first, end);
}

#endif
