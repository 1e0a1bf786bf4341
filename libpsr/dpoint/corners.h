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
};

int corners_init(struct corners *corners, const struct psr_mesh *mesh,
                 const struct dpoint_mesh_options *options); /* MEMORY; corners_fini() even then */
void corners_fini(struct corners *corners);

#endif
