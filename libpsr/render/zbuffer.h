/* The hierarchical z-buffer ([G] 7.2): a word a pixel, and levels of coarser cells with a guard band of one cell. */
#ifndef PSR_RENDER_ZBUFFER_H
#define PSR_RENDER_ZBUFFER_H

#include "plan.h"

/* Sets the size of the picture and of each level, 1..PSR_MAX_DEPTH_LEVEL. Returns how many cells the levels in the bit
 * mask have. */
size_t zbuffer_measure(struct psr_zstack *stack, uint32_t width, uint32_t height, uint32_t levels);

/* Places the cells of the levels in use one behind the other; z of other levels becomes NULL. Returns the end. */
float *zbuffer_place_cells(struct psr_zstack *stack, float *cells);

/* Finds how many words to leave between the rows of a picture. Vertical neighbours must differ in the lower 12 bits of
 * their addresses, by which a core tells a load from earlier stores, and lie in different sets of the L1 cache. */
uint32_t warp_gap(uint32_t width);

/* The bits of a tile's parts that a map of the picture's parts marks, and of parts outside of the picture. */
uint32_t warp_parts(const struct plan *plan, const uint8_t *map, uint32_t tile);

/* Words of one tile outside of the stack: they stay in a cache. */
#define WARP_OWN_STRIDE (TILE_WIDTH + 8)
#define WARP_OWN_WORDS (WARP_OWN_STRIDE * TILE_HEIGHT)

/* Makes a target of a tile of the stack, without clean or bare parts. Its words are the stack's, or the WARP_OWN_WORDS
 * of `own` if that is not NULL; its cells are the stack's. */
void warp_target_make(struct warp_target *target, const struct plan *plan, const struct psr_zstack *stack,
                      uint32_t tile, uint64_t *own);

#endif
