/* How far the normals of leaves lean from the faces that they are of: where vertices' normals round wide faces, and where
 * a normal map tilts them. Leaves of such a face would turn away before the face does, and leave a slit open. */
#ifndef PSR_SAMPLE_OCTREE_LEAN_H
#define PSR_SAMPLE_OCTREE_LEAN_H

#include "facet.h"
#include "octree/octree.h"
#include "psr/mesh.h"

struct lean_cell {
	uint32_t n_leaves, n[91]; /* those that open slits, by degrees from 0 on; the last one: 90 and more */
};

struct lean {
	const struct psr_mesh *mesh;
	const uint8_t *is_turned; /* as of octree_mesh_sides() */
	int levels;
	struct lean_cell *cell;   /* OCTREE_LEAN_CELLS, zero at first */
};

/* Adds a leaf of this path and normal (unit). */
void lean_add(struct lean *lean, uint64_t path, const float normal[3], const struct facet *facet, size_t n_facets);

/* Sets octree.lean, or leaves it NULL. Returns 0 without memory. */
int lean_set(struct octree *tree, const struct lean *lean);

#endif
