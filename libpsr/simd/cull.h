/* Blocks against frustum and cones, as plain loops, which the compiler turns into vectors; compiled once for each
 * ISA. */
#include <string.h>
#include "base/maths.h"
#include "simd.h"

/* How a block faces, by its visibility cone ([G] 6.4): with d from the eye to the sphere's centre, at the angle theta
 * from the cone's axis, a normal n within alpha of that and a sample x within r of the centre, n . (x - eye) is between
 * |d| cos(theta + alpha) - r and |d| cos(theta - alpha) + r, and |x - eye| within r of |d|. The slack makes up for
 * rounding, and for normals in 10 bits, which are off by sqrt(3) / 1022 at most. */
#define CONE_SLACK 0.0027f

/* Smallest c - r or greatest c + r, over 1 / z of the two ends of z: where perspective takes it. */
static inline float edge_of(float at, float if_negative, float if_positive)
{
	return at * psr_choose(at < 0, if_negative, if_positive);
}

static inline int32_t pixel_within(float pixel, float most)
{
	const float low = psr_where(pixel > 0, pixel);
	return (int32_t)psr_choose(low < most, low, most);
}

static inline int32_t region_of(int32_t pixel, float from, float scale)
{
	const float region = ((float)pixel + from) * scale, most = SCREEN_SIDE - 1, low = psr_where(region > 0, region);
	return (int32_t)psr_choose(low < most, low, most);
}

/* What the long loops work on is of 32 bits, since with narrower numbers the compiler takes several vectors at a
 * time, for which there are not enough registers; and of whole vectors, since most clusters are smaller than a
 * batch. */
#define LANES 16
struct widened {
	float x[CULL_BATCH], y[CULL_BATCH], z[CULL_BATCH], r[CULL_BATCH];
	float axis_x[CULL_BATCH], axis_y[CULL_BATCH], axis_z[CULL_BATCH];
	int32_t flags[CULL_BATCH], cone_sine[CULL_BATCH], is_bent[CULL_BATCH];
};

static void widen(struct widened *restrict to, const struct psr_blocks *b, uint32_t first, uint32_t n)
{
	const int16_t *x = b->sphere_x + first, *y = b->sphere_y + first, *z = b->sphere_z + first;
	const uint16_t *r = b->sphere_r + first;
	const uint8_t *flags = b->flags + first;
	for (uint32_t i = 0; i < n; i++) {
		to->x[i] = (float)x[i] * (1.0f / 16384);
		to->y[i] = (float)y[i] * (1.0f / 16384);
		to->z[i] = (float)z[i] * (1.0f / 16384);
		to->r[i] = (float)r[i] * (1.0f / 32768);
	}
	for (uint32_t i = 0; i < n; i++)
		to->flags[i] = flags[i];
}

static void widen_cones(struct widened *restrict to, const struct psr_blocks *b, uint32_t first, uint32_t n)
{
	const int8_t *x = b->cone_x + first, *y = b->cone_y + first, *z = b->cone_z + first;
	const uint8_t *sine = b->cone_sine + first;
	for (uint32_t i = 0; i < n; i++) {
		to->axis_x[i] = x[i];
		to->axis_y[i] = y[i];
		to->axis_z[i] = z[i];
		to->cone_sine[i] = sine[i];
	}
	if (!b->traits)
		return;
	for (uint32_t i = 0; i < n; i++)
		to->is_bent[i] = b->traits[first + i] & PSR_BLOCK_BENT;
}

static void cull_by_frustum(struct cull_batch *restrict out, const struct cull_view *view,
                            const struct widened *restrict b, uint32_t n)
{
	const struct cull_view v = *view;
	const float half_width = v.center_x, half_height = v.center_y;
	const float most_x = v.width - 1, most_y = v.height - 1;
	const int is_perspective = v.perspective;

	for (uint32_t i = 0; i < n; i++) {
		const float x = b->x[i], y = b->y[i], z = b->z[i], r = b->r[i] * v.scale;
		const int32_t flags = b->flags[i];
		const float cx = ((v.center_m[0][0] * x + v.center_m[0][1] * y) + v.center_m[0][2] * z) + v.center_m[0][3];
		const float cy = ((v.center_m[1][0] * x + v.center_m[1][1] * y) + v.center_m[1][2] * z) + v.center_m[1][3];
		const float cz = ((v.center_m[2][0] * x + v.center_m[2][1] * y) + v.center_m[2][2] * z) + v.center_m[2][3];
		const float stretch = cull_stretch(&v, cx, cy, cz, r, cz - r);

		/* Smallest k >= 0 with `pixels` <= 2^k ([G] 7.11), from the exponent; a part in 4096 is forgiven, so that
		 * rounding does not double the cells of a picture drawn at just the magnification that a level is made for. */
		const float spacing = v.spacing * psr_float_from_bits((uint32_t)(127 + (flags & PSR_BLOCK_LEVEL)) << 23);
		const float pixels = stretch * spacing * (1 - 0x1p-12f); /* no number where 0 meets infinity */
		const int32_t bits = (int32_t)psr_bits_from_float(psr_choose(pixels < 0x1p100f, pixels, 0x1p100f));
		const int32_t exponent = ((bits + 0x7fffff) >> 23) - 127, level = exponent > 0 ? exponent : 0;
		const int32_t used = level < PSR_MAX_DEPTH_LEVEL ? level : PSR_MAX_DEPTH_LEVEL;

		/* Two more pixels than the guard band's cell make up for rounding. */
		const float grown = r * 1.0001f, guard = psr_float_from_bits((uint32_t)(127 + used) << 23) + 2;
		const float front1 = cz - grown, z0 = psr_choose(front1 > v.near_z, front1, v.near_z), z1 = cz + grown;
		const float near_scale = v.focal * psr_choose(is_perspective, 1 / z0, 1);
		const float far_scale = v.focal * psr_choose(is_perspective, 1 / z1, 1);
		const float left = edge_of(cx - grown, near_scale, far_scale) + half_width;
		const float right = edge_of(cx + grown, far_scale, near_scale) + half_width;
		const float top = edge_of(cy - grown, near_scale, far_scale) + half_height;
		const float bottom = edge_of(cy + grown, far_scale, near_scale) + half_height;
		const float x0 = left - guard, x1 = right + guard, y0 = top - guard, y1 = bottom + guard;
		out->is_left[i] = (z1 > v.near_z) & (x1 >= 0) & (y1 >= 0) & (x0 < v.width) & (y0 < v.height);
		out->is_mixed[i] = !(flags & PSR_BLOCK_TWO_SIDED) & !v.both_sides;
		out->level[i] = level;
		const int32_t px0 = pixel_within(x0, most_x), px1 = pixel_within(x1, most_x);
		const int32_t py0 = pixel_within(y0, most_y), py1 = pixel_within(y1, most_y);
		out->x0[i] = px0;
		out->x1[i] = px1;
		out->y0[i] = py0;
		out->y1[i] = py1;
		const float reach = psr_choose(v.with_splats, guard, 2);
		out->tile_x0[i] = pixel_within(left - reach, most_x) / TILE_WIDTH;
		out->tile_x1[i] = pixel_within(right + reach, most_x) / TILE_WIDTH;
		out->tile_y0[i] = pixel_within(top - reach, most_y) / TILE_HEIGHT;
		out->tile_y1[i] = pixel_within(bottom + reach, most_y) / TILE_HEIGHT;
		const int32_t range_x = screen_range(region_of(px0, v.region_from[0], v.region_scale[0]),
		                                     region_of(px1, v.region_from[0], v.region_scale[0]));
		const int32_t range_y = screen_range(region_of(py0, v.region_from[1], v.region_scale[1]),
		                                     region_of(py1, v.region_from[1], v.region_scale[1]));
		out->range[i] = range_x * SCREEN_RANGES + range_y;
		out->near[i] = front1 * (1 - 0x1p-16f);
		const uint32_t shift = 14u + ((uint32_t)(flags & PSR_BLOCK_DEPTH) >> 3);
		out->depth_error[i] = stretch * v.scale * psr_float_from_bits((126u - shift) << 23);
	}
}

static void cull_by_cones(struct cull_batch *restrict out, const struct cull_view *view,
                          const struct widened *restrict b, uint32_t n)
{
	const int is_perspective = view->perspective, with_cones = view->with_cones;
	const float eye_x = view->eye[0], eye_y = view->eye[1], eye_z = view->eye[2];
	for (uint32_t i = 0; i < n; i++) {
		const float ax = b->axis_x[i], ay = b->axis_y[i], az = b->axis_z[i], r = psr_where(is_perspective, b->r[i]);
		const float dx = psr_where(is_perspective, b->x[i]) - eye_x, dy = psr_where(is_perspective, b->y[i]) - eye_y;
		const float dz = psr_where(is_perspective, b->z[i]) - eye_z;
		const float length2 = (dx * dx + dy * dy) + dz * dz, length = __builtin_sqrtf(length2);
		/* All lengths times that of the axis. */
		const float axis2 = (ax * ax + ay * ay) + az * az, axis = __builtin_sqrtf(axis2);
		const float g = (dx * ax + dy * ay) + dz * az, square = axis2 * length2 - g * g;
		const float across = __builtin_sqrtf(psr_where(square > 0, square)); /* |d| sin theta */
		const float sine = (float)b->cone_sine[i] * (1.0f / 255), cosine = __builtin_sqrtf(1 - sine * sine);
		const float least = g * cosine - across * sine, most = g * cosine + across * sine;
		const float slack = axis * (CONE_SLACK * length + r);
		const int is_bent = b->is_bent[i];
		const int has_cone = (b->cone_sine[i] != PSR_CONE_ANY) & out->is_mixed[i] & (with_cones | is_bent);
		const int is_away = least > axis * BACK_SINE * (length + r) + slack;
		const int faces_eye = most + slack <= axis * BACK_SINE * (length - r);
		out->is_left[i] &= !(has_cone & is_away);
		out->is_mixed[i] &= !((has_cone & faces_eye) | is_bent);
	}
}

static void cull(struct cull_batch *out, const struct cull_view *view, uint32_t first, uint32_t n)
{
	const uint32_t whole = (n + LANES - 1) / LANES * LANES;
	struct widened blocks;
	memset(&blocks, 0, sizeof blocks);
	widen(&blocks, view->blocks, first, n);
	cull_by_frustum(out, view, &blocks, whole);
	if (view->blocks->cone_sine && (view->with_cones || view->blocks->traits)) {
		widen_cones(&blocks, view->blocks, first, n);
		cull_by_cones(out, view, &blocks, whole);
	}
}
