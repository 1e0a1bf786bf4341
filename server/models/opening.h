/* Private to opener.c and opening.c: one model on its way into memory, and its two jobs on the io pool. */
#ifndef PSRD_OPENING_H
#define PSRD_OPENING_H

#include <limits.h>
#include "catalogue.h"
#include "server/net/loop.h"
#include "opener.h"

struct waiter {
	struct waiter *next;
	void *client;
	uint32_t id;
};

struct opening {
	struct opening *next;
	struct opener *opener;
	struct loop *loop;
	const char *cache;          /* folder */
	struct catalogue_file file; /* its path is a copy */
	uint32_t resolution;        /* that a source is built at; else 0 */
	struct waiter *waiters;
	struct psr_msg_progress progress;
	struct loop_note note;
	int has_job;
	/* Belong to the job while one runs: */
	char program[PATH_MAX], key[CATALOGUE_KEY];
	char *cached, *temporary;   /* of a source: CACHE/KEY-RESOLUTION.psr, and .tmp behind it */
	int is_cached, was_built;
	uint64_t bytes, reserved;
	struct psr_model *model;
	struct psr_error error;
	int code;
};

/* Jobs; userdata is the opening, whose note is posted when `code`, `error` and the rest are set.
 * prepare: `bytes`, and for a source `program`, `key`, `cached`, `temporary`, `is_cached`; makes the cache's folders.
 * load: renames what was built into place, then reads `model`. */
void opening_prepare(void *userdata);
void opening_load(void *userdata);

#endif
