/* Differential points ([K] 5): batches of them in a picture. Frames of points are (u, v, normal). */
#ifndef PSR_SIMD_LOOPS_POINTS_PLACE_H
#define PSR_SIMD_LOOPS_POINTS_PLACE_H

#include "points_unpack.h"

#define POINTS_FULL (POINTS_BATCH - DPOINT_GROUP) /* a batch of more is drawn: the next group may be a whole one */
#define POINTS_ROUNDING 0.0625f /* pixels: of bounds */

enum points_side { POINTS_FRONT = 1, POINTS_BACK = 2, POINTS_FRONT_OF_FEW = 4 };

/* Lines of sight in a point's frame. That through pixel (x + dx, y + dy) at depth z + s is at
 *   from + scale (dx right + dy down) + s (sight + [perspective] (dx right + dy down)). */
struct points_batch {
	const struct warp_instance *in;
	struct points_unpacked p;
	/* Listed, of groups: where the low corner is in the picture, and from the eye; [K]'s delta. */
	float origin[3][POINTS_ROOM], eye[3][POINTS_ROOM], delta[2][POINTS_ROOM];
	uint32_t id[POINTS_ROOM], is_mixed[POINTS_ROOM];
	/* Placed. */
	float extent[2][POINTS_ROOM]; /* with what sights that graze reach over */
	float x[POINTS_ROOM], y[POINTS_ROOM], z[POINTS_ROOM], scale[POINTS_ROOM];
	float from[3][POINTS_ROOM], sight[3][POINTS_ROOM], right[3][POINTS_ROOM], down[3][POINTS_ROOM];
	float low[2][POINTS_ROOM], high[2][POINTS_ROOM]; /* pixels that the quadric is within */
	float away[2][POINTS_ROOM]; /* above 0: no place shows its front; its back */
	/* Sorted: pixels of the tile, and the sides that show; 0 outside of it. */
	int32_t x0[POINTS_ROOM], y0[POINTS_ROOM], x1[POINTS_ROOM], y1[POINTS_ROOM];
	uint32_t sides[POINTS_ROOM];
};

static inline void list_group(struct points_batch *b, const struct bin_entry *entry)
{
	const struct warp_points *points = b->in->points;
	const struct dpoint_set *set = points->model->set;
	const struct dpoint_group *g = &set->group[entry->slot - b->in->first_slot];
	const double low[3] = { g->box.low[0], g->box.low[1], g->box.low[2] };
	const uint32_t first = b->p.n, n = g->n;

	for (uint32_t i = 0; i < n; i++) {
		points_list(&b->p, first + i, points, &set->word[g->first + i]);
		b->id[first + i] = entry->slot * PSR_BLOCK_SAMPLES + i;
		b->is_mixed[first + i] = entry->is_mixed;
	}
	for (int k = 0; k < 3; k++) {
		const double *axis = points->axis[k];
		const double at = points->origin[k] + ((axis[0] * low[0] + axis[1] * low[1]) + axis[2] * low[2]);

		points_repeat(b->p.step[k] + first, g->box.step[k], n);
		points_repeat(b->origin[k] + first, (float)at, n);
		points_repeat(b->eye[k] + first, (float)(low[k] - points->eye[k]), n);
	}
	for (int k = 0; k < 2 && set->delta == NULL; k++)
		points_repeat(b->delta[k] + first, dpoint_delta_of_class(g->delta[k]), n);
	for (uint32_t i = 0; i < n && set->delta != NULL; i++)
		for (int k = 0; k < 2; k++)
			b->delta[k][first + i] = dpoint_delta_of_class(set->delta[g->first + i][k]);
	b->p.n += n;
}

static inline void find_extents(struct points_batch *b)
{
	const uint32_t n = points_lanes(b->p.n);
	const float sine = b->in->points->model->set->sine;

	for (uint32_t i = 0; i < n; i++)
		b->p.lambda[1][i] *= b->p.lambda[0][i];
	for (int k = 0; k < 2; k++)
		for (uint32_t i = 0; i < n; i++) {
			const float lambda = __builtin_fabsf(b->p.lambda[k][i]), delta = b->delta[k][i];
			const int is_delta = delta * lambda <= sine;

			b->extent[k][i] = psr_choose(is_delta, delta, sine / psr_choose(is_delta, 1, lambda));
		}
}

static inline float points_dot(float ax, float ay, float az, float bx, float by, float bz)
{
	return (ax * bx + ay * by) + az * bz;
}

/* A bound of c / z for z from z0 to z1, both above 0. */
static inline float points_edge(float c, float if_negative, float if_positive)
{
	return c * psr_choose(c < 0, if_negative, if_positive);
}

/* Where a point's centre is not before the eye its lines of sight start on the view axis. The vector from the eye to a
 * place at u, v of the quadric meets the normal there, (-a u, -b v, 1), with normal's part of `eye` - a u eye_u - b v
 * eye_v - (a u^2 + b v^2) / 2: so `away` is exact. */
static inline void make_rays(struct points_batch *b, const struct warp_target *t)
{
	const struct points_unpacked *p = &b->p;
	const struct warp_points *points = b->in->points;
	const int perspective = t->perspective;
	const float graze = points->graze, near = t->near_z;
	const float fx = points->forward[0], fy = points->forward[1], fz = points->forward[2];
	const float rx = points->right[0], ry = points->right[1], rz = points->right[2];
	const float dx = points->down[0], dy = points->down[1], dz = points->down[2];
	const float center_x = points->center[0], center_y = points->center[1];
	const uint32_t n = points_lanes(p->n);
	float m[3][3];

	for (int a = 0; a < 3; a++)
		for (int k = 0; k < 3; k++)
			m[a][k] = (float)points->axis[a][k];
	for (uint32_t i = 0; i < n; i++) {
		const float px = p->at[0][i], py = p->at[1][i], pz = p->at[2][i];
		const float x = b->origin[0][i] + points_dot(m[0][0], m[0][1], m[0][2], px, py, pz);
		const float y = b->origin[1][i] + points_dot(m[1][0], m[1][1], m[1][2], px, py, pz);
		const float z = b->origin[2][i] + points_dot(m[2][0], m[2][1], m[2][2], px, py, pz);
		const int is_before = !perspective | (z > near);
		const float inverse = psr_choose(perspective & is_before, 1 / z, 1);
		const float to_x = psr_choose(perspective, b->eye[0][i] + px, fx);
		const float to_y = psr_choose(perspective, b->eye[1][i] + py, fy);
		const float to_z = psr_choose(perspective, b->eye[2][i] + pz, fz), depth = psr_choose(is_before, z, near);
		float eye_in[3], reach[3] = { 0, 0, 0 };

		for (int k = 0; k < 3; k++)
			eye_in[k] = points_dot(p->axis[k][0][i], p->axis[k][1][i], p->axis[k][2][i], to_x, to_y, to_z);
		const float s = p->lambda[0][i], r = p->lambda[1][i];
		const float eu = b->extent[0][i] + dpoint_graze_by(graze, eye_in[0], eye_in[1], eye_in[2]);
		const float ev = b->extent[1][i] + dpoint_graze_by(graze, eye_in[1], eye_in[0], eye_in[2]);
		const float rise_u = 0.5f * s * eu * eu, rise_v = 0.5f * r * ev * ev;
		const float extent[3] = { eu, ev, __builtin_fabsf(rise_u) + __builtin_fabsf(rise_v) };

		b->x[i] = psr_where(is_before, x * inverse) + center_x;
		b->y[i] = psr_where(is_before, y * inverse) + center_y;
		b->z[i] = depth;
		b->extent[0][i] = eu;
		b->extent[1][i] = ev;
		b->scale[i] = psr_choose(perspective, depth, 1);
		for (int k = 0; k < 3; k++) {
			const float ax = p->axis[k][0][i], ay = p->axis[k][1][i], az = p->axis[k][2][i];
			const float forward = points_dot(ax, ay, az, fx, fy, fz);

			b->sight[k][i] = psr_choose(is_before, eye_in[k] * inverse, forward);
			b->from[k][i] = psr_where(!is_before, near * forward - eye_in[k]);
			b->right[k][i] = points_dot(ax, ay, az, rx, ry, rz);
			b->down[k][i] = points_dot(ax, ay, az, dx, dy, dz);
			for (int c = 0; c < 3; c++)
				reach[c] += extent[k] * __builtin_fabsf(points_dot(m[c][0], m[c][1], m[c][2], ax, ay, az));
		}
		const float turned = __builtin_fabsf(s) * eu * __builtin_fabsf(eye_in[0])
		                     + __builtin_fabsf(r) * ev * __builtin_fabsf(eye_in[1]);
		b->away[0][i] = (eye_in[2] - turned) - (psr_where(s > 0, rise_u) + psr_where(r > 0, rise_v));
		b->away[1][i] = (-eye_in[2] - turned) + (psr_where(s < 0, rise_u) + psr_where(r < 0, rise_v));
		const float front = z - reach[2], z0 = psr_choose(front > near, front, near), z1 = z + reach[2];
		const float near_scale = psr_choose(perspective, 1 / z0, 1), far_scale = psr_choose(perspective, 1 / z1, 1);
		b->low[0][i] = points_edge(x - reach[0], near_scale, far_scale) + center_x;
		b->high[0][i] = points_edge(x + reach[0], far_scale, near_scale) + center_x;
		b->low[1][i] = points_edge(y - reach[1], near_scale, far_scale) + center_y;
		/* Behind the eye there is nothing. */
		b->high[1][i] = psr_choose(z1 > near, points_edge(y + reach[1], far_scale, near_scale) + center_y, -1e30f);
	}
}

/* Returns the first pixel whose centre is beyond, within low..high; NaN gives low. */
static inline int32_t points_pixel(float x, int32_t low, int32_t high)
{
	const float most = (float)high, least = (float)low;

	x = x > least ? x : least;
	return psr_floor_int((x < most ? x : most) - 0.5f) + 1;
}

/* Counts the points that may be in the tile, of all of its rows. */
static inline uint32_t count_points(const struct points_batch *b, const struct warp_target *t)
{
	const int32_t top = t->y0 - t->above, bottom = t->y1 + t->below;
	uint32_t n_inside = 0;

	for (uint32_t i = 0; i < b->p.n; i++) {
		const int32_t y0 = points_pixel(b->low[1][i] - POINTS_ROUNDING, top, bottom);
		const int32_t y1 = points_pixel(b->high[1][i] + POINTS_ROUNDING, top, bottom);

		n_inside += (b->x0[i] < b->x1[i]) & (y0 < y1);
	}
	return n_inside;
}

/* Returns how many points may be in the tile. few: fronts of points with at most as many pixels are told apart. */
static inline uint32_t sort_points(struct points_batch *b, const struct warp_target *t, int32_t few)
{
	const uint32_t n = points_lanes(b->p.n);
	const int32_t left = t->x0, right = t->x1, top = t->y0, bottom = t->y1;
	uint32_t n_inside = 0;

	for (uint32_t i = 0; i < n; i++) {
		b->x0[i] = points_pixel(b->low[0][i] - POINTS_ROUNDING, left, right);
		b->x1[i] = points_pixel(b->high[0][i] + POINTS_ROUNDING, left, right);
		b->y0[i] = points_pixel(b->low[1][i] - POINTS_ROUNDING, top, bottom);
		b->y1[i] = points_pixel(b->high[1][i] + POINTS_ROUNDING, top, bottom);
	}
	for (uint32_t i = 0; i < n; i++) {
		const uint32_t is_inside = (i < b->p.n) & (b->x0[i] < b->x1[i]) & (b->y0[i] < b->y1[i]);
		const uint32_t has_back = (uint32_t)!b->is_mixed[i] & (b->away[1][i] <= 0);
		const int32_t n_pixels = (b->x1[i] - b->x0[i]) * (b->y1[i] - b->y0[i]);
		const uint32_t front = !has_back && n_pixels <= few ? POINTS_FRONT_OF_FEW : POINTS_FRONT;

		n_inside += is_inside;
		b->sides[i] = (0u - is_inside) & ((b->away[0][i] <= 0 ? front : 0) | (has_back ? POINTS_BACK : 0));
	}
	return t->above + t->below > 0 ? count_points(b, t) : n_inside;
}

#endif
