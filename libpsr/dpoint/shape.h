/* Curvatures of what has no formula, by least squares over neighbours. */
#ifndef PSR_DPOINT_SHAPE_H
#define PSR_DPOINT_SHAPE_H

#include "dpoint.h"

struct dpoint_neighbour {
	double at[3], normal[3]; /* normal: of unit length; 0,0,0 if it is not known */
};

/* Computes local->shape; place and axes are given. A neighbour tells its height above the tangent plane, which is what
 * Desbrun and others fit (Meyer, Desbrun, Schroeder, Barr, "Discrete Differential-Geometry Operators", 2003, 5.2), and
 * its normal the slope there. Returns 0 if neighbours leave a curvature open: too few, or all along one line. */
int dpoint_shape_of_ring(struct dpoint_local *local, const struct dpoint_neighbour *neighbour, uint32_t n);

/* Computes place, axes and shape from places alone, for clouds: a polynomial of the second degree in a frame that turns
 * with it (a jet: Cazals and Pouget, "Estimating differential quantities using polynomial fitting of osculating jets",
 * 2005). local->at and a normal in local->axis[2] to begin with are given; neighbours' normals do not matter. The place
 * moves along the normal to the polynomial. *off: how far neighbours are off it, root mean square. Returns 0 as above:
 * five neighbours at least. */
int dpoint_shape_of_cloud(struct dpoint_local *local, double *off, const struct dpoint_neighbour *neighbour,
                          uint32_t n);

#endif
