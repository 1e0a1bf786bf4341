#include <math.h>
#include <stdlib.h>
#include "base/mem.h"
#include "base/srgb.h"
#include "base/vec.h"
#include "ray/ray.h"
#include "surface/lobe.h"
#include "surface/surface.h"
#include "base/direction.h"
#include "measure.h"
#include "model/blocks.h"
#include "base/pool.h"
#include "truth.h"

#define RUN 64 /* rays traced together; a multiple of every side */
#define MOST_SIDE 32

struct still {
	const struct psr_truth *truth;
	const struct psr_scene *scene;
	struct view view;
	uint32_t side;
	uint8_t *rgb, *covered;
	double to_light[PSR_MAX_LIGHTS][3];
};

/* Light as in frames, from the surface's attributes. */
static void light_place(const struct still *still, uint64_t attr, const double direction[3], double light[3])
{
	const struct psr_scene *scene = still->scene;
	const float *n = psr_direction_table()[PSR_ATTR_NORMAL(attr)];
	const double normal[3] = { (double)n[0], (double)n[1], (double)n[2] };
	double to_eye[3], ambient[3];
	struct look look;
	material_decode(&look, attr);
	v3d_normalize(to_eye, direction);
	v3d_scale(to_eye, to_eye, -1);
	lobe_ambient(ambient, &look, normal, to_eye);
	for (int c = 0; c < 3; c++)
		light[c] = look.unlit ? (double)look.base[c] : scene->ambient[c] * ambient[c];
	for (uint32_t l = 0; l < scene->n_lights && !look.unlit; l++) {
		double part[3];
		lobe_reflect(part, &look, normal, still->to_light[l], to_eye);
		for (int c = 0; c < 3; c++)
			light[c] += scene->light[l].color[c] * part[c];
	}
	for (int c = 0; c < 3; c++)
		light[c] = fmin(light[c], 1);
}

static void draw_pixel(const struct still *still, uint32_t x, uint32_t y)
{
	const uint32_t side = still->side;
	const size_t at = (size_t)y * (size_t)still->view.width + x;
	double sum[3] = { 0, 0, 0 };
	uint32_t n_met = 0;
	for (uint32_t first = 0; first < side * side; first += RUN) {
		const uint32_t n = side * side - first < RUN ? side * side - first : RUN;
		struct ray ray[RUN];
		struct ray_hit hit[RUN];
		for (uint32_t i = 0; i < n; i++)
			truth_ray(still->truth, &still->view, x + ((first + i) % side + 0.5) / side,
			          y + ((first + i) / side + 0.5) / side, &ray[i]);
		truth_trace(still->truth, ray, (int)n, still->view.near_z, hit);
		for (uint32_t i = 0; i < n; i++) {
			double light[3] = { still->scene->background[0], still->scene->background[1], still->scene->background[2] };
			if (hit[i].prim != RAY_NONE)
				light_place(still, truth_attr(still->truth, &ray[i], &hit[i]), ray[i].direction, light);
			n_met += hit[i].prim != RAY_NONE;
			v3d_add(sum, sum, light);
		}
	}
	for (int c = 0; c < 3; c++)
		still->rgb[3 * at + (size_t)c] = psr_linear_to_srgb((float)(sum[c] / (side * side)));
	still->covered[at] = n_met > 0;
}

static void draw_row(int y, void *userdata)
{
	const struct still *still = userdata;
	for (uint32_t x = 0; x < (uint32_t)still->view.width; x++)
		draw_pixel(still, x, (uint32_t)y);
}

int psr_truth_still(const struct psr_truth_shot *shot, const struct psr_scene *scene, uint32_t side, uint8_t *rgb,
                    uint8_t *covered, struct psr_error *err)
{
	struct still still = { .truth = shot->truth, .scene = scene, .side = side, .rgb = rgb, .covered = covered };
	struct psr_pool *pool;
	int rc = view_init(&still.view, shot->camera, shot->width, shot->height, err);
	if (rc != PSR_OK)
		return rc;
	if (side < 1 || side > MOST_SIDE)
		return psr_fail(err, PSR_ERR_ARG, "%u rays along the side of a pixel are not within 1..%d", side, MOST_SIDE);
	for (uint32_t l = 0; l < scene->n_lights; l++) {
		if (scene->light[l].kind != PSR_LIGHT_DIRECTIONAL)
			return psr_fail(err, PSR_ERR_UNSUPPORTED, "the truth of a still supports directional lights only");
		v3d_normalize(still.to_light[l], scene->light[l].direction);
		v3d_scale(still.to_light[l], still.to_light[l], -1);
	}
	rc = psr_pool_create(&pool, shot->n_threads, NULL);
	if (rc != PSR_OK)
		return psr_fail(err, rc, "cannot start %d threads", shot->n_threads);
	psr_pool_for(pool, (int)shot->height, draw_row, &still);
	psr_pool_destroy(pool);
	return PSR_OK;
}
