/* Pull and push of bricks and of coarser cells, and how far filled pixels are from samples, for fill.c. */
#ifndef PSR_RENDER_FILL_BRICKS_H
#define PSR_RENDER_FILL_BRICKS_H

#include <stddef.h>
#include "fill.h"

/* Pixels of a row in one call. Row by row: shorter steps defeat the prefetcher, and a pull takes a quarter longer. */
#define FILL_PIECE 256

static inline struct fill_row fill_row_at(const struct fill_level *level, int32_t x, int32_t y)
{
	const ptrdiff_t at = (ptrdiff_t)(y - level->top) * (ptrdiff_t)level->stride + (x - level->left);
	const struct fill_row *cell = &level->cell;

	return (struct fill_row){ cell->r + at,      cell->g + at, cell->b + at,
		                      cell->weight + at, cell->z + at, cell->near + at };
}

/* `own` of a row of pixels, with one more on each side; rows -1 and `height` are there, too. */
static inline float *fill_own_row(const struct fill *fill, uint32_t y)
{
	return fill->own + (size_t)(y + 1) * (fill->width + 2) + 1;
}

/* The threshold among cells of a level. */
static inline float fill_scale(const struct plan *plan, int level)
{
	return plan->gap_scale[level < PSR_MAX_DEPTH_LEVEL ? level : PSR_MAX_DEPTH_LEVEL];
}

static inline float fill_offset(const struct plan *plan, int level)
{
	return plan->gap_offset[level < PSR_MAX_DEPTH_LEVEL ? level : PSR_MAX_DEPTH_LEVEL];
}

static inline int fill_has_colors(const struct fill *fill)
{
	return fill->picture.rgb != NULL || fill->plan->is_wide;
}

static inline void fill_note_depth(struct fill *fill, int level)
{
	int seen = atomic_load(&fill->deepest);

	while (seen < level && !atomic_compare_exchange_weak(&fill->deepest, &seen, level))
		;
}

enum fill_coarse { FILL_PULLED = 1, FILL_NEEDED = 2 };

/* Finds the bricks and coarse cells needed by bricks that are not whole at their own level: upwards until all needed
 * cells are whole, or to the top. Pulls weights and depths of these cells. */
void fill_find_coarse(struct fill *fill);

/* Pulls and pushes the levels with cells larger than a brick. All of their cells, since they are few; cells that
 * fill_find_coarse() did not pull are undefined, and nothing reads them. */
void fill_run_coarse(struct fill *fill);

/* Pulls weights and depths of bricks bx0..bx1-1 of brick row `by` from the finer level to `level`; returns the least
 * weight. */
uint16_t fill_pull_weights(struct fill *fill, uint32_t bx0, uint32_t bx1, uint32_t by, int level);

/* Pulls their colours, after their weights. */
void fill_pull_colors(struct fill *fill, uint32_t bx0, uint32_t bx1, uint32_t by, int level);

/* Pushes to their cells of a level, from the coarser level. is_early: only to cells that read none of the bricks above
 * and below. */
void fill_push_level(struct fill *fill, uint32_t bx0, uint32_t bx1, uint32_t by, int level, int is_early);

/* Pixels. far: their depth changed, and no sample was found within FILL_NEAR, or none is looked for, when any number
 * stands for all; reach: the greatest distance of any other such one to the nearest sample, in pixels of its depth. */
struct fill_counts {
	uint32_t n_changed, n_filled, n_far;
	float reach;
};

/* Notes in `own` the samples that pixels of bricks bx0..bx1-1 show, while their weights are there; forgets those that
 * an earlier picture had in a brick. */
void fill_note_own(struct fill *fill, uint32_t bx0, uint32_t bx1, uint32_t by);
void fill_forget_own(struct fill *fill, uint32_t bx, uint32_t by);

/* Notes how far listed pixels of a row that begins at (x, y) are from samples, and changes the depths that fill.h says
 * another surface's pixels are to have. */
void fill_note_depths(struct fill_counts *counts, const struct fill *fill, uint32_t x, uint32_t y,
                      struct fill_places *places, uint32_t n);

/* Adds what was noted to the bound of the frame's error. */
void fill_add_error(struct psr_report *report, const struct fill *fill);

/* Pushes to their pixels. Adds to the counts. */
void fill_push_bricks(struct fill *fill, struct fill_counts *counts, uint32_t bx0, uint32_t bx1, uint32_t by,
                      int is_early);

#endif
