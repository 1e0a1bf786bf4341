/* Listeners in the loop: they accept connections, and rest while the process is out of descriptors. */
#ifndef PSRD_ACCEPT_H
#define PSRD_ACCEPT_H

#include "conn.h"
#include "listen.h"

#define ACCEPT_MAX 16 /* listeners */

struct acceptor;

struct accept_source {
	struct listener listener;
	struct loop_source source;
	struct acceptor *acceptor;
};

struct acceptor {
	struct conns *conns;
	struct accept_source listener[ACCEPT_MAX];
	int n, is_resting;
	uint64_t warned_us; /* last warning in the log that the listeners rest; 0: never */
};

/* Opens listeners at n addresses (listen.h) for `conns`. After a failure accept_close() closes the ones that are
 * open. */
int accept_open(struct acceptor *acceptor, struct conns *conns, const char *const *address, int n,
                struct psr_error *err);
void accept_close(struct acceptor *acceptor);
void accept_wake(struct acceptor *acceptor); /* ends the listeners' rest, on every tick */

/* Raises the limit of open files to what the connections need; lowers their numbers to what the limit allows. */
void accept_raise_descriptors(int64_t *max_clients, int64_t *max_pending);

#endif
