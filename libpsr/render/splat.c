#include <math.h>
#include <string.h>
#include "base/maths.h"
#include "base/vec.h"
#include "base/direction.h"
#include "block.h"
#include "splat.h"
#include "splat_disc.h"
#include "simd/block.h"

/* The greatest slope of a tangent plane in its projection, where a sample lacks neighbours. Projections own surfaces
 * that they see at less than 50 degrees; steeper normals mostly belong to a texture or to detail smaller than the disc.
 * Measured. */
#define MOST_SLOPE 0.7f
/* The greatest slope of a plane that neighbours confirm. */
#define MOST_STEEP 3.0f
/* Share of the radius along a line without neighbours on either side: the surface is narrower than a step there. */
#define NARROW 0.5f
/* Levels from which a block's discs cover so many pixels that each disc asks whether the frame is to end. */
#define LONG_LISTED 2
/* The finest level whose discs are cut: of finer ones, what is cut off is a pixel, and so are the seams. Measured. */
#define LEAST_CUT 2

/* Depths of a block's samples by place in the lattice. */
struct lattice_depths {
	uint64_t mask;
	uint16_t depth[PSR_BLOCK_SAMPLES];
	float rise; /* a step of depth, in steps of the lattice */
};

static void place_depths(struct lattice_depths *to, const struct warp_block *b, float rise)
{
	const uint16_t *depth = b->depth;

	to->mask = b->mask;
	to->rise = rise;
	for (uint64_t left = b->mask; left; left &= left - 1)
		to->depth[__builtin_ctzll(left)] = *depth++;
}

/* Finds the slope towards a neighbour. Returns 0 if the block has no sample there. */
static inline int slope_to(float *slope, const struct lattice_depths *at, int own, int row, int col)
{
	if (((row | col) & ~7) != 0 || !(at->mask >> (8 * row + col) & 1))
		return 0;
	*slope = (float)((int)at->depth[8 * row + col] - own) * at->rise;
	return 1;
}

/* Slope along a line of the lattice: the normal's, clamped between the slopes to the neighbours on both sides. `safe`
 * unless the sample has both. */
static inline float slope_along(int has_next, float next, int has_last, float last, float normal, float safe)
{
	const float low = next < -last ? next : -last, high = next < -last ? -last : next;

	if (!(has_next && has_last))
		return safe;
	return normal > low ? normal < high ? normal : high : low;
}

/* Finds how the projection's z rises along its x and y, on the plane of a normal. */
static void slope_of_normal(float slope[2], const float n[3], const struct psr_projection *projection)
{
	const float nz = v3f_dot(n, projection->axis[2]);

	slope[0] = -v3f_dot(n, projection->axis[0]) / nz;
	slope[1] = -v3f_dot(n, projection->axis[1]) / nz;
}

static void limit_slope(float slope[2], float most)
{
	const float length = __builtin_sqrtf(slope[0] * slope[0] + slope[1] * slope[1]);

	if (!(length <= most)) {
		const int is_vertical = !(length < 0x1p60f);

		slope[0] = is_vertical ? 0 : slope[0] * (most / length);
		slope[1] = is_vertical ? 0 : slope[1] * (most / length);
	}
}

/* Finds the slopes of a disc's plane, and the share of its radius along the rows and across them. The plane is the
 * normal's, clamped along each of the lattice's three lines by the depths on both sides: the normal may come from a
 * map, or a rounded corner. Odd rows are half a step to the right. */
static void find_plane(float slope[2], float share[2], const struct lattice_depths *at, uint32_t sample,
                       const float n[3], const struct psr_projection *projection)
{
	static const float half = 0.5f, high = 0.866025404f;
	const int r = (int)(sample >> 3), c = (int)(sample & 7), own = at->depth[sample], left = c - 1 + (r & 1);
	float normal[2], next[3] = { 0, 0, 0 }, last[3] = { 0, 0, 0 }, rise[3];

	slope_of_normal(normal, n, projection);
	const int has_next[3] = { slope_to(&next[0], at, own, r, c + 1), slope_to(&next[1], at, own, r + 1, left + 1),
		                      slope_to(&next[2], at, own, r + 1, left) };
	const int has_last[3] = { slope_to(&last[0], at, own, r, c - 1), slope_to(&last[1], at, own, r - 1, left),
		                      slope_to(&last[2], at, own, r - 1, left + 1) };
	const float along[3] = { normal[0], normal[0] * half + normal[1] * high, normal[1] * high - normal[0] * half };
	limit_slope(normal, MOST_SLOPE);
	const float safe[3] = { normal[0], normal[0] * half + normal[1] * high, normal[1] * high - normal[0] * half };
	for (int i = 0; i < 3; i++)
		rise[i] = slope_along(has_next[i], next[i], has_last[i], last[i], along[i], safe[i]);
	slope[0] = (2 * rise[0] + rise[1] - rise[2]) / 3;
	slope[1] = (rise[1] + rise[2]) / (2 * high);
	limit_slope(slope, MOST_STEEP);
	/* A sample at the block's border may have neighbours in the next block. */
	const int beside = has_next[0] | has_last[0] | (c == 0) | (c == 7);
	const int at_end = (r == 0) | (r == 7) | (left < 0) | (left == 7);
	const int across = has_next[1] | has_next[2] | has_last[1] | has_last[2] | at_end;
	share[0] = beside ? 1 : NARROW;
	share[1] = across ? 1 : NARROW;
}

static inline __attribute__((always_inline)) void draw_block(const struct splat_target *t,
                                                             const struct bin_entry *entry, enum way way)
{
	const struct warp_instance *in = &t->plan->warp[entry->instance];
	const struct psr_projection *projection =
		&in->blocks->projection[in->blocks->block_projection[entry->slot - in->first_slot]];
	const float (*normals)[3] = psr_direction_table();
	const int perspective = t->plan->perspective;
	struct lattice_depths at;
	struct splat_ends ends;
	struct warp_block b;
	struct splat s;

	warp_block_make(&b, in, entry->slot);
	splat_find_ends(&ends, way == WORDS && entry->level >= LEAST_CUT && entry->level < t->cut_below ? b.mask : 0);
	const float scale = (float)b.scale, step = projection->spacing * scale;
	/* Radii in the projection's plane, along x and y, and along z for a slope of 1. */
	float radius[2][3], along[3];
	for (int a = 0; a < 3; a++) {
		radius[0][a] = SPLAT_RADIUS * scale * (float)b.lattice->step[a];
		radius[1][a] = SPLAT_RADIUS * scale * (float)b.lattice->down[a] / 0.866025404f;
		along[a] = SPLAT_RADIUS * step * (float)b.lattice->along[a];
	}
	place_depths(&at, &b, b.rise / (projection->spacing * (float)b.scale));
	s = (struct splat){ .rim = RIM_DEPTH * step * t->plan->instance[entry->instance].cull.scale,
		                .most = (float)((1 << entry->level) + 2) };
	for (uint64_t left = b.mask; left; left &= left - 1, b.depth++, b.attr++) {
		const uint32_t sample = (uint32_t)__builtin_ctzll(left), r = sample >> 3, c = sample & 7;
		const float *n = normals[PSR_ATTR_NORMAL(*b.attr)], depth = (float)*b.depth;
		float p[3], d[3], slope[2], share[2];

		s.is_cut = way == WORDS && (ends.any >> sample & 1);
		for (int a = 0; a < 3; a++)
			p[a] = ((float)(b.origin[a] + b.scale * b.lattice->row[a][r]) + scale * b.lattice->col[a][c])
			       + depth * b.unit[a];
		if (!(p[2] > t->plan->near_z))
			continue;
		const float inverse = perspective ? 1 / p[2] : 1;
		v3f_set(s.at, p[0] * inverse, p[1] * inverse, p[2]);
		for (int k = 0; k < 3; k++)
			d[k] = (s.at[0] * in->du[k] + s.at[1] * in->dv[k]) + in->d0[k];
		if (entry->is_mixed && faces_away(-v3f_dot(n, d), d))
			continue;
		if (entry->level >= (way == LIST ? LONG_LISTED : LONG_DRAWN) && plan_is_cancelled(t->plan))
			return;
		find_plane(slope, share, &at, sample, n, projection);
		for (int i = 0; i < 2; i++) {
			float h[3];

			for (int a = 0; a < 3; a++)
				h[a] = share[i] * (radius[i][a] + slope[i] * along[a]);
			s.radius[i][0] = perspective ? (h[0] - s.at[0] * h[2]) * inverse : h[0];
			s.radius[i][1] = perspective ? (h[1] - s.at[1] * h[2]) * inverse : h[1];
			s.radius[i][2] = h[2];
		}
		if (s.is_cut)
			splat_cut_make(&s.cut, &ends, sample,
			               (const float[2]){ share[0] * SPLAT_RADIUS, share[1] * SPLAT_RADIUS });
		s.id = b.id + sample;
		if (way == VEILS)
			s.veil = (uint32_t)(t->veils->bits[in->blocks->opacity[b.attr - in->blocks->attr]] * t->area);
		limit_reach(&s);
		draw_splat(t, &s, way);
	}
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

static void clear_offcuts(const struct splat_target *t)
{
	const size_t n_bytes = ((size_t)(t->x1 - t->x0) + 7) / 8;

	for (int32_t y = t->y0; y < t->y1; y++)
		memset(t->offcuts->bits + (size_t)y * t->offcuts->stride + t->x0 / 8, 0, n_bytes);
}

_Static_assert(TILE_WIDTH % 8 == 0, "a byte of offcuts is in one tile");

struct warp_counts splat_tile(const struct simd *simd, const struct plan *plan, const struct bins *bins,
                              const struct splat_into *into, uint32_t tile)
{
	const uint32_t begin = bins->tile_begin[tile], end = sheer_begin(plan, bins, tile);
	struct warp_counts counts = { 0, 0, 0 };
	struct warp_target target;

	warp_target_make(&target, plan, into->stack, tile, NULL);
	target.clean = into->clean;
	counts.n_inside = draw_cells(simd, plan, &target, into->stack->levels, bins->entry + begin, end - begin);
	target.clean = warp_parts(plan, bins->is_quiet, tile);
	simd->warp_clear(&target, 0);
	const struct splat_target t = { plan,      target.word, target.stride, target.x0, target.y0,
		                            target.x1, target.y1,   NULL,          NULL,      0,
		                            &into->offcuts, into->cut_below };
	clear_offcuts(&t);
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

void splat_list(const struct plan *plan, const struct bin_entry *entry, const struct warp_target *target,
                struct sheer_list *list)
{
	const struct splat_target t = { plan,       NULL,       target->stride, target->x0, target->y0,
		                            target->x1, target->y1, list,       NULL,           0, NULL, 0 };

	draw_block(&t, entry, LIST);
}

void splat_veil(const struct plan *plan, const struct bin_entry *entry, const struct warp_target *target,
                const struct veil_layer *layer, float area)
{
	const struct splat_target t = { plan,       NULL,       target->stride, target->x0, target->y0,
		                            target->x1, target->y1, NULL,           layer, area, NULL, 0 };

	draw_block(&t, entry, VEILS);
}

float splat_rim(const struct plan_instance *in, uint32_t block)
{
	const struct psr_blocks *b = in->cull.blocks;
	const float scale = (float)(1u << psr_blocks_level(b, block));

	return RIM_DEPTH * (b->projection[b->block_projection[block]].spacing * scale) * in->cull.scale;
}
