/* The surface of one triangle within a leaf, and which faces such facets are of. */
#ifndef PSR_SAMPLE_OCTREE_FACET_H
#define PSR_SAMPLE_OCTREE_FACET_H

#include <stddef.h>
#include <stdint.h>
#include "surface/material.h"

struct facet {
	uint32_t triangle;
	double corner[3][3]; /* of the whole triangle, in leaves from the leaf's low corner */
	double area, middle[3];
	float normal[3];
	struct look look;
};

/* Both keep the order of the facets that they leave, and at least one of at least one. */

/* Leaves the facets on the side of the greatest one. Returns whether any is of another side. */
int facets_keep_side(struct facet *facet, size_t *n);

/* Where the normals around that of the greatest facet and those around the one farthest from it are of two faces, leaves
 * those of the face with more area. Returns whether there were two. */
int facets_keep_face(struct facet *facet, size_t *n);

#endif
