/* A scene whose instances all show one source, for rays of the world. */
#ifndef PSR_MEASURE_PLACED_H
#define PSR_MEASURE_PLACED_H

#include "psr/scene.h"
#include "source.h"

/* world = center + unit * turn * inner */
struct placed_instance {
	double turn[3][3], center[3], unit;
};

struct placed {
	const struct psr_source *source;
	struct placed_instance *instance;
	uint32_t n;
};

/* ARG, MEMORY. placed_fini() in any case. */
int placed_init(struct placed *placed, const struct psr_source *source, const struct psr_scene *scene,
                struct psr_error *err);
void placed_fini(struct placed *placed);

/* A hit by a ray of the world, whose direction is the unit of z. */
struct placed_hit {
	double z;
	const struct placed_instance *instance; /* NULL: none */
	struct ray_hit hit;
};

/* Makes a ray of the world one of an instance's inner coordinates; z = t * unit. */
void placed_ray(const struct placed_instance *instance, const struct ray *world, struct ray *inner);

/* Find the first hit of each ray of the world at z >= near_z, whatever its opacity; or up to PLACED_MOST of one ray,
 * nearest first, and return their number. */
#define PLACED_MOST RAY_MOST_HITS
void placed_trace(const struct placed *placed, const struct ray *ray, int n, double near_z, struct placed_hit *hit);
int placed_trace_all(const struct placed *placed, const struct ray *ray, double near_z, struct placed_hit *hit);

/* Returns the share of light, 0..1, that passes between a point, just off the surface there, and a light `length` away
 * in the unit direction to_light. Either side of a face stops it; `face` is the surface's own normal, on the side of
 * the eye. */
struct placed_point {
	double at[3], face[3];
};
double placed_passes(const struct placed *placed, const struct placed_point *point, const double to_light[3],
                     double length);

#endif
