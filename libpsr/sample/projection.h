/* The directions from which an object is sampled.
 *
 * [G] 5.1 takes the centres of the 32 triangles of the sphere subdivided once. They are followed by the 66 corners of
 * the sphere subdivided twice: the axes and the circles of the coordinate planes are among them, which look squarely at
 * the faces and into the slots of built things, and lie farthest from the 32. */
#ifndef PSR_SAMPLE_PROJECTION_H
#define PSR_SAMPLE_PROJECTION_H

#include "psr/model.h"

#define N_PROJECTIONS 98

/* Further ones, the new corners of the sphere subdivided three times, are taken only where they find what those missed:
 * the bottoms of deep slots and holes, which are seen from few sides. */
#define N_SCOUTS 192
#define MOST_PROJECTIONS (N_PROJECTIONS + N_SCOUTS)

/* ds: a pixel at the target resolution, inner units. Frames and the spacing ds * cos(tolerance) ([G] 4.4) are rounded
 * to the floats that models hold. */
void projection_list(struct psr_projection list[MOST_PROJECTIONS], double ds, double tolerance);

#endif
