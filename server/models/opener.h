/* From a name to a model in memory: finds the key of a source, has it built, reads the file. Requests for the same file
 * share the work. Belongs to the loop's thread; reading happens on the io pool. */
#ifndef PSRD_OPENER_H
#define PSRD_OPENER_H

#include "builder.h"
#include "catalogue.h"
#include "server/net/loop.h"
#include "psr/pool.h"

struct opener;

/* Who asks: a client and the id of its request. The opener calls these, from within opener_open() or later. Any number
 * of on_progress, then one of the other two. */
struct opener_user {
	void (*on_progress)(void *client, uint32_t id, const struct psr_msg_progress *progress);
	void (*on_opened)(void *client, uint32_t id, struct catalogue_model *model);
	void (*on_refused)(void *client, uint32_t id, int code, const char *text);
};

struct opener_parts {
	struct loop *loop;
	struct psr_pool *io;
	struct catalogue *catalogue;
	struct builder *builder;
	const char *cache;                   /* folder of built models */
	uint32_t resolution, max_resolution; /* that sources are built at, pixels */
	const struct opener_user *user;
};

int opener_create(struct opener **out, const struct opener_parts *parts); /* MEMORY */
void opener_destroy(struct opener *opener); /* after the io pool has ended; NULL is fine */

void opener_open(struct opener *opener, void *client, uint32_t id, const struct psr_msg_open *msg);

/* Stops waiting; 1 if `id` was waiting. The work goes on, for the next request. */
int opener_cancel(struct opener *opener, const void *client, uint32_t id);
void opener_forget(struct opener *opener, const void *client); /* it is gone: calls nothing for it any more */
int opener_is_working(const struct opener *opener);            /* on the io pool */

/* Refuses all that wait, and starts nothing more: the daemon ends. The builder may go. */
void opener_stop(struct opener *opener, int code, const char *text);

#endif
