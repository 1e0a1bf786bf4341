/* Shadows: which lights of a scene need maps, maps that fit them, and maps kept from frame to frame ([G] 7.3.1).
 *
 * A map is a picture of depths from a light, drawn like every picture: culled, warped, with level buffers where samples
 * are further apart than texels. It depends on light, instances, models and the picture's size, never on the camera, so
 * that it is the same whether it is drawn now or was kept. */
#ifndef PSR_RENDER_SHADOW_H
#define PSR_RENDER_SHADOW_H

#include "render.h"

struct shadow; /* the maps, and what drawing them takes */

/* Gives plan->shadow the maps of those lights that cast shadows, have a colour and reach an instance in view, and notes
 * what shading needs. Draws what is not there yet. *shadow is made when the first light needs it. `bins` is free to be
 * used. MEMORY, LIMIT. */
int shadow_prepare(struct shadow **shadow, const struct simd *simd, struct plan *plan, struct bins *bins,
                   const struct psr_scene *scene, struct psr_pool *pool, struct psr_report *report,
                   struct psr_error *err);

/* All maps of a renderer together have at most SHADOW_TEXELS texels, of 2 bytes and, where level buffers are in use, up
 * to two thirds more; 4 bytes more a texel, and up to two thirds more, of the largest. */
#define SHADOW_TEXELS (16u << 20)
#define SHADOW_SIDE 2048 /* at most */

uint64_t shadow_bytes(const struct shadow *shadow); /* 0 for NULL */
void shadow_destroy(struct shadow *shadow);         /* NULL is fine */

/* ---- fit: cameras of lights ---- */

struct shadow_fit {
	struct psr_camera camera;
	uint32_t width, height;
	double nearest, farthest; /* z' of instances is between them */
};

/* What fitting needs of a scene: a sphere about all instances, and the least distance of samples. */
struct shadow_bounds {
	double center[3], radius;
	double spacing;
};
void shadow_bounds_make(struct shadow_bounds *bounds, const struct psr_scene *scene);

/* Cameras of the maps of a light, at most SHADOW_FACES, with at most `side` texels a side: one whose picture holds all
 * instances, or as much as the cone of a spot, or the faces of a cube about the light that see instances. Returns how
 * many. */
uint32_t shadow_fit_light(struct shadow_fit fit[SHADOW_FACES], const struct psr_light *light,
                          const struct psr_scene *scene, const struct shadow_bounds *bounds, uint32_t side);

/* ---- map: one of them, drawn ---- */

struct shadow_kept {
	int is_drawn;
	struct shadow_fit fit;
	double axis[3][3], eye[3]; /* of its camera, as a plan has them */
	int exponent;
	struct shadow_map map;     /* all but what depends on the picture's camera */
	uint16_t *cells;
	size_t cells_size;
};

/* What drawing takes, for one map after the other. */
struct shadow_drawer {
	struct plan plan;
	uint64_t *word; /* of a tile, for each thread */
	size_t word_size;
	float *cells; /* depths of a map's, in the same order */
	size_t cells_size;
};

/* Draws kept->fit; adds the samples to *n_samples. On failure the map is left not drawn. */
int shadow_map_draw(struct shadow_kept *kept, struct shadow_drawer *drawer, const struct simd *simd, struct bins *bins,
                    const struct psr_scene *scene, struct psr_pool *pool, uint64_t *n_samples, struct psr_error *err);

/* The map for the picture of a plan. */
void shadow_map_bind(struct shadow_map *out, const struct shadow_kept *kept, const struct plan *plan);

#endif
