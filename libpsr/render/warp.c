#include "base/maths.h"
#include "base/direction.h"
#include "render.h"

uint32_t warp_gap(uint32_t width)
{
	const uint32_t page = 4096 / sizeof(uint64_t), line = 64 / sizeof(uint64_t), beyond = (width + line) % page;
	return beyond < 2 * line ? 2 * line - beyond : 0;
}

void warp_target_make(struct warp_target *t, const struct plan *plan, const struct psr_zstack *stack,
                      uint32_t tile, uint64_t *own)
{
	t->instance = plan->warp;
	t->direction = psr_direction_tens();
	t->near_z = plan->near_z;
	t->perspective = plan->perspective;
	const uint32_t tx = tile % plan->tiles_x, ty = tile / plan->tiles_x;
	t->stride = own ? WARP_OWN_STRIDE : stack->width + stack->gap;
	t->x0 = (int32_t)(tx * TILE_WIDTH);
	t->y0 = (int32_t)(ty * TILE_HEIGHT);
	t->word = own ? own : psr_zstack_row(stack, (uint32_t)t->y0) + t->x0;
	const int last_x = tx + 1 == plan->tiles_x, last_y = ty + 1 == plan->tiles_y;
	t->x1 = last_x ? (int32_t)plan->width : t->x0 + TILE_WIDTH;
	t->y1 = last_y ? (int32_t)plan->height : t->y0 + TILE_HEIGHT;
	for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		if (!(stack->levels >> k & 1))
			continue;
		struct warp_cells *const c = &t->cells[k];
		c->z = stack->level[k].z;
		c->stride = stack->level[k].width;
		c->x0 = tx ? t->x0 : -(1 << k);
		c->y0 = ty ? t->y0 : -(1 << k);
		c->x1 = last_x ? (int32_t)(stack->level[k].width - 1) << k : t->x1;
		c->first = (uint32_t)((c->y0 >> k) + 1) * c->stride + (uint32_t)((c->x0 >> k) + 1);
		c->y1 = last_y ? (int32_t)(stack->level[k].height - 1) << k : t->y1;
	}
}

uint32_t warp_parts(const struct plan *plan, const uint8_t *map, uint32_t tile)
{
	const uint32_t x0 = tile % plan->tiles_x * TILE_WIDTH, y0 = tile / plan->tiles_x * TILE_HEIGHT;
	uint32_t bits = ALL_PARTS;
	for (uint32_t y = 0; y < TILE_HEIGHT && y0 + y < plan->height; y += PART_HEIGHT)
		for (uint32_t x = 0; x < TILE_WIDTH && x0 + x < plan->width; x += PART_WIDTH)
			if (!map[(y0 + y) / PART_HEIGHT * plan->parts_x + (x0 + x) / PART_WIDTH])
				bits &= ~part_bit(x, y);
	return bits;
}

/* ---- occlusion: near to far, what the tile already hides is left out ---- */

#define OCCLUSION_BLOCKS 6144 /* of a tile: some eight samples a pixel, below which looking costs what it saves */
#define LOOK_EVERY 1024       /* blocks that are drawn between two looks at the tile */
#define WORTH 16              /* a look must leave out one block of so many that are tested, or it is the last */
#define KEYS 1024

struct occlusion {
	uint32_t far[TILE_HEIGHT / FAR_SIDE * (TILE_WIDTH / FAR_SIDE)];
	int is_known;
};

/* In order for depths above 0; what begins at the eye or behind it is nearest. */
static uint32_t depth_of(const struct bins *bins, uint32_t entry)
{
	const float near = bins->hit[bins->entry[entry].hit].near;
	return near > 0 ? psr_bits_from_float(near) : 0;
}

/* Stable, by the upper bits of depth. */
static void sort_by_depth(const struct bins *bins, uint32_t begin, uint32_t end)
{
	uint32_t low = UINT32_MAX, high = 0, count[KEYS + 1] = { 0 };
	int shift = 0;

	for (uint32_t e = begin; e < end; e++) {
		const uint32_t depth = depth_of(bins, e);
		low = depth < low ? depth : low;
		high = depth > high ? depth : high;
	}
	while ((high - low) >> shift >= KEYS)
		shift++;
	for (uint32_t e = begin; e < end; e++)
		count[((depth_of(bins, e) - low) >> shift) + 1]++;
	for (int k = 0; k < KEYS; k++)
		count[k + 1] += count[k];
	for (uint32_t e = begin; e < end; e++)
		bins->order[begin + count[(depth_of(bins, e) - low) >> shift]++] = e;
}

/* Whether all pixels that the block can change are nearer already. A block that lowers cells of level k changes what is
 * seen through them up to two cells away, which must be in this tile, too. */
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

static struct warp_counts warp_near_to_far(const struct simd *simd, const struct bins *bins,
                                           const struct warp_target *target, uint32_t begin, uint32_t end)
{
	struct warp_counts counts = { 0, 0, 1 };
	struct occlusion occlusion = { .is_known = 0 };
	struct bin_entry some[64];
	uint32_t n = 0, n_drawn = 0, n_left_out = 0; /* the latter two since the last look */
	int is_over = 0;
	sort_by_depth(bins, begin, end);
	for (uint32_t i = begin; i < end; i++) {
		const struct bin_entry *entry = &bins->entry[bins->order[i]];
		if (is_occluded(&occlusion, target, &bins->hit[entry->hit])) {
			n_left_out++;
			continue;
		}
		some[n++] = *entry;
		if (n < 64)
			continue;
		counts.n_inside += simd->warp(target, some, n);
		n_drawn += n;
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
	counts.n_inside += simd->warp(target, some, n);
	counts.n_occluded += n_left_out;
	return counts;
}

/* The level above 0 that most blocks of a tile have; 0 if none has any. */
static int most_frequent_level(const struct bin_entry *entry, uint32_t n)
{
	uint32_t count[PSR_MAX_DEPTH_LEVEL + 1] = { 0 };
	int most = 0;
	for (uint32_t e = 0; e < n; e++)
		count[entry[e].level] += !entry[e].at_border;
	count[0] = 0;
	for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++)
		most = count[k] > count[most] ? k : most;
	return most;
}

/* Cells of one level are taken from the words after its blocks were drawn as those without cells are, and before any
 * others. */
static uint64_t warp_in_turn(const struct simd *simd, const struct warp_target *target, uint32_t levels,
                             const struct bin_entry *entry, uint32_t n)
{
	const int first = most_frequent_level(entry, n);
	uint64_t n_inside = 0;
	simd->warp_clear(target, first ? levels & ~(1u << first) : levels);
	if (first == 0)
		return simd->warp(target, entry, n);
	for (int turn = 0; turn < 2; turn++) {
		struct bin_entry some[256];
		uint32_t n_some = 0;
		for (uint32_t e = 0; e < n; e++) {
			const int is_first = entry[e].level == first && !entry[e].at_border;
			if (is_first == turn)
				continue;
			some[n_some] = entry[e];
			some[n_some].level = turn ? entry[e].level : 0;
			if (++n_some == sizeof some / sizeof some[0]) {
				n_inside += simd->warp(target, some, n_some);
				n_some = 0;
			}
		}
		n_inside += simd->warp(target, some, n_some);
		if (turn == 0)
			simd->warp_cells(target, first);
	}
	return n_inside;
}

struct warp_counts warp_tile(const struct simd *simd, const struct plan *plan, const struct bins *bins,
                             struct psr_zstack *stack, uint32_t tile, uint32_t clean, uint64_t *own)
{
	const uint32_t begin = bins->tile_begin[tile], end = sheer_begin(plan, bins, tile);
	struct warp_target target;
	struct warp_counts counts = { 0, 0, 0 };
	warp_target_make(&target, plan, stack, tile, own);
	target.clean = clean;
	target.bare = warp_parts(plan, bins->is_quiet, tile);
	if (plan->cull_tests & PSR_CULL_OCCLUSION && (end - begin >= OCCLUSION_BLOCKS || plan->is_full)) {
		simd->warp_clear(&target, stack->levels);
		counts = warp_near_to_far(simd, bins, &target, begin, end);
	} else {
		counts.n_inside = warp_in_turn(simd, &target, stack->levels, bins->entry + begin, end - begin);
	}
	return counts;
}
