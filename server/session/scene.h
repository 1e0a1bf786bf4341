/* SCENE messages to scenes. */
#ifndef PSRD_SESSION_SCENE_H
#define PSRD_SESSION_SCENE_H

#include "session.h"

/* Checks what the wire cannot: handles, representations, angles. The scene has one reference, the caller's.
 * NOT_FOUND, UNSUPPORTED, MEMORY. */
int scene_create(struct scene **out, const struct session *session, struct catalogue *catalogue,
                 const struct psr_msg_scene *msg, struct psr_error *err);

#endif
