/* What the stages of a frame share. The order of the stages is known to pipeline.c alone. */
#ifndef PSR_RENDER_RENDER_H
#define PSR_RENDER_RENDER_H

#include <stdint.h>
#include "psr/pool.h"
#include "psr/render.h"
#include "simd/simd.h"

#define WEIGHT_ONE 256  /* weights are 0..256 */

/* ---- plan: a request, made ready ([G] 7.1) ---- */

struct plan_instance {
	uint32_t first_slot;  /* slot of block b is first_slot + b */
	uint32_t first_group; /* place of the model's group 0 among those of all instances, of which each has n_clusters */
	struct cull_view cull;
};

struct plan {
	uint32_t width, height, tiles_x, tiles_y;
	int perspective;
	int exponent;              /* everything here is world * 2^-exponent, relative to the eye */
	float focal;               /* pixels a unit of x'/z', or of x' if orthographic */
	float near_z;
	/* What a cell covers lies behind scale * z' + offset of it. */
	float gap_scale[PSR_MAX_DEPTH_LEVEL + 1], gap_offset[PSR_MAX_DEPTH_LEVEL + 1];
	uint32_t n_instances, n_lights, n_slots, n_groups;
	struct plan_instance *instance;
	struct warp_instance *warp; /* what warping knows of each */
	struct strip_view view;    /* needs is filled by the cull */
	struct strip_light *light;
	float ambient[3];
	uint16_t background[3];    /* linear, 16 bits */
	uint64_t n_samples;
	void *storage;             /* of all arrays */
	size_t storage_size;
};

int plan_make(struct plan *plan, const struct psr_scene *scene, const struct psr_settings *settings, struct psr_error *err);
void plan_clear(struct plan *plan);

/* Instance that a slot belongs to; the slot must be below n_slots. */
uint32_t plan_find_instance(const struct plan *plan, uint32_t slot);

/* ---- cull: one level of each group of clusters, blocks in view, sorted into tiles ([G] 6.1) ---- */

/* Of a group of clusters, drawn is that of the coarsest level whose spacing is at most a pixel wherever a sphere of the
 * group reaches, so that its blocks need no depth buffer but the picture's; the finest if there is none. */
struct cull_group {
	float stretch;  /* greatest of its clusters: pixels that a unit of camera space can be stretched to */
	uint32_t score; /* of the cluster that is drawn */
};

struct bins {
	struct bin_entry *entry;
	size_t entry_capacity;
	uint32_t *tile_begin;    /* n_tiles + 1 */
	size_t tile_capacity;
	struct cull_chunk *chunk;
	size_t chunk_capacity;
	struct cull_hit *hit;    /* one a block that is left, by chunk */
	size_t hit_capacity;
	struct cull_group *group; /* of all instances */
	size_t group_capacity;
	uint32_t *count;         /* chunk by tile */
	size_t count_capacity;
};

/* Also notes in plan->view what the blocks that are left need. */
int cull_blocks(struct bins *bins, const struct simd *simd, struct plan *plan, struct psr_pool *pool, struct psr_report *report);
size_t bins_bytes(const struct bins *bins);
void bins_clear(struct bins *bins);

/* ---- warp: samples to words and cells, by tile ([G] 7.1, 7.2) ---- */

/* Clears a tile and draws its blocks; returns how many samples fell into it. */
uint64_t warp_tile(const struct simd *simd, const struct plan *plan, const struct bins *bins, struct psr_zstack *stack, uint32_t tile);

/* ---- gaps: weights from the level buffers ([G] 4.6) ---- */

/* Weights of row y: WEIGHT_ONE * (1 - coverage). Returns how many pixels with a sample are below WEIGHT_ONE. */
uint32_t gaps_row(const struct plan *plan, const struct psr_zstack *stack, uint32_t y, uint16_t *weight);

/* ---- shade: words to linear colours ([G] 7.3) ---- */

struct shade_counts {
	uint64_t n_pixels;   /* shaded */
	uint64_t n_specular; /* of these with highlights looked for */
};

/* Writes 16-bit linear light of row y into rgb, from the row's words and weights: of samples, lit, where weights are above
 * 0, and of the background where no sample is. */
void shade_row(const struct simd *simd, const struct plan *plan, struct strip *strip, const uint64_t *word, const uint16_t *weight,
               uint32_t y, uint16_t *rgb, struct shade_counts *counts);

/* ---- fill: pull-push ([G] 4.7, appendix) ---- */

struct fill_level {
	uint32_t width, height;
	uint16_t *rgb;    /* premultiplied with the weight */
	uint16_t *weight;
	float *z;
};

#define FILL_LEVELS 15 /* 2^14 is the largest side */

struct fill {
	struct fill_level level[FILL_LEVELS]; /* level 0 is the picture */
	int n_levels;
	void *storage;    /* of levels above 0 */
	size_t storage_size;
};

int fill_prepare(struct fill *fill, uint32_t width, uint32_t height, uint16_t *rgb, uint16_t *weight, float *z);
void fill_clear(struct fill *fill);

/* Gives every pixel of weight below WEIGHT_ONE its colour and z'. */
void fill_run(struct fill *fill, const struct plan *plan, struct psr_pool *pool, struct psr_report *report);

#endif
