/* A tile's sheer surfaces while they are drawn. */
#ifndef PSR_RENDER_SHEER_TILE_H
#define PSR_RENDER_SHEER_TILE_H

#include <stdatomic.h>
#include "base/root.h"
#include "shade.h"
#include "sheer.h"
#include "zbuffer.h"

struct sheer_span {
	uint32_t begin, end;
};

/* A tile's layers, in rows WARP_OWN_STRIDE apart, from the first column of an area on. */
struct sheer_tile {
	struct sheer_list list;
	uint32_t last[WARP_OWN_WORDS]; /* of the list */
	uint8_t n_words[WARP_OWN_WORDS];
	uint64_t word[WARP_OWN_WORDS]; /* of the layer that is drawn */
	float beyond[WARP_OWN_WORDS];  /* z' where the layer ends */
	float before[WARP_OWN_WORDS];  /* z' of the opaque picture */
	float first[WARP_OWN_WORDS];   /* z' of the nearest layer, or infinity */
	uint64_t front[WARP_OWN_WORDS]; /* its word; of frames with planes */
	float through[WARP_OWN_WORDS]; /* share of the light behind that the layers let through */
	float light[3][WARP_OWN_WORDS];
	uint32_t veil[WARP_OWN_WORDS]; /* of thin things, see simd/veil.h */
	uint8_t is_done[TILE_HEIGHT][TILE_WIDTH / STRIP]; /* strips without words beyond their layers */
	struct sheer_span shown[TILE_HEIGHT]; /* by row: the columns of pixels that show layers */
	struct strip_pixels pixels;
	struct strip strip;
};

struct sheer_drawing {
	const struct simd *simd;
	const struct plan *plan;
	const struct bins *bins;
	const struct sheer_picture *picture;
	struct sheer *sheer;
	float to_world[2], to_stack[2]; /* two factors each: their product may be beyond a float */
	struct sheer_sum {
		atomic_int any_blocks;
		_Atomic uint64_t n_pixels;
	} thin, glass;
	atomic_int failed;
};

/* Pixels of a tile: columns x0 .. x0 + width - 1, and rows low_y .. high_y - 1 of those from y0 on. */
struct sheer_area {
	uint32_t x0, y0, width, low_y, high_y;
};

/* Entries of the bins, begin .. end - 1. */
struct sheer_entries {
	uint32_t begin, end;
};

/* The light of a strip's 16 bits. */
static inline float sheer_light(const struct plan *plan, uint16_t color)
{
	return plan->is_wide ? psr_light_of_root(color) : (float)color * (1.0f / 65535);
}

static inline size_t sheer_place(const struct sheer_area *area, uint32_t y)
{
	return (size_t)(y - area->y0) * WARP_OWN_STRIDE;
}

/* Notes the pixels, in order, that a strip from column x on shows. */
static inline void sheer_show(struct sheer_tile *l, const struct sheer_area *area, uint32_t y, uint32_t x, uint32_t n)
{
	struct sheer_span *shown = &l->shown[y - area->y0];
	const uint16_t *at = l->pixels.x;

	if (n == 0)
		return;
	shown->begin = x + at[0] < shown->begin ? x + at[0] : shown->begin;
	shown->end = x + at[n - 1] >= shown->end ? x + at[n - 1] + 1 : shown->end;
}

#endif
