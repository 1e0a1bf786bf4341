#ifndef PSRD_SESSION_PRESETS_H
#define PSRD_SESSION_PRESETS_H

#include <stdint.h>

struct conn;

/* Answers PRESETS: the cameras and lights of the model's source file, and a camera "home" that shows the whole model
 * with its own way up, unless the file has one of that name. */
void session_send_presets(struct conn *conn, uint32_t id, uint32_t handle);

#endif
