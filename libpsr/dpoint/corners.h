/* Corners of triangles by place and normal, and their curvatures. */
#ifndef PSR_DPOINT_CORNERS_H
#define PSR_DPOINT_CORNERS_H

#include "mesh.h"

/* A corner that triangles share; edges between two of them that have one triangle only are open: creases, borders. */
struct corner {
	double at[3], normal[3]; /* inner units */
	double tensor[6];        /* second form as a symmetric matrix: xx, xy, xz, yy, yz, zz; 0 across the normal */
};

struct corners {
	struct corner *corner;
	uint32_t n, n_bad;
	uint32_t *of;      /* of each triangle's three corners */
	uint8_t *is_open;  /* bit i of a triangle: the edge from its corner i to the next */
	uint32_t *next;    /* of each triangle's three edges: which one of another triangle it is, 3 * triangle + edge;
	                    * UINT32_MAX: of none, or of several */
};

int corners_init(struct corners *corners, const struct psr_mesh *mesh,
                 const struct dpoint_mesh_options *options); /* MEMORY; corners_fini() even then */
void corners_fini(struct corners *corners);

/* Returns the sine of the angle at which the next face goes on from a triangle's edge: 1 from a right one on, and where
 * there is no such face. */
float corners_bend(const struct corners *corners, const struct psr_mesh *mesh, uint32_t triangle, int edge);

#endif
