/* Brings models back into memory for frames. A handle is only a name: its model may have left memory.
 *
 * A frame gets all models of its scene at once, pinned, or waits. It holds no model while it waits for room, so two
 * waiting frames cannot block each other. Needs for which all is in memory go first, but only so often that others do
 * not starve. A model comes back from its file; a built one from the cache, and is built again if it is missing there.
 * Belongs to the loop's thread. */
#ifndef PSRD_RESIDENCE_H
#define PSRD_RESIDENCE_H

#include "opener.h"

#define RESIDENCE_CHANGED "model %.200s left memory, and its file has changed since it was opened; open it again"

struct residence;

struct residence_parts {
	struct loop *loop;
	struct psr_pool *io;
	struct catalogue *catalogue;
	struct opener *opener;
	const char *cache;
};

struct residence_need { /* part of its owner */
	struct catalogue_model *const *model; /* n different models; the owner is a user of each */
	uint32_t n;
	/* error NULL: all are in memory and pinned until residence_put() */
	void (*on_end)(const struct psr_error *error, void *userdata);
	void *userdata;
	/* Private: */
	struct residence *residence;
	struct residence_need *next;
	struct catalogue_claim claim;
	struct coming *waits_for;
	uint32_t at;
	int is_pinned, n_tries;
};

int residence_create(struct residence **out, const struct residence_parts *parts); /* MEMORY */
void residence_destroy(struct residence *residence); /* call it after the io pool has ended; NULL is fine */

/* Returns 1 if all models are in memory and pinned: on_end is not called. Returns 0: on_end is called, possibly before
 * this returns. on_end gets NOT_FOUND: a file is gone or has changed; LIMIT: together the models are larger than
 * --max-memory; errors of reading and building. */
int residence_get(struct residence *residence, struct residence_need *need);
void residence_cancel(struct residence_need *need); /* before on_end, which is then not called */
void residence_put(struct residence *residence, struct catalogue_model *const *model, uint32_t n);

void residence_on_rebuilt(struct catalogue_model *model, const struct psr_error *error); /* the opener calls it */
int residence_is_working(const struct residence *residence); /* whether it has work on the io pool */

#endif
