/* Finding gaps: how much of each pixel nearer surfaces cover ([G] 4.6), and the guard against pinholes. */
#include "gaps_cells.h"
#include "gaps_close.h"
#include "gaps_slits.h"

/* Samples of level 0 miss a pixel only by rounding, and then a single one. The guard closes pixels behind at least
 * seven of their eight neighbours, if those are one surface: within level ALIKE's threshold of each other, since a
 * crevice may be deep; within a coarser level's where the pixel is empty, since an opening through a model is seldom
 * one pixel wide. */
#define ALIKE 1
#define ALIKE_BEFORE_NOTHING 4
#define GUARD_RUN 32

static uint32_t guard_run(int32_t *weight, const struct gaps_target *t, const float *above, const float *own,
                          const float *below)
{
	const float scale = t->scale[1], offset = t->offset[1];
	const float alike = t->scale[ALIKE], alike_offset = t->offset[ALIKE];
	const float nothing = t->scale[ALIKE_BEFORE_NOTHING], nothing_offset = t->offset[ALIKE_BEFORE_NOTHING];
	int32_t n_pinholes = 0;

	for (int x = 0; x < GUARD_RUN; x++) {
		const float z[8] = { above[x - 1], above[x],     above[x + 1], own[x - 1],
			                 own[x + 1],   below[x - 1], below[x],     below[x + 1] };
		float nearest = INFINITY, farthest = 0;
		int32_t n_before = 0;

		for (int i = 0; i < 8; i++) {
			const int32_t is_before = z[i] * scale + offset < own[x];
			const float seen = psr_where(is_before, z[i]);

			n_before += is_before;
			nearest = z[i] < nearest ? z[i] : nearest;
			farthest = seen > farthest ? seen : farthest;
		}
		const float limit = nearest * alike + alike_offset, limit_before_nothing = nearest * nothing + nothing_offset;
		const int32_t is_alike = farthest <= psr_choose(own[x] < INFINITY, limit, limit_before_nothing);
		const int32_t is_pinhole = (weight[x] > 0) & (n_before >= 7) & is_alike;
		weight[x] = is_pinhole ? 0 : weight[x];
		n_pinholes += is_pinhole;
	}
	return (uint32_t)n_pinholes;
}

/* A quick test, since most runs have none: left or right, and above or below, a neighbour lies before a pinhole. Pixels
 * that cells cover whole have no weight to lose. */
static inline int32_t may_have_pinholes(const int32_t *weight, const struct gaps_target *t, const float *above,
                                        const float *own, const float *below)
{
	const float scale = t->scale[1], offset = t->offset[1];
	int32_t is_near = 0;

	for (int x = 0; x < GUARD_RUN; x++) {
		const float side = own[x - 1] < own[x + 1] ? own[x - 1] : own[x + 1],
					line = above[x] < below[x] ? above[x] : below[x];
		const float later = side < line ? line : side;

		is_near |= (later * scale + offset < own[x]) & (weight[x] > 0);
	}
	return is_near;
}

/* Takes pinholes, then lists slits. Where no pixel may be in a slit, none is a pinhole: of neighbours on rows and
 * columns a pinhole has two before it. */
static uint32_t guard_row(struct gaps_counts *counts, int32_t *weight, const struct gaps_target *t,
                          const struct gaps_tile *tile, uint32_t y)
{
	uint32_t n_pinholes = 0;

	if (!(tile->has_samples[GAPS_MARGIN + y - 1] | tile->has_samples[GAPS_MARGIN + y + 1]))
		return 0;
	for (uint32_t x = 0; x < tile->width; x += GUARD_RUN) {
		const float *above = gaps_row(tile, (int32_t)y - 1) + x, *own = above + GAPS_STRIDE, *below = own + GAPS_STRIDE;

		if (t->slit != NULL && !may_have_slits(weight + x, t, own))
			continue;
		if (may_have_pinholes(weight + x, t, above, own, below))
			n_pinholes += guard_run(weight + x, t, above, own, below);
		if (t->slit != NULL)
			counts->n_slits += list_slits(t->slit + counts->n_slits, weight + x, t, own, tile->width - x,
			                              y * GAPS_WIDTH + x);
	}
	counts->n_pinholes += n_pinholes;
	return n_pinholes;
}

_Static_assert(SLIT_RUN == GUARD_RUN, "runs are tested together");

static struct gaps_counts gaps(const struct gaps_target *t, uint32_t x0, uint32_t x1, uint32_t y0, uint32_t y1,
                               uint8_t *marks)
{
	struct gaps_tile tile = { .x0 = x0, .y0 = y0, .width = x1 - x0, .height = y1 - y0 };
	struct gaps_level level[PSR_MAX_DEPTH_LEVEL + 1];
	float limit[GAPS_BRICK][GAPS_WIDTH];
	struct gaps_counts counts = { 0, 0, 0, 0 };

	_Alignas(64) int32_t is_marked[GAPS_WIDTH] = { 0 }, n_partial[GAPS_WIDTH] = { 0 };
	const int closed = t->method == PSR_GAPS_CLOSED ? closed_level(t, &tile) : 0;
	const int by_cells = t->method == PSR_GAPS_CLOSED ? CLOSED_LEVELS + 1 : 1;
	load_depths(&tile, t->stack, closed ? 2 * (uint32_t)closed : 1);
	if (closed)
		close_piece(limit, t, &tile, closed);
	for (int k = by_cells; k <= PSR_MAX_DEPTH_LEVEL && t->method != PSR_GAPS_OPAQUE; k++)
		if (t->stack->levels >> k & 1)
			begin_level(&level[k], k);
	for (uint32_t y = 0; y < tile.height; y++) {
		uint16_t *to = t->weight + (size_t)(y0 + y) * t->stack->width + x0;
		const float *z = gaps_row(&tile, (int32_t)y);

		_Alignas(64) int32_t weight[GAPS_WIDTH];
		int is_less = 0;
		for (uint32_t x = 0; x < GAPS_WIDTH; x++)
			weight[x] = GAPS_WHOLE;
		if (closed)
			is_less = cover_closed(weight, limit[y], z);
		for (int k = by_cells; k <= PSR_MAX_DEPTH_LEVEL; k++)
			if (t->stack->levels >> k & 1)
				is_less |= t->method == PSR_GAPS_OPAQUE ? cover_opaque(weight, t, &tile, k, y)
				                                        : cover_level(weight, &level[k], t, &tile, y);
		if (!guard_row(&counts, weight, t, &tile, y) && !is_less) {
			for (uint32_t x = 0; x < tile.width; x++)
				to[x] = GAPS_WHOLE;
			continue;
		}
		for (uint32_t x = 0; x < tile.width; x++)
			to[x] = (uint16_t)weight[x];
		for (uint32_t x = 0; x < tile.width; x++) {
			const int32_t is_partial = weight[x] < GAPS_WHOLE;

			is_marked[x] |= is_partial;
			n_partial[x] += is_partial & (z[x] < INFINITY);
		}
	}
	for (uint32_t brick = 0; brick < GAPS_WIDTH / GAPS_BRICK; brick++) {
		int32_t is_any = 0, n = 0;

		for (uint32_t x = brick * GAPS_BRICK; x < (brick + 1) * GAPS_BRICK; x++) {
			is_any |= is_marked[x];
			n += n_partial[x];
		}
		marks[brick] = (uint8_t)is_any;
		counts.n_marked += (uint32_t)is_any;
		counts.n_partial += (uint32_t)n;
	}
	return counts;
}
