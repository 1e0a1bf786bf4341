/* The plan: a request prepared for drawing, read by all stages. */
#ifndef PSR_RENDER_PLAN_H
#define PSR_RENDER_PLAN_H

#include "render.h"

/* What casts the shadow of a map. Sheer blocks are of the class of their mean opacity: 1 up to a quarter, 2 to a half, 3
 * and 4. Each class has a map, in which its blocks are solid. */
enum { NO_CASTER = -1, SHADOW_OPAQUE, SHADOW_CASTERS = 5 };

/* Of an instance that is not drawn in its own colours. */
struct plan_tint {
	enum psr_color_by by;
	uint16_t low;
	float scale;   /* INTENSITY: (intensity - low) * scale is 0..1 */
	float axis[4]; /* HEIGHT: axis . (x, y, z, 1), in camera space, is 0 at the bottom and 1 at the top */
};

struct plan_instance {
	struct plan_tint tint;
	uint32_t first_slot;  /* slot of block b is first_slot + b */
	uint32_t first_group; /* number of the model's group 0; each model has n_clusters numbers */
	struct cull_view cull;
	float level_spacing;  /* of level 0, camera space: a level is fine enough where this is a pixel */
	double turn[3][3];    /* inner coordinates to camera space, a rotation */
	enum psr_why masks;   /* PSR_WHY_RAN: test visibility masks */
};

struct plan {
	uint32_t width, height, tiles_x, tiles_y, parts_x, parts_y;
	struct psr_window window;  /* of the picture; the whole picture if the settings have none */
	double center[2];          /* pixels from the frame's corner to where the view axis meets it */
	int perspective;
	int with_splats;
	int asks_ewa, with_ewa; /* the latter: and an instance is drawn as an octree */
	int with_runs;          /* bins->cubes says which cubes of a run an entry draws; else each is an entry */
	int is_smooth;
	unsigned place_bits;       /* of words: of smooth pictures of blocks; else 0 */
	int is_wide;
	unsigned cull_tests;
	int is_full;
	enum psr_gap_method gap_method;
	int no_fill;
	int cell_bias;
	uint32_t shadow_side;
	float finer;               /* 1 / settings' spacing: samples are to be this much finer than pixels */
	int exponent;              /* lengths below are world * 2^-exponent, positions relative to the eye */
	double tangent[2];         /* of half the picture's angles; perspective */
	float focal;               /* pixels a unit of x'/z', or of x' if orthographic */
	float near_z;
	/* A cell of level k at z' covers pixels beyond gap_scale[k] * z' + gap_offset[k]. */
	float gap_scale[PSR_MAX_DEPTH_LEVEL + 1], gap_offset[PSR_MAX_DEPTH_LEVEL + 1];
	uint32_t n_instances, n_lights, n_slots, n_groups;
	struct plan_instance *instance;
	struct warp_instance *warp;        /* one an instance */
	struct strip_view view;            /* the cull completes `needs` */
	int has_sheer;                     /* a block in view has opacities; set by the cull, as is the next */
	int has_thin;                      /* a sheer block in view is of thin things */
	int has_tint;                      /* an instance is not drawn in its own colours */
	int has_octrees, has_points;       /* an instance is drawn as one, or as differential points */
	int only_points;                   /* all are drawn as these */
	int caster;                        /* of a shadow map, SHADOW_OPAQUE or a class of glass; of a picture NO_CASTER */
	struct strip_light *light;
	/* By light, SHADOW_CASTERS each, or NULL: no shadows; and the share of the light that each caster keeps back. The
	 * shadow stage owns both. */
	const struct shadow_light *shadow;
	const float *shadow_share;
	double axes[3][3], eye[3];         /* the camera's right, down and forward in the world, and its position */
	float ambient[3];
	uint16_t background[3];            /* linear, 16 bits; if is_wide, see base/root.h */
	/* Map of the picture's parts, parts_x in a row, or NULL: 1 where all words are empty and all weights whole, since
	 * no block draws there, nor do cells reach there. */
	const uint8_t *is_quiet;
	struct psr_cancel cancel;          /* the settings' */
	uint64_t n_samples;
	void *storage;                     /* of all arrays */
	size_t storage_size;
};

/* Validated scene and settings. ARG, LIMIT, MEMORY, CANCELLED. */
int plan_make(struct plan *plan, const struct psr_scene *scene, const struct render_settings *settings,
              struct psr_error *err);
void plan_clear(struct plan *plan);

/* Finds the centre of an instance's inner coordinates relative to `from`, and its rotation. Returns the length of an
 * inner unit in the world. */
double plan_place(double center[3], double rotation[3][3], const struct psr_instance *instance, const double from[3]);

/* Finds the instance of a slot; the slot must be below n_slots. */
uint32_t plan_find_instance(const struct plan *plan, uint32_t slot);

/* Whether the frame is to end. A stage asks so often that no thread works on for more than a millisecond. Then it
 * leaves what it does, and returns CANCELLED once all threads have left. */
static inline int plan_is_cancelled(const struct plan *plan)
{
	return psr_is_cancelled(&plan->cancel);
}

/* Asks before some steps of a run of short ones: before step 0, 1024, ... */
static inline int plan_is_cancelled_at(const struct plan *plan, uint32_t step)
{
	return step % 1024 == 0 && plan_is_cancelled(plan);
}

static inline int plan_is_quiet(const struct plan *plan, uint32_t x, uint32_t y)
{
	return plan->is_quiet != NULL && plan->is_quiet[y / PART_HEIGHT * plan->parts_x + x / PART_WIDTH];
}

#endif
