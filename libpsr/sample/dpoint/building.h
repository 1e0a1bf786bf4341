/* Shared by the builders of meshes and of clouds. */
#ifndef PSR_SAMPLE_DPOINT_BUILDING_H
#define PSR_SAMPLE_DPOINT_BUILDING_H

#include "of_mesh.h"
#include "surface/surface.h"

#define BUILDING_LOOKS 8 /* 255ths of a channel that a cell may differ from its point */

struct building {
	const struct psr_mesh *mesh;
	const struct dpoint_build_options *options;
	struct psr_error *err;
	struct psr_model_info *info;
	struct surface look;
	uint8_t *two_sided; /* by material */
	double *grain;      /* likewise */
	struct dpoint_surface surface;
	uint32_t n_flat;    /* of a cloud */
};

void building_say(const struct building *b, const char *stage);
struct dpoint_cover_options building_cover(const struct dpoint_build_options *options);

/* Fills the surface with the pieces of a mesh and of its patches, and finds sides. LIMIT, FORMAT, MEMORY. */
int building_put_mesh(struct building *b);

/* Fills the surface with a cloud's points, and finds sides. LIMIT, FORMAT, MEMORY. */
int building_put_cloud(struct building *b);

#endif
