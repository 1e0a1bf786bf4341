#include "sheer.h"
#include "warp.h"

#define OCCLUSION_BLOCKS 6144 /* of a tile: some eight samples a pixel; with fewer, looking costs what it saves */

#define RUN 1024     /* blocks warped between two questions */
#define POINTS_RUN 256 /* differential points, each of which may cover the tile */

/* The most frequent level above 0 among a tile's blocks; 0 if there is none. */
static int most_frequent_level(const struct plan *plan, const struct bin_entry *entry, uint32_t n)
{
	uint32_t count[PSR_MAX_DEPTH_LEVEL + 1] = { 0 };
	int most = 0;

	for (uint32_t e = 0; e < n && !plan_is_cancelled_at(plan, e); e++)
		count[entry[e].level] += !entry[e].at_border;
	count[0] = 0;
	for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++)
		most = count[k] > count[most] ? k : most;
	return most;
}

static inline warp_fn *kernel_of(const struct simd *simd, const struct plan *plan, const struct bin_entry *entry)
{
	const struct warp_instance *in = &plan->warp[entry->instance];

	if (in->points != NULL)
		return simd->warp_points;
	return in->cubes == NULL ? simd->warp : plan->with_ewa ? simd->ewa_words : simd->warp_leaves;
}

/* Of a group of differential points; else 0. */
static inline uint32_t n_points_of(const struct plan *plan, const struct bin_entry *entry)
{
	const struct warp_instance *in = &plan->warp[entry->instance];

	return in->points != NULL ? in->points->model->set->group[entry->slot - in->first_slot].n : 0;
}

uint64_t warp_entries(const struct simd *simd, const struct plan *plan, const struct warp_target *target,
                      const struct bin_entry *entry, uint32_t n)
{
	uint64_t n_inside = 0;

	if (!plan->has_octrees && !plan->has_points)
		return simd->warp(target, entry, n);
	for (uint32_t first = 0, end = 0; first < n; first = end) {
		warp_fn *warp = kernel_of(simd, plan, &entry[first]);
		uint32_t left = POINTS_RUN;

		if (warp == simd->warp_points && plan_is_cancelled(plan))
			break;
		for (; end < n && kernel_of(simd, plan, &entry[end]) == warp; end++) {
			const uint32_t n_points = n_points_of(plan, &entry[end]);

			if (n_points > left)
				break;
			left -= n_points;
		}
		n_inside += warp(target, entry + first, end - first);
	}
	return n_inside;
}

static uint64_t warp_runs(const struct simd *simd, const struct plan *plan, const struct warp_target *target,
                          const struct bin_entry *entry, uint32_t n)
{
	uint64_t n_inside = 0;

	for (uint32_t first = 0; first < n && !plan_is_cancelled(plan); first += RUN)
		n_inside += warp_entries(simd, plan, target, entry + first, n - first < RUN ? n - first : RUN);
	return n_inside;
}

/* Draws the blocks of one level first, without cells, and derives that level's cells from the words. */
static uint64_t warp_in_turn(const struct simd *simd, const struct plan *plan, const struct warp_target *target,
                             uint32_t levels, const struct bin_entry *entry, uint32_t n)
{
	const int first = most_frequent_level(plan, entry, n);
	uint64_t n_inside = 0;

	simd->warp_clear(target, first ? levels & ~(1u << first) : levels);
	if (first == 0)
		return warp_runs(simd, plan, target, entry, n);
	for (int turn = 0; turn < 2; turn++) {
		struct bin_entry some[256];
		uint32_t n_some = 0;

		for (uint32_t e = 0; e < n; e++) {
			const int is_first = entry[e].level == first && !entry[e].at_border;

			if (plan_is_cancelled_at(plan, e))
				return n_inside;
			if (is_first == turn)
				continue;
			some[n_some] = entry[e];
			some[n_some].level = turn ? entry[e].level : 0;
			if (++n_some == sizeof some / sizeof some[0]) {
				n_inside += warp_entries(simd, plan, target, some, n_some);
				n_some = 0;
			}
		}
		n_inside += warp_entries(simd, plan, target, some, n_some);
		if (turn == 0)
			simd->warp_cells(target, first);
	}
	return n_inside;
}

struct warp_counts warp_tile(const struct simd *simd, const struct plan *plan, const struct bins *bins,
                             const struct warp_into *into, uint32_t tile)
{
	const uint32_t begin = bins->tile_begin[tile], end = sheer_begin(plan, bins, tile);
	struct warp_target target;
	struct warp_counts counts = { 0, 0, 0 };

	warp_target_make(&target, plan, into->stack, tile, into->own);
	target.clean = into->clean;
	target.bare = warp_parts(plan, bins->is_quiet, tile);
	if (plan->cull_tests & PSR_CULL_OCCLUSION && (end - begin >= OCCLUSION_BLOCKS || plan->is_full)) {
		simd->warp_clear(&target, into->stack->levels);
		counts = warp_near_to_far(simd, plan, bins, &target, begin, end);
	} else {
		counts.n_inside = warp_in_turn(simd, plan, &target, into->stack->levels, bins->entry + begin, end - begin);
	}
	return counts;
}
