/* Sheer: draws translucent surfaces over the finished picture. */
#ifndef PSR_RENDER_SHEER_H
#define PSR_RENDER_SHEER_H

#include "bins.h"
#include "slots.h"

/* What was drawn of thin things, or of other sheer surfaces. */
struct sheer_counts {
	int any_blocks;
	uint64_t n_pixels;
};

struct sheer {
	struct sheer_tile *tile; /* scratch, by slot */
	int n_tiles;
	struct slots slots;
	float *depth;
	size_t depth_size;
	float bits[PSR_OPAQUE + 1]; /* of thin things, see thin_tabulate() */
	struct sheer_counts thin, glass; /* of the last picture */
};

void sheer_init(struct sheer *sheer);

#define SHEER_MOST 64 /* words of a pixel: eight layers of eight samples, so that a crowd of panes costs no more */

/* The nearest words of a tile's sheer blocks, in the order of blocks. */
struct sheer_list {
	const float *before; /* by pixel: z' of the opaque surface, which hides words behind it */
	uint32_t *last;      /* by pixel: its last word; SHEER_END: none */
	uint8_t *n_words;    /* by pixel */
	struct sheer_word {
		uint64_t word;
		uint32_t at;     /* its pixel */
		uint32_t former; /* the pixel's word before it */
	} *word;
	uint32_t n, capacity;
	int failed;          /* out of memory */
};
#define SHEER_END UINT32_MAX

#define SHEER_LIST_MOST (TILE_WIDTH * TILE_HEIGHT * SHEER_MOST) /* words of a tile */

/* Makes room for more words, SHEER_LIST_MOST at most. MEMORY, which also sets `failed`. */
int sheer_grow(struct sheer_list *list);

/* Puts a word into the place of the farthest of a pixel that has SHEER_MOST, if it is nearer. */
void sheer_replace(struct sheer_list *list, uint32_t at, uint64_t word);

static inline void sheer_add(struct sheer_list *list, uint32_t at, uint64_t word)
{
	if (list->n_words[at] == SHEER_MOST) {
		sheer_replace(list, at, word);
		return;
	}
	if (list->n == list->capacity && sheer_grow(list))
		return;
	list->n_words[at]++;
	list->word[list->n] = (struct sheer_word){ word, at, list->last[at] };
	list->last[at] = list->n++;
}

/* Finds the mean opacity of a sheer block, 0..1. Returns the class of its shadow. */
int sheer_caster(float *opacity, const struct psr_blocks *blocks, uint32_t block);

/* Lists the words of blocks in a tile. Samples at most a pixel apart are pixels if the picture has no splats; all
 * others are discs. */
void sheer_list_blocks(struct sheer_list *list, const struct simd *simd, const struct plan *plan,
                       const struct bin_entry *entry, uint32_t n, const struct warp_target *target);

/* The picture to draw over: sRGB or NULL, 16 bits a channel if the plan is wide, depths in world units, and the frame if
 * it has other planes, or NULL. */
struct sheer_picture {
	uint8_t *rgb;
	uint16_t *wide[3];
	const uint8_t *srgb; /* 8 bits of 16-bit linear light */
	float *depth;
	const struct psr_frame *planes;
	int exponent; /* of the stack */
};

/* Allocates depths for a frame that has none. Returns NULL without memory. */
float *sheer_depths(struct sheer *sheer, const struct plan *plan);

/* Draws thin things, then the eight nearest other sheer surfaces of each pixel over the picture. Each hides its
 * opacity's share of the light behind it. Where they hide at least half of the light, depth and planes become those of
 * the nearest. Sets the counts of thin things and glass. A pure function of picture, plan and bins. MEMORY,
 * CANCELLED. */
int sheer_draw(struct sheer *sheer, const struct simd *simd, const struct plan *plan, const struct bins *bins,
               const struct sheer_picture *picture, struct psr_pool *pool);
void sheer_clear(struct sheer *sheer);
uint64_t sheer_bytes(const struct sheer *sheer);
uint64_t sheer_most_bytes(uint64_t n_pixels, int n_threads); /* of pictures of so many pixels */

#endif
