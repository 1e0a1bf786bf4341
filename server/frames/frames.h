/* Frame requests: who is drawn next, the drawing itself, the way back.
 *
 * At most as many frames run at once as the pool has threads. Connections with waiting requests take turns; a request
 * starts only while its connection's output queue, with what its running frames may add, is below --max-queue (or
 * empty): so the memory that a slow reader holds is bounded. All functions belong to the loop's thread. */
#ifndef PSRD_FRAMES_H
#define PSRD_FRAMES_H

#include <stdint.h>
#include "proto/proto.h"
#include "server/session/session.h"

struct conn;
struct frames;
struct server;

int frames_create(struct frames **out, struct server *server);
void frames_destroy(struct frames *frames); /* after the pool has ended; NULL is fine */

/* Queues a checked request; keeps a reference to the scene. Without memory it is refused. */
void frames_ask(struct frames *frames, struct conn *conn, uint32_t id, const struct psr_msg_frame *request,
                struct scene *scene);
/* 1 if it was open: no answer comes any more. */
int frames_cancel(struct frames *frames, struct conn *conn, uint32_t id);
void frames_forget(struct frames *frames, struct conn *conn); /* it closes: all its requests are dropped */
void frames_refuse_waiting(struct frames *frames, struct conn *conn, int code, const char *text);

void frames_pump(struct frames *frames); /* starts what can start; after a queue has shrunk */
unsigned frames_waiting(const struct frames *frames);
unsigned frames_running(const struct frames *frames); /* cancelled ones that still draw too */

#endif
