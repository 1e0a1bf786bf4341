/* Finds models whose names resemble a mistyped one. */
#ifndef PSR_CLIENT_SCENE_SUGGEST_H
#define PSR_CLIENT_SCENE_SUGGEST_H

#include <stddef.h>
#include "psr/client.h"

/* Returns the most similar of n names, `stride` bytes apart. Similar names are equal but for case, for an ending such
 * as .glb, or for a few letters. NULL: none is similar. */
const char *suggest_name(const char *name, const char *names, size_t n, size_t stride);

/* Adds the most similar name to the error NOT_FOUND for `model`. No frame may be under way. */
int suggest_model(struct psr_client *client, const char *model, int timeout_ms, struct psr_error *err);

#endif
