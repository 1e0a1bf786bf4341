/* Culling of more than a block at once: clusters, and runs of cubes, which are nodes of their tree ([B] 4.2). */
#include "base/vec.h"
#include "cull.h"

_Static_assert(CUBES_RUN <= CULL_BATCH, "a run is a batch, or a part of one");

/* Interval of c / z for c within c +- r and z within z0..z1, both positive. */
static inline void interval(float c, float r, float z0, float z1, float *low, float *high)
{
	*low = (c - r) / (c - r < 0 ? z0 : z1);
	*high = (c + r) / (c + r < 0 ? z1 : z0);
}

/* Two more pixels cover rounding. */
int cull_sees_sphere(const struct plan *plan, const struct cull_sphere *sphere)
{
	const float guard = (float)(1 << PSR_MAX_DEPTH_LEVEL) + 2, *c = sphere->c, r = sphere->r * 1.0001f;

	if (!(c[2] + r > plan->near_z))
		return 0;
	float x0 = c[0] - r, x1 = c[0] + r, y0 = c[1] - r, y1 = c[1] + r;
	if (plan->perspective) {
		float z0 = c[2] - r > plan->near_z ? c[2] - r : plan->near_z, z1 = c[2] + r;

		interval(c[0], r, z0, z1, &x0, &x1);
		interval(c[1], r, z0, z1, &y0, &y1);
	}
	const float half_w = (float)plan->center[0], half_h = (float)plan->center[1];
	return x1 * plan->focal + half_w + guard >= 0 && y1 * plan->focal + half_h + guard >= 0
	       && x0 * plan->focal + half_w - guard < (float)plan->width
	       && y0 * plan->focal + half_h - guard < (float)plan->height;
}

/* As the kernel decides of a block, of all samples of a run. */
static int faces_away(const struct cull_view *v, const struct psr_cube_bound *bound)
{
	const float r = v->perspective ? bound->radius : 0;
	float d[3], a[3];

	if (bound->sine == PSR_CONE_ANY)
		return 0;
	for (int k = 0; k < 3; k++) {
		d[k] = (v->perspective ? bound->center[k] : 0) - v->eye[k];
		a[k] = bound->axis[k];
	}
	const float length2 = v3f_dot(d, d), axis2 = v3f_dot(a, a), g = v3f_dot(d, a), square = axis2 * length2 - g * g;
	const float length = __builtin_sqrtf(length2), axis = __builtin_sqrtf(axis2);
	const float across = square > 0 ? __builtin_sqrtf(square) : 0;
	const float sine = (float)bound->sine * (1.0f / 255), cosine = __builtin_sqrtf(1 - sine * sine);

	return g * cosine - across * sine > axis * BACK_SINE * (length + r) + axis * (CONE_SLACK * length + r);
}

int cull_sees_run(const struct plan *plan, const struct plan_instance *in, uint32_t cube)
{
	const struct psr_cube_level *level = psr_cubes_level(in->cull.cubes, cube);
	const struct psr_cube_bound *bound = &level->bound[(cube - level->first) / CUBES_RUN];
	const struct cull_sphere sphere = cull_view_sphere(in, bound->center, bound->radius);

	return cull_sees_sphere(plan, &sphere)
	       && !(in->cull.with_cones && !in->cull.both_sides && faces_away(&in->cull, bound));
}
