/* FETCH: parts of the file of a model. A session's requests are answered one after another. The io pool reads 64 KiB at
 * a time, when the answers before them have almost left: so a fetch takes the bytes that pictures leave, and a reader
 * that does not read holds some of them. */
#ifndef PSRD_SESSION_FETCHES_H
#define PSRD_SESSION_FETCHES_H

#include "proto/proto.h"
#include "psr/error.h"

#define FETCHES_MAX 64    /* a client has no more open ids */
#define FETCHES_ROOM 65536 /* bytes of answers that may wait while more is read */

struct catalogue_model;
struct session;
struct sessions;

struct fetches {
	struct fetch {
		uint32_t id;
		struct catalogue_model *model; /* a reference; NULL: by name */
		char *path;                    /* then of its file */
		uint64_t offset, end, hash;    /* of the next part; behind the last one; of the file, 0: any yet */
	} fetch[FETCHES_MAX];              /* a ring */
	unsigned first, n;
	struct fetch_read *read;           /* what is on its way, of the first one */
};

void fetches_ask(struct session *session, uint32_t id, const struct psr_msg_fetch *msg);
int fetches_cancel(struct session *session, uint32_t id); /* returns 1 if `id` was open: it is no more */
void fetches_refuse(struct session *session, int code, const char *text); /* the daemon ends: ERROR for all */
void fetches_forget(struct session *session);  /* the client is gone */
void fetches_pump(struct sessions *all);       /* queues have shrunk */

void fetches_fini(struct sessions *all);       /* call it after the io pool has ended */

#endif
