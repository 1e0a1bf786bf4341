/* A frame's effects, as the server reports them: which ones ran, and why the others did not. */
#ifndef PSR_CLIENT_OUTPUT_EFFECTS_H
#define PSR_CLIENT_OUTPUT_EFFECTS_H

#include <cjson/cJSON.h>
#include "psr/message.h"

/* Adds "effects", with one member an effect: "ran", and "count" or "why". Skips effects that this program does not
 * know. */
void effects_add(cJSON *to, const struct psr_msg_frame_end *end);

/* Prints one effect a line. */
void effects_print(const struct psr_msg_frame_end *end);

#endif
