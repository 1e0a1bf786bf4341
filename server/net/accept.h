/* The listeners in the loop: they accept connections, and rest while the process is out of descriptors. */
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
};

/* Opens listeners at n addresses (listen.h) for `conns`. On failure accept_close() closes those that are open. */
int accept_open(struct acceptor *acceptor, struct conns *conns, const char *const *address, int n,
                struct psr_error *err);
void accept_close(struct acceptor *acceptor);
void accept_wake(struct acceptor *acceptor); /* ends the rest, if there is one: on every tick */

/* Raises the limit of open files to what max_clients connections need; returns how many it allows. */
int64_t accept_raise_descriptors(int64_t max_clients);

#endif
