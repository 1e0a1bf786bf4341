/* Drawing of bare depths for visibility: all samples of a level, from far away, two opposite sides at once. */
#ifndef PSR_SAMPLE_PACK_VISIBILITY_MASK_DRAW_H
#define PSR_SAMPLE_PACK_VISIBILITY_MASK_DRAW_H

#include <stdint.h>
#include "base/direction.h"
#include "model/blocks.h"

/* The samples of a model, unpacked. Each array is readable for VPOINTS_BEYOND elements beyond its last. */
#define VPOINTS_BEYOND 64

struct vpoints {
	const struct psr_blocks *blocks;
	float *x, *y, *z;
	uint16_t *normal; /* PSR_DIRECTIONS: that of a two-sided block, which faces everybody */
	float reach;      /* from the origin */
};

int vpoints_init(struct vpoints *points, const struct psr_blocks *blocks); /* MEMORY */
void vpoints_fini(struct vpoints *points);

/* Blocks of one level, and the greatest distance of neighbours on their lattices. */
struct vlevel {
	uint32_t n_blocks, n_runs;
	uint32_t *block;
	uint32_t (*run)[2]; /* of samples: first and end */
	float spacing;
};

int vlevel_init(struct vlevel *level, const struct vpoints *points, unsigned which); /* MEMORY */
void vlevel_fini(struct vlevel *level);

/* Pixels around a sample among which there may be one through which it is seen. */
#define VPICTURE_REACH 2

/* Square pixels, seen from both ends of an axis: from its end 0 and, through the same pixels, from its end 1. */
struct vpicture {
	int side;
	float scale, offset[2];                 /* pixel = scale * coordinate + offset */
	float frame[3][3];                      /* rows: right, up, towards end 0 */
	uint8_t faces[PSR_DIRECTIONS + 1];      /* bit e: a normal faces end e */
	/* Heights along the axis, negated for end 1, so that greater ones are nearer, two a pixel: of what is nearest to
	 * either end, -INFINITY where nothing is; and the least of all within VPICTURE_REACH columns, then rows, too. */
	float *nearest, *row, *farthest;
};

/* Pixels a little greater than the level's spacing, or greater ones if those were too many. MEMORY. */
int vpicture_init(struct vpicture *picture, const struct vpoints *points, const struct vlevel *level);
void vpicture_fini(struct vpicture *picture);

/* Draws all of the level; `axis` is a unit vector towards end 0, and seed shifts the pixels by a part of one. */
void vpicture_draw(struct vpicture *picture, const struct vpoints *points, const struct vlevel *level,
                   const double axis[3], uint32_t seed);

/* Whether any sample of the block is seen from an end: it faces it and is not behind the farthest of the pixels around
 * it. */
int vpicture_sees(const struct vpicture *picture, const struct vpoints *points, uint32_t block, int end);

#endif
