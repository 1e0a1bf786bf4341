#ifndef PSRD_FRAMES_CHECK_H
#define PSRD_FRAMES_CHECK_H

#include "proto/proto.h"

struct scene;

/* Checks whether this server draws such a frame. Returns PSR_OK, or ARG, UNSUPPORTED or LIMIT with a sentence. */
int frame_check(const struct psr_msg_frame *frame, uint32_t id, uint16_t view, int64_t max_pixels,
                struct psr_error *err);

/* The same of its scene. NOT_FOUND: it is NULL; UNSUPPORTED: a budget of RMSE, and a model has no calibration. */
int frame_check_scene(const struct psr_msg_frame *frame, const struct scene *scene, struct psr_error *err);

#endif
