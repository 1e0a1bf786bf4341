#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include "base/random.h"
#include "base/vec.h"
#include "world.h"

/* Random blocks of random colours; every sample has a depth of its own. */
static struct hard_block *random_blocks(struct psr_projection projection[8], uint64_t *seed)
{
	struct hard_block *block = calloc(HARD_BLOCKS, sizeof *block);

	assert_non_null(block);
	for (int p = 0; p < 8; p++) {
		double d[3];

		hard_direction(d, seed);
		projection[p] = hard_projection(d[0], d[1], d[2], 1.0 / 64);
	}
	for (int b = 0; b < HARD_BLOCKS; b++) {
		const double z = random_in(seed, -0.5, 0.5);
		double normal[3];

		hard_direction(normal, seed);
		block[b].projection = random_below(seed, 8);
		block[b].col = (int)random_below(seed, 60) - 30;
		block[b].row = 2 * ((int)random_below(seed, 30) - 15);
		block[b].mask = random_next(seed) | 1;
		block[b].flags = random_below(seed, 2) ? PSR_BLOCK_TWO_SIDED : 0;
		for (int i = 0; i < 64; i++) {
			block[b].depth[i] = z + random_in(seed, 0, 0.05);
			block[b].attr[i] = hard_attr(normal, random_below(seed, 3) ? 0 : 0xffff, random_below(seed, 256));
			block[b].attr[i] ^= (uint64_t)random_below(seed, 1 << 24) << 16;
		}
	}
	return block;
}

struct psr_model *hard_world_model(const struct hard_world *w, const struct hard_block *block, uint32_t n)
{
	return hard_model(&(struct hard_model){ .projection = w->projection, .n_projections = 8 }, block, n);
}

/* A lit scene whose blocks need no and some depth buffers. */
static struct psr_scene random_scene(struct psr_instance *instance, struct psr_light light[2], uint64_t *seed)
{
	struct psr_scene scene = { .instance = instance, .n_instances = 1, .light = light, .n_lights = 2,
		                       .ambient = { 0.2, 0.1, 0.3 } };
	double d[3];

	hard_direction(d, seed);
	hard_direction(scene.camera.up, seed);
	v3d_scale(scene.camera.eye, d, exp2(random_in(seed, 0, 2.5)));
	scene.camera.fov_y = 0.9;
	scene.camera.ortho_height = random_in(seed, 0.5, 2);
	scene.camera.kind = random_below(seed, 3) ? PSR_CAMERA_PERSPECTIVE : PSR_CAMERA_ORTHOGRAPHIC;
	light[0] = (struct psr_light){ .kind = PSR_LIGHT_DIRECTIONAL, .color = { 0.6, 0.5, 0.4 }, .casts_shadow = 1 };
	hard_direction(light[0].direction, seed);
	light[1] = (struct psr_light){ .kind = PSR_LIGHT_SPOT, .color = { 0.3, 0.6, 0.9 }, .inner = 0.3, .outer = 0.9,
		                           .reference = 2, .casts_shadow = 1 };
	hard_direction(light[1].direction, seed);
	v3d_scale(light[1].position, light[1].direction, -2);
	return scene;
}

void hard_world_make(struct hard_world *w, uint64_t *seed)
{
	w->block = random_blocks(w->projection, seed);
	w->model = hard_world_model(w, w->block, HARD_BLOCKS);
	w->instance = hard_place(w->model);
	w->scene = random_scene(&w->instance, w->light, seed);
}

void hard_world_clear(struct hard_world *w)
{
	psr_model_unref(w->model);
	free(w->block);
}
