/* A frame's effects, as the server reports them: which ones ran, and why the others did not. */
#ifndef PSR_CLIENT_OUTPUT_EFFECTS_H
#define PSR_CLIENT_OUTPUT_EFFECTS_H

#include <cjson/cJSON.h>
#include "psr/message.h"

/* Adds "effects", with one member an effect: "ran", and "count" or "why". Skips effects that this program does not
 * know. */
void effects_add(cJSON *to, const struct psr_msg_frame_end *end);

/* Adds "drawn_as": by "blocks", "octree", "dpoints" the instances that are drawn as that, and why; of an octree
 * the levels that the view needs. */
void drawn_as_add(cJSON *to, const struct psr_msg_frame_end *end);

/* Prints a line for each representation, and for each effect. */
void effects_print(const struct psr_msg_frame_end *end);

#endif
