/* The directions from which an object is sampled.
 *
 * [G] 5.1 takes the centres of the 32 triangles of the sphere subdivided once: some normals are 32.4 degrees from the
 * nearest. The 12 corners of an icosahedron with the 20 middles of its faces are as many, and no normal is further
 * than 22.6 degrees: within the tolerance of 25 that [G] 4.4 wants. */
#ifndef PSR_SAMPLE_PROJECT_PROJECTION_H
#define PSR_SAMPLE_PROJECT_PROJECTION_H

#include "model/blocks.h"

#define N_PROJECTIONS 32

/* Number i ^ 1 looks at the other side of the same lattice as number i: its axes are -x, y, -z.
 *
 * ds: a pixel at the target resolution, inner units. Frames and the spacing ds * cos(tolerance) ([G] 4.4) are rounded
 * to the floats that models hold. */
void projection_list(struct psr_projection list[N_PROJECTIONS], double ds, double tolerance);

#endif
