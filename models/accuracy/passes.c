#include "passes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "psr/build.h"
#include "compare/compare.h"
#include "measure/measure.h"
#include "psr/mesh.h"
#include "psr/render.h"

#define FOV (35 * 3.14159265358979323846 / 180)
#define RAYS 16  /* along the side of a pixel */
#define TRIALS 3 /* runs of a pass; the quickest counts */
#define MOST_SIDE 4096

struct passes {
	struct psr_model *model;
	struct psr_mesh *mesh;
	struct psr_truth *truth;
	struct psr_renderer *renderer;
	struct psr_pool *pool;
	uint8_t *truth_rgb, *covered, *rgb;
	uint32_t side;
};

/* A square picture in which samples of the finest level are as far apart as so many pixels, at the camera's target. */
static int make_scene(struct passes *p, struct psr_scene *scene, struct psr_instance *instance, struct psr_light *light,
                      double magnification, struct psr_error *err)
{
	const struct psr_model_info *info = psr_model_info(p->model);
	double distance = 0, side;

	psr_camera_frame(&scene->camera, info->box_min, info->box_max, info->up, FOV, 1);
	for (int i = 0; i < 3; i++)
		distance += pow(scene->camera.target[i] - scene->camera.eye[i], 2);
	side = 2 * sqrt(distance) * tan(FOV / 2) / info->spacing * magnification;
	if (!(side >= 1 && side <= MOST_SIDE))
		return psr_fail(err, PSR_ERR_LIMIT, "at magnification %g the picture would have %.0f pixels a side; 1 to %d are drawn",
		                magnification, side, MOST_SIDE);
	p->side = (uint32_t)(side + 0.5);
	*instance = (struct psr_instance){ .model = p->model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	psr_light_key(light, &scene->camera);
	scene->instance = instance;
	scene->n_instances = 1;
	scene->light = light;
	scene->n_lights = 1;
	for (int i = 0; i < 3; i++) {
		scene->ambient[i] = 0.15;
		scene->background[i] = 0.02;
	}
	return PSR_OK;
}

static int load(struct passes *p, const char *source, const char *model, struct psr_error *err)
{
	int code = psr_model_read(&p->model, model, err);

	if (code == PSR_OK)
		code = psr_mesh_import(&p->mesh, source, NULL, err);
	if (code == PSR_OK)
		code = psr_truth_create(&p->truth, p->mesh, err);
	if (code == PSR_OK)
		code = psr_renderer_create(&p->renderer, err);
	return code;
}

static int draw_passes(struct passes *p, const struct psr_scene *scene, unsigned n_passes, struct psr_error *err)
{
	const uint64_t n = (uint64_t)p->side * p->side;
	struct psr_settings settings;
	int code = PSR_OK;

	psr_settings_default(&settings, p->side, p->side);
	printf("%ux%u pixels\npass  sub-pixels      dB      ms\n", p->side, p->side);
	for (unsigned pass = 0; code == PSR_OK && pass <= n_passes; pass++) {
		struct psr_frame frame = { .width = p->side, .height = p->side, .rgb = p->rgb };
		uint64_t least = UINT64_MAX;

		settings.pass = pass;
		for (int trial = 0; code == PSR_OK && trial < TRIALS; trial++) {
			uint64_t start = clock_ns(), ns;

			code = psr_render(p->renderer, scene, &settings, p->pool, &frame, err);
			ns = clock_ns() - start;
			least = ns < least ? ns : least;
		}
		if (code == PSR_OK)
			printf("%4u  %6ux%-2u  %8.2f  %6.1f\n", pass, 1u << pass, 1u << pass,
			       compare_psnr(p->rgb, p->truth_rgb, p->covered, n), (double)least / 1e6);
	}
	return code;
}

static int measure(struct passes *p, const char *source, const char *model, double magnification, unsigned n_passes,
                   struct psr_error *err)
{
	struct psr_build_options options;
	struct psr_scene scene = { 0 };
	struct psr_instance instance;
	struct psr_light light;
	int code = load(p, source, model, err);

	psr_build_options_default(&options);
	if (code == PSR_OK)
		code = make_scene(p, &scene, &instance, &light, magnification, err);
	if (code == PSR_OK)
		code = psr_pool_create(&p->pool, options.n_threads, NULL);
	if (code != PSR_OK)
		return code;
	p->rgb = malloc((size_t)p->side * p->side * 7);
	if (p->rgb == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for pictures of %ux%u pixels", p->side, p->side);
	p->truth_rgb = p->rgb + (size_t)p->side * p->side * 3;
	p->covered = p->truth_rgb + (size_t)p->side * p->side * 3;
	const struct psr_truth_shot shot = { p->truth, &scene.camera, p->side, p->side, options.n_threads };
	code = psr_truth_still(&shot, &scene, RAYS, p->truth_rgb, p->covered, err);
	return code == PSR_OK ? draw_passes(p, &scene, n_passes, err) : code;
}

int accuracy_passes(const char *source, const char *model, double magnification, unsigned n_passes, struct psr_error *err)
{
	struct passes p = { 0 };
	int code = measure(&p, source, model, magnification, n_passes, err);

	psr_pool_destroy(p.pool);
	psr_renderer_destroy(p.renderer);
	psr_truth_destroy(p.truth);
	psr_mesh_destroy(p.mesh);
	psr_model_unref(p.model);
	free(p.rgb);
	return code;
}
