#include "tint.h"
#include <math.h>
#include "base/srgb.h"
#include "base/vec.h"

/* A surface that is seen at a slant keeps this part of its colour: so much that the legend's colours are found again in
 * the picture, and so little that shapes show. */
#define LEAST_SHADE 0.7f

/* The box's extent along the way up, object units. */
static void find_heights(double *low, double *high, const struct psr_model_info *info)
{
	*low = *high = 0;
	for (int c = 0; c < 3; c++) {
		const double a = info->up[c] * info->box_min[c], b = info->up[c] * info->box_max[c];

		*low += fmin(a, b);
		*high += fmax(a, b);
	}
}

static void make_axis(struct plan_instance *to, const struct psr_model_info *info)
{
	double low, high, axis[3], at;

	find_heights(&low, &high, info);
	const double extent = fmax(high - low, 1e-300);
	m3d_apply(axis, (const double(*)[3])to->turn, info->up);
	v3d_scale(axis, axis, info->scale / extent / (double)to->cull.scale);
	at = (v3d_dot(info->up, info->origin) - low) / extent;
	for (int c = 0; c < 3; c++) {
		at -= axis[c] * (double)to->cull.center_m[c][3];
		to->tint.axis[c] = (float)axis[c];
	}
	to->tint.axis[3] = (float)at;
}

void plan_tints(struct plan *plan, const struct psr_scene *scene)
{
	struct psr_scan scan;

	psr_scene_scan(&scan, scene);
	plan->has_tint = 0;
	for (uint32_t i = 0; i < scene->n_instances; i++) {
		struct plan_instance *to = &plan->instance[i];

		to->tint = (struct plan_tint){ .by = scene->instance[i].color_by, .low = scan.low };
		to->tint.scale = scan.high > scan.low ? 1.0f / (float)(scan.high - scan.low) : 0;
		if (to->tint.by == PSR_COLOR_HEIGHT)
			make_axis(to, psr_model_info(scene->instance[i].model));
		plan->has_tint |= to->tint.by != PSR_COLOR_OWN;
	}
	if (plan->has_tint)
		plan->view.needs |= STRIP_POSITION;
}

static void ramp(uint8_t rgb[3], float at)
{
	const float within = at > 0 ? at < 1 ? at : 1 : 0; /* NaN: 0 */

	psr_ramp_color(rgb, (unsigned)(within * (PSR_RAMP - 1) + 0.5f));
}

static void color_of(uint8_t rgb[3], const struct strip *strip, uint32_t i, const struct plan *plan, uint32_t instance)
{
	const struct plan_tint *tint = &plan->instance[instance].tint;

	if (tint->by == PSR_COLOR_HEIGHT) {
		const float *axis = tint->axis;

		ramp(rgb, axis[0] * strip->px[i] + axis[1] * strip->py[i] + axis[2] * strip->pz[i] + axis[3]);
		return;
	}
	const uint32_t id = strip->pixels->id[i], cube = id / PSR_BLOCK_SAMPLES - plan->instance[instance].first_slot;
	const struct psr_cubes *cubes = plan->warp[instance].cubes->model;
	const struct psr_cube_level *level = psr_cubes_level(cubes, cube);
	const uint32_t leaf = psr_cubes_leaf(cubes, level, cube)
	                      + psr_cubes_rank(level->tree, psr_cubes_code(cubes, level, cube), id % PSR_BLOCK_SAMPLES);
	const struct octree_scan *scan = &level->tree->scan;

	if (tint->by == PSR_COLOR_INTENSITY)
		ramp(rgb, (float)((int)scan->intensity[leaf] - (int)tint->low) * tint->scale);
	else if (tint->by == PSR_COLOR_CLASS)
		psr_class_color(rgb, scan->class[leaf]);
	else
		psr_order_color(rgb, psr_return_order(scan->returns[leaf]));
}

/* Returns how bright a sample is by the angle between its normal and the line of sight. Without a normal: 1. */
static float shade_of(const struct strip *s, uint32_t i, int is_perspective)
{
	const float x = is_perspective ? s->px[i] : 0, y = is_perspective ? s->py[i] : 0, z = is_perspective ? s->pz[i] : 1;
	const float nx = s->nx[i], ny = s->ny[i], nz = s->nz[i];
	const float dot = nx * x + ny * y + nz * z, squares = (nx * nx + ny * ny + nz * nz) * (x * x + y * y + z * z);

	if (PSR_ATTR_UNLIT(s->attr[i]) || !(squares > 0))
		return 1;
	const float cosine = sqrtf(dot * dot / squares);
	return LEAST_SHADE + (1 - LEAST_SHADE) * (cosine < 1 ? cosine : 1);
}

void tint_strip(struct strip *strip, const struct plan *plan)
{
	for (uint32_t i = 0; i < strip->n; i++) {
		const uint32_t instance = plan_find_instance(plan, strip->pixels->id[i] / PSR_BLOCK_SAMPLES);
		uint8_t rgb[3];

		if (plan->instance[instance].tint.by == PSR_COLOR_OWN)
			continue;
		const float shade = shade_of(strip, i, plan->perspective);
		color_of(rgb, strip, i, plan, instance);
		strip->dr[i] = psr_srgb_to_linear[rgb[0]] * shade;
		strip->dg[i] = psr_srgb_to_linear[rgb[1]] * shade;
		strip->db[i] = psr_srgb_to_linear[rgb[2]] * shade;
		strip->attr[i] |= 1u << 15; /* PSR_ATTR_UNLIT */
	}
}
