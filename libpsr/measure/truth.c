#include "truth.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/direction.h"
#include "base/mem.h"
#include "base/srgb.h"
#include "base/vec.h"
#include "surface/validate.h"
#include "ray/ray.h"
#include "surface/lobe.h"
#include "surface/stipple.h"
#include "surface/surface.h"
#include "model/blocks.h"
#include "base/pool.h"

#define MOST_SIDE 64
#define RUN 64 /* rays traced together */
#define REACH_SIDE 60

struct psr_truth {
	const struct psr_mesh *mesh;
	struct ray_scene *scene;
	struct surface surface;
	double origin[3], scale;
};

#define LEANING (M_PI / 18) /* 10 degrees */

struct job {
	const struct psr_truth *truth;
	struct view view;
	uint32_t side, n_columns;
	float *depth;
	float (*normal)[3];
	uint8_t (*color)[4];
};

void psr_truth_stipple(struct psr_truth *truth, double spacing)
{
	ray_scene_stipple(truth->scene, STIPPLE_PIXELS * spacing / truth->scale);
}

int psr_truth_create(struct psr_truth **out, const struct psr_mesh *mesh, struct psr_error *err)
{
	struct psr_truth *truth;
	int rc = validate_mesh(mesh, err);
	if (rc != PSR_OK)
		return rc;
	truth = calloc(1, sizeof *truth);
	if (truth == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for the ray tracer");
	truth->mesh = mesh;
	rc = validate_bound_mesh(mesh, truth->origin, &truth->scale, err);
	if (rc == PSR_OK)
		rc = ray_scene_create(&truth->scene, mesh, truth->origin, truth->scale, err);
	if (rc == PSR_OK)
		rc = ray_scene_index_distances(truth->scene, err);
	if (rc == PSR_OK && surface_init(&truth->surface, mesh, truth->scale) != PSR_OK)
		rc = psr_fail(err, PSR_ERR_MEMORY, "no memory for the mesh's textures");
	if (rc != PSR_OK) {
		psr_truth_destroy(truth);
		return rc;
	}
	*out = truth;
	return PSR_OK;
}

void psr_truth_destroy(struct psr_truth *truth)
{
	if (truth == NULL)
		return;
	ray_scene_destroy(truth->scene);
	surface_fini(&truth->surface);
	free(truth);
}

/* World to inner coordinates; t becomes z' / scale. */
void truth_ray(const struct psr_truth *truth, const struct view *view, double x, double y, struct ray *ray)
{
	view_ray(view, x, y, ray->origin, ray->direction);
	for (int k = 0; k < 3; k++)
		ray->origin[k] = (ray->origin[k] - truth->origin[k]) / truth->scale;
}

double truth_distance(const struct psr_truth *truth, const double point[3], double most)
{
	double inner[3];
	for (int k = 0; k < 3; k++)
		inner[k] = (point[k] - truth->origin[k]) / truth->scale;
	return fmin(most, truth->scale * ray_scene_distance(truth->scene, inner, most / truth->scale));
}

/* Traces row j of side * side rays, spread over the n * n pixels from (x, y) on. */
static void trace_row(struct ray_hit *hit, const struct psr_truth *truth, const struct view *view, const double at[2],
                      int n, int side, int j)
{
	struct ray ray[MOST_SIDE];
	for (int i = 0; i < side; i++)
		truth_ray(truth, view, at[0] + (i + 0.5) / side * n, at[1] + (j + 0.5) / side * n, &ray[i]);
	truth_trace(truth, ray, side, view->near_z, hit);
}

int truth_is_met(const struct psr_truth *truth, const struct view *view, double x, double y, int n, int side)
{
	struct ray_hit hit[MOST_SIDE];
	for (int j = 0; j < side; j++) {
		trace_row(hit, truth, view, (const double[2]){ x, y }, n, side, j);
		for (int i = 0; i < side; i++)
			if (hit[i].prim != RAY_NONE)
				return 1;
	}
	return 0;
}

int truth_reaches(const struct psr_truth *truth, const struct view *view, double x, double y, int n, double z)
{
	struct ray_hit hit[REACH_SIDE];
	for (int j = 0; j < REACH_SIDE; j++) {
		trace_row(hit, truth, view, (const double[2]){ x, y }, n, REACH_SIDE, j);
		for (int i = 0; i < REACH_SIDE; i++)
			if (hit[i].prim == RAY_NONE ? isinf(z) : hit[i].t * truth->scale >= z)
				return 1;
	}
	return 0;
}

/* Traces both ways, since rays pass faces from behind. */
static int is_between(const struct psr_truth *truth, const double from[3], const double to_light[3], double length)
{
	const double off = 1e-4;
	struct ray ray = { { 0 }, { 0 } };
	struct ray_hit hit;
	if (length <= 2 * off)
		return 0;
	v3d_add_scaled(ray.origin, from, off, to_light);
	memcpy(ray.direction, to_light, sizeof ray.direction);
	ray_scene_trace_near(truth->scene, &ray, 1, 0, length - off, &hit);
	if (hit.prim != RAY_NONE)
		return 1;
	v3d_add_scaled(ray.origin, from, length, to_light);
	v3d_scale(ray.direction, to_light, -1);
	ray_scene_trace_near(truth->scene, &ray, 1, 0, length - off, &hit);
	return hit.prim != RAY_NONE;
}

void truth_light(const struct psr_truth *truth, const struct view *view, const struct psr_light *light,
                 const double (*place)[2], int n, struct truth_light *out)
{
	struct ray ray[RUN] = { { { 0 }, { 0 } } };
	struct ray_hit hit[RUN];
	for (int i = 0; i < n; i++)
		truth_ray(truth, view, place[i][0], place[i][1], &ray[i]);
	truth_trace(truth, ray, n, view->near_z, hit);
	for (int i = 0; i < n; i++) {
		double point[3], to_light[3], length = 4, facing = 0, seen = 0;
		const float *normal;
		out[i] = (struct truth_light){ -2, 0 };
		if (hit[i].prim == RAY_NONE)
			continue;
		normal = ray_scene_normal(truth->scene, hit[i].prim);
		v3d_add_scaled(point, ray[i].origin, hit[i].t, ray[i].direction);
		if (light->kind == PSR_LIGHT_DIRECTIONAL) {
			v3d_scale(to_light, light->direction, -1);
			v3d_normalize(to_light, to_light);
		} else {
			for (int k = 0; k < 3; k++)
				to_light[k] = (light->position[k] - truth->origin[k]) / truth->scale - point[k];
			length = v3d_normalize(to_light, to_light);
		}
		for (int k = 0; k < 3; k++) {
			facing += (double)normal[k] * to_light[k];
			seen += (double)normal[k] * ray[i].direction[k];
		}
		out[i].facing = seen > 0 ? -facing : facing;
		out[i].is_shadowed = out[i].facing > 0 && is_between(truth, point, to_light, length);
	}
}

void truth_trace(const struct psr_truth *truth, const struct ray *ray, int n, double near_z, struct ray_hit *hit)
{
	ray_scene_trace(truth->scene, ray, n, near_z / truth->scale, hit);
}

uint64_t truth_attr(const struct psr_truth *truth, const struct ray *ray, const struct ray_hit *hit)
{
	const struct surface_place place = { hit->prim, hit->is_back, hit->u, hit->v };
	double back[3];
	v3d_normalize(back, ray->direction);
	const float facing[3] = { (float)-back[0], (float)-back[1], (float)-back[2] };
	return surface_attr(&truth->surface, &place, 0, facing);
}

static void put_normal(const struct job *job, const struct ray *ray, const struct ray_hit *hit, float normal[3])
{
	const float *n = ray_scene_normal(job->truth->scene, hit->prim);
	double facing = 0;
	for (int k = 0; k < 3; k++)
		facing += (double)n[k] * ray->direction[k];
	v3f_scale(normal, n, facing > 0 ? -1.0f : 1.0f);
}

static void shade_ambient(uint8_t rgb[3], const struct look *look, double facing)
{
	double light[3];
	lobe_ambient(light, look, (const double[3]){ 0, 0, 1 }, (const double[3]){ sqrt(1 - facing * facing), 0, facing });
	for (int c = 0; c < 3; c++)
		rgb[c] = psr_linear_to_srgb(look->unlit ? look->base[c] : (float)light[c]);
}

/* Unfiltered color in ambient light: the rays of a pixel are its filter. */
static void put_color(const struct psr_truth *truth, const struct ray *ray, const struct ray_hit *hit,
                      uint8_t color[4])
{
	const struct surface_place place = { hit->prim, hit->is_back, hit->u, hit->v };
	float side[3];
	v3f_scale(side, ray_scene_normal(truth->scene, hit->prim), hit->is_back ? -1.0f : 1.0f);
	const uint64_t attr = surface_attr(&truth->surface, &place, 0, side);
	const float *n = psr_direction_table()[PSR_ATTR_NORMAL(attr)];
	double to_eye[3], facing;
	struct look look;
	uint8_t leaning[3];
	material_decode(&look, attr);
	v3d_normalize(to_eye, ray->direction);
	facing = -v3d_dot((const double[3]){ (double)n[0], (double)n[1], (double)n[2] }, to_eye);
	facing = fmin(fmax(facing, 0), 1);
	shade_ambient(color, &look, facing);
	shade_ambient(leaning, &look, cos(fmin(acos(facing) + LEANING, M_PI / 2)));
	color[3] = 0;
	for (int c = 0; c < 3; c++) {
		const int change = abs(leaning[c] - color[c]);
		color[3] = change > color[3] ? (uint8_t)change : color[3];
	}
}

static void draw_row(int row, void *userdata)
{
	const struct job *job = userdata;
	struct ray ray[RUN];
	struct ray_hit hit[RUN];
	for (uint32_t first = 0; first < job->n_columns; first += RUN) {
		uint32_t n = job->n_columns - first < RUN ? job->n_columns - first : RUN;
		size_t at = (size_t)row * job->n_columns + first;
		for (uint32_t i = 0; i < n; i++)
			truth_ray(job->truth, &job->view, (first + i + 0.5) / job->side, (row + 0.5) / job->side, &ray[i]);
		truth_trace(job->truth, ray, (int)n, job->view.near_z, hit);
		for (uint32_t i = 0; i < n; i++) {
			int is_met = hit[i].prim != RAY_NONE;
			job->depth[at + i] = is_met ? (float)(hit[i].t * job->truth->scale) : INFINITY;
			if (job->normal != NULL) {
				v3f_set(job->normal[at + i], 0, 0, 0);
				if (is_met)
					put_normal(job, &ray[i], &hit[i], job->normal[at + i]);
			}
			if (job->color != NULL) {
				memset(job->color[at + i], 0, 4);
				if (is_met)
					put_color(job->truth, &ray[i], &hit[i], job->color[at + i]);
			}
		}
	}
}

int psr_truth_draw(const struct psr_truth_shot *shot, uint32_t side, float *depth, float (*normal)[3],
                   uint8_t (*color)[4], struct psr_error *err)
{
	struct job job = { .truth = shot->truth, .side = side, .depth = depth, .normal = normal, .color = color };
	struct psr_pool *pool;
	int rc = view_init(&job.view, shot->camera, shot->width, shot->height, err);
	if (rc != PSR_OK)
		return rc;
	if (side < 1 || side > MOST_SIDE)
		return psr_fail(err, PSR_ERR_ARG, "%u rays along the side of a pixel are not within 1..%d", side, MOST_SIDE);
	rc = psr_pool_create(&pool, shot->n_threads, NULL);
	if (rc != PSR_OK)
		return psr_fail(err, rc, "cannot start %d threads", shot->n_threads);
	job.n_columns = shot->width * side;
	psr_pool_for(pool, (int)(shot->height * side), draw_row, &job);
	psr_pool_destroy(pool);
	return PSR_OK;
}
