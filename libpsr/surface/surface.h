/* What the surface of a mesh looks like, as the attribute words of psr/model.h. */
#ifndef PSR_SURFACE_SURFACE_H
#define PSR_SURFACE_SURFACE_H

#include <stdint.h>
#include "psr/mesh.h"

/* A side of a primitive is its number, and this bit for its back. */
#define SURFACE_BACK 0x80000000u

struct mip;

/* A mesh with what filtering its textures needs: their mip maps (mip.h), one for each image and use. Any number of
 * threads may read it. */
struct surface {
	const struct psr_mesh *mesh;
	double scale;         /* object units an inner unit */
	struct mip *mip;      /* n_images * MIP_KINDS; those that no material uses are empty */
	uint64_t *plain_word; /* of each material by itself, normal 0 */
	uint8_t *is_plain;    /* whether a material has no textures, so that the mesh's colours alone can change its word */
};

/* The mesh must outlive it. scale > 0. MEMORY; surface_fini() either way. */
int surface_init(struct surface *surface, const struct psr_mesh *mesh, double scale);
void surface_fini(struct surface *surface);

/* A place on a primitive, as rays report it (ray/ray.h). */
struct surface_place {
	uint32_t prim;
	int is_back; /* met from the back */
	double u, v;
};

/* What textures say is filtered over a circle in the tangent plane, of this diameter in inner units ([G] 5.1, figure
 * 5.2b; filter.h), 0 for the place alone; colours of alpha-tested materials by their alpha. Vertex colours and normals
 * are interpolated, and normal maps turn the normal and spread the highlight (normal.h, material.h). The normal is on
 * the side that was met, bent as far as it must be to face the unit vector `facing`, so that a sample is never shaded
 * as a back in the view that found it. */
uint64_t surface_attr(const struct surface *surface, const struct surface_place *place, double diameter,
                      const float facing[3]);

/* The same without a normal, which is *normal, as it is shaded, whichever way it faces. */
uint64_t surface_look(const struct surface *surface, const struct surface_place *place, double diameter,
                      float normal[3]);

/* How much of the light a place of a BLEND material keeps back, 0..1, filtered likewise; 1 of other materials. */
float surface_opacity(const struct surface *surface, const struct surface_place *place, double diameter);

/* Bends a unit normal as far as it must be for a sample to face `facing`, however it is quantised. */
void surface_face(float normal[3], const float facing[3]);

#endif
