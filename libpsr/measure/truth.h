/* Single rays of a truth, for the measures of this folder. */
#ifndef PSR_MEASURE_TRUTH_H
#define PSR_MEASURE_TRUTH_H

#include "ray/ray.h"
#include "measure.h"
#include "view.h"

/* Whether any of side * side rays spread over the n * n pixels from (x, y) on meets the object. */
int truth_is_met(const struct psr_truth *truth, const struct view *view, double near_z, double x, double y, int n,
                 int side);

/* What n rays through places of the picture (x, y in pixels) meet first, and how much of a light gets there: facing is
 * the cosine between the face's normal, on the side that is seen, and the light; -2 where nothing is met. */
struct truth_light {
	double facing;
	int is_shadowed;
};
void truth_light(const struct psr_truth *truth, const struct view *view, double near_z, const struct psr_light *light,
                 const double (*place)[2], int n, struct truth_light *out);

/* The ray through a place in the picture, in the mesh's inner coordinates; what rays meet from near_z on (world units);
 * and the attributes of that place, unfiltered, as model/blocks.h has them. */
void truth_ray(const struct psr_truth *truth, const struct view *view, double x, double y, struct ray *ray);
void truth_trace(const struct psr_truth *truth, const struct ray *ray, int n, double near_z, struct ray_hit *hit);
uint64_t truth_attr(const struct psr_truth *truth, const struct ray *ray, const struct ray_hit *hit);

/* Distance from a point of the world to the nearest point of the mesh, or `most` if that is less. */
double truth_distance(const struct psr_truth *truth, const double point[3], double most);

#endif
