/* Sheer: surfaces that let a part of the light through, over the finished picture. */
#ifndef PSR_RENDER_SHEER_H
#define PSR_RENDER_SHEER_H

#include "bins.h"

struct sheer {
	struct sheer_tile *tile; /* scratch, one a thread that has drawn any */
	int n_tiles;
	float *depth;
	size_t depth_size;
	uint64_t n_pixels; /* of the last picture */
};

/* All words of a tile's sheer blocks, by pixel, nearest first. */
struct sheer_list {
	const float *before; /* z' of the opaque surface, which hides words behind it */
	uint32_t *first;     /* by pixel; SHEER_END: none */
	struct sheer_word {
		uint64_t word;
		uint32_t next;
	} *word;
	uint32_t n, capacity;
	int failed;          /* out of memory */
};
#define SHEER_END UINT32_MAX

/* Makes room for more words. MEMORY, also noted in `failed`. */
int sheer_grow(struct sheer_list *list);

static inline void sheer_add(struct sheer_list *list, uint32_t at, uint64_t word)
{
	uint32_t *link = &list->first[at];
	if (list->n == list->capacity && sheer_grow(list))
		return;
	while (*link != SHEER_END && list->word[*link].word < word)
		link = &list->word[*link].next;
	list->word[list->n] = (struct sheer_word){ word, *link };
	*link = list->n++;
}

/* Moves the sheer entries of a tile behind the others, which alone are warped; returns the first of them. In a shadow map
 * blocks that absorb half of the light or more stay, and the other sheer ones cast no shadow. */
uint32_t sheer_begin(const struct plan *plan, const struct bins *bins, uint32_t tile);

/* Lists blocks of a tile: samples as pixels if they are at most a pixel apart and the picture has no splats, else as
 * discs. */
void sheer_list_blocks(struct sheer_list *list, const struct plan *plan, const struct bin_entry *entry, uint32_t n,
                       const struct warp_target *target);

/* A picture without sheer surfaces: sRGB or NULL, and its depths in world units. */
struct sheer_picture {
	uint8_t *rgb;
	const uint8_t *srgb; /* 8 bits of 16-bit linear light */
	float *depth;
	int exponent; /* of the stack */
};

/* Allocates depths, for frames without. NULL without memory. */
float *sheer_depths(struct sheer *sheer, const struct plan *plan);

/* Draws sheer surfaces over the picture, at most the eight nearest of a pixel, from back to front: each hides its opacity's
 * share of the light behind it. The depth becomes the nearest one's where they hide half of the light or
 * more. sheer->n_pixels: pixels with any. A pure function of picture, plan and bins. MEMORY. */
int sheer_draw(struct sheer *sheer, const struct simd *simd, const struct plan *plan, const struct bins *bins,
               const struct sheer_picture *picture, struct psr_pool *pool);
void sheer_clear(struct sheer *sheer);
uint64_t sheer_bytes(const struct sheer *sheer);

#endif
