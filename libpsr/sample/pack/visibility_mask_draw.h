/* Draws depths alone, for visibility: all samples of a level, from far away, from two opposite sides at once. */
#ifndef PSR_SAMPLE_PACK_VISIBILITY_MASK_DRAW_H
#define PSR_SAMPLE_PACK_VISIBILITY_MASK_DRAW_H

#include <stdint.h>
#include "base/direction.h"
#include "model/blocks.h"

/* A model's samples, unpacked. Each array is readable for MASK_POINTS_BEYOND elements beyond its last. */
#define MASK_POINTS_BEYOND 64

struct mask_points {
	const struct psr_blocks *blocks;
	float *x, *y, *z;
	uint16_t *normal; /* PSR_DIRECTIONS: of a two-sided block, which faces all views */
	float reach;      /* from the origin */
};

int mask_points_init(struct mask_points *points, const struct psr_blocks *blocks); /* MEMORY */
void mask_points_fini(struct mask_points *points);

/* Blocks of one level, and the greatest distance of neighbours on their lattices. */
struct mask_level {
	uint32_t n_blocks, n_runs;
	uint32_t *block;
	uint32_t (*run)[2]; /* of samples: first and end */
	float spacing;
};

int mask_level_init(struct mask_level *level, const struct mask_points *points, unsigned which); /* MEMORY */
void mask_level_fini(struct mask_level *level);

/* A sample may be seen through a pixel so many pixels away. */
#define MASK_PICTURE_REACH 2

/* A square picture along an axis, from its end 0 and, through the same pixels, from its end 1. */
struct mask_picture {
	int side;
	float scale, offset[2];                 /* pixel = scale * coordinate + offset */
	float basis[3][3];                      /* rows: right, up, towards end 0 */
	uint8_t faces[PSR_DIRECTIONS + 1];      /* bit e: a normal faces end e */
	/* Heights along the axis, negated for end 1, so that greater ones are nearer, two a pixel: of the sample nearest to
	 * either end, -INFINITY in an empty pixel; and the least of all within MASK_PICTURE_REACH columns, then also
	 * rows. */
	float *nearest, *row, *farthest;
};

/* Pixels are a little greater than the level's spacing, or greater if they were too many. MEMORY. */
int mask_picture_init(struct mask_picture *picture, const struct mask_points *points, const struct mask_level *level);
void mask_picture_fini(struct mask_picture *picture);

/* Draws all of the level; `axis` is a unit vector towards end 0, and seed shifts the pixels by a part of one. */
void mask_picture_draw(struct mask_picture *picture, const struct mask_points *points, const struct mask_level *level,
                   const double axis[3], uint32_t seed);

/* Returns whether a sample of the block is seen from an end: it faces the end, and is not behind the farthest of the
 * pixels around it. */
int mask_picture_sees(const struct mask_picture *picture, const struct mask_points *points, uint32_t block, int end);

#endif
