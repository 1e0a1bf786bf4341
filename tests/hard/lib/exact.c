#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "base/maths.h"
#include "model/blocks.h"
#include "blocks.h"
#include "exact.h"

#define E 0x1p-24L
#define ROUNDINGS (64 * 0x1p-53L)

typedef long double real;

int exact_is_there(void)
{
	if (LDBL_MANT_DIG < 64)
		print_message("# SKIP long double has %d bits here, and this test compares with 64\n", LDBL_MANT_DIG);
	return LDBL_MANT_DIG >= 64;
}

static real dot(const real a[3], const real b[3])
{
	return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static real length(const real a[3])
{
	return sqrtl(dot(a, a));
}

static void cross(real r[3], const real a[3], const real b[3])
{
	const real c[3] = { a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0] };

	memcpy(r, c, sizeof c);
}

static void normalize(real r[3], const real a[3])
{
	const real l = length(a);

	for (int i = 0; i < 3; i++)
		r[i] = a[i] / l;
}

static real length_of(const double v[3])
{
	return length((const real[3]){ v[0], v[1], v[2] });
}

/* The view of a frame: the picture's right, down and forward. */
struct sight {
	real axis[3][3], focal, focal_off, half[3];
	int is_perspective;
};

static void sight_make(struct sight *s, const struct psr_camera *c, uint32_t width, uint32_t height)
{
	real forward[3], right[3], up[3];

	for (int i = 0; i < 3; i++) {
		forward[i] = (real)c->target[i] - (real)c->eye[i];
		up[i] = c->up[i];
	}
	normalize(s->axis[2], forward);
	normalize(up, up);
	cross(right, s->axis[2], up);
	normalize(s->axis[0], right);
	cross(s->axis[1], s->axis[2], s->axis[0]);
	s->half[0] = width / 2.0L;
	s->half[1] = height / 2.0L;
	s->half[2] = 0;
	s->is_perspective = c->kind == PSR_CAMERA_PERSPECTIVE;
	if (s->is_perspective) {
		const real sine = sinl((real)c->fov_y / 2);

		s->focal = height / 2.0L * cosl((real)c->fov_y / 2) / sine;
		s->focal_off = height / 2.0L * 2e-15L / (sine * sine);
	} else {
		s->focal = height / (real)c->ortho_height;
		s->focal_off = 0;
	}
}

static void rotate(real r[3], const double q[4], const real a[3])
{
	const real n = sqrtl((real)q[0] * q[0] + (real)q[1] * q[1] + (real)q[2] * q[2] + (real)q[3] * q[3]);
	const real w = q[3] / n, v[3] = { q[0] / n, q[1] / n, q[2] / n };
	real t[3], tt[3];

	cross(t, v, a);
	cross(tt, v, t);
	for (int i = 0; i < 3; i++)
		r[i] = a[i] + 2 * (w * t[i] + tt[i]);
}

/* A length or a place of a model in a sight: what the kernels hold of it along axis a. */
static real along(const struct sight *s, int a, const real camera[3])
{
	const real focal = a < 2 ? s->focal : 1;

	return focal * camera[a] + (s->is_perspective ? s->half[a] * camera[2] : 0);
}

static void to_sight(real out[3], const struct sight *s, const struct psr_instance *in, const real v[3])
{
	real turned[3];

	rotate(turned, in->rotation, v);
	for (int i = 0; i < 3; i++)
		out[i] = dot(s->axis[i], turned);
}

static const struct psr_instance *find_instance(const struct psr_scene *scene, uint32_t *slot)
{
	const struct psr_instance *in = scene->instance;

	while (*slot >= psr_model_blocks(in->model)->n_blocks) {
		*slot -= psr_model_blocks(in->model)->n_blocks;
		in++;
	}
	return in;
}

/* The origin of an instance's model, scaled, and where it is from the eye. */
static void place_origin(real center[3], real origin[3], const struct psr_scene *scene, const struct psr_instance *in)
{
	for (int k = 0; k < 3; k++)
		origin[k] = in->scale * (real)psr_model_info(in->model)->origin[k];
	rotate(center, in->rotation, origin);
	for (int k = 0; k < 3; k++)
		center[k] += (real)in->translation[k] - (real)scene->camera.eye[k];
}

static void place_in(struct exact_place *out, const struct sight *s, const struct psr_scene *scene, uint32_t slot,
                     uint32_t sample)
{
	const struct psr_instance *in = find_instance(scene, &slot);
	const struct psr_blocks *b = psr_model_blocks(in->model);
	const struct psr_model_info *info = psr_model_info(in->model);
	const struct psr_projection *p = &b->projection[b->block_projection[slot]];
	const uint64_t below = b->mask[slot] & ((UINT64_C(1) << sample) - 1);
	const real steps = b->depth[psr_blocks_attr_first(b, slot) + (uint32_t)__builtin_popcountll(below)];
	const real dx = p->spacing, dy = dx * 0.86602540378443864676372317075293618L, unit = (real)info->scale * in->scale;
	const real level = 1u << psr_blocks_level(b, slot), r = sample >> 3, c = sample & 7;
	real part[4][3], sum[3], off[3], reach;
	struct psr_place place;

	/* The place on the lattice is exact; the depth of its origin is that of the sphere's centre. */
	psr_blocks_place(b, slot, &place);
	real bias = 0;
	for (int k = 0; k < 3; k++)
		bias += (real)p->axis[2][k] * (k == 0 ? b->sphere_x : k == 1 ? b->sphere_y : b->sphere_z)[slot] * 0x1p-14L;
	const real x[3] = { (place.col + level * ((int)r & 1) * 0.5L) * dx, level * c * dx, 0 };
	const real y[3] = { (place.row + level * r) * dy, 0, 0 };
	const real z[3] = { bias - 32768 * (real)place.step, 0, steps * place.step };
	for (int i = 0; i < 3; i++) { /* row, col, depth */
		real v[3];

		for (int k = 0; k < 3; k++)
			v[k] = unit * (x[i] * p->axis[0][k] + y[i] * p->axis[1][k] + z[i] * p->axis[2][k]);
		to_sight(part[i], s, in, v);
	}
	real center[3], origin[3];
	place_origin(center, origin, scene, in);
	for (int k = 0; k < 3; k++)
		part[0][k] += dot(s->axis[k], center);

	/* Lengths that make a place: a model reaches two units from its origin. */
	reach = length_of(scene->camera.eye) + length_of(in->translation) + length(origin) + 2 * unit;
	for (int a = 0; a < 3; a++) {
		const real shift = s->is_perspective ? 0 : s->half[a];
		const real row = along(s, a, part[0]) + shift, col = along(s, a, part[1]), depth = along(s, a, part[2]);
		const real focal = a < 2 ? s->focal : 1, focal_off = a < 2 ? s->focal_off : 0;

		sum[a] = row + col + depth;
		off[a] = 3 * E * (fabsl(row) + fabsl(col) + fabsl(depth)) + ROUNDINGS * ((focal + s->half[a]) * reach + shift)
		         + focal_off * reach;
	}
	out->z = sum[2];
	out->off_z = off[2];
	if (!s->is_perspective) {
		out->u = sum[0];
		out->v = sum[1];
		out->off_u = off[0];
		out->off_v = off[1];
		return;
	}
	const real least = fabsl(sum[2]) - off[2];
	out->u = sum[0] / sum[2];
	out->v = sum[1] / sum[2];
	out->off_u = least > 0 ? (off[0] + fabsl(out->u) * off[2]) / least + 3 * E * fabsl(out->u) : INFINITY;
	out->off_v = least > 0 ? (off[1] + fabsl(out->v) * off[2]) / least + 3 * E * fabsl(out->v) : INFINITY;
}

void exact_place(struct exact_place *out, const struct psr_scene *scene, uint32_t width, uint32_t height,
                 uint32_t slot, uint32_t sample)
{
	struct sight sight;

	sight_make(&sight, &scene->camera, width, height);
	place_in(out, &sight, scene, slot, sample);
}

int exact_is_at_border(const struct exact_place *at)
{
	return floorl(at->u - at->off_u) != floorl(at->u + at->off_u)
	       || floorl(at->v - at->off_v) != floorl(at->v + at->off_v);
}

static void check_word(const struct exact_place *at, uint32_t x, uint32_t y, real z, real near)
{
	if (!(at->u >= x - at->off_u && at->u <= x + 1 + at->off_u && at->v >= y - at->off_v && at->v <= y + 1 + at->off_v))
		fail_msg("pixel (%u, %u) shows a sample at (%Lg +- %Lg, %Lg +- %Lg)", x, y, at->u, at->off_u, at->v, at->off_v);
	if (!(fabsl(z - at->z) <= at->off_z && at->z >= near - at->off_z))
		fail_msg("pixel (%u, %u) has the depth %Lg; its sample has %Lg +- %Lg, the near plane %Lg", x, y, z, at->z,
		         at->off_z, near);
}

/* The near plane that the frame had: the request's, or 2^-14 of the power of two above the scene's far end. */
static real near_plane(const struct psr_scene *scene)
{
	double far = 0;
	int exponent;

	if (scene->camera.near_z > 0)
		return scene->camera.near_z;
	for (uint32_t i = 0; i < scene->n_instances; i++) {
		const struct psr_instance *in = &scene->instance[i];
		const struct psr_model_info *info = psr_model_info(in->model);
		real center[3], origin[3];

		place_origin(center, origin, scene, in);
		far = fmax(far, (double)length(center) + in->scale * info->scale);
	}
	frexp(far, &exponent);
	return ldexpl(1, exponent - 14);
}

struct exact_counts exact_check(const struct psr_scene *scene, uint32_t width, uint32_t height)
{
	struct psr_frame frame;
	struct exact_counts counts = { 0, 0, 0, 0 };
	const real near = near_plane(scene);
	struct sight sight;
	uint32_t first = 0;

	sight_make(&sight, &scene->camera, width, height);
	hard_draw(&frame, scene, width, height);
	for (uint32_t y = 0; y < height; y++)
		for (uint32_t x = 0; x < width; x++) {
			const uint64_t word = frame.words[(size_t)y * width + x];
			struct exact_place at;

			if (word == PSR_WORD_EMPTY)
				continue;
			place_in(&at, &sight, scene, (uint32_t)word / 64, (uint32_t)word % 64);
			check_word(&at, x, y, psr_float_from_bits((uint32_t)(word >> 32)), near);
			counts.n_drawn++;
		}
	for (uint32_t i = 0; i < scene->n_instances; i++) {
		const struct psr_blocks *b = psr_model_blocks(scene->instance[i].model);

		for (uint32_t block = 0; block < b->n_blocks; block++)
			for (uint64_t left = b->mask[block]; left; left &= left - 1) {
				struct exact_place at;

				place_in(&at, &sight, scene, first + block, (uint32_t)__builtin_ctzll(left));
				counts.n_samples++;
				if (at.z + at.off_z < near * (1 - E))
					continue;
				if (at.u + at.off_u < 0 || at.v + at.off_v < 0 || at.u - at.off_u > width || at.v - at.off_v > height)
					continue;
				if (!(at.z - at.off_z > near * (1 + E)) || exact_is_at_border(&at)) {
					counts.n_unsure++;
					continue;
				}
				const uint64_t word = frame.words[(size_t)floorl(at.v) * width + (size_t)floorl(at.u)];
				counts.n_inside++;
				if (!((real)psr_float_from_bits((uint32_t)(word >> 32)) <= at.z + at.off_z))
					fail_msg("sample %u of block %u at (%Lg, %Lg), depth %Lg, is lost", (uint32_t)__builtin_ctzll(left),
					         first + block, at.u, at.v, at.z);
			}
		first += b->n_blocks;
	}
	assert_in_range(frame.report.count[PSR_STAGE_WARP], counts.n_inside, counts.n_inside + counts.n_unsure);
	psr_frame_free(&frame);
	return counts;
}
