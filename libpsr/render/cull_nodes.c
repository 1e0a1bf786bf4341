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

void cull_bound_sphere(float bound[2][2], const struct plan *plan, const struct cull_sphere *sphere)
{
	const float *c = sphere->c, r = sphere->r * 1.0001f;

	for (int a = 0; a < 2; a++) {
		float low = c[a] - r, high = c[a] + r;

		if (plan->perspective)
			interval(c[a], r, c[2] - r > plan->near_z ? c[2] - r : plan->near_z, c[2] + r, &low, &high);
		bound[a][0] = low * plan->focal + (float)plan->center[a];
		bound[a][1] = high * plan->focal + (float)plan->center[a];
	}
}

/* Two more pixels cover rounding. */
int cull_sees_sphere(const struct plan *plan, const struct cull_sphere *sphere)
{
	const float guard = (float)(1 << PSR_MAX_DEPTH_LEVEL) + 2;
	float bound[2][2];

	if (!(sphere->c[2] + sphere->r * 1.0001f > plan->near_z))
		return 0;
	cull_bound_sphere(bound, plan, sphere);
	return bound[0][1] + guard >= 0 && bound[1][1] + guard >= 0 && bound[0][0] - guard < (float)plan->width
	       && bound[1][0] - guard < (float)plan->height;
}

int cull_holds_sphere(const struct plan *plan, const struct cull_sphere *sphere)
{
	float bound[2][2];

	if (!(sphere->c[2] - sphere->r * 1.0001f > plan->near_z))
		return 0;
	cull_bound_sphere(bound, plan, sphere);
	return bound[0][0] >= 0 && bound[1][0] >= 0 && bound[0][1] <= (float)plan->width
	       && bound[1][1] <= (float)plan->height;
}

/* As the kernel decides of a block, of all samples of a run. */
enum cull_facing cull_run_faces(const struct plan_instance *in, const struct psr_cube_bound *bound, uint8_t flags)
{
	const struct cull_view *v = &in->cull;
	const float r = v->perspective ? bound->radius : 0;
	float d[3], a[3];

	if (flags & PSR_BLOCK_TWO_SIDED || v->both_sides)
		return CULL_FACES_EYE;
	if (bound->sine == PSR_CONE_ANY || !v->with_cones)
		return CULL_MIXED;
	for (int k = 0; k < 3; k++) {
		d[k] = (v->perspective ? bound->center[k] : 0) - v->eye[k];
		a[k] = bound->axis[k];
	}
	const float length2 = v3f_dot(d, d), axis2 = v3f_dot(a, a), g = v3f_dot(d, a), square = axis2 * length2 - g * g;
	const float length = __builtin_sqrtf(length2), axis = __builtin_sqrtf(axis2);
	const float across = square > 0 ? __builtin_sqrtf(square) : 0;
	const float sine = (float)bound->sine * (1.0f / 255), cosine = __builtin_sqrtf(1 - sine * sine);
	const float slack = axis * (CONE_SLACK * length + r);

	if (g * cosine - across * sine > axis * BACK_SINE * (length + r) + slack)
		return CULL_AWAY;
	return g * cosine + across * sine + slack <= axis * BACK_SINE * (length - r) ? CULL_FACES_EYE : CULL_MIXED;
}

int cull_sees_run(const struct plan *plan, const struct plan_instance *in, uint32_t cube)
{
	const struct psr_cube_level *level = psr_cubes_level(in->cull.cubes, cube);
	const struct psr_cube_bound *bound = &level->bound[(cube - level->first) / CUBES_RUN];
	const struct cull_sphere sphere = cull_view_sphere(in, bound->center, bound->radius);

	return cull_sees_sphere(plan, &sphere) && cull_run_faces(in, bound, in->cull.blocks->flags[cube]) != CULL_AWAY;
}
