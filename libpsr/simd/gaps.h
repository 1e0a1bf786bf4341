/* Kernel of gap finding ([G] 4.6). */
#ifndef PSR_SIMD_GAPS_H
#define PSR_SIMD_GAPS_H

#include "zstack.h"

/* How a surface covers what lies behind it between its samples. */
enum psr_gap_method {
	PSR_GAPS_BILINEAR, /* [G] 4.6: by cells of the depth buffers, by the distance to their centres */
	PSR_GAPS_OPAQUE,   /* by cells as opaque squares; both are kept for comparison */
	PSR_GAPS_CLOSED    /* levels 1 and 2 by depths, closed over the distance of samples; coarser ones bilinear */
};

#define GAPS_WIDTH 128 /* a multiple of the coarsest cell */
#define GAPS_BRICK 32
#define GAPS_WHOLE 256 /* the weight of an uncovered pixel */

/* A cell of level k at z' covers pixels beyond scale[k] * z' + offset[k], closed depths of level k
 * beyond scale[k - 1] * z' + offset[k - 1]. */
struct gaps_target {
	const struct psr_zstack *stack;
	const float *scale, *offset; /* by level */
	uint16_t *weight;            /* stack->width * stack->height */
	enum psr_gap_method method;
	/* Room for all pixels of a piece, or NULL: takes y * GAPS_WIDTH + x, from the piece's first pixel, of those in slits,
	 * which have a weight and lie behind at least six of their eight neighbours by more than level 1's threshold. */
	uint16_t *slit;
};

struct gaps_counts {
	uint32_t n_partial;  /* pixels with a sample and a weight below GAPS_WHOLE */
	uint32_t n_pinholes; /* pixels, with a sample or without, that the guard closed and no cell covers whole */
	uint32_t n_marked;   /* bricks with a weight below GAPS_WHOLE */
	uint32_t n_slits;    /* pixels listed */
};

/* Computes weights of the pixels x0 <= x < x1, y0 <= y < y1: the share, of GAPS_WHOLE, that no nearer cell covers; 0
 * for pinholes. x0 is a multiple of GAPS_WIDTH, x1 at most GAPS_WIDTH more; y0 a multiple of GAPS_BRICK, y1 at most
 * GAPS_BRICK more. Sets marks[i], for the GAPS_WIDTH / GAPS_BRICK bricks side by side, to whether brick i has a weight
 * below GAPS_WHOLE. */
typedef struct gaps_counts gaps_fn(const struct gaps_target *target, uint32_t x0, uint32_t x1, uint32_t y0, uint32_t y1,
                                   uint8_t *marks);

#endif
