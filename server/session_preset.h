/* Cameras and lights of models as messages. */
#ifndef PSRD_SESSION_PRESET_H
#define PSRD_SESSION_PRESET_H

#include "psr/model.h"
#include "psr/proto.h"

/* What a message cannot hold is brought to its nearest: intensities beyond 1e6, colours between two codes of sRGB. */
void preset_from_camera(struct psr_msg_preset *msg, const struct psr_preset_camera *preset);
void preset_from_light(struct psr_msg_preset *msg, const struct psr_preset_light *preset);

#endif
