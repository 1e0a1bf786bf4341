/* Cameras and lights of a model, found by name. */
#ifndef PSR_CLIENT_SCENE_PRESET_H
#define PSR_CLIENT_SCENE_PRESET_H

#include "scene.h"

/* Finds a camera or light (enum psr_wire_preset_kind) of the scene's first model. NOT_FOUND lists the names;
 * UNSUPPORTED by an older server. */
int preset_find(const struct psr_msg_preset **out, const struct scene *scene, uint8_t kind, const char *name,
                struct psr_error *err);

/* Adds all lights of the scene's first model to msg's. LIMIT, and the errors above. */
int preset_all_lights(struct psr_msg_scene *msg, const struct scene *scene, struct psr_error *err);

/* Moves a camera or light of a model to where the model is. */
void preset_place(struct psr_msg_preset *preset, const struct psr_msg_instance *place);

/* Returns the kind as a word: "perspective", "spot", ... */
const char *preset_type(const struct psr_msg_preset *preset);

/* Returns the name after "preset:" in a light option, or NULL. */
const char *preset_of_light(const char *text);

#endif
