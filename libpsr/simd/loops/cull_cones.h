/* Visibility cones ([G] 6.4): how a block faces. */
#include "base/maths.h"
#include "simd/cull.h"
#include "simd/warp.h"

/* Blocks for the long loops: 32-bit values, since narrower ones make the compiler use several vectors at a time, more
 * than there are registers; and whole vectors, since most clusters are smaller than a batch. */
#define LANES 16
struct widened {
	float x[CULL_BATCH], y[CULL_BATCH], z[CULL_BATCH], r[CULL_BATCH];
	float axis_x[CULL_BATCH], axis_y[CULL_BATCH], axis_z[CULL_BATCH];
	int32_t flags[CULL_BATCH], cone_sine[CULL_BATCH], is_bent[CULL_BATCH];
};

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
