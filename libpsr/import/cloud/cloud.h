/* Clouds: the steps of import_cloud_finish, and helpers of the readers of scans.
 *
 * A tree sorts the points; these files address a point by its place in that order, its slot. Slots, neighbours and
 * results depend on the points and their order in the file alone, never on threads. */
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
	double middle[3], unit;     /* of the file's coordinates; unit is 1 if all points coincide */
	struct cloud_point *point;  /* n */
	uint32_t *near; /* n * k slots: the k nearest of each point, nearest first, then in the file's order */
	float (*normal)[3];         /* n, unit length */
	uint8_t *is_given;          /* n: the normal is the file's */
	float *radius;              /* n, in units */
	float *open_radius;         /* n: before limiting by the neighbours' */
	struct cloud_node *node;
	uint32_t n_nodes;
	struct psr_pool *pool;
};

/* tree.c: builds a k-d tree over the points, whose positions are finite; finds `near`. MEMORY, without a text. */
int cloud_tree_build(struct cloud *cloud, const double (*position)[3]);
void cloud_tree_nearest(struct cloud *cloud);

/* plane.c: estimates missing normals, of either sign, as the direction of least extent of a point and its neighbours
 * ([Hoppe et al. 1992, "Surface Reconstruction from Unorganized Points"] 3.1), and radii as the distance to the
 * farthest corner of the point's Voronoi cell among its neighbours, seen along the normal. Discs of exactly these radii
 * cover a flat sampling, however uneven. Open sides of a cell (an edge, a wire) do not count. A point further from its
 * neighbours than they are from theirs gets at most twice their radius. */
void cloud_planes(struct cloud *cloud);

/* orient.c: turns estimated normals so that neighbours agree, along a minimal spanning tree of the neighbours ([Hoppe
 * et al. 1992] 3.3): outwards on closed surfaces, upwards on flat ones. MEMORY, without a text. */
int cloud_orient(struct cloud *cloud);

/* Converts an sRGB code of 0..255, which may be fractional (16 bits a channel), to linear light. Clamps; NaN gives 0.
 * */
float cloud_linear(double code);

/* Intensities have no unit: returns the bin at which few points exceed white. */
#define CLOUD_BINS 65536
double cloud_white(const uint64_t histogram[CLOUD_BINS]);

#endif
