#include <math.h>
#include "base/maths.h"
#include "base/vec.h"
#include "base/view.h"
#include "groups.h"
#include "psr/scene.h"

#define MAX_LENGTH 1e30

static int check_tint(const struct psr_instance *instance, unsigned i, struct psr_error *err)
{
	static const char *const names[] = { "", "intensities", "classes", "", "returns" };
	static const struct psr_scan none;
	const struct psr_cubes *cubes = instance_cubes(instance);
	const struct psr_scan *scan = cubes != NULL ? &cubes->scan : &none;
	const enum psr_color_by by = instance->color_by;
	struct psr_model_prefix prefix;

	if ((unsigned)by > PSR_COLOR_RETURN)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "instance %u: there are no colours %d", i, by);
	if (by == PSR_COLOR_OWN || by == PSR_COLOR_HEIGHT || (by == PSR_COLOR_INTENSITY && scan->has_intensity)
	    || (by == PSR_COLOR_CLASS && scan->has_class) || (by == PSR_COLOR_RETURN && scan->has_return))
		return PSR_OK;
	if (cubes != NULL && psr_model_is_prefix(instance->model, &prefix) && prefix.levels == prefix.of_levels)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "instance %u: %s of a scan stand behind all levels of a packed octree, and "
		                "the model's file ends before them", i, names[by]);
	if (cubes != NULL && prefix.levels > 0)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "instance %u: %s of a scan stand behind all levels of a packed octree, and "
		                "these are %u of %u; ask for all of them", i, names[by], prefix.levels, prefix.of_levels);
	return psr_fail(err, PSR_ERR_UNSUPPORTED, "instance %u: its %s no %s of a scan; an octree has them that psr-model "
	                "build --scan made of a LAS file that tells them. Any model can be coloured by height", i,
	                cubes != NULL ? "octree keeps" : "representation has", names[by]);
}

void psr_scene_scan(struct psr_scan *scan, const struct psr_scene *scene)
{
	*scan = (struct psr_scan){ .low = UINT16_MAX };
	for (uint32_t i = 0; i < scene->n_instances; i++) {
		const enum psr_color_by by = scene->instance[i].color_by;
		const struct psr_cubes *cubes = instance_cubes(&scene->instance[i]);

		if (by == PSR_COLOR_INTENSITY) {
			scan->has_intensity = 1;
			scan->low = cubes->scan.low < scan->low ? cubes->scan.low : scan->low;
			scan->high = cubes->scan.high > scan->high ? cubes->scan.high : scan->high;
		} else if (by == PSR_COLOR_CLASS) {
			scan->has_class = 1;
			for (int k = 0; k < 4; k++)
				scan->classes[k] |= cubes->scan.classes[k];
		} else if (by == PSR_COLOR_RETURN) {
			scan->has_return = 1;
			scan->orders |= cubes->scan.orders;
		}
	}
	if (!scan->has_intensity)
		scan->low = 0;
}

static int validate_instance(const struct psr_instance *instance, unsigned i, struct psr_error *err)
{
	static const char *const names[] = { "samples", "blocks", "octree", "differential points" };

	if (instance->model == NULL)
		return psr_fail(err, PSR_ERR_ARG, "instance %u has no model", i);
	if ((unsigned)instance->representation > PSR_DPOINTS)
		return psr_fail(err, PSR_ERR_ARG, "instance %u: there is no representation %d", i, instance->representation);
	if (is_octree(instance)) {
		const int rc = psr_model_make_cubes(instance->model, err);

		if (rc != PSR_OK)
			return rc;
	}
	if (instance_groups(instance) == NULL)
		return psr_fail(err, PSR_ERR_ARG, "instance %u: the model has no %s", i, names[instance->representation]);
	if (check_tint(instance, i, err) != PSR_OK)
		return PSR_ERR_UNSUPPORTED;
	double q = 0;
	for (int k = 0; k < 4; k++)
		q += instance->rotation[k] * instance->rotation[k];
	if (!(fabs(q - 1) <= 1e-6))
		return psr_fail(err, PSR_ERR_ARG, "instance %u: the rotation is not a unit quaternion", i);
	if (!view_is_point(instance->translation))
		return psr_fail(err, PSR_ERR_ARG, "instance %u: the translation must be finite and below 1e30", i);
	if (!(instance->scale >= 1e-30 && instance->scale <= MAX_LENGTH))
		return psr_fail(err, PSR_ERR_ARG, "instance %u: a scale of %g is not within 1e-30..1e30", i, instance->scale);
	return PSR_OK;
}

int psr_scene_validate(const struct psr_scene *scene, struct psr_error *err)
{
	if (scene->n_instances > PSR_MAX_INSTANCES)
		return psr_fail(err, PSR_ERR_LIMIT, "%u instances exceed the limit of %d", scene->n_instances,
		                PSR_MAX_INSTANCES);
	if (scene->n_lights > PSR_MAX_LIGHTS)
		return psr_fail(err, PSR_ERR_LIMIT, "%u lights exceed the limit of %d", scene->n_lights, PSR_MAX_LIGHTS);
	if (!view_is_light(scene->ambient) || !view_is_light(scene->background))
		return psr_fail(err, PSR_ERR_ARG, "ambient and background must be within 0..1e9");
	struct psr_error what = { 0 };
	int rc = view_check_camera(&scene->camera, &what);
	if (rc)
		return psr_fail(err, rc, "camera: %s", what.text);
	uint64_t n_blocks = 0;
	for (unsigned i = 0; !rc && i < scene->n_instances; i++) {
		rc = validate_instance(&scene->instance[i], i, err);
		if (!rc)
			n_blocks += instance_groups(&scene->instance[i])->n_blocks;
	}
	for (unsigned i = 0; !rc && i < scene->n_lights; i++) {
		rc = view_check_light(&scene->light[i], &what);
		if (rc)
			return psr_fail(err, rc, "light %u: %s", i, what.text);
	}
	/* Sample ids have 32 bits; the last one belongs to empty words. */
	if (!rc && n_blocks >= UINT64_C(1) << 26)
		return psr_fail(err, PSR_ERR_LIMIT, "the instances have %llu blocks together; the limit is 2^26 - 1",
		                (unsigned long long)n_blocks);
	return rc;
}

void psr_camera_axes(double axes[3][3], const double up[3])
{
	v3d_normalize(axes[1], up);
	const int first = fabs(axes[1][0]) > 0.9;
	v3d_set(axes[0], !first, first, 0);
	v3d_add_scaled(axes[0], axes[0], -v3d_dot(axes[0], axes[1]), axes[1]);
	v3d_normalize(axes[0], axes[0]);
	v3d_cross(axes[2], axes[0], axes[1]);
}

void psr_camera_frame(struct psr_camera *camera, const double box_min[3], const double box_max[3], const double up[3],
                      double fov_y, double aspect)
{
	/* Right, down and forward of the camera, along the axes right, up and front of the object. */
	static const double view[3][3] = {
		{ 0.9302605094190634, 0, -0.3668996928526715 },
		{ 0.11006990785580148, -0.9539392014169455, 0.2790781528257191 },
		{ -0.35, -0.3, -0.887411967464942 },
	};
	const double margin = 1.06;
	double axes[3][3], right[3], down[3], forward[3];
	/* Fits the corners of the box, not a sphere around it: most objects are far from round. */
	double half[3], tangent[2] = { aspect, 1 }, distance = 0, extent = 0, deepest = 0;

	psr_camera_axes(axes, up);
	m3d_apply_transposed(right, axes, view[0]);
	m3d_apply_transposed(down, axes, view[1]);
	m3d_apply_transposed(forward, axes, view[2]);
	for (int i = 0; i < 3; i++) {
		camera->target[i] = box_min[i] / 2 + box_max[i] / 2;
		half[i] = box_max[i] / 2 - box_min[i] / 2;
	}
	if (fov_y > 0) {
		double s, c;

		psr_sincos(fov_y / 2, &s, &c);
		tangent[0] *= s / c;
		tangent[1] *= s / c;
	}
	for (int corner = 0; corner < 8; corner++) {
		double p[3];

		for (int i = 0; i < 3; i++)
			p[i] = corner >> i & 1 ? half[i] : -half[i];
		double x = fabs(v3d_dot(p, right)) / tangent[0], y = fabs(v3d_dot(p, down)) / tangent[1],
			   z = v3d_dot(p, forward);
		extent = fmax(extent, fmax(x, y));
		distance = fmax(distance, fmax(x, y) * margin - z);
		deepest = fmax(deepest, -z);
	}
	if (!(extent > 0))
		extent = distance = 1;
	v3d_add_scaled(camera->up, (const double[3]){ 0, 0, 0 }, 1, axes[1]);
	camera->kind = fov_y > 0 ? PSR_CAMERA_PERSPECTIVE : PSR_CAMERA_ORTHOGRAPHIC;
	camera->fov_y = fov_y > 0 ? fov_y : 0;
	camera->ortho_height = fov_y > 0 ? 0 : 2 * extent * margin;
	if (!(fov_y > 0))
		distance = 2 * deepest + extent;
	v3d_add_scaled(camera->eye, camera->target, -distance, forward);
	camera->near_z = (distance - deepest) / 2;
}

void psr_light_key(struct psr_light *light, const struct psr_camera *camera)
{
	double forward[3], right[3], up[3];

	*light = (struct psr_light){ .kind = PSR_LIGHT_DIRECTIONAL, .color = { 1, 1, 1 } };
	v3d_sub(forward, camera->target, camera->eye);
	v3d_normalize(forward, forward);
	v3d_cross(right, forward, camera->up);
	v3d_normalize(right, right);
	v3d_cross(up, right, forward);
	for (int i = 0; i < 3; i++)
		light->direction[i] = forward[i] + 0.5 * right[i] - 0.6 * up[i];
}
