/* Private to opener.c, opening.c and steps.c: one model on its way into memory. opener.c knows the waiting requests,
 * steps.c the order of steps on the loop, opening.c the jobs on the io pool. */
#ifndef PSRD_OPENING_H
#define PSRD_OPENING_H

#include <limits.h>
#include <stdatomic.h>
#include "catalogue.h"
#include "server/net/loop.h"
#include "opener.h"

struct opener {
	struct opener_parts parts;
	int is_stopped;
	struct opening *first;
};

struct waiter { /* an OPEN, or a model that has to be built again */
	struct waiter *next;
	void *client;
	uint32_t id;
	struct catalogue_model *model; /* NULL for an OPEN */
};

struct opening {
	struct opening *next;
	struct opener *opener;
	struct loop *loop;
	const char *cache;          /* folder */
	uint64_t max_cache;
	struct catalogue_file file; /* its path is a copy */
	uint32_t resolution;        /* at which a source is built; 0 of a .psr file */
	uint32_t levels;            /* of the beginning of a .psr file; 0: all of it */
	struct waiter *waiters;
	struct psr_msg_progress progress;
	struct loop_note note;
	struct catalogue_claim claim;  /* of room for the model */
	int has_job, is_building, is_loading;
	uint64_t unwanted_us;          /* since when nobody has waited; 0: somebody does */
	atomic_int is_stopped;         /* the job that loads is to end */
	/* Belong to the job while one runs: */
	char program[PATH_MAX], key[CATALOGUE_KEY];
	char *cached, *temporary;   /* for a source: its model's path in the cache, and the path where it is built */
	char (*in_use)[CATALOGUE_KEY]; /* keys of models that the cache has to keep */
	size_t n_in_use;
	int is_cached, was_built;
	uint64_t bytes, reserved;
	struct psr_model *model;
	struct psr_error error;
	int code;
};

/* ---- opening.c: jobs; userdata is the opening. Each posts the opening's note when its results are set, `code` and
 * `error` among them ---- */

/* Sets `bytes`, and for a source `program`, `key`, `cached`, `temporary`, `is_cached`; makes the cache's folders. */
void opening_prepare(void *userdata);

/* Renames the built file into place and trims the cache, then reads `model`. */
void opening_load(void *userdata);

/* ---- steps.c ---- */

void opening_start(struct opening *o); /* prepares, builds, loads; then calls opener_end() */

/* ---- opener.c ---- */

void opener_progress(struct opening *o, const struct psr_msg_progress *progress);
/* model or error is NULL */
void opener_end(struct opening *o, struct catalogue_model *model, const struct psr_error *error);
struct catalogue_entry *opener_entry(const struct opening *o); /* the opening's entry; NULL if the catalogue has lost
                                                                * it */
int opener_has(const struct opening *o, int is_rebuild); /* whether an OPEN waits, or, with is_rebuild, a model that has
                                                          * to be built again */

#endif
