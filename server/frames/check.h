#ifndef PSRD_FRAMES_CHECK_H
#define PSRD_FRAMES_CHECK_H

#include "proto/proto.h"

/* Checks whether this server draws such a frame. Returns PSR_OK, or ARG, UNSUPPORTED or LIMIT with a sentence. */
int frame_check(const struct psr_msg_frame *frame, uint32_t id, uint16_t view, int64_t max_pixels,
                struct psr_error *err);

#endif
