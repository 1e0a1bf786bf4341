/* What a server says of a frame's effects: which ran, and why the others were left out. */
#ifndef PSR_CLIENT_SCENE_EFFECTS_H
#define PSR_CLIENT_SCENE_EFFECTS_H

#include <cjson/cJSON.h>
#include "psr/message.h"

/* Adds "effects" with a member each: "ran", and "count" or "why". Effects that this program does not know are
 * skipped. */
void effects_add(cJSON *to, const struct psr_msg_frame_end *end);

/* The same on standard output, a line each. */
void effects_print(const struct psr_msg_frame_end *end);

#endif
