/* A small model with everything in it: two projections, two levels, three clusters in two groups, six blocks with three
 * visibility masks, two cameras, three lights. */
#ifndef MODEL_FIXTURE_H
#define MODEL_FIXTURE_H

#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include "model/blocks.h"

#define FIXTURE_BLOCKS 6
#define FIXTURE_SAMPLES 143
#define FIXTURE_MASKS 3

struct fixture {
	struct psr_model_info info;
	struct psr_blocks blocks; /* points to the arrays below */
	struct psr_projection projection[2];
	struct psr_cluster cluster[3];
	int16_t center[3][FIXTURE_BLOCKS];
	struct psr_run run;
	int8_t cone[3][FIXTURE_BLOCKS];
	uint8_t cone_sine[FIXTURE_BLOCKS], traits[FIXTURE_BLOCKS], opacity[FIXTURE_SAMPLES];
	uint8_t block_projection[FIXTURE_BLOCKS], flags[FIXTURE_BLOCKS];
	uint16_t radius[FIXTURE_BLOCKS];
	uint16_t attr_offset[FIXTURE_BLOCKS], depth[FIXTURE_SAMPLES];
	uint64_t mask[FIXTURE_BLOCKS], attr[FIXTURE_SAMPLES], visibility_mask[FIXTURE_MASKS][2];
	uint8_t visibility_index[FIXTURE_BLOCKS];
	struct psr_presets presets; /* points to the arrays below */
	struct psr_preset_camera camera[2];
	struct psr_preset_light light[3];
};

static inline uint64_t fixture_random(uint64_t *state)
{
	*state ^= *state << 13;
	*state ^= *state >> 7;
	*state ^= *state << 17;
	return *state;
}

static inline void fixture_init(struct fixture *f, int with_optional)
{
	/* 1 + 64 + 32 + 2 + 8 + 36 samples */
	static const uint64_t masks[FIXTURE_BLOCKS] = { 0x8000000000000000, UINT64_MAX, 0x00ff00ff00ff00ff, 0x11,
		                                            0x0101010101010101, 0xfffffffff0000000 };
	static const struct psr_cluster clusters[3] = {
		{ { 0.25f, 0, 0 }, 0.5f, 0, 3, 0, 0, { 0 } },
		{ { -0.25f, 0, 0 }, 0.5f, 3, 2, 1, 0, { 0 } },
		{ { 0, 0, 0 }, 1, 5, 1, 0, 1, { 0 } },
	};
	static const uint8_t levels[FIXTURE_BLOCKS] = { 0, 0, 0, 0, 0, 1 };
	uint64_t state = 0x243f6a8885a308d3u;
	uint32_t n = 0;

	memset(f, 0, sizeof *f);
	f->info = (struct psr_model_info){ .origin = { 500000.25, 5e6, -1e-3 }, .scale = 12.5, .box_min = { 1, 2, 3 },
		                               .box_max = { 4, 5, 6 }, .up = { 0, 0.6, 0.8 }, .spacing = 0.01, .tolerance = 1.2, .resolution = 256,
		                               .n_trials = 1000000, .n_missing = 3, .n_lost = 1,
		                               .builder = "test 1.0" };
	for (int i = 0; i < 2; i++) {
		for (int k = 0; k < 3; k++)
			f->projection[i].axis[k][(k + i) % 3] = 1;
		f->projection[i].spacing = 0.0625f / (float)(i + 1);
	}
	memcpy(f->cluster, clusters, sizeof clusters);
	memcpy(f->mask, masks, sizeof masks);
	for (int i = 0; i < FIXTURE_BLOCKS; i++) {
		for (int k = 0; k < 3; k++)
			f->center[k][i] = (int16_t)(2048 * (i - 2 + k)); /* eighths */
		f->radius[i] = 8192;                                 /* a quarter */
		f->cone[i % 3][i] = 127;
		f->cone[(i + 1) % 3][i] = (int8_t)(20 * i);
		f->cone_sine[i] = i == 4 ? PSR_CONE_ANY : (uint8_t)(50 * i);
		f->traits[i] = (uint8_t)(i % 4);
		f->block_projection[i] = (uint8_t)(i % 2);
		f->flags[i] = (uint8_t)(levels[i] | 6 << 3 | (i % 3 == 0 ? PSR_BLOCK_TWO_SIDED : 0));
		f->attr_offset[i] = (uint16_t)n;
		f->visibility_index[i] = (uint8_t)(i * i % FIXTURE_MASKS);
		for (int s = 0; s < PSR_BLOCK_SAMPLES; s++) {
			if (f->mask[i] >> s & 1) {
				f->depth[n] = (uint16_t)fixture_random(&state);
				f->opacity[n] = (uint8_t)(37 * n);
				f->attr[n++] = fixture_random(&state);
			}
		}
	}
	for (int i = 0; i < FIXTURE_MASKS; i++)
		for (int w = 0; w < 2; w++)
			f->visibility_mask[i][w] = fixture_random(&state);
	if (n != FIXTURE_SAMPLES)
		abort();
	f->blocks = (struct psr_blocks){
		.n_blocks = FIXTURE_BLOCKS, .n_projections = 2, .n_clusters = 3, .n_levels = 2, .n_samples = FIXTURE_SAMPLES,
		.projection = f->projection, .cluster = f->cluster, .run = &f->run,
		.sphere_x = f->center[0], .sphere_y = f->center[1], .sphere_z = f->center[2], .sphere_r = f->radius,
		.block_projection = f->block_projection, .flags = f->flags, .mask = f->mask, .attr_offset = f->attr_offset,
		.depth = f->depth, .attr = f->attr,
	};
	if (with_optional) {
		f->presets = (struct psr_presets){ .n_cameras = 2, .n_lights = 3, .camera = f->camera, .light = f->light };
		f->camera[0] = (struct psr_preset_camera){
			"front", { { 0, 0, 5 }, { 0, 0, 0 }, { 0, 1, 0 }, PSR_CAMERA_PERSPECTIVE, 0.75, 0, 0.5 }
		};
		f->camera[1] = (struct psr_preset_camera){
			"S\303\274dwand", { { 1, 2, 3 }, { 4, 5, 6 }, { 0, 0, 1 }, PSR_CAMERA_ORTHOGRAPHIC, 0, 2.5, 0 }
		};
		f->light[0] = (struct psr_preset_light){ "sun", { .kind = PSR_LIGHT_DIRECTIONAL, .direction = { 0, -1, 0 },
			                                              .color = { 3, 2, 1 } } };
		f->light[1] = (struct psr_preset_light){ "lamp", { .kind = PSR_LIGHT_POINT, .position = { 1, 2, 3 },
			                                               .color = { 50, 40, 30 }, .reference = 1 } };
		f->light[2] = (struct psr_preset_light){ "beam", { .kind = PSR_LIGHT_SPOT, .position = { 1, 2, 3 },
			                                               .direction = { 1, 0, 0 }, .color = { 50, 40, 30 },
			                                               .inner = 0.25, .outer = 0.5, .reference = 1 } };
		f->blocks.cone_x = f->cone[0];
		f->blocks.cone_y = f->cone[1];
		f->blocks.cone_z = f->cone[2];
		f->blocks.cone_sine = f->cone_sine;
		f->blocks.traits = f->traits;
		f->blocks.opacity = f->opacity;
		f->blocks.n_masks = FIXTURE_MASKS;
		f->blocks.visibility_index = f->visibility_index;
		f->blocks.visibility_mask = (const uint64_t(*)[2])f->visibility_mask;
	}
}

#endif
