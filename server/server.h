/* The daemon's life: start, serve, drain, end. */
#ifndef PSRD_SERVER_H
#define PSRD_SERVER_H

#include "options.h"

struct server;

/* Opens the listeners, reads the models folder, starts the threads. After a failure everything is closed again. */
int server_start(struct server **out, struct options *options, struct psr_error *err);

/* Prints READY lines and serves until a signal ends it; frees the server. */
int server_run(struct server *server, struct psr_error *err);

#endif
