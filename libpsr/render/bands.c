#include "warp.h"

#define LEAST_ENTRIES 64 /* of a tile that is cut: a few microseconds of work */

/* Of the parts of a tile from top to bottom: how many entries show there. */
static void count_parts(uint32_t count[BANDS_MOST], const struct bins *bins, uint32_t tile, uint32_t top)
{
	for (uint32_t k = 0; k < BANDS_MOST; k++)
		count[k] = 0;
	for (uint32_t e = bins->tile_begin[tile]; e < bins->tile_begin[tile + 1]; e++) {
		const struct cull_hit *hit = &bins->hit[bins->entry[e].hit];
		const uint32_t y = (uint32_t)(hit->y0 + hit->y1) / 2, k = y > top ? (y - top) / PART_HEIGHT : 0;

		count[k < BANDS_MOST ? k : BANDS_MOST - 1]++;
	}
}

static void put(struct band *out, uint32_t *n, uint32_t tile, uint32_t first, uint32_t end)
{
	if (first < end)
		out[(*n)++] = (struct band){ tile, (uint16_t)(first * PART_HEIGHT), (uint16_t)(end * PART_HEIGHT) };
}

/* Cuts a tile into bands of about `share` entries. */
static void cut(struct band *out, uint32_t *n, const struct plan *plan, const struct bins *bins, uint32_t tile,
                uint32_t share)
{
	const uint32_t top = tile / plan->tiles_x * TILE_HEIGHT, left = plan->height - top;
	const uint32_t n_parts = left < TILE_HEIGHT ? (left + PART_HEIGHT - 1) / PART_HEIGHT : BANDS_MOST;
	uint32_t count[BANDS_MOST], first = 0, sum = 0;

	count_parts(count, bins, tile, top);
	for (uint32_t k = 0; k < n_parts; k++) {
		if (sum > 0 && sum + count[k] / 2 > share) {
			put(out, n, tile, first, k);
			first = k;
			sum = 0;
		}
		sum += count[k];
	}
	put(out, n, tile, first, n_parts);
}

uint32_t bands_make(struct band *out, const struct plan *plan, const struct bins *bins, uint32_t levels, int n_threads)
{
	const uint32_t n_tiles = plan->tiles_x * plan->tiles_y, share = bins->tile_begin[n_tiles] / (uint32_t)n_threads;
	const int may_cut = n_threads > 1 && plan->only_points && !levels && !plan->with_splats && !plan->has_sheer;
	uint32_t n = 0;

	for (uint32_t i = 0; i < n_tiles; i++) {
		const uint32_t tile = (uint32_t)bins->by_work[i];
		const uint32_t n_entries = bins->tile_begin[tile + 1] - bins->tile_begin[tile];

		if (may_cut && n_entries >= LEAST_ENTRIES && n_entries > share && !warp_looks(plan, n_entries))
			cut(out, &n, plan, bins, tile, n_entries / 2);
		else
			out[n++] = (struct band){ tile, 0, TILE_HEIGHT };
	}
	return n;
}
