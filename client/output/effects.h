/* A frame's effects, as the server reports them: which ran, and why the others did not. */
#ifndef PSR_CLIENT_OUTPUT_EFFECTS_H
#define PSR_CLIENT_OUTPUT_EFFECTS_H

#include <cjson/cJSON.h>
#include "psr/proto.h"

/* Adds "effects" with a member each: "ran", and "count" or "why". Skips effects that this program does not know. */
void effects_add(cJSON *to, const struct psr_msg_frame_end *end);

/* Prints them, a line each. */
void effects_print(const struct psr_msg_frame_end *end);

#endif
