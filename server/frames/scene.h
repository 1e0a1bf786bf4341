/* SCENE messages to scenes. */
#ifndef PSRD_FRAMES_SCENE_H
#define PSRD_FRAMES_SCENE_H

#include "server/models/handles.h"
#include "psr/scene.h"

/* The scene of a SCENE message: immutable, shared by its slot and the frames that were asked for while it stood there.
 * The loop's thread counts references. */
struct scene {
	uint32_t n_refs;
	struct catalogue *catalogue;
	struct psr_scene scene;         /* camera unset */
	uint8_t background[3];
	struct psr_instance *instance;  /* models as of scene_bind() */
	uint32_t *of_instance;          /* index of its model */
	struct catalogue_model **model; /* each once, a reference */
	uint32_t n_models;
	struct psr_light light[PSR_WIRE_MAX_LIGHTS];
};

/* Checks what the wire cannot: handles, representations, angles. *out is the caller's reference. NOT_FOUND,
 * UNSUPPORTED, MEMORY. */
int scene_create(struct scene **out, const struct handles *handles, const struct psr_msg_scene *msg,
                 struct psr_error *err);

unsigned scene_shadow_lights(const struct scene *scene); /* that cast shadows */
uint64_t scene_blocks(const struct scene *scene);        /* of all instances */

/* After scene_bind(): how many pixels the spheres around the instances cover, each at most the picture's, summed. */
double scene_area(const struct scene *scene, const struct psr_camera *camera, uint32_t width, uint32_t height);
/* UNSUPPORTED: an instance's model has no calibration, or it is drawn as an octree, which has none. */
int scene_check_calibrated(const struct scene *scene, struct psr_error *err);
int scene_has_sheer(const struct scene *scene);          /* a model has samples that let light through */
int scene_has_octrees(const struct scene *scene);        /* an instance is drawn as one */

/* Gives the instances their models, all of which are in memory and pinned: before a frame is drawn. */
void scene_bind(struct scene *scene);

struct scene *scene_ref(struct scene *scene);
void scene_unref(struct scene *scene); /* NULL is fine */

#endif
