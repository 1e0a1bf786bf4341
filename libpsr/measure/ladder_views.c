#include <math.h>
#include <stdlib.h>
#include "base/maths.h"
#include "base/random.h"
#include "base/vec.h"
#include "ladder.h"
#include "view.h"

#define FOV (35 * PSR_DEGREE)
#define AWAY 5            /* how many times as far LADDER_FAR is as LADDER_AROUND */
#define CLOSE_PIXELS 2    /* between samples */
#define GRAZING_PIXELS 1
#define PROBE_SIDE 48     /* pixels of the picture in which places of the surface are looked for */
#define TRIES 64          /* places, of which the first one that the eye sees is taken */
#define AMBIENT 0.15
#define LIGHT 0.8            /* with the ambient light below 1: white that saturates would hide errors */
#define BACKGROUND 0.02

const char *ladder_kind_name(enum ladder_kind kind)
{
	static const char *const names[LADDER_N_KINDS] = { "around", "close", "grazing", "far" };

	return names[kind];
}

/* Any vector perpendicular to v, of length 1, turned about v by chance. */
static void any_across(double out[3], const double v[3], uint64_t *random)
{
	double axis[3], other[3], s, c;

	v3d_set(axis, fabs(v[0]) < 0.7, fabs(v[0]) >= 0.7, 0);
	v3d_cross(axis, v, axis);
	v3d_normalize(axis, axis);
	v3d_cross(other, v, axis);
	psr_sincos(random_in(random, 0, 360 * PSR_DEGREE), &s, &c);
	for (int i = 0; i < 3; i++)
		out[i] = c * axis[i] + s * other[i];
}

/* Looks at `target` from `toward` (length 1), which is where the eye is, seen from there. */
static void look_at(struct psr_camera *camera, const double target[3], const double toward[3], double distance,
                    const double up[3])
{
	*camera = (struct psr_camera){ .kind = PSR_CAMERA_PERSPECTIVE, .fov_y = FOV };
	v3d_add_scaled(camera->eye, target, distance, toward);
	for (int i = 0; i < 3; i++) {
		camera->target[i] = target[i];
		camera->up[i] = up[i];
	}
	if (fabs(v3d_dot(up, toward)) > 0.98) /* any other way up will do */
		v3d_set(camera->up, fabs(toward[0]) < 0.7, fabs(toward[0]) >= 0.7, 0);
}

/* From any side, more often from above than from below. */
static void look_around(struct psr_camera *camera, const struct ladder_look *look, double times, uint64_t *random)
{
	const struct psr_model_info *info = look->info;
	double across[3], toward[3], center[3], half[3];
	const double height = random_in(random, -0.3, 0.8);

	any_across(across, info->up, random);
	for (int i = 0; i < 3; i++) {
		toward[i] = height * info->up[i] + sqrt(1 - height * height) * across[i];
		center[i] = info->box_min[i] / 2 + info->box_max[i] / 2;
		half[i] = info->box_max[i] / 2 - info->box_min[i] / 2;
	}
	const double narrow = look->width < look->height ? (double)look->width / look->height : 1;
	look_at(camera, center, toward, times * v3d_length(half) / (sin(FOV / 2) * narrow), info->up);
}

/* A place of the surface, and its normal on the side that the eye sees. */
struct place {
	double at[3], normal[3];
};

struct probe {
	float depth[PROBE_SIDE * PROBE_SIDE], normal[PROBE_SIDE * PROBE_SIDE][3];
};

static int probe(struct probe *out, const struct ladder_look *look, const struct psr_camera *camera,
                 struct psr_error *err)
{
	const struct psr_truth_shot shot = { look->truth, camera, PROBE_SIDE, PROBE_SIDE, look->n_threads };

	return psr_truth_draw(&shot, 1, out->depth, out->normal, NULL, err);
}

/* Takes one of the places that the probe met; returns 0 if there is none. */
static int take_place(struct place *place, const struct probe *probe, const struct view *view, uint64_t *random)
{
	uint32_t n = 0, k, i;
	double origin[3], direction[3];

	for (i = 0; i < PROBE_SIDE * PROBE_SIDE; i++)
		n += isfinite(probe->depth[i]) != 0;
	if (n == 0)
		return 0;
	k = random_below(random, n);
	for (i = 0; !isfinite(probe->depth[i]) || k-- > 0; i++)
		;
	view_ray(view, i % PROBE_SIDE + 0.5, i / PROBE_SIDE + 0.5, origin, direction);
	v3d_add_scaled(place->at, origin, (double)probe->depth[i], direction);
	for (int c = 0; c < 3; c++)
		place->normal[c] = (double)probe->normal[i][c];
	return 1;
}

/* Whether a ray to the target ends there, or near. */
static int sees_target(int *out, const struct ladder_look *look, const struct psr_camera *camera,
                       struct psr_error *err)
{
	const struct psr_truth_shot shot = { look->truth, camera, 1, 1, look->n_threads };
	double to[3];
	float depth;
	int rc;

	v3d_sub(to, camera->target, camera->eye);
	rc = psr_truth_draw(&shot, 1, &depth, NULL, NULL, err);
	*out = rc == PSR_OK && fabs((double)depth - v3d_length(to)) <= 4 * look->info->spacing;
	return rc;
}

/* A place of the surface that an eye sees at an angle from the normal. Where no place is found, the view stays as
 * around. */
static int look_at_place(struct ladder_view *view, const struct ladder_look *look, uint64_t *random,
                         struct psr_error *err)
{
	const int is_close = view->kind == LADDER_CLOSE;
	const double pixel = look->info->spacing / (is_close ? CLOSE_PIXELS : GRAZING_PIXELS);
	const double distance = pixel * look->height / (2 * tan(FOV / 2));
	const struct psr_camera around = view->camera;
	struct probe *found = malloc(sizeof *found);
	struct view from;
	int is_seen = 0, rc;

	if (found == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to look for a view");
	rc = view_init(&from, &around, PROBE_SIDE, PROBE_SIDE, err);
	if (rc == PSR_OK)
		rc = probe(found, look, &around, err);
	for (int i = 0; rc == PSR_OK && !is_seen && i < TRIES; i++) {
		struct psr_camera camera;
		struct place place;
		double across[3], toward[3], s, c;

		if (!take_place(&place, found, &from, random))
			break;
		any_across(across, place.normal, random);
		const double degrees = is_close ? random_in(random, 0, 40) : random_in(random, 75, 85);
		psr_sincos(degrees * PSR_DEGREE, &s, &c);
		for (int k = 0; k < 3; k++)
			toward[k] = c * place.normal[k] + s * across[k];
		look_at(&camera, place.at, toward, distance, look->info->up);
		rc = sees_target(&is_seen, look, &camera, err);
		if (is_seen)
			view->camera = camera;
	}
	free(found);
	return rc;
}

int ladder_views_make(struct ladder_view *view, uint32_t n, const struct ladder_look *look, struct psr_error *err)
{
	int rc = PSR_OK;

	for (uint32_t i = 0; rc == PSR_OK && i < n; i++) {
		struct ladder_view *v = &view[i];
		uint64_t random = look->seed + UINT64_C(0x632be59bd9b4e019) * (i + 1);

		*v = (struct ladder_view){ .kind = i % LADDER_N_KINDS, .width = look->width, .height = look->height };
		look_around(&v->camera, look, v->kind == LADDER_FAR ? AWAY : 1, &random);
		psr_light_key(&v->light, &v->camera);
		v3d_set(v->light.color, LIGHT, LIGHT, LIGHT);
		v->light.casts_shadow = i / LADDER_N_KINDS % 2 != 0;
		if (v->kind == LADDER_CLOSE || v->kind == LADDER_GRAZING)
			rc = look_at_place(v, look, &random, err);
	}
	return rc;
}

void ladder_scene(struct psr_scene *scene, const struct ladder_view *view, const struct psr_instance *instance)
{
	*scene = (struct psr_scene){ .instance = instance, .n_instances = instance != NULL, .light = &view->light,
		                         .n_lights = 1, .camera = view->camera };
	for (int i = 0; i < 3; i++) {
		scene->ambient[i] = AMBIENT;
		scene->background[i] = BACKGROUND;
	}
}

int ladder_view_trace(struct ladder_view *view, const struct ladder_look *look, uint32_t rays, struct psr_error *err)
{
	const size_t area = (size_t)view->width * view->height;
	uint8_t *truth = malloc(3 * area);
	float *coverage = malloc(area * sizeof *coverage);
	struct psr_scene scene;
	int rc = truth != NULL && coverage != NULL
	             ? PSR_OK
	             : psr_fail(err, PSR_ERR_MEMORY, "no memory for a picture of %ux%u", view->width, view->height);

	ladder_scene(&scene, view, NULL);
	const struct psr_source_shot shot = { look->source, &scene, view->width, view->height, rays, look->n_threads };
	if (rc == PSR_OK)
		rc = psr_source_draw(&shot, &(struct psr_source_planes){ .rgb = (uint8_t(*)[3])truth, .coverage = coverage }, err);
	view->n_covered = 0;
	for (size_t i = 0; rc == PSR_OK && i < area; i++)
		view->n_covered += coverage[i] > 0;
	free(coverage);
	if (rc != PSR_OK) {
		free(truth);
		return rc;
	}
	free(view->truth);
	view->truth = truth;
	return PSR_OK;
}

void ladder_view_fini(struct ladder_view *view)
{
	free(view->truth);
	view->truth = NULL;
}
