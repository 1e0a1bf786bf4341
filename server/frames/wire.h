/* Cameras and lights of messages, to those of scenes and from those of models' presets. */
#ifndef PSRD_WIRE_H
#define PSRD_WIRE_H

#include "psr/model.h"
#include "psr/proto.h"

/* Of messages that were decoded: all fields are valid. */
void wire_to_camera(struct psr_camera *camera, const struct psr_msg_camera *msg);
void wire_to_light(struct psr_light *light, const struct psr_msg_light *msg);

/* What a message cannot hold is brought to its nearest: intensities beyond 1e6, colours between two codes of sRGB. */
void wire_from_camera(struct psr_msg_preset *msg, const struct psr_preset_camera *preset);
void wire_from_light(struct psr_msg_preset *msg, const struct psr_preset_light *preset);

#endif
