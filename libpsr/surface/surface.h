/* How a mesh's surface looks, as attribute words (model/blocks.h). */
#ifndef PSR_SURFACE_SURFACE_H
#define PSR_SURFACE_SURFACE_H

#include <stdint.h>
#include "psr/mesh.h"

/* A side of a primitive is its number, and this bit for its back. */
#define SURFACE_BACK 0x80000000u

struct mip;

/* A mesh and the mip maps (mip.h) of its textures, one for each image and use. Any number of threads may read it. */
struct surface {
	const struct psr_mesh *mesh;
	double scale;         /* object units an inner unit */
	struct mip *mip;      /* n_images * MIP_KINDS; pyramids that no material uses are empty */
	uint64_t *plain_word; /* of each material by itself, normal 0 */
	uint8_t *is_plain;    /* whether a material has no textures: only the mesh's colours can change its word */
};

/* Prepares the surface; the mesh must outlive it. scale > 0. MEMORY; call surface_fini() even then. */
int surface_init(struct surface *surface, const struct psr_mesh *mesh, double scale);
void surface_fini(struct surface *surface);

/* A place on a primitive, as rays report it (ray/ray.h). */
struct surface_place {
	uint32_t prim;
	int is_back; /* met from the back */
	double u, v;
};

/* Textures are filtered over a circle in the tangent plane, of this diameter in inner units ([G] 5.1, figure 5.2b;
 * filter.h), 0 for the place alone; colours of alpha-tested materials by their alpha. Vertex colours and normals are
 * interpolated; normal maps turn the normal and spread the highlight (normal.h, material.h). The normal is on the side
 * that was met, bent to face the unit vector `facing`: the view that found a sample never shades its back. */
uint64_t surface_attr(const struct surface *surface, const struct surface_place *place, double diameter,
                      const float facing[3]);

/* Computes the attributes without a normal in the word; *normal gets the normal, unbent. */
uint64_t surface_look(const struct surface *surface, const struct surface_place *place, double diameter,
                      float normal[3]);

/* Computes the opacity of a place, 0..1, filtered likewise; 1 for materials that are not BLEND. */
float surface_opacity(const struct surface *surface, const struct surface_place *place, double diameter);

/* Bends a unit normal until it faces `facing`, however it is quantised. */
void surface_face(float normal[3], const float facing[3]);

#endif
