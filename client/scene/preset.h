/* Cameras and lights that came with a model, where command lines name them. */
#ifndef PSR_CLIENT_SCENE_PRESET_H
#define PSR_CLIENT_SCENE_PRESET_H

#include "scene.h"

/* Of the scene's first model. NOT_FOUND with the names that there are; UNSUPPORTED by an older server; LIMIT. */
int preset_camera(struct psr_camera *camera, const char *name, const struct psr_client *client,
                  const struct scene *scene, struct psr_error *err);
int preset_light(struct psr_msg_light *light, const char *name, const struct psr_client *client,
                 const struct scene *scene, struct psr_error *err);
int preset_all_lights(struct psr_msg_scene *msg, const struct psr_client *client, const struct scene *scene,
                      struct psr_error *err); /* behind those that msg has */

/* "perspective", "spot", ... */
const char *preset_type(const struct psr_msg_preset *preset);

/* What a light option says of a preset: the name after "preset:", or NULL. */
const char *preset_of_light(const char *text);

#endif
