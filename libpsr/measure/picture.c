#include <math.h>
#include <string.h>
#include "base/maths.h"
#include "base/pool.h"
#include "base/srgb.h"
#include "base/vec.h"
#include "base/view.h"
#include "placed.h"
#include "view.h"

#define MOST_SIDE 16
#define LEAST_LIGHT (1.0 / 1024) /* what passes all layers so far, and is worth the next */

struct picture {
	const struct psr_scene *scene;
	const struct psr_source *source;
	struct placed placed;
	struct view view;
	uint32_t side;
	const struct psr_source_planes *to;
};

/* Finds the unit direction from a point to a light, its distance, and the share of its intensity that arrives. */
static double arrives(const struct psr_light *light, const double point[3], double to_light[3], double *length)
{
	double amount = 1;

	if (light->kind == PSR_LIGHT_DIRECTIONAL) {
		v3d_scale(to_light, light->direction, -1);
		v3d_normalize(to_light, to_light);
		*length = INFINITY;
		return 1;
	}
	v3d_sub(to_light, light->position, point);
	*length = v3d_normalize(to_light, to_light);
	if (!(*length > 0))
		return 0;
	if (light->reference > 0)
		amount = light->reference / *length * (light->reference / *length);
	if (light->kind == PSR_LIGHT_SPOT) {
		double axis[3];

		v3d_normalize(axis, light->direction);
		const double cosine = -v3d_dot(axis, to_light), inner = cos(light->inner), outer = cos(light->outer);
		const double t = (cosine - outer) / (inner - outer);
		if (!(cosine > outer))
			return 0;
		amount *= cosine < inner ? t * t * (3 - 2 * t) : 1;
	}
	return amount;
}

static void add_lights(const struct picture *picture, const struct source_look *look, const struct placed_point *point,
                       const double to_eye[3], double light[3])
{
	const struct psr_scene *scene = picture->scene;

	for (uint32_t l = 0; l < scene->n_lights; l++) {
		double to_light[3], reflected[3], length;
		double amount = arrives(&scene->light[l], point->at, to_light, &length);

		if (!(amount > 0) || !(v3d_dot(look->normal, to_light) > 0))
			continue;
		if (scene->light[l].casts_shadow)
			amount *= placed_passes(&picture->placed, point, to_light, length);
		brdf_reflect(&look->brdf, look->normal, to_eye, to_light, reflected);
		for (int c = 0; c < 3; c++)
			light[c] += amount * scene->light[l].color[c] * reflected[c];
	}
}

/* Computes the light that a surface sends to the eye. Turns the vectors of `look` to the world. */
static void shade(const struct picture *picture, const struct placed_hit *hit, const struct ray *ray,
                  struct source_look *look, double light[3])
{
	const double (*turn)[3] = (const double(*)[3])hit->instance->turn;
	struct placed_point point;
	double to_eye[3];

	m3d_apply(look->normal, turn, look->normal);
	m3d_apply(look->face, turn, look->face);
	v3d_set(light, look->base[0], look->base[1], look->base[2]);
	if (look->is_unlit)
		return;
	v3d_normalize(to_eye, ray->direction);
	v3d_scale(to_eye, to_eye, -1);
	v3d_add_scaled(point.at, ray->origin, hit->z, ray->direction);
	v3d_set(point.face, look->face[0], look->face[1], look->face[2]);
	brdf_ambient(&picture->source->albedo, &look->brdf, v3d_dot(look->normal, to_eye), light);
	for (int c = 0; c < 3; c++)
		light[c] = look->emission[c] + light[c] * look->occlusion * picture->scene->ambient[c];
	add_lights(picture, look, &point, to_eye, light);
}

/* One ray's share of a pixel. */
struct seen {
	double light[3], coverage, z; /* z: +inf where nothing holds back half of the light */
	double normal[3];
	int is_textured;
};

static void add_layer(const struct picture *picture, const struct source_ray *world, const struct placed_hit *hit,
                      struct seen *seen)
{
	struct source_ray inner;
	struct source_look look;
	double light[3];

	placed_ray(hit->instance, &world->ray, &inner.ray);
	for (int i = 0; i < 2; i++)
		placed_ray(hit->instance, &world->beside[i], &inner.beside[i]);
	source_look_at(picture->source, &inner, &hit->hit, &look);
	const double share = (1 - seen->coverage) * look.opacity;
	if (!(share > 0))
		return;
	shade(picture, hit, &world->ray, &look, light);
	v3d_add_scaled(seen->light, seen->light, share, light);
	if (look.opacity >= 0.5 && isinf(seen->z)) {
		seen->z = hit->z;
		v3d_set(seen->normal, look.normal[0], look.normal[1], look.normal[2]);
		seen->is_textured = look.is_textured;
	}
	seen->coverage += share;
}

static void see(const struct picture *picture, const struct source_ray *ray, const struct placed_hit *first,
                struct seen *seen)
{
	struct placed_hit hit[PLACED_MOST];

	*seen = (struct seen){ .z = INFINITY };
	if (!picture->source->is_layered) {
		if (first->instance != NULL)
			add_layer(picture, ray, first, seen);
	} else {
		const int n = placed_trace_all(&picture->placed, &ray->ray, picture->view.near_z, hit);

		for (int i = 0; i < n && 1 - seen->coverage > LEAST_LIGHT; i++)
			add_layer(picture, ray, &hit[i], seen);
	}
	v3d_add_scaled(seen->light, seen->light, 1 - seen->coverage, picture->scene->background);
}

static void make_ray(const struct picture *picture, double x, double y, struct source_ray *ray)
{
	const double step = 1.0 / picture->side;

	view_ray(&picture->view, x, y, ray->ray.origin, ray->ray.direction);
	view_ray(&picture->view, x + step, y, ray->beside[0].origin, ray->beside[0].direction);
	view_ray(&picture->view, x, y + step, ray->beside[1].origin, ray->beside[1].direction);
}

/* Sees through n points of the picture. */
static void see_all(const struct picture *picture, const double (*place)[2], int n, struct seen *seen)
{
	struct source_ray ray[MOST_SIDE * MOST_SIDE + 1];
	struct ray flat[MOST_SIDE * MOST_SIDE + 1];
	struct placed_hit hit[MOST_SIDE * MOST_SIDE + 1];

	for (int i = 0; i < n; i++) {
		make_ray(picture, place[i][0], place[i][1], &ray[i]);
		flat[i] = ray[i].ray;
	}
	if (!picture->source->is_layered)
		placed_trace(&picture->placed, flat, n, picture->view.near_z, hit);
	for (int i = 0; i < n; i++)
		see(picture, &ray[i], &hit[i], &seen[i]);
}

static void write_pixel(const struct psr_source_planes *to, size_t at, const struct seen *seen, int n_rays)
{
	const struct seen *center = &seen[n_rays];
	double light[3] = { 0 }, coverage = 0, textured = 0, near = INFINITY, far = -INFINITY;

	for (int i = 0; i < n_rays; i++) {
		v3d_add_scaled(light, light, 1.0 / n_rays, seen[i].light);
		coverage += seen[i].coverage / n_rays;
		textured += (double)seen[i].is_textured / n_rays;
		near = fmin(near, seen[i].z);
		far = isinf(seen[i].z) ? far : fmax(far, seen[i].z);
	}
	for (int c = 0; c < 3; c++) {
		if (to->rgb != NULL)
			to->rgb[at][c] = psr_linear_to_srgb((float)light[c]);
		if (to->light != NULL)
			to->light[at][c] = (float)light[c];
		if (to->normal != NULL)
			to->normal[at][c] = (float)center->normal[c];
	}
	if (to->coverage != NULL)
		to->coverage[at] = (float)coverage;
	if (to->textured != NULL)
		to->textured[at] = (float)textured;
	if (to->depth != NULL)
		to->depth[at] = (float)center->z;
	if (to->range != NULL) {
		to->range[at][0] = (float)near;
		to->range[at][1] = (float)far;
	}
}

static void draw_row(int y, void *userdata)
{
	const struct picture *picture = userdata;
	const uint32_t side = picture->side, width = (uint32_t)picture->view.width;
	const int n_rays = (int)(side * side);
	double place[MOST_SIDE * MOST_SIDE + 1][2];
	struct seen seen[MOST_SIDE * MOST_SIDE + 1];

	for (uint32_t x = 0; x < width; x++) {
		for (int i = 0; i < n_rays; i++) {
			place[i][0] = x + ((uint32_t)i % side + 0.5) / side;
			place[i][1] = y + ((uint32_t)i / side + 0.5) / side;
		}
		place[n_rays][0] = x + 0.5;
		place[n_rays][1] = y + 0.5;
		see_all(picture, (const double(*)[2])place, n_rays + 1, seen);
		write_pixel(picture->to, (size_t)y * width + x, seen, n_rays);
	}
}

static int check(const struct psr_source_shot *shot, struct psr_error *err)
{
	const struct psr_scene *scene = shot->scene;

	if (shot->side < 1 || shot->side > MOST_SIDE)
		return psr_fail(err, PSR_ERR_ARG, "%u rays along the side of a pixel are not within 1..%d", shot->side,
		                MOST_SIDE);
	if (scene->n_lights > PSR_MAX_LIGHTS)
		return psr_fail(err, PSR_ERR_LIMIT, "%u lights exceed the limit of %d", scene->n_lights, PSR_MAX_LIGHTS);
	for (uint32_t l = 0; l < scene->n_lights; l++) {
		const int rc = view_check_light(&scene->light[l], err);

		if (rc != PSR_OK)
			return rc;
	}
	if (!view_is_light(scene->ambient) || !view_is_light(scene->background))
		return psr_fail(err, PSR_ERR_ARG, "ambient and background must be within 0..1e9");
	return PSR_OK;
}

int psr_source_draw(const struct psr_source_shot *shot, const struct psr_source_planes *to, struct psr_error *err)
{
	struct picture picture = { .scene = shot->scene, .source = shot->source, .side = shot->side, .to = to };
	struct psr_pool *pool;
	int rc = check(shot, err);

	if (rc == PSR_OK)
		rc = view_init(&picture.view, &shot->scene->camera, shot->width, shot->height, err);
	if (rc != PSR_OK)
		return rc;
	rc = placed_init(&picture.placed, shot->source, shot->scene, err);
	if (rc == PSR_OK)
		rc = psr_pool_create(&pool, shot->n_threads, err);
	if (rc == PSR_OK) {
		psr_pool_for(pool, (int)shot->height, draw_row, &picture);
		psr_pool_destroy(pool);
	}
	placed_fini(&picture.placed);
	return rc;
}
