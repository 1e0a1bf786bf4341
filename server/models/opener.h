/* From a name to a model in memory: finds the key of a source, has it built, reads the file; everyone who asks for the
 * same file meanwhile waits for the same work. Belongs to the loop's thread; reading happens on the io pool. */
#ifndef PSRD_OPENER_H
#define PSRD_OPENER_H

#include <stdint.h>
#include "proto/proto.h"

struct conn;
struct opener;
struct server;

int opener_create(struct opener **out, struct server *server);
void opener_destroy(struct opener *opener); /* after the io pool has ended; NULL is fine */

/* Answers OPEN `id` by PROGRESS... and OPENED or ERROR, now or later. */
void opener_open(struct opener *opener, struct conn *conn, uint32_t id, const struct psr_msg_open *msg);

/* Stops waiting; 1 if `id` was waiting. The work goes on: who asks again finds it done. */
int opener_cancel(struct opener *opener, struct conn *conn, uint32_t id);
void opener_forget(struct opener *opener, struct conn *conn); /* it closes */
int opener_is_working(const struct opener *opener); /* on the io pool */
void opener_refuse_all(struct opener *opener, int code, const char *text);

#endif
