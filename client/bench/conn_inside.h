/* Shared by conn.c and conn_take.c. */
#ifndef PSR_CLIENT_BENCH_CONN_INSIDE_H
#define PSR_CLIENT_BENCH_CONN_INSIDE_H

#include "conn.h"

/* Doubles the room for what is sent. Returns 0 if that fails; the connection is over then. */
int conn_grow(struct conn *conn);

void conn_end(struct conn *conn, struct conn_request *request, const struct conn_answer *answer);

/* conn_take.c: handles a message. */
void conn_take(struct conn *conn, const struct psr_message *message);

#endif
