/* Models whose names resemble a mistyped one. */
#ifndef PSR_CLIENT_SCENE_SUGGEST_H
#define PSR_CLIENT_SCENE_SUGGEST_H

#include <stddef.h>
#include "psr/client.h"

/* The most similar of n names, `stride` bytes apart: equal but for case, an ending such as .glb, or a few letters.
 * NULL: none is similar. */
const char *suggest_name(const char *name, const char *names, size_t n, size_t stride);

/* After NOT_FOUND for `model`: adds the most similar name to the error. No frame may be under way. */
int suggest_model(struct psr_client *client, const char *model, int timeout_ms, struct psr_error *err);

#endif
