/* Differential points ([K] 5): each is drawn as the quadric of its curvatures over its rectangle, a ray a pixel. Frames of
 * points are (u, v, normal). */
#ifndef PSR_SIMD_LOOPS_POINTS_H
#define PSR_SIMD_LOOPS_POINTS_H

#include "base/maths.h"
#include "simd/strip.h"

#define POINTS_LANES 16       /* pixels of a row that are met together */
#define POINTS_NONE 0x7fffffffu /* bits of a depth beyond that of empty words */
#define POINTS_ROUNDING 0.0625f /* pixels: of bounds */

/* ---- unpacking ---- */

/* A group's points; lengths are inner units. */
struct points_unpacked {
	float at[3][DPOINT_GROUP]; /* from the low corner of the group's box */
	float axis[3][3][DPOINT_GROUP];
	float lambda[2][DPOINT_GROUP], extent[2][DPOINT_GROUP];
};

/* Unpacks one word as dpoint_unpack() does, to lane i of arrays. */
static inline __attribute__((always_inline)) void points_unpack(float *at[3], float *axis[3][3], float *lambda[2],
                                                                const struct warp_points *points,
                                                                const struct dpoint_word *word, const float step[3])
{
	const uint64_t place = word->place;
	const float *turn = points->tables->turn[place >> DPOINT_ANGLE_AT & 127];
	float x[3], y[3], u[3], n[3], fine[2];

	dpoint_fine_of(fine, place);
	dpoint_fine_normal(n, points->direction[PSR_ATTR_NORMAL(word->attr)], fine);
	dpoint_tangents(x, y, n);
	for (int k = 0; k < 3; k++) {
		*at[k] = (float)(int32_t)(place >> k * DPOINT_PLACE_BITS & DPOINT_PLACE_STEPS) * step[k];
		u[k] = turn[0] * x[k] + turn[1] * y[k];
		*axis[0][k] = u[k];
		*axis[2][k] = n[k];
	}
	*axis[1][0] = n[1] * u[2] - n[2] * u[1];
	*axis[1][1] = n[2] * u[0] - n[0] * u[2];
	*axis[1][2] = n[0] * u[1] - n[1] * u[0];
	*lambda[0] = points->tables->lambda[place >> DPOINT_LAMBDA_AT & 255];
	*lambda[1] = (float)((int32_t)(place >> DPOINT_RHO_AT) - DPOINT_RHO_STEPS) / DPOINT_RHO_STEPS;
}

static inline void unpack_group(struct points_unpacked *to, const struct warp_points *points,
                                const struct dpoint_group *g)
{
	const struct dpoint_set *set = points->model->set;
	const struct dpoint_limit limit = dpoint_group_limit(set, g);

	for (uint32_t i = 0; i < g->n; i++) {
		float *at[3], *axis[3][3], *lambda[2] = { &to->lambda[0][i], &to->lambda[1][i] };

		for (int k = 0; k < 3; k++) {
			at[k] = &to->at[k][i];
			for (int c = 0; c < 3; c++)
				axis[k][c] = &to->axis[k][c][i];
		}
		points_unpack(at, axis, lambda, points, &set->word[g->first + i], g->box.step);
	}
	for (uint32_t i = 0; i < g->n; i++)
		to->lambda[1][i] *= to->lambda[0][i];
	for (int k = 0; k < 2; k++)
		for (uint32_t i = 0; i < g->n; i++) {
			const float lambda = __builtin_fabsf(to->lambda[k][i]);
			const int is_delta = limit.delta[k] * lambda <= limit.sine;

			to->extent[k][i] = psr_choose(is_delta, limit.delta[k], limit.sine / psr_choose(is_delta, 1, lambda));
		}
}

/* ---- a group in a picture ---- */

/* Lines of sight in a point's frame. That through pixel (x + dx, y + dy) at depth z + s is at
 *   from + scale (dx right + dy down) + s (sight + [perspective] (dx right + dy down)). */
struct points_rays {
	float x[DPOINT_GROUP], y[DPOINT_GROUP], z[DPOINT_GROUP], scale[DPOINT_GROUP];
	float from[3][DPOINT_GROUP], sight[3][DPOINT_GROUP], right[3][DPOINT_GROUP], down[3][DPOINT_GROUP];
	float low[2][DPOINT_GROUP], high[2][DPOINT_GROUP]; /* pixels that the quadric is within */
	float away[2][DPOINT_GROUP]; /* above 0: no place shows its front; its back */
};

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
static inline void make_rays(struct points_rays *restrict to, const struct points_unpacked *restrict p,
                             const struct warp_points *points, const struct dpoint_group *g,
                             const struct warp_target *t)
{
	const int perspective = t->perspective;
	const float near = t->near_z, *f = points->forward;
	float m[3][3], origin[3], eye[3];

	for (int a = 0; a < 3; a++) {
		const double *axis = points->axis[a], *low = (const double[3]){ g->box.low[0], g->box.low[1], g->box.low[2] };

		for (int k = 0; k < 3; k++)
			m[a][k] = (float)axis[k];
		origin[a] = (float)(points->origin[a] + ((axis[0] * low[0] + axis[1] * low[1]) + axis[2] * low[2]));
		eye[a] = (float)(low[a] - points->eye[a]);
	}
	for (uint32_t i = 0; i < g->n; i++) {
		const float px = p->at[0][i], py = p->at[1][i], pz = p->at[2][i];
		const float x = origin[0] + points_dot(m[0][0], m[0][1], m[0][2], px, py, pz);
		const float y = origin[1] + points_dot(m[1][0], m[1][1], m[1][2], px, py, pz);
		const float z = origin[2] + points_dot(m[2][0], m[2][1], m[2][2], px, py, pz);
		const int is_before = !perspective | (z > near);
		const float inverse = psr_choose(perspective & is_before, 1 / z, 1);
		const float rx = psr_choose(perspective, eye[0] + px, f[0]), ry = psr_choose(perspective, eye[1] + py, f[1]);
		const float rz = psr_choose(perspective, eye[2] + pz, f[2]);

		to->x[i] = psr_where(is_before, x * inverse) + points->center[0];
		to->y[i] = psr_where(is_before, y * inverse) + points->center[1];
		to->z[i] = psr_choose(is_before, z, near);
		to->scale[i] = psr_choose(perspective, to->z[i], 1);
		float eye_in[3], reach[3] = { 0, 0, 0 };
		const float a = p->lambda[0][i], b = p->lambda[1][i], eu = p->extent[0][i], ev = p->extent[1][i];
		const float rise_u = 0.5f * a * eu * eu, rise_v = 0.5f * b * ev * ev;
		const float extent[3] = { eu, ev, __builtin_fabsf(rise_u) + __builtin_fabsf(rise_v) };
		for (int k = 0; k < 3; k++) {
			const float ax = p->axis[k][0][i], ay = p->axis[k][1][i], az = p->axis[k][2][i];
			const float forward = points_dot(ax, ay, az, f[0], f[1], f[2]);

			eye_in[k] = points_dot(ax, ay, az, rx, ry, rz);
			to->sight[k][i] = psr_choose(is_before, eye_in[k] * inverse, forward);
			to->from[k][i] = psr_where(!is_before, near * forward - eye_in[k]);
			to->right[k][i] = points_dot(ax, ay, az, points->right[0], points->right[1], points->right[2]);
			to->down[k][i] = points_dot(ax, ay, az, points->down[0], points->down[1], points->down[2]);
			for (int c = 0; c < 3; c++)
				reach[c] += extent[k] * __builtin_fabsf(points_dot(m[c][0], m[c][1], m[c][2], ax, ay, az));
		}
		const float turned = __builtin_fabsf(a) * eu * __builtin_fabsf(eye_in[0])
		                     + __builtin_fabsf(b) * ev * __builtin_fabsf(eye_in[1]);
		to->away[0][i] = (eye_in[2] - turned) - (psr_where(a > 0, rise_u) + psr_where(b > 0, rise_v));
		to->away[1][i] = (-eye_in[2] - turned) + (psr_where(a < 0, rise_u) + psr_where(b < 0, rise_v));
		const float front = z - reach[2], z0 = psr_choose(front > near, front, near), z1 = z + reach[2];
		const float near_scale = psr_choose(perspective, 1 / z0, 1), far_scale = psr_choose(perspective, 1 / z1, 1);
		to->low[0][i] = points_edge(x - reach[0], near_scale, far_scale) + points->center[0];
		to->high[0][i] = points_edge(x + reach[0], far_scale, near_scale) + points->center[0];
		to->low[1][i] = points_edge(y - reach[1], near_scale, far_scale) + points->center[1];
		/* Behind the eye there is nothing. */
		to->high[1][i] = psr_choose(z1 > near, points_edge(y + reach[1], far_scale, near_scale) + points->center[1], -1e30f);
	}
}

/* A point that is drawn, from one of its sides: from the back its normal and v, and so its curvatures, are turned. */
struct points_one {
	float x, y, z, scale, from[3], sight[3], right[3], down[3], a, b, extent[2], near, through;
	uint32_t id;
	int32_t x0, x1, y0, y1;
};

/* Returns the first pixel whose centre is beyond, within low..high; NaN gives low. */
static inline int32_t points_pixel(float x, int32_t low, int32_t high)
{
	const float most = (float)high, least = (float)low;

	x = x > least ? x : least;
	return psr_floor_int((x < most ? x : most) - 0.5f) + 1;
}

/* Meets POINTS_LANES lines of sight with the quadric, w = (a u^2 + b v^2) / 2: where its normal faces the eye, the
 * derivative of the equation along the line is below 0, which tells one root of two. */
static inline void meet_quadric(uint32_t bits[POINTS_LANES], const struct points_one *p, int32_t x, int32_t y)
{
	const float dy = (float)y + 0.5f - p->y;
	const float down[3] = { dy * p->down[0], dy * p->down[1], dy * p->down[2] };
	const float x0 = (float)x + 0.5f - p->x, a = p->a, b = p->b, through = p->through, scale = p->scale;
	const float z0 = p->z, near = p->near, eu = p->extent[0], ev = p->extent[1];

	for (int32_t i = 0; i < POINTS_LANES; i++) {
		const float dx = x0 + (float)i;
		const float su = dx * p->right[0] + down[0], sv = dx * p->right[1] + down[1], sn = dx * p->right[2] + down[2];
		const float qu = p->from[0] + scale * su, qv = p->from[1] + scale * sv, qn = p->from[2] + scale * sn;
		const float du = p->sight[0] + through * su, dv = p->sight[1] + through * sv, dn = p->sight[2] + through * sn;
		const float au = a * du, bv = b * dv;
		const float square = -0.5f * (au * du + bv * dv), linear = dn - (au * qu + bv * qv);
		const float rest = qn - 0.5f * (a * (qu * qu) + b * (qv * qv));
		const float inside = linear * linear - 4 * (square * rest);
		const float root = __builtin_sqrtf(psr_where(inside > 0, inside));
		const int is_falling = linear <= 0;
		const float above = psr_choose(is_falling, 2 * rest, -linear - root);
		const float below = psr_choose(is_falling, root - linear, 2 * square);
		const float s = above / below, z = z0 + s;
		const float u = qu + s * du, v = qv + s * dv;
		const int is_hit = (inside >= 0) & (__builtin_fabsf(u) <= eu) & (__builtin_fabsf(v) <= ev) & (z > near);
		const uint32_t mask = 0u - (uint32_t)is_hit;

		bits[i] = (psr_bits_from_float(z) & mask) | (POINTS_NONE & ~mask);
	}
}

static inline void draw_point(const struct warp_target *t, const struct points_one *p)
{
	for (int32_t y = p->y0; y < p->y1; y++) {
		uint64_t *row = t->word + (size_t)(y - t->y0) * t->stride;

		for (int32_t x = p->x0; x < p->x1; x += POINTS_LANES) {
			const int32_t n = p->x1 - x < POINTS_LANES ? p->x1 - x : POINTS_LANES;
			uint64_t *at = row + (x - t->x0);
			uint32_t bits[POINTS_LANES];

			meet_quadric(bits, p, x, y);
			for (int32_t i = 0; i < n; i++) {
				const uint64_t word = (uint64_t)bits[i] << 32 | p->id;

				at[i] = word < at[i] ? word : at[i];
			}
		}
	}
}

static inline void pick_point(struct points_one *to, const struct points_unpacked *p, const struct points_rays *rays,
                              uint32_t i)
{
	to->x = rays->x[i];
	to->y = rays->y[i];
	to->z = rays->z[i];
	to->scale = rays->scale[i];
	for (int k = 0; k < 3; k++) {
		to->from[k] = rays->from[k][i];
		to->sight[k] = rays->sight[k][i];
		to->right[k] = rays->right[k][i];
		to->down[k] = rays->down[k][i];
	}
	to->a = p->lambda[0][i];
	to->b = p->lambda[1][i];
	to->extent[0] = p->extent[0][i];
	to->extent[1] = p->extent[1][i];
}

static inline void turn_point(struct points_one *p)
{
	for (int k = 1; k < 3; k++) {
		p->from[k] = -p->from[k];
		p->sight[k] = -p->sight[k];
		p->right[k] = -p->right[k];
		p->down[k] = -p->down[k];
	}
	p->a = -p->a;
	p->b = -p->b;
}

static uint64_t warp_points(const struct warp_target *t, const struct bin_entry *entry, uint32_t n)
{
	struct points_unpacked p;
	struct points_rays rays;
	struct points_one one = { .near = t->near_z, .through = t->perspective ? 1.0f : 0.0f };
	uint64_t n_inside = 0;

	for (uint32_t e = 0; e < n; e++) {
		const struct warp_instance *in = &t->instance[entry[e].instance];
		const struct dpoint_group *g = &in->points->model->set->group[entry[e].slot - in->first_slot];

		unpack_group(&p, in->points, g);
		make_rays(&rays, &p, in->points, g, t);
		for (uint32_t i = 0; i < g->n; i++) {
			one.x0 = points_pixel(rays.low[0][i] - POINTS_ROUNDING, t->x0, t->x1);
			one.x1 = points_pixel(rays.high[0][i] + POINTS_ROUNDING, t->x0, t->x1);
			one.y0 = points_pixel(rays.low[1][i] - POINTS_ROUNDING, t->y0, t->y1);
			one.y1 = points_pixel(rays.high[1][i] + POINTS_ROUNDING, t->y0, t->y1);
			if (one.x0 >= one.x1 || one.y0 >= one.y1)
				continue;
			pick_point(&one, &p, &rays, i);
			one.id = entry[e].slot * PSR_BLOCK_SAMPLES + i;
			n_inside++;
			if (rays.away[0][i] <= 0)
				draw_point(t, &one);
			if (!entry[e].is_mixed && rays.away[1][i] <= 0) {
				turn_point(&one);
				draw_point(t, &one);
			}
		}
	}
	return n_inside;
}

/* ---- normals ---- */

/* Normals in camera space by [K] (6), where the lines of sight meet the quadrics: at the depths of the words. */
static void points_resolve(struct strip *strip, const struct strip_view *view, const struct warp_instance *in,
                           uint32_t first, uint32_t end)
{
	const struct warp_points *points = in->points;
	const struct dpoint_set *set = points->model->set;
	const struct strip_pixels *p = strip->pixels;
	const float y = (float)p->y + 0.5f - points->center[1];
	float from[3][STRIP], at[3][STRIP], axis[3][3][STRIP], lambda[2][STRIP];

	for (uint32_t i = first; i < end; i++) {
		const struct dpoint_group *g = &set->group[p->id[i] / PSR_BLOCK_SAMPLES - in->first_slot];
		const struct dpoint_word *word = &set->word[g->first + p->id[i] % PSR_BLOCK_SAMPLES];
		float *to_at[3], *to_axis[3][3], *to_lambda[2] = { &lambda[0][i], &lambda[1][i] };

		for (int k = 0; k < 3; k++) {
			to_at[k] = &at[k][i];
			for (int c = 0; c < 3; c++)
				to_axis[k][c] = &axis[k][c][i];
			from[k][i] = (float)(points->eye[k] - (double)g->box.low[k]);
		}
		points_unpack(to_at, to_axis, to_lambda, points, word, g->box.step);
	}
	for (uint32_t i = first; i < end; i++) {
		const float x = (float)(int32_t)(p->x0 + p->x[i]) + 0.5f - points->center[0];
		const float z = psr_float_from_bits((uint32_t)(p->word[p->x[i]] >> 32));
		const float wide = psr_choose(view->perspective, z, 1);
		float away[3], normal[3], n[3], local[2];

		for (int k = 0; k < 3; k++)
			away[k] = (from[k][i] - at[k][i]) + (wide * (x * points->right[k] + y * points->down[k]) + z * points->forward[k]);
		for (int k = 0; k < 2; k++)
			local[k] = points_dot(axis[k][0][i], axis[k][1][i], axis[k][2][i], away[0], away[1], away[2]);
		dpoint_normal_at(n, lambda[0][i], lambda[1][i], local[0], local[1]);
		for (int k = 0; k < 3; k++)
			normal[k] = (n[0] * axis[0][k][i] + n[1] * axis[1][k][i]) + axis[2][k][i];
		const float unit = 1 / __builtin_sqrtf(points_dot(normal[0], normal[1], normal[2], normal[0], normal[1], normal[2]));
		strip->nx[i] = points_dot(in->turn[0][0], in->turn[0][1], in->turn[0][2], normal[0], normal[1], normal[2]) * unit;
		strip->ny[i] = points_dot(in->turn[1][0], in->turn[1][1], in->turn[1][2], normal[0], normal[1], normal[2]) * unit;
		strip->nz[i] = points_dot(in->turn[2][0], in->turn[2][1], in->turn[2][2], normal[0], normal[1], normal[2]) * unit;
	}
}

#endif
