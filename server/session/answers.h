/* Answers that need no waiting: STATS, PRESETS, PING; LIST, in parts; and OPENED. */
#ifndef PSRD_SESSION_ANSWERS_H
#define PSRD_SESSION_ANSWERS_H

#include "session.h"

/* Sends the next entries of the LIST under way. Returns 1 if there are more, of this LIST or of another. */
int answer_list_part(struct session *session);
void answer_stats(struct session *session, uint32_t id);
void answer_ping(struct session *session, const struct psr_msg_ping *ping);

/* Sends the cameras and lights of the model's source file, and a camera "home" that shows the whole model, its own way
 * up, unless the file has a camera of this name. ERROR if the handle names no model. */
void answer_presets(struct session *session, uint32_t id, uint32_t handle);

/* Makes a handle and sends OPENED; else returns an error with its text: LIMIT. */
int answer_opened(struct session *session, uint32_t id, struct catalogue_model *model, struct psr_error *err);

void refuse_handle(struct session *session, uint32_t id, uint32_t handle); /* sends ERROR: the handle names no model */

#endif
