/* A model built from a small mesh, and all of its samples by themselves, for tests of the sampler. */
#ifndef TESTS_SAMPLE_MODEL_H
#define TESTS_SAMPLE_MODEL_H

#include "base/vec.h"
#include "psr/build.h"
#include "sample/own/kept.h"
#include "sample/project/sheet.h"
#include "meshes.h"

static inline struct psr_model *model_build(const struct psr_mesh *mesh, uint32_t resolution)
{
	struct psr_build_options options;
	struct psr_model *model = NULL;
	struct psr_error err = { .text = "" };

	psr_build_options_default(&options);
	options.resolution = resolution;
	options.n_threads = 2;
	if (psr_model_build(&model, mesh, &options, NULL, &err) != PSR_OK)
		fail_msg("%s", err.text);
	return model;
}

/* What several groups have is there for each of them. */
struct model_sample {
	float p[3];
	uint32_t group;
	uint8_t level, two_sided;
	uint16_t projection;
	int row, col;
	uint64_t attr;
};

/* n_samples of them; free() it. */
static inline struct model_sample *model_samples(const struct psr_blocks *b)
{
	struct model_sample *list = malloc(b->n_samples * sizeof *list), *out = list;

	for (uint32_t c = 0; c < b->n_clusters; c++) {
		for (uint32_t i = b->cluster[c].first_block; i < b->cluster[c].first_block + b->cluster[c].n_blocks; i++) {
			const struct psr_projection *projection = &b->projection[b->block_projection[i]];
			double spacing = (double)projection->spacing * (double)(1u << psr_blocks_level(b, i)), inner[3];
			uint32_t k = psr_blocks_attr_first(b, i);
			struct psr_place place;

			psr_blocks_place(b, i, &place);
			for (uint64_t left = b->mask[i]; left != 0; left &= left - 1, k++, out++) {
				int s = __builtin_ctzll(left);
				float z = psr_place_depth(&place, b->depth[k]);

				*out = (struct model_sample){ .group = b->cluster[c].group, .level = (uint8_t)psr_blocks_level(b, i),
					                          .two_sided = (b->flags[i] & PSR_BLOCK_TWO_SIDED) != 0,
					                          .projection = b->block_projection[i],
					                          .row = ((int)place.row >> psr_blocks_level(b, i)) + s / 8,
					                          .col = ((int)place.col >> psr_blocks_level(b, i)) + s % 8, .attr = b->attr[k] };
				projection_inner(projection, (out->col + (out->row & 1) / 2.0) * spacing,
				             out->row * 0.86602540378443864676 * spacing, (double)z, inner);
				v3f_set(out->p, (float)inner[0], (float)inner[1], (float)inner[2]);
			}
		}
	}
	assert_int_equal(out - list, b->n_samples);
	return list;
}

struct model_built {
	struct psr_mesh *mesh;
	struct psr_model *model;
	const struct psr_blocks *blocks;
	struct model_sample *sample;
};

static inline void model_open(struct model_built *built, struct psr_mesh *mesh, uint32_t resolution, uint32_t n_levels)
{
	built->mesh = mesh;
	built->model = model_build(mesh, resolution);
	built->blocks = psr_model_blocks(built->model);
	built->sample = model_samples(built->blocks);
	assert_int_equal(built->blocks->n_levels, n_levels);
}

static inline void model_close(struct model_built *built, void (*mesh_free)(struct psr_mesh *mesh))
{
	free(built->sample);
	psr_model_unref(built->model);
	mesh_free(built->mesh);
}

/* Those of a level by cells of a pixel of it, number in the list in `patch`; group in `projection`. kept_fini(). */
static inline void model_map(struct kept *map, const struct model_sample *list, uint64_t n, unsigned level, double ds)
{
	assert_int_equal(kept_init(map, ds), PSR_OK);
	for (uint64_t i = 0; i < n; i++) {
		struct kept_sample sample = { .projection = list[i].group, .patch = (uint32_t)i };

		if (list[i].level != level)
			continue;
		memcpy(sample.position, list[i].p, sizeof sample.position);
		assert_int_equal(kept_add(map, &sample), PSR_OK);
	}
}

/* Distance to the nearest of them within a pixel, of a group or of any (UINT32_MAX); INFINITY. */
static inline float model_nearest(const struct kept *map, const float p[3], uint32_t group)
{
	float least = INFINITY;
	int at[3];

	for (int i = 0; i < 27; i++) {
		for (int k = 0; k < 3; k++)
			at[k] = (int)floor((double)p[k] / map->grid.width) + (k == 0 ? i % 3 : k == 1 ? i / 3 % 3 : i / 9) - 1;
		for (uint32_t c = grid_first(&map->grid, at); c != GRID_NONE; c = map->sample[c].next) {
			float d[3];

			v3f_sub(d, map->sample[c].position, p);
			if (group == UINT32_MAX || map->sample[c].projection == group)
				least = fminf(least, v3f_length(d));
		}
	}
	return least;
}

#endif
