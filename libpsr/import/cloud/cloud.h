/* Clouds: what import_cloud_finish is made of, and what the readers of scans share. Shared by cloud*.c, ply*.c, las*.c.
 *
 * Points are put in order by a tree, and within these files a point is its place in that order: a slot. Slots,
 * neighbours and results depend on the points and their order in the file alone, never on threads. */
#ifndef PSR_IMPORT_CLOUD_CLOUD_H
#define PSR_IMPORT_CLOUD_CLOUD_H

#include "import/import.h"
#include "base/pool.h"

#define CLOUD_NEIGHBOURS 16

struct cloud_point {
	double at[3]; /* from the middle of the bounds, in units of half their longest side */
	uint32_t id;  /* index in the mesh */
};

struct cloud_node; /* of the tree */

struct cloud {
	uint32_t n, k;              /* points, and neighbours of each: 1..CLOUD_NEIGHBOURS, less than n; 0 if n is 1 */
	double middle[3], unit;     /* of the file's coordinates; unit is 1 if all points are one */
	struct cloud_point *point;  /* n */
	uint32_t *near; /* n * k slots: the k nearest of each point, itself left out, nearest first; of equally far
	                 * ones the one that stands first in the file */
	float (*normal)[3];         /* n, unit length */
	uint8_t *is_given;          /* n: the normal is the file's */
	float *radius;              /* n, in units */
	float *open_radius;         /* n: before they were held to those around them */
	struct cloud_node *node;
	uint32_t n_nodes;
	struct psr_pool *pool;
};

/* tree.c: a k-d tree over the points, whose positions are finite; then near. MEMORY, without a text. */
int cloud_tree_build(struct cloud *cloud, const double (*position)[3]);
void cloud_tree_nearest(struct cloud *cloud);

/* plane.c: normals where none is given, as the direction in which a point and its neighbours extend least, of
 * either sign ([Hoppe et al. 1992, "Surface Reconstruction from Unorganized Points"] 3.1), and radii: the distance to
 * the farthest corner of the point's cell in the Voronoi diagram of its neighbours, seen along the normal. Discs of
 * exactly these radii cover a flat sampling, however uneven. Where the cells are open (an edge, a wire) the open side
 * does not count; a point that is far from others than those are from theirs is held to twice their radius. */
void cloud_planes(struct cloud *cloud);

/* orient.c: turns the normals that are not given so that neighbours agree, along a minimal spanning tree of the
 * neighbours ([Hoppe et al. 1992] 3.3): outwards on what is closed, upwards on what is more flat than closed. MEMORY,
 * without a text. */
int cloud_orient(struct cloud *cloud);

/* Linear light of an sRGB code of 0..255 that may lie between two codes (16 bits a channel); clamped, NaN gives 0. */
float cloud_linear(double code);

#endif
