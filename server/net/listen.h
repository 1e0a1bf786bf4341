/* Opens listening sockets: TCP on loopback addresses only, Unix sockets with mode 0600. */
#ifndef PSRD_LISTEN_H
#define PSRD_LISTEN_H

#include <sys/stat.h>
#include "psr/error.h"

#define LISTEN_NAME 256

struct listener {
	int fd;                  /* non-blocking, listening */
	char name[LISTEN_NAME];  /* as READY prints it: 127.0.0.1:41234, [::1]:41234, unix:/run/psr */
	char path[LISTEN_NAME];  /* of a Unix socket, else "" */
	dev_t device;            /* of the socket file: listen_close() leaves another daemon's file alone */
	ino_t inode;
};

/* Opens one address: [tcp://]ADDR:PORT or unix:PATH. A host name may give several sockets; *n counts them, at most max.
 * After a failure none is open. ARG: not such an address, not loopback, or tls://; IO, LIMIT; BUSY: another daemon
 * serves there. */
int listen_open(struct listener *listeners, int max, int *n, const char *address, struct psr_error *err);
void listen_close(struct listener *listener); /* removes a Unix socket's file if it is still this socket's */

#endif
