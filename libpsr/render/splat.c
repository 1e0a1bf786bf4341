#include <string.h>
#include "base/maths.h"
#include "base/vec.h"
#include "splat.h"
#include "splat_cut.h"
#include "splat_disc.h"

/* The levels from which a block's discs cover so many pixels that each disc asks whether the frame is to end. */
#define LONG_LISTED 2
#define LONG_DRAWN 4
/* The finest level whose discs are cut: of finer ones, what is cut off is a pixel, and so are the seams. Measured. */
#define LEAST_CUT 2
/* Offcuts reach so many radii: a crack between two cut discs may be a little wider than what was cut off. Measured. */
#define OFFCUT_REACH 1.25f

/* Where a picture's discs go. */
enum way { WORDS, LIST, VEILS };

/* A disc that is drawn pixel by pixel. */
struct splat {
	float at[3], radius[2][3], rim;
	uint32_t id, veil;
	int is_cut;
	struct splat_cut cut;
};

static inline void lower(const struct warp_target *t, int32_t x, int32_t y, float z, uint32_t id)
{
	const uint64_t word = (uint64_t)psr_bits_from_float(z) << 32 | id;
	uint64_t *at = &t->word[(size_t)(y - t->y0) * t->stride + (size_t)(x - t->x0)];

	*at = word < *at ? word : *at;
}

/* NaN gives high. */
static inline int32_t within(float x, int32_t low, int32_t high)
{
	return x <= (float)low ? low : x < (float)high ? (int32_t)x : high;
}

/* Lists a pixel of a disc unless an opaque surface is nearer than its plane by half of a rim's depth: a sheer surface
 * on an opaque one stays visible. */
static inline void list_place(struct sheer_list *list, const struct splat *s, uint32_t at, float z, float square)
{
	if (z - (square + 0.5f) * s->rim < list->before[at])
		sheer_add(list, at, (uint64_t)psr_bits_from_float(z) << 32 | s->id);
}

/* Draws a pixel of a cut disc, or marks one of its offcut. */
static inline void draw_cut(const struct splat_target *t, const struct splat *s, const int32_t at[2],
                            const float place[2], float z)
{
	const int32_t x = at[0], y = at[1];

	if (splat_is_cut_off(&s->cut, place))
		t->offcuts->bits[(size_t)y * t->offcuts->stride + (size_t)x / 8] |= (uint8_t)(1 << x % 8);
	else if (place[0] * place[0] + place[1] * place[1] <= 1)
		lower(t->tile, x, y, z, s->id);
}

/* Draws the pixels whose centres are in the ellipse: what discs_draw() does, for other ways, and for cut discs. */
static inline __attribute__((always_inline)) void draw_splat(const struct splat_target *t, const struct splat *s,
                                                             enum way way)
{
	const struct warp_target *tile = t->tile;
	const float u = s->at[0], v = s->at[1], *a = s->radius[0], *b = s->radius[1], reach = s->is_cut ? OFFCUT_REACH : 1;
	const float extent_x = reach * (__builtin_fabsf(a[0]) + __builtin_fabsf(b[0])),
				extent_y = reach * (__builtin_fabsf(a[1]) + __builtin_fabsf(b[1]));
	const float area = a[0] * b[1] - a[1] * b[0];

	if (!(area < 0 || area > 0))
		return;
	const float p_x = b[1] / area, p_y = -b[0] / area, q_x = -a[1] / area, q_y = a[0] / area;
	const int32_t x0 = within(u - extent_x, tile->x0, tile->x1), x1 = within(u + extent_x + 1, tile->x0, tile->x1);
	const int32_t y0 = within(v - extent_y, tile->y0, tile->y1), y1 = within(v + extent_y + 1, tile->y0, tile->y1);
	for (int32_t y = y0; y < y1; y++)
		for (int32_t x = x0; x < x1; x++) {
			const uint32_t at = (uint32_t)(y - tile->y0) * tile->stride + (uint32_t)(x - tile->x0);
			const float dx = (float)x + 0.5f - u, dy = (float)y + 0.5f - v;
			const float p = dx * p_x + dy * p_y, q = dx * q_x + dy * q_y, square = p * p + q * q;
			const float z = (s->at[2] + (p * a[2] + q * b[2])) + square * s->rim;

			if (!(square <= reach * reach && z > t->plan->near_z))
				continue;
			if (way == LIST)
				list_place(t->list, s, at, z, square);
			else if (way == VEILS)
				veil_add(t->veils, at, (uint64_t)psr_bits_from_float(z) << 32 | s->id, s->veil);
			else
				draw_cut(t, s, (const int32_t[2]){ x, y }, (const float[2]){ p, q }, z);
		}
}

void splat_words(const struct splat_target *t, const struct discs *discs, uint64_t mask, unsigned level)
{
	if (level < LONG_DRAWN)
		t->simd->discs_draw(t->tile, discs, mask);
	for (uint64_t left = level < LONG_DRAWN ? 0 : mask; left && !plan_is_cancelled(t->plan); left &= left - 1)
		t->simd->discs_draw(t->tile, discs, left & -left);
}

/* Draws the discs of the lanes of `mask` one by one; ends: those of cut ones. */
static inline __attribute__((always_inline)) void draw_each(const struct splat_target *t, const struct discs *discs,
                                                            uint64_t mask, const struct bin_entry *entry,
                                                            const struct splat_ends *ends, enum way way)
{
	const struct warp_instance *in = &t->plan->warp[entry->instance];
	const struct psr_blocks *blocks = in->blocks;
	const uint32_t block = entry->slot - in->first_slot, first = psr_blocks_attr_first(blocks, block);
	struct splat s = { .rim = discs->rim, .is_cut = way == WORDS };

	for (uint64_t left = mask; left; left &= left - 1) {
		const uint32_t i = (uint32_t)__builtin_ctzll(left);

		if (entry->level >= (way == LIST ? LONG_LISTED : LONG_DRAWN) && plan_is_cancelled(t->plan))
			return;
		for (int a = 0; a < 3; a++) {
			s.at[a] = discs->at[a][i];
			for (int k = 0; k < 2; k++)
				s.radius[k][a] = discs->radius[k][a][i];
		}
		s.id = discs->id + i;
		if (way == WORDS)
			splat_cut_make(&s.cut, ends, i,
			               (const float[2]){ discs->share[0][i] * DISC_RADIUS, discs->share[1][i] * DISC_RADIUS });
		if (way == VEILS) {
			const uint64_t below = blocks->mask[block] & ((UINT64_C(1) << i) - 1);

			s.veil = (uint32_t)(t->veils->bits[blocks->opacity[first + (uint32_t)__builtin_popcountll(below)]] * t->area);
		}
		draw_splat(t, &s, way);
	}
}

static inline __attribute__((always_inline)) void draw_block(const struct splat_target *t,
                                                             const struct bin_entry *entry, enum way way)
{
	const struct warp_instance *in = &t->plan->warp[entry->instance];
	const uint32_t block = entry->slot - in->first_slot;
	const int may_cut = way == WORDS && entry->level >= LEAST_CUT && entry->level < t->cut_below;
	struct splat_ends ends;
	struct discs discs;

	splat_find_ends(&ends, may_cut ? in->blocks->mask[block] : 0);
	t->simd->discs_of_block(&discs, t->tile, entry);
	discs.most = (float)((1 << entry->level) + 2);
	discs.rim = splat_rim(&t->plan->instance[entry->instance], block);
	t->simd->discs_place(&discs, t->tile);
	if (way == WORDS)
		splat_words(t, &discs, discs.mask & ~ends.any, entry->level);
	draw_each(t, &discs, way == WORDS ? discs.mask & ends.any : discs.mask, entry, &ends, way);
}

/* Draws the samples' cells by the warp, which draws words, too. Blocks of level 0 get cells of two pixels. */
static uint64_t draw_cells(const struct simd *simd, const struct plan *plan, const struct warp_target *target,
                           uint32_t levels, const struct bin_entry *entry, uint32_t n)
{
	uint64_t n_inside = 0;

	simd->warp_clear(target, levels);
	for (uint32_t e = 0; e < n && !plan_is_cancelled(plan);) {
		struct bin_entry some[256];
		uint32_t n_some = 0;

		for (; e < n && n_some < sizeof some / sizeof *some; e++) {
			if (plan->warp[entry[e].instance].points != NULL)
				continue;
			some[n_some] = entry[e];
			some[n_some++].level = entry[e].level ? entry[e].level : 1;
		}
		n_inside += warp_entries(simd, plan, target, some, n_some);
	}
	return n_inside;
}

static void clear_offcuts(const struct splat_offcuts *offcuts, const struct warp_target *t)
{
	const size_t n_bytes = ((size_t)(t->x1 - t->x0) + 7) / 8;

	for (int32_t y = t->y0; y < t->y1; y++)
		memset(offcuts->bits + (size_t)y * offcuts->stride + t->x0 / 8, 0, n_bytes);
}

_Static_assert(TILE_WIDTH % 8 == 0, "a byte of offcuts is in one tile");

struct warp_counts splat_tile(const struct simd *simd, const struct plan *plan, const struct bins *bins,
                              const struct splat_into *into, uint32_t tile)
{
	const uint32_t begin = bins->tile_begin[tile], end = bins->thin_begin[tile];
	struct warp_counts counts = { 0, 0, 0 };
	struct warp_target target;

	warp_target_make(&target, plan, into->stack, tile, NULL);
	target.clean = into->clean;
	counts.n_inside = draw_cells(simd, plan, &target, into->stack->levels, bins->entry + begin, end - begin);
	target.clean = warp_parts(plan, bins->is_quiet, tile);
	simd->warp_clear(&target, 0);
	const struct splat_target t = { .simd = simd, .plan = plan, .tile = &target, .offcuts = &into->offcuts,
		                            .cut_below = into->cut_below };
	clear_offcuts(&into->offcuts, &target);
	for (uint32_t e = begin; e < end && !(e % 8 == 0 && plan_is_cancelled(plan)); e++) {
		if (plan->warp[bins->entry[e].instance].cubes != NULL)
			splat_cube(&t, &bins->entry[e]);
		else if (plan->warp[bins->entry[e].instance].points != NULL)
			counts.n_inside += simd->warp_points(&target, &bins->entry[e], 1);
		else
			draw_block(&t, &bins->entry[e], WORDS);
	}
	return counts;
}

void splat_list(const struct simd *simd, const struct plan *plan, const struct bin_entry *entry,
                const struct warp_target *target, struct sheer_list *list)
{
	const struct splat_target t = { .simd = simd, .plan = plan, .tile = target, .list = list };

	draw_block(&t, entry, LIST);
}

void splat_veil(const struct simd *simd, const struct plan *plan, const struct bin_entry *entry,
                const struct warp_target *target, const struct veil_layer *layer, float area)
{
	const struct splat_target t = { .simd = simd, .plan = plan, .tile = target, .veils = layer, .area = area };

	draw_block(&t, entry, VEILS);
}

float splat_rim(const struct plan_instance *in, uint32_t block)
{
	const struct psr_blocks *b = in->cull.blocks;
	const float scale = (float)(1u << psr_blocks_level(b, block));

	return RIM_DEPTH * (b->projection[b->block_projection[block]].spacing * scale) * in->cull.scale;
}
