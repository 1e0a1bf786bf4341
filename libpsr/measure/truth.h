/* Single rays of a truth, for the measures of this folder. */
#ifndef PSR_MEASURE_TRUTH_H
#define PSR_MEASURE_TRUTH_H

#include "psr/measure.h"
#include "view.h"

/* Whether any of side * side rays spread over the n * n pixels from (x, y) on meets the object. */
int truth_is_met(const struct psr_truth *truth, const struct view *view, double near_z, double x, double y, int n,
                 int side);

/* Distance from a point of the world to the nearest point of the mesh, or `most` if that is less. */
double truth_distance(const struct psr_truth *truth, const double point[3], double most);

#endif
