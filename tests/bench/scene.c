#include "scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "child.h"
#include "isolate.h"
#include "base/vec.h"
#include "ours.h"
#include "report.h"

#define RADIANS (3.14159265358979323846 / 180)
#define SWING (15 * RADIANS)
#define MAX_ZOOM 8.0

static void run(const char *const *argv, const char *what)
{
	struct child_use use;

	if (child_run(&use, argv) != 0)
		report_die(what, "psr-model fails on it");
}

struct psr_model *scene_model(const char *psr_model, const char *folder, const char *name, const char *source,
                              int resolution)
{
	struct psr_model *model;
	struct psr_error err;
	char path[4096], number[16];
	const char *argv[] = { psr_model, "build", source, "-o", path, "-r", number, "--quiet", NULL };

	snprintf(path, sizeof path, "%s/%s-%d.psr", folder, name, resolution);
	snprintf(number, sizeof number, "%d", resolution);
	if (psr_model_read(&model, path, &err) == PSR_OK)
		return model;
	fprintf(stderr, "bench: building %s, once\n", path);
	run(argv, source);
	if (psr_model_read(&model, path, &err) != PSR_OK)
		report_die(path, err.text);
	return model;
}

void scene_standard(char path[4096], const char *psr_model, const char *folder, const char *name)
{
	const char *argv[] = { psr_model, "make", name, "-o", path, NULL };

	snprintf(path, 4096, "%s/%s.glb", folder, name);
	if (access(path, R_OK) != 0)
		run(argv, name);
}

void scene_film_camera(struct psr_camera *camera, const struct scene_film *film, int frame)
{
	const struct psr_model_info *info = psr_model_info(film->model);
	const double turn = SWING * sin(2 * 180 * RADIANS * frame / SCENE_FRAMES), s = sin(turn), c = cos(turn);
	double away[3], side[3];

	psr_camera_frame(camera, info->box_min, info->box_max, info->up, SCENE_FOV * RADIANS,
	                 (double)film->picture.width / film->picture.height);
	v3d_sub(away, camera->eye, camera->target);
	v3d_sub(side, info->box_max, info->box_min);
	for (int k = 0; k < 3; k++)
		camera->target[k] += film->aim[k] * side[k] / 2;
	camera->eye[0] = camera->target[0] + c * away[0] + s * away[2];
	camera->eye[1] = camera->target[1] + away[1];
	camera->eye[2] = camera->target[2] - s * away[0] + c * away[2];
	camera->fov_y = 2 * atan(tan(SCENE_FOV / 2 * RADIANS) / film->zoom);
}

void scene_film_frame(struct psr_scene *scene, const struct scene_film *film, int frame)
{
	*scene = (struct psr_scene){
		.instance = &film->instance, .n_instances = 1, .light = &film->light, .n_lights = 1,
		.ambient = { SCENE_AMBIENT, SCENE_AMBIENT, SCENE_AMBIENT },
	};
	scene_film_camera(&scene->camera, film, frame);
}

static void find_zoom(void *arg)
{
	struct scene_film *film = arg;
	double low = 1, high = MAX_ZOOM;

	for (int i = 0; i < 9; i++) {
		film->zoom = sqrt(low * high);
		if (ours_coverage(film, 4) < film->picture.coverage)
			low = film->zoom;
		else
			high = film->zoom;
	}
}

static double magnification_of(const struct scene_film *film)
{
	struct psr_camera camera;
	double away[3];

	scene_film_camera(&camera, film, 0);
	v3d_sub(away, camera.eye, camera.target);
	return psr_model_info(film->model)->spacing * film->picture.height / 2 / tan(camera.fov_y / 2) / v3d_length(away);
}

void scene_film_init(struct scene_film *film, const struct scene_picture *picture, struct psr_model *model,
                     const double aim[3])
{
	*film = (struct scene_film){
		.picture = *picture, .model = model,
		.instance = { .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1 },
		.light = { .kind = PSR_LIGHT_DIRECTIONAL, .direction = { 0.55, -0.6, -0.85 }, .color = { 1, 1, 1 } },
		.zoom = 1,
	};
	if (picture->coverage > 0) {
		struct scene_film *shared = isolate_alloc(sizeof *shared);

		memcpy(film->aim, aim, sizeof film->aim);
		*shared = *film;
		isolate_run(find_zoom, shared);
		film->zoom = shared->zoom;
		isolate_free(shared, sizeof *shared);
	}
	film->magnification = magnification_of(film);
}

void scene_film_magnify(struct scene_film *film, double magnification)
{
	film->zoom *= magnification / film->magnification;
	film->magnification = magnification_of(film);
}

void scene_spread(struct psr_instance *out, const struct scene_film *film, const struct psr_model *model, uint32_t n)
{
	const struct psr_model_info *info = psr_model_info(model);
	const uint32_t across = (uint32_t)ceil(sqrt((double)n));
	struct psr_camera camera;
	double forward[3], right[3], down[3], place[3];

	scene_film_camera(&camera, film, 0);
	v3d_sub(forward, camera.target, camera.eye);
	v3d_normalize(forward, forward);
	v3d_cross(right, forward, camera.up);
	v3d_normalize(right, right);
	v3d_cross(down, forward, right);
	for (uint32_t i = 0; i < n; i++) {
		const double x = (2.0 * (i % across) + 1) / across - 1, y = (2.0 * (i / across) + 1) / across - 1;

		out[i] = (struct psr_instance){ .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1.0 / across };
		for (int k = 0; k < 3; k++)
			place[k] = (info->box_min[k] + info->box_max[k]) / 2;
		v3d_add_scaled(place, place, x * info->scale, right);
		v3d_add_scaled(place, place, y * info->scale, down);
		for (int k = 0; k < 3; k++)
			out[i].translation[k] = place[k] - out[i].scale * (info->box_min[k] + info->box_max[k]) / 2;
	}
}
