/* The listeners in the loop: accepting, resting when descriptors run out. */
#ifndef PSRD_ACCEPT_H
#define PSRD_ACCEPT_H

#include "server/server.h"

/* Opens what the options name and takes it into the loop; on failure accept_close() closes what is open. */
int accept_open(struct server *server, struct psr_error *err);
void accept_close(struct server *server);

void accept_pause(struct server *server, int paused);

/* As many descriptors as the clients need; lowers options->max_clients where the system gives fewer. */
void accept_raise_descriptors(struct options *options);

#endif
