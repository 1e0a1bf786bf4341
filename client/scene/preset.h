/* Cameras and lights of a model, by name. */
#ifndef PSR_CLIENT_SCENE_PRESET_H
#define PSR_CLIENT_SCENE_PRESET_H

#include "scene.h"

/* The camera or light (enum psr_wire_preset_kind) of the scene's first model. NOT_FOUND lists the names;
 * UNSUPPORTED by an older server. */
int preset_find(const struct psr_msg_preset **out, const struct scene *scene, uint8_t kind, const char *name,
                struct psr_error *err);

/* Adds all lights of the scene's first model to those of msg. LIMIT, and as above. */
int preset_all_lights(struct psr_msg_scene *msg, const struct scene *scene, struct psr_error *err);

/* "perspective", "spot", ... */
const char *preset_type(const struct psr_msg_preset *preset);

/* The name after "preset:" in a light option, or NULL. */
const char *preset_of_light(const char *text);

#endif
