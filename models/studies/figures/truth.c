#include <math.h>
#include <stdlib.h>
#include "figures.h"
#include "base/srgb.h"
#include "base/vec.h"
#include "measure/truth.h"
#include "surface/lobe.h"
#include "base/direction.h"

#define RUN 64   /* rays traced together */
#define LIFT 1e-5 /* inner units from the surface, where shadow rays begin */

struct job {
	const struct figure_model *model;
	const struct psr_scene *scene;
	struct view view;
	struct figure_truth *truth;
};

struct place {
	double point[3], normal[3], to_eye[3]; /* the point in inner coordinates */
	double face[3];                        /* the face's normal, on the side that was met */
	struct look look;
};

static void look_up(struct place *place, const struct figure_model *model, const struct ray *ray,
                    const struct ray_hit *hit)
{
	const float *face = ray_scene_normal(model->source.scene, hit->prim);
	const uint64_t attr = truth_attr(model->truth, ray, hit);
	const float *normal = psr_direction_table()[PSR_ATTR_NORMAL(attr)];

	v3d_normalize(place->to_eye, ray->direction);
	v3d_scale(place->to_eye, place->to_eye, -1);
	v3d_add_scaled(place->point, ray->origin, hit->t, ray->direction);
	for (int k = 0; k < 3; k++) {
		place->face[k] = hit->is_back ? -(double)face[k] : (double)face[k];
		place->normal[k] = (double)normal[k];
	}
	material_decode(&place->look, attr);
}

/* How much of a light gets to the place if no surface stands between; from where, and from how far away, in inner
 * units. */
static double light_amount(const struct psr_light *light, const struct figure_model *model, const struct place *place,
                           double to_light[3], double *distance)
{
	const double scale = model->source.scale;
	double axis[3], amount = 1;

	v3d_normalize(axis, light->direction);
	if (light->kind == PSR_LIGHT_DIRECTIONAL) {
		v3d_scale(to_light, axis, -1);
		*distance = INFINITY;
		return 1;
	}
	for (int k = 0; k < 3; k++)
		to_light[k] = (light->position[k] - model->source.origin[k]) / scale - place->point[k];
	*distance = v3d_normalize(to_light, to_light);
	if (light->reference > 0)
		amount = light->reference * light->reference / (*distance * *distance * scale * scale);
	if (light->kind == PSR_LIGHT_SPOT) {
		const double c = -v3d_dot(to_light, axis), outer = cos(light->outer), inner = cos(light->inner);
		const double t = c >= inner ? 1 : (c - outer) / (inner - outer);

		amount = c > outer ? amount * t * t * (3 - 2 * t) : 0;
	}
	return amount;
}

static int is_shadowed(const struct figure_model *model, const struct place *place, const double to_light[3],
                       double distance)
{
	struct ray ray;
	uint8_t is_occluded;

	v3d_add_scaled(ray.origin, place->point, LIFT, place->face);
	v3d_set(ray.direction, to_light[0], to_light[1], to_light[2]);
	ray_scene_occluded(model->source.scene, &ray, 1, distance, &is_occluded);
	return is_occluded;
}

static void light_place(const struct job *job, const struct place *place, double light[3])
{
	const struct psr_scene *scene = job->scene;

	double ambient[3];

	lobe_ambient(ambient, &place->look, place->normal, place->to_eye);
	for (int c = 0; c < 3; c++)
		light[c] = place->look.unlit ? (double)place->look.base[c] : ambient[c] * scene->ambient[c];
	for (uint32_t l = 0; l < scene->n_lights && !place->look.unlit; l++) {
		double to_light[3], distance, part[3];
		const double amount = light_amount(&scene->light[l], job->model, place, to_light, &distance);

		if (!(v3d_dot(place->normal, to_light) > 0 && amount > 0))
			continue;
		if (scene->light[l].casts_shadow
		    && (v3d_dot(place->face, to_light) <= 0 || is_shadowed(job->model, place, to_light, distance)))
			continue;
		lobe_reflect(part, &place->look, place->normal, to_light, place->to_eye);
		for (int c = 0; c < 3; c++)
			light[c] += scene->light[l].color[c] * amount * part[c];
	}
}

static void draw_pixel(const struct job *job, uint32_t x, uint32_t y)
{
	const uint32_t rays = job->truth->rays, all = rays * rays;
	const size_t at = (size_t)y * job->truth->side + x;
	double sum[3] = { 0, 0, 0 };
	uint32_t n_met = 0;

	for (uint32_t first = 0; first < all; first += RUN) {
		const uint32_t n = all - first < RUN ? all - first : RUN;
		struct ray ray[RUN];
		struct ray_hit hit[RUN];

		for (uint32_t i = 0; i < n; i++)
			truth_ray(job->model->truth, &job->view, x + ((first + i) % rays + 0.5) / rays,
			          y + ((first + i) / rays + 0.5) / rays, &ray[i]);
		truth_trace(job->model->truth, ray, (int)n, job->scene->camera.near_z, hit);
		for (uint32_t i = 0; i < n; i++) {
			double light[3] = { job->scene->background[0], job->scene->background[1], job->scene->background[2] };
			struct place place;

			if (hit[i].prim != RAY_NONE) {
				look_up(&place, job->model, &ray[i], &hit[i]);
				light_place(job, &place, light);
				n_met++;
			}
			v3d_add(sum, sum, light);
		}
	}
	for (int c = 0; c < 3; c++)
		job->truth->rgb[3 * at + (size_t)c] = psr_linear_to_srgb((float)(sum[c] / all));
	job->truth->n_met[at] = (uint16_t)n_met;
}

static void draw_row(int y, void *userdata)
{
	const struct job *job = userdata;

	for (uint32_t x = 0; x < job->truth->side; x++)
		draw_pixel(job, x, (uint32_t)y);
}

int figure_truth_draw(struct figure_truth *truth, struct study *study, const struct figure_model *model,
                      const struct figure_shot *shot, uint32_t rays)
{
	struct job job = { .model = model, .scene = &shot->scene, .truth = truth };
	const uint32_t side = shot->settings.width;
	int rc = view_init(&job.view, &shot->scene.camera, side, side, study->err);

	if (rc != PSR_OK)
		return rc;
	if (truth->side != side) {
		figure_truth_fini(truth);
		truth->rgb = malloc((size_t)3 * side * side);
		truth->n_met = malloc((size_t)side * side * sizeof *truth->n_met);
		if (truth->rgb == NULL || truth->n_met == NULL)
			return psr_fail(study->err, PSR_ERR_MEMORY, "no memory for a picture by rays");
	}
	truth->side = side;
	truth->rays = rays;
	psr_pool_for(study->pool, (int)side, draw_row, &job);
	return PSR_OK;
}

void figure_truth_fini(struct figure_truth *truth)
{
	free(truth->rgb);
	free(truth->n_met);
	*truth = (struct figure_truth){ .side = 0 };
}
