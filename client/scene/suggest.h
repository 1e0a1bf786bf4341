/* What a person may have meant. */
#ifndef PSR_CLIENT_SCENE_SUGGEST_H
#define PSR_CLIENT_SCENE_SUGGEST_H

#include <stddef.h>
#include "psr/client.h"

/* Of n names (the first at `names`, each `stride` bytes behind the one before) that which is most like `name`: equal
 * but for case, an ending such as .glb, or a few letters. NULL: none is. */
const char *suggest_name(const char *name, const char *names, size_t n, size_t stride);

/* Behind a NOT_FOUND of `model`: the same error, with the name that was probably meant. No frame may be under way. */
int suggest_model(struct psr_client *client, const char *model, int timeout_ms, struct psr_error *err);

#endif
