/* The tree that the files of ray/ share; they alone include Embree. */
#ifndef PSR_RAY_TREE_H
#define PSR_RAY_TREE_H

#include <embree3/rtcore.h>
#include "ray.h"
#include "surface/texture.h"

#define RAY_PACKET 8

/* Geometries of the tree; either may be missing. */
enum { RAY_TRIANGLES, RAY_DISCS };

struct ray_scene {
	const struct psr_mesh *mesh;
	double origin[3], shrink; /* inner = (object - origin) * shrink */
	double cell; /* of the stipple pattern of BLEND surfaces (surface/stipple.h), inner units; 0: none */
	double (*corner)[3][3]; /* of the triangles, inner coordinates; */
	float (*normal)[3]; /* and their unit normals */
	int lets_through;   /* whether any material may let a ray through */
	RTCDevice device;
	RTCScene scene;
	RTCScene discs; /* for distances; NULL until ray_scene_index_distances */
};

/* A packet of rays. The context comes first: Embree gives it back to the filters. */
struct ray_packet {
	struct RTCIntersectContext context;
	const struct ray_scene *scene;
	const struct ray *ray;
	struct ray_list *list; /* ray_scene_trace_all() collects hits here, */
	int has_ends;          /* the rays of both ends */
};

void ray_packet_init(struct ray_packet *packet, const struct ray_scene *scene, const struct ray *ray);

/* Fills a packet with ray[0..n-1] at t >= t_min as floats; `valid` is -1 for each, and 0 for the rest of the packet. */
void ray_packet_fill(struct RTCRay8 *rays, int valid[RAY_PACKET], const struct ray *ray, int n, double t_min);

/* Computes t, u, v and is_back of a hit from its prim, and the tree's u and v. Returns whether the surface is absent
 * there. */
void ray_hit_locate(const struct ray_scene *scene, const struct ray *ray, struct ray_hit *hit);
int ray_hit_is_absent(const struct ray_scene *scene, const struct ray_hit *hit);

/* A filter's arguments, N wide: Embree's header names them in C++ only. */
struct ray_columns {
	const unsigned *id, *prim, *geometry;
	const float *u, *v;
};
static inline struct ray_columns ray_columns_of(const struct RTCFilterFunctionNArguments *args)
{
	enum { ID = 10, U = 3, V = 4, PRIM = 5, GEOMETRY = 6 };
	const unsigned *ray = (const unsigned *)(const void *)args->ray, *hit = (const unsigned *)(const void *)args->hit;

	return (struct ray_columns){ .id = ray + ID * args->N, .prim = hit + PRIM * args->N,
		                         .geometry = hit + GEOMETRY * args->N,
		                         .u = (const float *)(const void *)hit + U * args->N,
		                         .v = (const float *)(const void *)hit + V * args->N };
}

static inline uint32_t ray_prim(const struct ray_scene *scene, unsigned geometry, unsigned prim)
{
	return geometry == RAY_DISCS ? scene->mesh->n_triangles + prim : prim;
}

static inline int ray_is_disc(const struct ray_scene *scene, uint32_t prim)
{
	return prim >= scene->mesh->n_triangles;
}

static inline int ray_is_two_sided(const struct ray_scene *scene, uint32_t prim)
{
	const struct psr_mesh *mesh = scene->mesh;

	return mesh->material[texture_material(mesh, prim)].two_sided != 0;
}

/* Prefetch: hits arrive in random order. */
static inline void ray_prefetch(const struct ray_scene *scene, uint32_t prim)
{
	if (!ray_is_disc(scene, prim)) {
		__builtin_prefetch(scene->corner[prim]);
		__builtin_prefetch(scene->corner[prim][2]);
	}
}

/* Finds centre, normal and radius of a primitive's disc, in inner coordinates. */
double ray_disc(const struct ray_scene *scene, uint32_t prim, double center[3], double normal[3]);

#endif
