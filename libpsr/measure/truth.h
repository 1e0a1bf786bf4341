/* Single rays of a truth, for the measures. */
#ifndef PSR_MEASURE_TRUTH_H
#define PSR_MEASURE_TRUTH_H

#include "ray/ray.h"
#include "measure.h"
#include "view.h"

/* Returns whether any of side * side rays, spread over the n * n pixels from (x, y) on, meets the object. */
int truth_is_met(const struct psr_truth *truth, const struct view *view, double x, double y, int n, int side);

/* Returns whether any of 60 * 60 rays, spread likewise, meets a surface at depth z or behind; z infinite: meets nothing. */
int truth_reaches(const struct psr_truth *truth, const struct view *view, double x, double y, int n, double z);

/* Finds the light that arrives where rays through n points (x, y in pixels) of the picture first meet the object.
 * `facing`: the cosine between the light and the face's normal on the visible side; -2: the ray meets nothing. */
struct truth_light {
	double facing;
	int is_shadowed;
};
void truth_light(const struct psr_truth *truth, const struct view *view, const struct psr_light *light,
                 const double (*place)[2], int n, struct truth_light *out);

/* Make the ray through a point of the picture, in the mesh's inner coordinates; find the first hits of rays from near_z
 * on (world units); compute the attributes at a hit, unfiltered, as in model/blocks.h. */
void truth_ray(const struct psr_truth *truth, const struct view *view, double x, double y, struct ray *ray);
void truth_trace(const struct psr_truth *truth, const struct ray *ray, int n, double near_z, struct ray_hit *hit);
uint64_t truth_attr(const struct psr_truth *truth, const struct ray *ray, const struct ray_hit *hit);

/* Returns the distance from a point of the world to the nearest point of the mesh, or `most` if that is less. */
double truth_distance(const struct psr_truth *truth, const double point[3], double most);

#endif
