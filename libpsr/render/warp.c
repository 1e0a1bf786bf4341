#include <math.h>
#include "cull.h"
#include "sheer.h"
#include "warp.h"

#define RUN 1024     /* blocks, or cubes, warped between two questions */
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

/* How much of a run between two questions an entry takes: points of a group, cubes of a run, or 0: callers count. */
static inline uint32_t work_of(const struct plan *plan, const struct warp_target *target, const struct bin_entry *entry)
{
	const struct warp_instance *in = &plan->warp[entry->instance];

	if (in->points != NULL)
		return in->points->model->set->group[entry->slot - in->first_slot].n;
	return in->cubes != NULL && target->cubes != NULL ? cull_count_bits(target->cubes[entry->hit]) : 0;
}

uint64_t warp_entries(const struct simd *simd, const struct plan *plan, const struct warp_target *target,
                      const struct bin_entry *entry, uint32_t n)
{
	uint64_t n_inside = 0;

	if (!plan->has_octrees && !plan->has_points)
		return simd->warp(target, entry, n);
	for (uint32_t first = 0, end = 0; first < n; first = end) {
		warp_fn *warp = kernel_of(simd, plan, &entry[first]);
		uint32_t left = warp == simd->warp_points ? POINTS_RUN : RUN;

		if (warp != simd->warp && plan_is_cancelled(plan))
			break;
		for (; end < n && kernel_of(simd, plan, &entry[end]) == warp; end++) {
			const uint32_t work = work_of(plan, target, &entry[end]);

			if (work > left)
				break;
			left -= work;
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

int warp_looks(const struct plan *plan, uint32_t n)
{
	const uint32_t least = 6144; /* of a tile: some eight samples a pixel; with fewer, looking costs what it saves */

	return plan->cull_tests & PSR_CULL_OCCLUSION && (n >= least || plan->is_full);
}

/* As how many blocks of a smooth surface a tile's entries are: these have half of their samples, cubes of a surface
 * sixteen leaves in the mean. Groups of points count as one. */
static uint32_t n_blocks_of(const struct warp_target *t, const struct bin_entry *entry, uint32_t n_entries)
{
	const struct psr_blocks *last = NULL;
	float n = 0, share = 1;

	for (uint32_t e = 0; e < n_entries; e++) {
		const struct warp_instance *in = &t->instance[entry[e].instance];
		const int is_run = in->cubes != NULL && t->cubes != NULL;

		if (in->points != NULL) {
			n++;
			continue;
		}
		if (in->blocks != last) {
			const float whole = in->cubes != NULL ? 16 : 32;

			last = in->blocks;
			share = fminf((float)last->n_samples / (whole * (float)last->n_blocks), 1);
		}
		n += is_run ? share * (float)cull_count_bits(t->cubes[entry[e].hit]) : share;
	}
	return (uint32_t)n;
}

struct warp_counts warp_tile(const struct simd *simd, const struct plan *plan, const struct bins *bins,
                             const struct warp_into *into, uint32_t tile)
{
	const uint32_t begin = bins->tile_begin[tile], end = bins->thin_begin[tile];
	struct warp_target target;
	struct warp_counts counts = { 0, 0, 0 };

	warp_target_make(&target, plan, into->stack, tile, into->own);
	target.clean = into->clean;
	target.bare = warp_parts(plan, bins->is_quiet, tile);
	target.cubes = plan->with_runs ? bins->cubes : NULL;
	if (warp_looks(plan, n_blocks_of(&target, bins->entry + begin, end - begin))) {
		simd->warp_clear(&target, into->stack->levels);
		counts = warp_near_to_far(simd, plan, bins, &target, begin, end);
	} else {
		counts.n_inside = warp_in_turn(simd, plan, &target, into->stack->levels, bins->entry + begin, end - begin);
	}
	return counts;
}

/* Entries that reach into rows above the band are counted there. */
struct waiting {
	struct bin_entry entry[256];
	uint32_t n;
};

static uint64_t warp_waiting(const struct simd *simd, const struct plan *plan, const struct warp_target *t,
                             struct waiting *waiting)
{
	const uint32_t n = waiting->n;

	waiting->n = 0;
	return warp_entries(simd, plan, t, waiting->entry, n);
}

static void warp_target_cut(struct warp_target *t, const struct band *band)
{
	const int32_t top = t->y0 + band->y0, bottom = t->y0 + band->y1 < t->y1 ? t->y0 + band->y1 : t->y1;

	t->above = top - t->y0;
	t->below = t->y1 - bottom;
	t->word += (size_t)t->above * t->stride;
	t->y0 = top;
	t->y1 = bottom;
}

struct warp_counts warp_band(const struct simd *simd, const struct plan *plan, const struct bins *bins,
                             const struct warp_into *into, const struct band *band)
{
	struct waiting counted = { .n = 0 }, again = { .n = 0 };
	struct warp_counts counts = { 0, 0, 0 };
	struct warp_target t;

	warp_target_make(&t, plan, into->stack, band->tile, into->own);
	warp_target_cut(&t, band);
	t.clean = into->clean >> part_shift(band->y0);
	t.bare = 0;
	simd->warp_clear(&t, 0);
	for (uint32_t e = bins->tile_begin[band->tile]; e < bins->tile_begin[band->tile + 1]; e++) {
		const struct cull_hit *hit = &bins->hit[bins->entry[e].hit];
		struct waiting *to = hit->y0 < t.y0 && t.above > 0 ? &again : &counted;

		if (plan_is_cancelled_at(plan, e))
			return counts;
		if (hit->y1 < t.y0 || hit->y0 >= t.y1)
			continue;
		to->entry[to->n++] = bins->entry[e];
		if (to->n < sizeof to->entry / sizeof to->entry[0])
			continue;
		const uint64_t n_inside = warp_waiting(simd, plan, &t, to);
		counts.n_inside += to == &counted ? n_inside : 0;
	}
	warp_waiting(simd, plan, &t, &again);
	counts.n_inside += warp_waiting(simd, plan, &t, &counted);
	return counts;
}
