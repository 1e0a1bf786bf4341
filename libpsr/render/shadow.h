/* Shadow maps: which lights need them, cameras that fit, and maps kept from frame to frame ([G] 7.3.1).
 *
 * A map is a picture of depths seen from a light, culled and warped like any picture, with z-buffer levels where
 * samples are further apart than texels. It depends on light, instances, models and the picture's size, but never on
 * the camera: a kept map equals a new one. */
#ifndef PSR_RENDER_SHADOW_H
#define PSR_RENDER_SHADOW_H

#include "slots.h"
#include "warp.h"

struct shadow; /* kept maps, and working memory */

struct shadow_call {
	const struct psr_cancel *cancel;
	const struct simd *simd;
	struct bins *bins; /* scratch; contents are lost */
	const struct psr_scene *scene;
	struct psr_pool *pool;
	struct psr_report *report;
	struct psr_error *err;
};

/* Sets plan->shadow and shadow_share to the maps of the lights that cast shadows, have a colour and reach an instance in
 * view, and tells the plan what shading needs. Draws missing maps. Allocates *shadow when the first light needs it.
 * MEMORY, LIMIT; CANCELLED, after which the next call draws the maps that are still missing. */
int shadow_prepare(struct shadow **shadow, struct plan *plan, const struct shadow_call *call);

/* Limits the texels of all maps of a renderer. A texel takes 2 bytes, plus two thirds with z-buffer levels; drawing
 * takes twice that of the largest map. */
#define SHADOW_TEXELS (16u << 20)

uint64_t shadow_bytes(const struct shadow *shadow); /* 0 for NULL */
void shadow_destroy(struct shadow *shadow);         /* NULL is fine */

/* ---- fit: cameras of lights ---- */

struct shadow_fit {
	struct psr_camera camera;
	uint32_t width, height;
	double nearest, farthest; /* bounds of the instances' z' */
};

/* Of a scene: a sphere around all instances, and the least spacing of samples. */
struct shadow_bounds {
	double center[3], radius;
	double spacing;
};
void shadow_bounds_make(struct shadow_bounds *bounds, const struct psr_scene *scene);

/* Fits cameras to a light, at most SHADOW_FACES, with at most `side` texels a side: one that sees all instances, or all
 * of a spot's cone, or the faces of a cube around the light that see instances. Returns how many. */
uint32_t shadow_fit_light(struct shadow_fit fit[SHADOW_FACES], const struct psr_light *light,
                          const struct psr_scene *scene, const struct shadow_bounds *bounds, uint32_t side);

/* ---- map: drawing one ---- */

struct shadow_kept {
	int is_drawn, caster; /* of the plan */
	struct shadow_fit fit;
	double axes[3][3], eye[3]; /* of its camera, as in a plan */
	int exponent;
	struct shadow_map map;     /* without the members that depend on the picture's camera */
	uint16_t *cells;
	size_t cells_size;
};

/* Working memory, for one map after the other. */
struct shadow_drawer {
	struct plan plan;
	uint64_t *word; /* of a tile, for each slot */
	size_t word_size;
	struct slots slots;
	float *cells; /* depths, in the order of the map's cells */
	size_t cells_size;
};

/* Draws the map of kept->fit; adds its samples to the report. On failure kept->is_drawn is 0. */
int shadow_map_draw(struct shadow_kept *kept, struct shadow_drawer *drawer, const struct shadow_call *call);

/* Makes the map ready for the picture of a plan. */
void shadow_map_bind(struct shadow_map *out, const struct shadow_kept *kept, const struct plan *plan);

#endif
