#ifndef PSRD_FRAMES_CHECK_H
#define PSRD_FRAMES_CHECK_H

#include "psr/proto.h"

/* Whether this server draws such frames: UNSUPPORTED or LIMIT with a sentence if not. */
int frame_check(const struct psr_msg_frame *frame, uint16_t view, int64_t max_pixels, struct psr_error *err);

#endif
