/* Sheer: draws translucent surfaces over the finished picture. */
#ifndef PSR_RENDER_SHEER_H
#define PSR_RENDER_SHEER_H

#include "bins.h"

struct sheer {
	struct sheer_tile *tile; /* scratch, one a thread */
	int n_tiles;
	float *depth;
	size_t depth_size;
	uint64_t n_pixels; /* of the last picture */
};

#define SHEER_MOST 64 /* words of a pixel: eight layers of eight samples, so that a crowd of panes costs no more */

/* The nearest words of a tile's sheer blocks: a list a pixel, nearest first. */
struct sheer_list {
	const float *before; /* z' of the opaque surface, which hides words behind it */
	uint32_t *first;     /* by pixel; SHEER_END: none */
	uint8_t *n_words;    /* by pixel */
	struct sheer_word {
		uint64_t word;
		uint32_t next;
	} *word;
	uint32_t n, capacity;
	int failed;          /* out of memory */
};
#define SHEER_END UINT32_MAX

/* Makes room for more words. MEMORY, which also sets `failed`. */
int sheer_grow(struct sheer_list *list);

static inline void sheer_add(struct sheer_list *list, uint32_t at, uint64_t word)
{
	uint32_t *link = &list->first[at], *last, to = list->n;

	if (list->n_words[at] < SHEER_MOST && list->n == list->capacity && sheer_grow(list))
		return;
	while (*link != SHEER_END && list->word[*link].word < word)
		link = &list->word[*link].next;
	if (list->n_words[at] < SHEER_MOST) {
		list->n_words[at]++;
		list->n++;
	} else if (*link != SHEER_END) { /* takes the place of the farthest */
		for (last = link; list->word[*last].next != SHEER_END;)
			last = &list->word[*last].next;
		to = *last;
		*last = SHEER_END;
	} else {
		return;
	}
	list->word[to] = (struct sheer_word){ word, *link };
	*link = to;
}

/* Moves a tile's sheer entries behind its opaque ones, and returns the first sheer one. The warp draws the opaque ones.
 * In a shadow map a block that absorbs at least half of the light counts as opaque, and other sheer blocks cast no
 * shadow. */
uint32_t sheer_begin(const struct plan *plan, const struct bins *bins, uint32_t tile);

/* Lists the words of blocks in a tile. Samples at most a pixel apart are pixels if the picture has no splats; all
 * others are discs. */
void sheer_list_blocks(struct sheer_list *list, const struct plan *plan, const struct bin_entry *entry, uint32_t n,
                       const struct warp_target *target);

/* The picture to draw over: sRGB or NULL, and depths in world units. */
struct sheer_picture {
	uint8_t *rgb;
	const uint8_t *srgb; /* 8 bits of 16-bit linear light */
	float *depth;
	int exponent; /* of the stack */
};

/* Allocates depths for a frame that has none. Returns NULL without memory. */
float *sheer_depths(struct sheer *sheer, const struct plan *plan);

/* Draws the eight nearest sheer surfaces of each pixel over the picture. Each hides its opacity's share of the light
 * behind it. Where they hide at least half of the light, the depth becomes that of the nearest. Sets sheer->n_pixels to
 * how many pixels have sheer surfaces. A pure function of picture, plan and bins. MEMORY. */
int sheer_draw(struct sheer *sheer, const struct simd *simd, const struct plan *plan, const struct bins *bins,
               const struct sheer_picture *picture, struct psr_pool *pool);
void sheer_clear(struct sheer *sheer);
uint64_t sheer_bytes(const struct sheer *sheer);

#endif
