/* Fill: pull-push ([G] 4.7, appendix). */
#ifndef PSR_RENDER_FILL_H
#define PSR_RENDER_FILL_H

#include <stdatomic.h>
#include "plan.h"

#define FILL_LEVELS 15      /* 2^14 is the largest side */
#define FILL_BRICK_LEVELS 5 /* where a brick is one cell */

/* For a pixel that gets its depth from cells, samples are looked for that it or pixels around it show, in pictures whose
 * samples are close: cells of FILL_CLOSE and coarser levels are not in use, or discs cover what is between samples. In
 * others most pixels have no sample near, and count the reach of cells. They are looked for in the smallest
 * square with one that is FILL_APART pixels away at most along the view axis, and one pixel more to all sides; at most
 * FILL_NEAR to each. But if the smallest square with any, and one pixel more, has FILL_MANY and none so near along the
 * axis, it is among pixels of another surface, and gets the depth of the one that is nearest along the axis. */
#define FILL_CLOSE 2
#define FILL_NEAR 8
#define FILL_APART 2 /* pixels */
#define FILL_MANY 6

/* The cells of one level, with a border outside of the picture; `cell` is the one at (left, top). */
struct fill_level {
	uint32_t width, height; /* of the picture */
	int32_t left, top;
	uint32_t stride;
	struct fill_row cell;
};

/* The picture to fill. In the bricks that fill_wants flags, the linear colours r, g, b of all pixels with weight above
 * 0, the background's too, are valid. */
struct fill_picture {
	const struct psr_zstack *stack;
	uint16_t *weight;      /* becomes WEIGHT_ONE where filled */
	const uint8_t *bricks; /* as gaps_rows marks them */
	uint16_t *r, *g, *b;
	const uint8_t *srgb;   /* 8 bits of 16-bit linear light */
	uint8_t *rgb;          /* 3 * width * height, or NULL: then r, g and b take the colours of a wide plan */
	float *depth;          /* world units, or NULL */
};

struct fill {
	struct fill_level level[FILL_LEVELS]; /* of 1..top, the single cell */
	int top, brick_top;                   /* brick_top: the coarsest level that a brick pulls by itself */
	uint32_t width, height, bricks_x, bricks_y;
	uint8_t *pulled;  /* by brick: level to which weights and depths are pulled */
	uint8_t *whole;   /* by brick: finest level with whole cells only; brick_top + 1: none; 0: not marked */
	uint8_t *needs;   /* by marked brick: the greatest of `whole` around it */
	uint32_t *left;   /* by brick, a bit a row: the row may have pixels that are not whole */
	uint8_t *wants;   /* by brick: number of levels to pull */
	float *own;       /* z' of samples that marked bricks' pixels show: those of any weight; NAN of others and around */
	uint8_t *coarse;  /* by cell of levels from brick_top: enum fill_coarse */
	size_t coarse_first[FILL_LEVELS], n_coarse;
	int looks;        /* for samples around pixels */
	int is_coarse;    /* a brick needs levels beyond brick_top */
	int needed;       /* the greatest of `needs` */
	int pushed;       /* the level that is being pushed; 0: the picture */
	void *storage;
	size_t storage_size;
	/* The picture in progress. */
	const struct simd *simd;
	const struct plan *plan;
	struct fill_picture picture;
	_Atomic int deepest; /* coarsest level with a cell of weight below a half: its depth comes from a coarser one */
	_Atomic uint64_t n_changed, n_filled; /* as of fill_counts, as are the next two */
	_Atomic uint64_t n_far;
	_Atomic float reach;
};

/* Filling takes four steps; each begins when the one before has ended. Any thread may run the steps that take a row of
 * bricks, in any order; they run while the row's pixels are in the cache, looking after gaps_rows, pulling after
 * shading. */
/* MEMORY, CANCELLED. */
int fill_begin(struct fill *fill, const struct simd *simd, const struct plan *plan, const struct fill_picture *picture);
void fill_clear(struct fill *fill);

/* 1. Finds, from weights and depths, which coarser levels the row's bricks need. */
void fill_look(struct fill *fill, uint32_t row);

/* 2. Finds what they need of other bricks. Returns a byte a brick, not 0 where the fill needs the brick's 16-bit
 * colours. Returns early if the frame is cancelled. */
const uint8_t *fill_wants(struct fill *fill);

/* 3. Pulls the coarser levels that are needed from the row's colours, and pushes to pixels that need no other row. */
void fill_pull(struct fill *fill, uint32_t row);

/* 4. Pushes: sets the colour of every pixel of weight below WEIGHT_ONE and, where the weight is below a half, its
 * depth, see above. Other pixels of rgb and depth stay. Adds the stage's counts to the report, and to its error
 * bound how far such a place may be from one that a sample shows. CANCELLED. */
int fill_push(struct fill *fill, struct psr_pool *pool, struct psr_report *report);

#endif
