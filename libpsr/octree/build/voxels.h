/* Octrees of surfaces: the leaves that triangles meet. */
#ifndef PSR_OCTREE_BUILD_VOXELS_H
#define PSR_OCTREE_BUILD_VOXELS_H

#include "octree/octree.h"

struct octree_surface {
	const double (*position)[3];  /* finite */
	const uint32_t (*triangle)[3];
	uint32_t n_triangles;         /* 1 at least */
	double low[3], edge;          /* a cube that holds all positions; edge > 0 */
};

/* Builds a tree without attributes: a leaf for each closed cell that a triangle meets. Sorts in `memory` bytes, in runs
 * in `folder`. ARG: levels out of range; IO, MEMORY. */
int octree_from_surface(struct octree **out, const struct octree_surface *surface, int levels, uint64_t memory,
                        const char *folder, struct psr_error *err);

#endif
