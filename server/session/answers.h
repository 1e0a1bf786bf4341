/* Requests that are answered at once: LIST, STATS, PRESETS, PING; and OPENED. */
#ifndef PSRD_SESSION_ANSWERS_H
#define PSRD_SESSION_ANSWERS_H

#include "session.h"

void answer_list(struct session *session, uint32_t id);
void answer_stats(struct session *session, uint32_t id);
void answer_ping(struct session *session, const struct psr_msg_ping *ping);

/* The cameras and lights of the model's source file, and a camera "home" that shows the whole model with its own way
 * up, unless the file has a camera of this name. ERROR if no model has the handle. */
void answer_presets(struct session *session, uint32_t id, uint32_t handle);

/* A handle and OPENED; or an error with its text: LIMIT. */
int answer_opened(struct session *session, uint32_t id, struct catalogue_model *model, struct psr_error *err);

void refuse_handle(struct session *session, uint32_t id, uint32_t handle); /* ERROR: no model has it */

#endif
