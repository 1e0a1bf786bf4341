/* The source's own surfaces behind a ray tracer, for the truth of pictures: its materials evaluated as their formats
 * define them, by code that shares nothing with the modeller's. */
#ifndef PSR_MEASURE_SOURCE_H
#define PSR_MEASURE_SOURCE_H

#include "brdf.h"
#include "measure.h"
#include "pyramid.h"
#include "ray/ray.h"

struct psr_source {
	const struct psr_mesh *mesh;
	struct psr_mesh solid;          /* the mesh with opaque materials: rays do not read alpha, the truth does */
	struct ray_scene *scene;
	double origin[3], scale;        /* object = origin + scale * inner */
	struct pyramid *pyramid;        /* n_images * PYRAMID_KINDS */
	struct brdf_albedo albedo;
	int is_layered;                 /* some material lets light through */
};

/* A ray and its neighbours, one footprint to the right and below, in inner coordinates. */
struct source_ray {
	struct ray ray, beside[2];
};

/* The surface at a place; vectors are those of the object's space, unit. */
struct source_look {
	struct brdf brdf;
	double normal[3];   /* shading normal, on the side that is seen */
	double face[3];     /* the face's own, on that side */
	double emission[3];
	double occlusion;   /* share of the surroundings' light that arrives */
	double opacity;     /* 0..1 */
	double base[3];     /* unlit: what is seen */
	int is_unlit, is_textured; /* is_textured: the base colour has an image */
};
void source_look_at(const struct psr_source *source, const struct source_ray *ray, const struct ray_hit *hit,
                    struct source_look *look);

/* Returns the opacity alone, 0..1, as for magnification. */
double source_opacity(const struct psr_source *source, const struct ray_hit *hit);

#endif
