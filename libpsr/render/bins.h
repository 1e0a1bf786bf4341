/* Bins: the blocks in view, sorted into tiles. The cull fills them, the warp reads them. */
#ifndef PSR_RENDER_BINS_H
#define PSR_RENDER_BINS_H

#include "plan.h"

/* What draws a block: the warp, or what adds sheer surfaces, thin ones first. A shadow map of glass warps the blocks of
 * its class, and leaves all others to BIN_GLASS, which nothing draws. */
enum bin_kind { BIN_WARPED, BIN_THIN, BIN_GLASS, BIN_KINDS };

/* A block in view, and where it may show. */
struct cull_hit {
	uint32_t slot;
	float near;                 /* a lower bound of its samples' z' */
	uint16_t x0, x1, y0, y1;    /* pixels, inclusive, with the guard band */
	uint16_t instance;
	uint8_t level;
	uint8_t is_mixed : 1, at_border : 1, is_wide : 1; /* as in bin_entry */
	uint8_t kind : 2; /* enum bin_kind */
	uint8_t tile_x0, tile_x1, tile_y0, tile_y1; /* inclusive */
};

/* Capacities are in bytes. */
struct bins {
	struct bin_entry *entry; /* by tile and kind */
	size_t entry_capacity;
	uint32_t *tile_begin;    /* n_tiles + 1 */
	size_t tile_begin_capacity;
	uint32_t *thin_begin, *glass_begin; /* by tile: where its entries of these kinds begin */
	size_t thin_begin_capacity, glass_begin_capacity;
	uint64_t *by_work;       /* tiles, in the lower halves, most entries first: threads wait for the last ones */
	size_t by_work_capacity;
	uint8_t *is_quiet;       /* as plan.is_quiet */
	size_t is_quiet_capacity;
	struct cull_hit *hit;    /* of each chunk together; chunks as they end, in any order */
	size_t hit_capacity;
	uint64_t *cubes;         /* in plans with runs, by hit: of cubes the ones that it draws, bit i: that of slot + i */
	size_t cubes_capacity;
	uint32_t *order;         /* one an entry, for the thread that draws its tile */
	size_t order_capacity;
	/* Of the cull alone. */
	struct cull_chunk *chunk;
	size_t chunk_capacity;
	struct cull_masks *masks; /* by instance */
	size_t masks_capacity;
	struct cull_group *group; /* of all instances */
	size_t group_capacity;
	uint32_t *count;          /* chunk by tile and kind */
	size_t count_capacity;
};

size_t bins_bytes(const struct bins *bins);
void bins_clear(struct bins *bins);

/* Makes room for n elements of one of the arrays, and a quarter more for the next frame; its contents are lost. Returns
 * 0 without memory. */
#define bins_room(bins, array, n) \
	(((bins)->array = bins_room_for((bins)->array, &(bins)->array##_capacity, n, sizeof *(bins)->array)) != NULL)
void *bins_room_for(void *array, size_t *capacity, size_t n, size_t size);

#endif
