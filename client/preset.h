/* Cameras and lights that came with a model, where command lines name them. */
#ifndef PSR_CLIENT_PRESET_H
#define PSR_CLIENT_PRESET_H

#include "psr.h"

struct preset_wish {
	const char *camera;                     /* name, or NULL */
	const char *light[PSR_WIRE_MAX_LIGHTS]; /* name of what scene->light[i] will be, or NULL: it is there already */
	int has_lights, all_lights;             /* any of light[] is set; all of the model's, after those */
};

/* Fills in what is wished for, from the open model. NOT_FOUND with the names that there are; LIMIT. */
int preset_apply(const struct preset_wish *wish, struct psr_client *client, uint32_t handle,
                 struct psr_msg_camera *camera, struct psr_msg_scene *scene, int timeout_ms, struct psr_error *err);

/* "perspective", "spot", ... */
const char *preset_type(const struct psr_msg_preset *preset);

/* What a light option says of a preset: the name after "preset:", or NULL. */
const char *preset_of_light(const char *text);

#endif
