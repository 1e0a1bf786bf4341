#include <math.h>
#include <string.h>
#include "base/maths.h"
#include "base/mem.h"
#include "base/root.h"
#include "base/vec.h"
#include "base/direction.h"
#include "groups.h"
#include "plan.h"
#include "plan_warp.h"
#include "tint.h"

/* The near distance, as a part of the scene's extent, if the request sets none. */
#define AUTO_NEAR (1.0 / 16384)

#define MOST_PLACED_SLOTS (UINT32_MAX / (PSR_BLOCK_SAMPLES << PSR_PLACE_BITS))

/* The camera's axes in the world (rows right, down, forward), its eye, and the scale of lengths. */
struct view {
	double axis[3][3], eye[3];
	double scale; /* 2^-exponent */
};

static void rotation_matrix(double m[3][3], const double q[4])
{
	double n = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
	double x = q[0] / n, y = q[1] / n, z = q[2] / n, w = q[3] / n;

	v3d_set(m[0], 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w));
	v3d_set(m[1], 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w));
	v3d_set(m[2], 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y));
}

static void view_make(struct view *view, const struct psr_camera *camera)
{
	double forward[3], right[3];

	v3d_sub(forward, camera->target, camera->eye);
	v3d_normalize(forward, forward);
	v3d_normalize(right, camera->up);
	v3d_cross(right, forward, right);
	v3d_normalize(right, right);
	v3d_cross(view->axis[1], forward, right);
	memcpy(view->axis[0], right, sizeof right);
	memcpy(view->axis[2], forward, sizeof forward);
	memcpy(view->eye, camera->eye, sizeof view->eye);
}

double plan_place(double center[3], double rotation[3][3], const struct psr_instance *instance, const double from[3])
{
	const struct psr_model_info *info = psr_model_info(instance->model);
	double turned[3];

	rotation_matrix(rotation, instance->rotation);
	m3d_apply(turned, (const double(*)[3])rotation, info->origin);
	for (int i = 0; i < 3; i++)
		center[i] = instance->translation[i] - from[i] + instance->scale * turned[i];
	return instance->scale * info->scale;
}

/* Exponent of the power of two just above the distance of the scene's far end. */
static int scene_exponent(const struct psr_scene *scene)
{
	double far = 0;
	int exponent = 0;

	for (uint32_t i = 0; i < scene->n_instances; i++) {
		double center[3], rotation[3][3];
		double scale = plan_place(center, rotation, &scene->instance[i], scene->camera.eye);

		far = fmax(far, v3d_length(center) + scale);
	}
	frexp(far, &exponent);
	return exponent;
}

static void light_make(struct strip_light *out, const struct psr_light *light, const struct view *view)
{
	double v[3], s, c;

	out->kind = light->kind;
	for (int i = 0; i < 3; i++)
		out->color[i] = (float)light->color[i];
	if (light->kind != PSR_LIGHT_POINT) {
		v3d_normalize(v, light->direction);
		m3d_apply(v, view->axis, v);
		v3f_set(out->axis, (float)v[0], (float)v[1], (float)v[2]);
		v3f_set(out->to_light, (float)-v[0], (float)-v[1], (float)-v[2]);
	}
	if (light->kind != PSR_LIGHT_DIRECTIONAL) {
		v3d_sub(v, light->position, view->eye);
		m3d_apply(v, view->axis, v);
		v3f_set(out->position, (float)(v[0] * view->scale), (float)(v[1] * view->scale), (float)(v[2] * view->scale));
		const double r = light->reference * view->scale;
		out->reference2 = (float)(r * r);
	}
	if (light->kind == PSR_LIGHT_SPOT) {
		psr_sincos(light->inner, &s, &c);
		out->cos_inner = (float)c;
		psr_sincos(light->outer, &s, &c);
		out->cos_outer = (float)c;
	}
}

static void instance_make(struct plan_instance *out, struct warp_instance *warp, const struct psr_instance *instance,
                          const struct plan *plan, const struct view *view, double focal)
{
	double center[3], rotation[3][3], camera_center[3], to_camera[3][3], eye[3];
	double world = plan_place(center, rotation, instance, view->eye), scale = world * view->scale;
	const double blocks_spacing = psr_model_info(instance->model)->spacing * instance->scale * view->scale;
	const struct psr_cubes *cubes = instance_cubes(instance);
	const struct psr_points *points = instance_points(instance);
	const double edge = cubes != NULL ? cubes->level[0].edge * scale : 0;
	/* Rectangles of points meet: there are no gaps at any distance. */
	const double spacing = points != NULL ? 0 : cubes != NULL ? CUBES_SPACING * edge : blocks_spacing;
	struct cull_view *cull = &out->cull;

	*cull = (struct cull_view){
		.blocks = warp->blocks, .cubes = cubes, .points = points, .scale = (float)scale, .perspective = plan->perspective,
		.focal = plan->focal, .spacing = (float)ldexp(spacing, plan->cell_bias),
		.near_z = plan->near_z, .width = (float)plan->width, .height = (float)plan->height,
		.center_x = (float)plan->center[0], .center_y = (float)plan->center[1],
		.with_cones = (plan->cull_tests & PSR_CULL_CONES) != 0,
		.with_splats = plan->with_splats || warp->blocks->opacity != NULL || (plan->with_ewa && cubes != NULL),
		.reach = plan->with_ewa && cubes != NULL,
		.region_from = { (float)plan->window.left, (float)plan->window.top },
		.region_scale = { (float)SCREEN_SIDE / (float)plan->window.picture_width,
		                  (float)SCREEN_SIDE / (float)plan->window.picture_height },
	};
	out->level_spacing = (float)(cubes != NULL ? CUBES_LEVEL_SPACING * edge : blocks_spacing);
	m3d_multiply(to_camera, (const double(*)[3])view->axis, (const double(*)[3])rotation);
	m3d_apply(camera_center, view->axis, center);
	v3d_scale(camera_center, camera_center, view->scale);
	plan_sight(warp, to_camera, plan, focal);
	memcpy(out->turn, to_camera, sizeof out->turn);
	for (int i = 0; i < 3; i++) {
		v3f_set(warp->turn[i], (float)to_camera[i][0], (float)to_camera[i][1], (float)to_camera[i][2]);
		v3d_scale(to_camera[i], to_camera[i], scale);
		for (int k = 0; k < 3; k++)
			cull->center_m[i][k] = (float)to_camera[i][k];
		cull->center_m[i][3] = (float)camera_center[i];
	}

	v3d_scale(eye, plan->perspective ? center : view->axis[2], -1);
	m3d_apply_transposed(eye, (const double(*)[3])rotation, eye);
	v3d_scale(eye, eye, plan->perspective ? 1 / world : 1);
	v3f_set(cull->eye, (float)eye[0], (float)eye[1], (float)eye[2]);

	/* Masks hold for eyes outside of the object's convex hull; the unit sphere contains that. */
	const struct psr_model_info *info = psr_model_info(instance->model);
	const int is_outside = !plan->perspective || v3d_length(eye) > 1;
	out->masks = !(plan->cull_tests & PSR_CULL_MASKS)                     ? PSR_WHY_OFF
	             : warp->blocks->visibility_mask == NULL                  ? PSR_WHY_NOTHING
	             : !is_outside || info->n_trials == 0 || info->n_lost > 0 ? PSR_WHY_VOID
	                                                                      : PSR_WHY_RAN;

	if (cubes != NULL)
		plan_cubes((struct warp_cubes *)warp->cubes, to_camera, camera_center, plan, focal);
	if (points != NULL)
		plan_points((struct warp_points *)warp->points, to_camera, out->turn, camera_center, plan, focal);
	struct warp_lattice *const lattice = (struct warp_lattice *)warp->lattice;
	for (uint32_t p = 0; p < warp->blocks->n_projections; p++)
		plan_lattice(&lattice[p], &warp->blocks->projection[p], to_camera, camera_center, plan, focal);
}

/* Thresholds of gaps: `gap_threshold` pixel widths for cells of two pixels ([G] 7.2), proportional to the cell's size,
 * as is the fall of a slanted surface within the cell. */
static void threshold_make(struct plan *plan, double gap_threshold)
{
	for (int k = 0; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		float t = (float)(gap_threshold * (1 << k) / 2) / plan->focal;

		plan->gap_scale[k] = plan->perspective ? 1 + t : 1;
		plan->gap_offset[k] = plan->perspective ? 0 : t;
	}
}

static int storage_make(struct plan *plan, const struct psr_scene *scene)
{
	struct warp_lattice *lattice;
	struct warp_cubes *to;
	struct warp_points *to_points;
	size_t n_projections = 0, n_octrees = 0, n_points = 0;

	for (uint32_t i = 0; i < scene->n_instances; i++) {
		n_projections += instance_groups(&scene->instance[i])->n_projections;
		n_octrees += instance_cubes(&scene->instance[i]) != NULL;
		n_points += instance_points(&scene->instance[i]) != NULL;
	}
	const size_t size = n_octrees * sizeof *to + n_points * sizeof *to_points + n_projections * sizeof(struct warp_lattice)
	                    + scene->n_lights * sizeof(struct strip_light)
	                    + scene->n_instances * (sizeof(struct plan_instance) + sizeof(struct warp_instance));
	plan->storage = psr_grow_huge(plan->storage, &plan->storage_size, size + 1);
	if (plan->storage == NULL)
		return PSR_ERR_MEMORY;
	to = plan->storage;
	to_points = (struct warp_points *)(to + n_octrees);
	lattice = (struct warp_lattice *)(to_points + n_points);
	plan->instance = (struct plan_instance *)(lattice + n_projections);
	plan->warp = (struct warp_instance *)(plan->instance + scene->n_instances);
	plan->light = (struct strip_light *)(plan->warp + scene->n_instances);
	plan->n_slots = plan->n_groups = 0;
	plan->n_samples = 0;
	plan->has_octrees = n_octrees > 0;
	plan->has_points = n_points > 0;
	plan->only_points = n_points > 0 && n_points == scene->n_instances;
	for (uint32_t i = 0; i < scene->n_instances; i++) {
		const struct psr_blocks *blocks = instance_groups(&scene->instance[i]);
		const struct psr_cubes *cubes = instance_cubes(&scene->instance[i]);
		const struct psr_points *points = instance_points(&scene->instance[i]);

		if (points != NULL)
			to_points->model = points;
		plan->warp[i].points = points != NULL ? to_points++ : NULL;
		if (cubes != NULL)
			to->model = cubes;
		plan->warp[i].cubes = cubes != NULL ? to++ : NULL;
		plan->instance[i].first_slot = plan->n_slots;
		plan->warp[i].blocks = blocks;
		plan->warp[i].lattice = lattice;
		plan->warp[i].first_slot = plan->n_slots;
		plan->instance[i].first_group = plan->n_groups;
		plan->n_slots += blocks->n_blocks;
		plan->n_groups += blocks->n_clusters;
		plan->n_samples += blocks->n_samples;
		lattice += blocks->n_projections;
	}
	return PSR_OK;
}

static uint16_t light16(double linear, int is_wide)
{
	return is_wide ? psr_root_of_light((float)linear) : (uint16_t)(fmin(linear, 1) * 65535 + 0.5);
}

/* Leaves and points have no places, and ids of many blocks leave no bits. */
static unsigned words_place_bits(const struct plan *plan)
{
	const int is_of_blocks = !plan->has_octrees && !plan->has_points && !plan->with_splats;

	return plan->is_smooth && is_of_blocks && plan->n_slots <= MOST_PLACED_SLOTS ? PSR_PLACE_BITS : 0;
}

int plan_make(struct plan *plan, const struct psr_scene *scene, const struct render_settings *settings,
              struct psr_error *err)
{
	const struct psr_camera *camera = &scene->camera;
	struct view view;
	double focal;
	int rc = storage_make(plan, scene);

	if (rc)
		return psr_fail(err, rc, "no memory for a scene of %u instances", scene->n_instances);

	view_make(&view, camera);
	memcpy(plan->axes, view.axis, sizeof plan->axes);
	memcpy(plan->eye, view.eye, sizeof plan->eye);
	plan->shadow = NULL;
	plan->width = settings->width;
	plan->height = settings->height;
	plan->window = settings->window;
	if (plan->window.picture_width == 0)
		plan->window = (struct psr_window){ plan->width, plan->height, 0, 0 };
	plan->center[0] = plan->window.picture_width / 2.0 - plan->window.left;
	plan->center[1] = plan->window.picture_height / 2.0 - plan->window.top;
	plan->tiles_x = (plan->width + TILE_WIDTH - 1) / TILE_WIDTH;
	plan->tiles_y = (plan->height + TILE_HEIGHT - 1) / TILE_HEIGHT;
	plan->parts_x = (plan->width + PART_WIDTH - 1) / PART_WIDTH;
	plan->parts_y = (plan->height + PART_HEIGHT - 1) / PART_HEIGHT;
	plan->perspective = camera->kind == PSR_CAMERA_PERSPECTIVE;
	plan->cull_tests = settings->cull_tests;
	plan->is_full = settings->is_full;
	plan->gap_method = settings->gap_method;
	plan->no_fill = settings->no_fill;
	plan->shadow_side = settings->shadow_side;
	plan->finer = (float)(1 / settings->spacing_px);
	plan->cell_bias = settings->cell_bias;
	plan->is_quiet = NULL;
	plan->has_sheer = plan->has_thin = 0;
	plan->caster = NO_CASTER;
	plan->with_splats = settings->with_splats;
	plan->asks_ewa = settings->with_ewa;
	plan->with_ewa = settings->with_ewa && plan->has_octrees;
	plan->with_runs = plan->has_octrees && !plan->with_ewa && !plan->with_splats && !plan->is_full;
	plan->is_smooth = settings->smooth != PSR_SMOOTH_NONE;
	plan->place_bits = words_place_bits(plan);
	plan->is_wide = settings->is_wide;
	plan->cancel = settings->cancel;
	plan->exponent = scene_exponent(scene);
	view.scale = ldexp(1, -plan->exponent);

	if (plan->perspective) {
		double s, c;

		psr_sincos(camera->fov_y / 2, &s, &c);
		focal = plan->window.picture_height / 2.0 * c / s;
		plan->tangent[0] = plan->window.picture_width / 2.0 / focal;
		plan->tangent[1] = s / c;
	} else {
		focal = plan->window.picture_height / (camera->ortho_height * view.scale);
	}
	plan->focal = (float)focal;
	plan->near_z = (float)(camera->near_z * view.scale);
	if (!(plan->near_z > 0))
		plan->near_z = (float)AUTO_NEAR;
	threshold_make(plan, settings->gap_threshold);

	plan->n_instances = scene->n_instances;
	plan->n_lights = 0;
	for (int i = 0; i < 3; i++) {
		plan->ambient[i] = (float)scene->ambient[i];
		plan->background[i] = light16(scene->background[i], settings->is_wide);
	}
	for (uint32_t i = 0; i < scene->n_instances; i++) {
		if (plan_is_cancelled(plan))
			return render_cancelled(err);
		instance_make(&plan->instance[i], &plan->warp[i], &scene->instance[i], plan, &view, focal);
	}
	plan->view = (struct strip_view){
		.instance = plan->warp, .n_instances = plan->n_instances, .direction_word = psr_direction_words(),
		.half_width = (float)plan->center[0], .half_height = (float)plan->center[1],
		.focal = plan->focal, .perspective = plan->perspective,
	};
	for (uint32_t l = 0; l < scene->n_lights; l++) {
		const double *color = scene->light[l].color;

		if (!(color[0] > 0 || color[1] > 0 || color[2] > 0) && !plan->is_full)
			continue;
		light_make(&plan->light[plan->n_lights], &scene->light[l], &view);
		if (plan->light[plan->n_lights++].kind != PSR_LIGHT_DIRECTIONAL)
			plan->view.needs |= STRIP_POSITION;
	}
	plan_tints(plan, scene);
	if (plan->is_full)
		plan->view.needs = STRIP_POSITION | STRIP_TWO_SIDED | STRIP_SPECULAR | STRIP_BENT;
	return PSR_OK;
}

void plan_clear(struct plan *plan)
{
	psr_free_huge(plan->storage, plan->storage_size);
	memset(plan, 0, sizeof *plan);
}

uint32_t plan_find_instance(const struct plan *plan, uint32_t slot)
{
	uint32_t low = 0, high = plan->n_instances;

	while (high - low > 1) {
		uint32_t middle = (low + high) / 2;

		if (plan->instance[middle].first_slot <= slot)
			low = middle;
		else
			high = middle;
	}
	return low;
}
