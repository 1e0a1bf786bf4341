/* From a name to a model in memory: finds the key of a source, has it built, reads the file. Requests for the same file
 * share the work. Belongs to the loop's thread; files are read on the io pool. */
#ifndef PSRD_OPENER_H
#define PSRD_OPENER_H

#include "builder.h"
#include "catalogue.h"
#include "server/net/loop.h"
#include "base/pool.h"

struct opener;

/* The asker: a client and the id of its request. The opener calls these, from within opener_open() or later:
 * on_progress any number of times, then one of the other two. */
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
	const char *models, *cache;          /* folder of sources and models; folder of built models */
	uint64_t max_cache;                  /* bytes of built models; 0: no limit */
	uint32_t resolution, max_resolution; /* at which sources are built, pixels */
	const struct opener_user *user;
	/* Called when a rebuild has ended: with error NULL the model is in memory again if model->model is not NULL. */
	void (*on_rebuilt)(struct catalogue_model *model, const struct psr_error *error);
};

int opener_create(struct opener **out, const struct opener_parts *parts); /* MEMORY */
void opener_destroy(struct opener *opener); /* call it after the io pool has ended; NULL is fine */

void opener_open(struct opener *opener, void *client, uint32_t id, const struct psr_msg_open *msg);

/* Builds a model again that the cache has lost; needs model->entry and model->coming. Calls on_rebuilt, unless
 * opener_forget() is called for the model. MEMORY, CANCELLED: does not call it. */
int opener_rebuild(struct opener *opener, struct catalogue_model *model);

/* Stops waiting; returns 1 if `id` was waiting. A build that nobody waits for ends after a second, the unpacking of an
 * octree at once; all other work goes on, for the next request. */
int opener_cancel(struct opener *opener, const void *client, uint32_t id);
void opener_forget(struct opener *opener, const void *client); /* the client is gone: calls nothing for it any more */
void opener_tick(struct opener *opener);                       /* call it on the loop's ticks */
int opener_is_working(const struct opener *opener);            /* whether it has work on the io pool */

/* Refuses all waiting requests, and starts nothing more: the daemon ends. Afterwards the builder may be destroyed. */
void opener_stop(struct opener *opener, int code, const char *text);

#endif
