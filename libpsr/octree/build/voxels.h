/* Octrees of surfaces: the leaves that triangles meet. */
#ifndef PSR_OCTREE_BUILD_VOXELS_H
#define PSR_OCTREE_BUILD_VOXELS_H

#include <stddef.h>
#include "octree/octree.h"
#include "base/pool.h"

struct octree_surface {
	const double (*position)[3];  /* finite */
	const uint32_t (*triangle)[3];
	uint32_t n_triangles;         /* 1 at least */
	double low[3], edge;          /* a cube that holds all positions; edge > 0 */
	const struct psr_cancel *cancel; /* may be NULL */
};

/* Finds where a vertex is along an axis, in leaves, of which there are `side` along the cube's edge, `scale` a unit:
 * within the cube, however places round. */
static inline double octree_surface_place(const struct octree_surface *surface, uint32_t vertex, int axis, double side,
                                          double scale)
{
	const double at = (surface->position[vertex][axis] - surface->low[axis]) * scale;

	return at < 0.0 ? 0.0 : at > side ? side : at;
}

/* Builds a tree without attributes: a leaf for each closed cell that a triangle meets. Sorts in `memory` bytes, in runs
 * in `folder`. ARG: levels out of range; IO, MEMORY, CANCELLED. */
int octree_from_surface(struct octree **out, const struct octree_surface *surface, int levels, uint64_t memory,
                        const char *folder, struct psr_error *err);

/* Where to sort. */
struct octree_room {
	uint64_t memory;    /* bytes */
	const char *folder; /* for runs */
};

/* Visits the same leaves, in Morton order, with the triangles that meet each, in ascending order: pairs of both are
 * sorted. A visitor that returns something else than PSR_OK ends the walk, which returns it. */
int octree_surface_walk(const struct octree_surface *surface, int levels, const struct octree_room *room,
                        int (*visit)(uint64_t path, const uint32_t *triangle, size_t n, void *userdata), void *userdata,
                        struct psr_error *err);

#endif
