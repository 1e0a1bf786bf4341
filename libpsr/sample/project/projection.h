/* The directions from which an object is sampled.
 *
 * [G] 5.1 takes the centres of the 32 triangles of the sphere subdivided once: some normals are 32.4 degrees from the
 * nearest. The 12 corners of an icosahedron with the 20 middles of its faces are as many, and no normal is further
 * than 22.6 degrees: within the tolerance of 25 that [G] 4.4 wants. */
#ifndef PSR_SAMPLE_PROJECT_PROJECTION_H
#define PSR_SAMPLE_PROJECT_PROJECTION_H

#include "model/blocks.h"

#define N_PROJECTIONS 32

/* Number i ^ 1 sees the lattice of number i from behind: its axes are -x, y, -z.
 *
 * ds: a pixel at the target resolution, inner units. Axes and the spacing ds * cos(tolerance) ([G] 4.4) are rounded
 * to the floats that models hold. */
void projection_list(struct psr_projection list[N_PROJECTIONS], double ds, double tolerance);

/* Between inner coordinates and those along the projection's axes. */
static inline void projection_project(const struct psr_projection *projection, const float p[3], float out[3])
{
	for (int k = 0; k < 3; k++)
		out[k] = projection->axis[k][0] * p[0] + projection->axis[k][1] * p[1] + projection->axis[k][2] * p[2];
}

static inline void projection_inner(const struct psr_projection *p, double x, double y, double z, double inner[3])
{
	for (int k = 0; k < 3; k++)
		inner[k] = x * (double)p->axis[0][k] + y * (double)p->axis[1][k] + z * (double)p->axis[2][k];
}

#endif
