/* What the warp leaves: a word a pixel, and depth buffers of coarser cells. */
#ifndef PSR_SIMD_ZSTACK_H
#define PSR_SIMD_ZSTACK_H

#include <stddef.h>
#include <stdint.h>
#include "base/maths.h"

#define PSR_MAX_DEPTH_LEVEL 7 /* the coarsest level buffer has cells of 2^7 pixels */

struct psr_zstack {
	uint32_t width, height;
	uint32_t gap;       /* words between a row's last and the next row's first */
	uint64_t *word;     /* (width + gap) * height: bits of the float z' << 32 | sample id; PSR_WORD_EMPTY */
	unsigned place_bits; /* 0, or PSR_PLACE_BITS: ids are so far above where in their pixels samples lie */
	uint32_t levels;    /* bit k: level[k] is in use, 1 <= k <= PSR_MAX_DEPTH_LEVEL */
	struct {
		float *z;       /* plain minimum of z' a cell, +inf where nothing is; a guard band of one cell on each side */
		uint32_t width, height; /* cells with the band: ceil(frame / 2^k) + 2 */
	} level[PSR_MAX_DEPTH_LEVEL + 1];
	int exponent;       /* z' here is world z' * 2^-exponent: no stage knows an absolute length */
};
#define PSR_WORD_EMPTY UINT64_C(0x7f800000ffffffff)

/* z' of a word; of an empty one infinity. */
static inline float psr_word_z(uint64_t word)
{
	return psr_float_from_bits((uint32_t)(word >> 32));
}

#define PSR_PLACE_BITS 4 /* quarters of a pixel: right, and four times those down */
#define PSR_PLACE_NONE 16

static inline uint64_t *psr_zstack_row(const struct psr_zstack *stack, uint32_t y)
{
	return stack->word + (size_t)y * (stack->width + stack->gap);
}

#endif
