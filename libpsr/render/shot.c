#include <string.h>
#include "base/srgb.h"
#include "psr/shot.h"

#define FOV (35 * 3.14159265358979323846 / 180)
#define AMBIENT 0.15

void psr_shot_default(struct psr_shot *shot, uint32_t width, uint32_t height)
{
	memset(shot, 0, sizeof *shot);
	psr_settings_default(&shot->settings, width, height);
	shot->settings.smooth = PSR_SMOOTH_EDGES;
	shot->planes = 1 << PSR_PLANE_COLOR;
	shot->fov_y = FOV;
	shot->ambient = AMBIENT;
	memcpy(shot->background, "\x20\x24\x28", 3);
}

static int draw(const struct psr_shot *shot, const struct psr_scene *scene, struct psr_frame *frame,
                struct psr_error *err)
{
	struct psr_renderer *renderer = NULL;
	struct psr_pool *pool = NULL;
	int rc = psr_renderer_create(&renderer, err);

	if (rc == PSR_OK)
		rc = psr_pool_create(&pool, 0, err);
	if (rc == PSR_OK)
		rc = psr_render(renderer, scene, &shot->settings, pool, frame, err);
	psr_pool_destroy(pool);
	psr_renderer_destroy(renderer);
	return rc;
}

int psr_shot_draw(const struct psr_shot *shot, struct psr_model *model, struct psr_frame *frame, struct psr_error *err)
{
	const struct psr_model_info *info = psr_model_info(model);
	const struct psr_instance instance = { .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	struct psr_light key;
	struct psr_scene scene = { .instance = &instance, .n_instances = 1, .light = shot->light,
		                       .n_lights = shot->n_lights };
	int rc = psr_frame_alloc(frame, shot->settings.width, shot->settings.height, shot->planes, err);

	if (rc)
		return rc;
	for (int k = 0; k < 3; k++) {
		scene.ambient[k] = shot->ambient;
		scene.background[k] = (double)psr_srgb_to_linear[shot->background[k]];
	}
	if (shot->camera != NULL)
		scene.camera = *shot->camera;
	else
		psr_camera_frame(&scene.camera, info->box_min, info->box_max, info->up, shot->fov_y,
		                 (double)frame->width / frame->height);
	if (shot->n_lights == 0) {
		psr_light_key(&key, &scene.camera);
		scene.light = &key;
		scene.n_lights = 1;
	}
	rc = draw(shot, &scene, frame, err);
	if (rc)
		psr_frame_free(frame);
	return rc;
}
