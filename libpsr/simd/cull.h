/* Blocks against frustum and cones, as plain loops, which the compiler turns into vectors; compiled once for each ISA. */
#include "base/maths.h"
#include "simd/simd.h"

/* How a block faces, by its visibility cone ([G] 6.4): with d from the eye to the sphere's centre, at the angle theta from
 * the cone's axis, a normal n within alpha of that and a sample x within r of the centre, n . (x - eye) is between
 * |d| cos(theta + alpha) - r and |d| cos(theta - alpha) + r, and |x - eye| within r of |d|. The slack makes up for
 * rounding, and for normals in 10 bits, which are off by sqrt(3) / 1022 at most. */
#define CONE_SLACK 0.0027f

/* Smallest c - r or greatest c + r, over z within z0..z1: where perspective takes it. */
static inline float edge_of(float at, int is_perspective, float z_if_negative, float z_if_positive)
{
	return psr_choose(is_perspective, at / psr_choose(at < 0, z_if_negative, z_if_positive), at);
}

static inline int32_t pixel_within(float pixel, float most)
{
	const float low = psr_where(pixel > 0, pixel);
	return (int32_t)psr_choose(low < most, low, most);
}

static void cull(struct cull_batch *out, const struct cull_view *view, uint32_t first, uint32_t n)
{
	const struct psr_blocks *b = view->blocks;
	const struct cull_view v = *view;
	const int16_t *sphere_x = b->sphere_x + first, *sphere_y = b->sphere_y + first, *sphere_z = b->sphere_z + first;
	const uint16_t *sphere_r = b->sphere_r + first;
	const uint8_t *flags = b->flags + first;
	const float half_width = v.center_x, half_height = v.center_y;
	const float most_x = v.width - 1, most_y = v.height - 1;
	const int is_perspective = v.perspective;

	for (uint32_t i = 0; i < n; i++) {
		const float x = (float)sphere_x[i] * (1.0f / 16384), y = (float)sphere_y[i] * (1.0f / 16384);
		const float z = (float)sphere_z[i] * (1.0f / 16384), r = (float)sphere_r[i] * (1.0f / 32768) * v.scale;
		const float cx = ((v.center_m[0][0] * x + v.center_m[0][1] * y) + v.center_m[0][2] * z) + v.center_m[0][3];
		const float cy = ((v.center_m[1][0] * x + v.center_m[1][1] * y) + v.center_m[1][2] * z) + v.center_m[1][3];
		const float cz = ((v.center_m[2][0] * x + v.center_m[2][1] * y) + v.center_m[2][2] * z) + v.center_m[2][3];

		/* Pixels that a length across the surface at the sphere can be stretched to, as stretch() of render/cull.c has it
		 * for clusters. */
		const float front = cz - r, near = psr_choose(front > v.near_z, front, v.near_z);
		const float side2 = cx * cx + cy * cy, distance2 = side2 + cz * cz, rim2 = distance2 - r * r;
		const float most = v.focal * (__builtin_sqrtf(distance2) + r) / (near * near);
		const float cosine = (cz * __builtin_sqrtf(psr_where(rim2 > 0, rim2)) - __builtin_sqrtf(side2) * r) / distance2;
		const float sharp = v.focal / (near * cosine);
		const int is_sharp = (rim2 > 0) & (cosine > 0) & (sharp < most);
		const float stretch = psr_choose(is_perspective, psr_choose(is_sharp, sharp, most), v.focal);

		/* Smallest k >= 0 with `pixels` <= 2^k ([G] 7.11), from the exponent; a part in 4096 is forgiven, so that rounding
		 * does not double the cells of a picture drawn at just the magnification that a level is made for. */
		const float spacing = v.spacing * psr_float_from_bits((127u + (flags[i] & PSR_BLOCK_LEVEL)) << 23);
		const float pixels = stretch * spacing * (1 - 0x1p-12f); /* no number where 0 meets infinity */
		const int32_t bits = (int32_t)psr_bits_from_float(psr_choose(pixels < 0x1p100f, pixels, 0x1p100f));
		const int32_t exponent = ((bits + 0x7fffff) >> 23) - 127, level = exponent > 0 ? exponent : 0;
		const int32_t used = level < PSR_MAX_DEPTH_LEVEL ? level : PSR_MAX_DEPTH_LEVEL;

		/* Two more pixels than the guard band's cell make up for rounding. */
		const float grown = r * 1.0001f, guard = psr_float_from_bits((uint32_t)(127 + used) << 23) + 2;
		const float front1 = cz - grown, z0 = psr_choose(front1 > v.near_z, front1, v.near_z), z1 = cz + grown;
		const float x0 = edge_of(cx - grown, is_perspective, z0, z1) * v.focal + half_width - guard;
		const float x1 = edge_of(cx + grown, is_perspective, z1, z0) * v.focal + half_width + guard;
		const float y0 = edge_of(cy - grown, is_perspective, z0, z1) * v.focal + half_height - guard;
		const float y1 = edge_of(cy + grown, is_perspective, z1, z0) * v.focal + half_height + guard;
		out->is_left[i] = (uint8_t)((z1 > v.near_z) & (x1 >= 0) & (y1 >= 0) & (x0 < v.width) & (y0 < v.height));
		out->is_mixed[i] = (uint8_t)(!(flags[i] & PSR_BLOCK_TWO_SIDED) & !v.both_sides);
		out->level[i] = (uint8_t)level;
		out->x0[i] = pixel_within(x0, most_x);
		out->x1[i] = pixel_within(x1, most_x);
		out->y0[i] = pixel_within(y0, most_y);
		out->y1[i] = pixel_within(y1, most_y);
		out->near[i] = front1 * (1 - 0x1p-16f);
		const uint32_t shift = 14u + ((uint32_t)(flags[i] & PSR_BLOCK_DEPTH) >> 3);
		out->depth_error[i] = stretch * v.scale * psr_float_from_bits((126u - shift) << 23);
	}
	if (!b->cone_sine || !v.with_cones)
		return;
	const int8_t *cone_x = b->cone_x + first, *cone_y = b->cone_y + first, *cone_z = b->cone_z + first;
	const uint8_t *cone_sine = b->cone_sine + first;
	for (uint32_t i = 0; i < n; i++) {
		const float ax = cone_x[i], ay = cone_y[i], az = cone_z[i];
		const float x = (float)sphere_x[i] * (1.0f / 16384), y = (float)sphere_y[i] * (1.0f / 16384);
		const float z = (float)sphere_z[i] * (1.0f / 16384), r = psr_where(is_perspective, (float)sphere_r[i] * (1.0f / 32768));
		const float dx = psr_where(is_perspective, x) - v.eye[0], dy = psr_where(is_perspective, y) - v.eye[1];
		const float dz = psr_where(is_perspective, z) - v.eye[2];
		const float length = __builtin_sqrtf((dx * dx + dy * dy) + dz * dz);
		const float g = ((dx * ax + dy * ay) + dz * az) / __builtin_sqrtf((ax * ax + ay * ay) + az * az);
		const float square = length * length - g * g, across = __builtin_sqrtf(psr_where(square > 0, square)); /* |d| sin theta */
		const float sine = (float)cone_sine[i] / 255, cosine = __builtin_sqrtf(1 - sine * sine);
		const float least = g * cosine - across * sine, most = g * cosine + across * sine, slack = CONE_SLACK * length + r;
		const int has_cone = (cone_sine[i] != PSR_CONE_ANY) & out->is_mixed[i];
		const int is_away = least > BACK_SINE * (length + r) + slack, faces_eye = most + slack <= BACK_SINE * (length - r);
		out->is_left[i] = (uint8_t)(out->is_left[i] & !(has_cone & is_away));
		out->is_mixed[i] = (uint8_t)(out->is_mixed[i] & !(has_cone & faces_eye));
	}
}
