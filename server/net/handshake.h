/* HELLO and its answer. */
#ifndef PSRD_HANDSHAKE_H
#define PSRD_HANDSHAKE_H

#include "proto/proto.h"

struct conn;

/* The first message of a connection: WELCOME and OPEN, or ERROR with id 0 and DRAINING. */
void handshake_take(struct conn *conn, const struct psr_message *message);

#endif
