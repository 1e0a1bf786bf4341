#include "base/maths.h"
#include "cull.h"
#include "warp.h"

#define LOOK_EVERY 1024 /* blocks drawn between two looks at the tile */
#define WORTH 16        /* stop looking unless a look skips one block in so many */
#define KEYS 1024

struct occlusion {
	uint32_t far[FAR_CELLS];
	int is_known;
};

/* Ascending with depth; blocks that begin at the eye or behind it come first. */
static uint32_t depth_of(const struct bins *bins, uint32_t entry)
{
	const float near = bins->hit[bins->entry[entry].hit].near;

	return near > 0 ? psr_bits_from_float(near) : 0;
}

/* Counting sort by the upper bits of depth; stable. Returns 0 if the frame was cancelled. */
static int sort_by_depth(const struct plan *plan, const struct bins *bins, uint32_t begin, uint32_t end)
{
	uint32_t low = UINT32_MAX, high = 0, count[KEYS + 1] = { 0 };

	for (uint32_t e = begin; e < end; e++) {
		const uint32_t depth = depth_of(bins, e);

		if (plan_is_cancelled_at(plan, e))
			return 0;
		low = depth < low ? depth : low;
		high = depth > high ? depth : high;
	}
	int shift = 0;
	while ((high - low) >> shift >= KEYS)
		shift++;
	for (uint32_t e = begin; e < end; e++) {
		if (plan_is_cancelled_at(plan, e))
			return 0;
		count[((depth_of(bins, e) - low) >> shift) + 1]++;
	}
	for (int k = 0; k < KEYS; k++)
		count[k + 1] += count[k];
	for (uint32_t e = begin; e < end; e++) {
		if (plan_is_cancelled_at(plan, e))
			return 0;
		bins->order[begin + count[(depth_of(bins, e) - low) >> shift]++] = e;
	}
	return 1;
}

/* Whether all pixels that the block can change are nearer already. Cells of level k matter up to two cells away; those
 * pixels must be in this tile, too. */
static int is_occluded(const struct occlusion *o, const struct warp_target *t, const struct cull_hit *hit)
{
	const int32_t grown = hit->level ? 2 << hit->level : 0;
	int32_t x0 = hit->x0 - grown, x1 = hit->x1 + grown, y0 = hit->y0 - grown, y1 = hit->y1 + grown;

	if (!o->is_known || !(hit->near > 0))
		return 0;
	if (hit->level && (x0 < t->x0 || y0 < t->y0 || x1 >= t->x1 || y1 >= t->y1))
		return 0;
	x0 = (x0 > t->x0 ? x0 - t->x0 : 0) / FAR_SIDE;
	y0 = (y0 > t->y0 ? y0 - t->y0 : 0) / FAR_SIDE;
	x1 = ((x1 < t->x1 ? x1 : t->x1 - 1) - t->x0) / FAR_SIDE;
	y1 = ((y1 < t->y1 ? y1 : t->y1 - 1) - t->y0) / FAR_SIDE;
	const uint32_t near = psr_bits_from_float(hit->near);
	for (int32_t y = y0; y <= y1; y++)
		for (int32_t x = x0; x <= x1; x++)
			if (o->far[y * (TILE_WIDTH / FAR_SIDE) + x] >= near)
				return 0;
	return 1;
}

/* How many blocks or cubes an entry is. */
static inline uint32_t n_blocks_of(const struct warp_target *t, const struct bin_entry *entry)
{
	return t->cubes != NULL && t->instance[entry->instance].cubes != NULL ? cull_count_bits(t->cubes[entry->hit]) : 1;
}

struct warp_counts warp_near_to_far(const struct simd *simd, const struct plan *plan, const struct bins *bins,
                                    const struct warp_target *target, uint32_t begin, uint32_t end)
{
	struct warp_counts counts = { 0, 0, 1 };
	struct occlusion occlusion = { .is_known = 0 };
	struct bin_entry some[64];
	uint32_t n = 0, n_drawn = 0, n_left_out = 0; /* entries; the latter two blocks since the last look */
	int is_over = 0;

	if (!sort_by_depth(plan, bins, begin, end))
		return counts;
	for (uint32_t i = begin; i < end && !plan_is_cancelled_at(plan, i); i++) {
		const struct bin_entry *entry = &bins->entry[bins->order[i]];

		if (is_occluded(&occlusion, target, &bins->hit[entry->hit])) {
			n_left_out += n_blocks_of(target, entry);
			continue;
		}
		some[n++] = *entry;
		n_drawn += n_blocks_of(target, entry);
		if (n < 64 && (n_drawn < LOOK_EVERY || is_over))
			continue;
		counts.n_inside += warp_entries(simd, plan, target, some, n);
		n = 0;
		if (n_drawn >= LOOK_EVERY && !is_over) {
			is_over = occlusion.is_known && n_left_out * WORTH < n_drawn;
			occlusion.is_known = !is_over;
			if (!is_over)
				simd->warp_far(target, occlusion.far);
			counts.n_occluded += n_left_out;
			n_drawn = n_left_out = 0;
		}
	}
	counts.n_inside += warp_entries(simd, plan, target, some, n);
	counts.n_occluded += n_left_out;
	return counts;
}
