/* Octrees of meshes: the leaves that a surface meets, with its normals, filtered colours, materials and offsets ([B]
 * 5.1). */
#ifndef PSR_SAMPLE_OCTREE_OF_MESH_H
#define PSR_SAMPLE_OCTREE_OF_MESH_H

#include "octree/build/build.h"
#include "psr/mesh.h"

struct octree_mesh_report {
	uint64_t n_both; /* leaves that hold two sides, whose normals are more than 120 degrees apart: of thin sheets, and
	                  * of sharp edges. Their normal is of the side with the greater area */
	int is_closed;   /* the surface has no rim: with n_both 0 nobody outside sees a leaf from its back */
};

/* Builds a tree with normals, offsets, colours and materials: one of all leaves, if they are the same. A leaf's normal,
 * colour and material are means over the surface within the leaf, weighted by area; where what shines has an edge, the
 * normal is that of the face with the most area. Textures are filtered over a circle of the leaf's diagonal. The offset
 * is where the line through the leaf's middle along the normal meets the surface, as near to the middle as it does;
 * where it misses, where the middle of the surface within the leaf lies along it. Transparent places have no leaves,
 * nor have cells that a surface only touches. Normals are on the side from which the triangles are counter-clockwise;
 * closed parts of two-sided materials that are inside out are turned. The tree is one-sided if the surface is closed
 * and few leaves hold two sides. report may be NULL.
 *
 * ARG: options out of range, no triangles; FORMAT: nothing is opaque; IO, MEMORY, CANCELLED. */
int octree_of_mesh(struct octree **out, struct octree_mesh_report *report, const struct psr_mesh *mesh,
                   const struct octree_build_options *options, struct psr_error *err);

/* ---- the steps ---- */

/* closed.c: parts of the surface hang together by positions. Sets *is_turned[t], for each triangle, if it belongs to a
 * closed part of two-sided materials alone whose volume is below 0; *is_closed as above. The caller frees. MEMORY,
 * without a text. */
int octree_mesh_sides(uint8_t **is_turned, int *is_closed, const struct psr_mesh *mesh);

/* clip.c: what of a triangle is within the cube from 0 to 1. */
#define CLIP_CORNERS 9

struct clip {
	int n;                            /* corners, 0 or 3 at least */
	double corner[CLIP_CORNERS][3];
};

void clip_triangle(struct clip *clip, const double corner[3][3]);
/* Returns the area and the centroid of corners 0, i + 1 and i + 2. */
double clip_fan(const struct clip *clip, int i, double centroid[3]);
/* Returns whether all corners have 1 along an axis where the cube is not the last one: bit c of `is_last`. */
int clip_is_next_ones(const struct clip *clip, unsigned is_last);

#endif
