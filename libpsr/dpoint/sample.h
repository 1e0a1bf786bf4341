/* Patches to candidates and cells. */
#ifndef PSR_DPOINT_SAMPLE_H
#define PSR_DPOINT_SAMPLE_H

#include "patch.h"
#include "surface.h"

/* Samples each span of a patch uniformly, as [K] 6 does: n x n candidates in the middles of as many rectangles of
 * parameters, of cells x cells cells each. scale: lengths of the patch to inner units. MEMORY. */
struct dpoint_uniform {
	uint32_t n, cells;
	double origin[3], scale;
	float delta;
	uint32_t part;
	uint64_t attr; /* of all points, without a normal */
	float sine;    /* of epsilon: where the rectangle of a sample is not over all of its part, each of the part's cells gets
	                * a sample of its own; 0: none does */
};
int dpoint_sample_uniform(struct dpoint_surface *surface, const struct dpoint_patch *patch,
                          const struct dpoint_uniform *uniform);

#endif
