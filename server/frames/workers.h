/* Workers that draw nothing now. One that has drawn shadow maps is its flow's, which gets it again; others are
 * nobody's: few of them serve many flows, and stay in the caches. A worker of the same size of picture knows its clean
 * tiles. */
#ifndef PSRD_WORKERS_H
#define PSRD_WORKERS_H

#include "draw.h"

#define WORKERS_MOST 512

struct workers_use {
	uint64_t flow;          /* 0: it is nobody's */
	uint32_t width, height; /* of the picture */
};

struct workers {
	struct psr_pool *io; /* frees them */
	struct {
		struct draw_worker *worker;
		struct workers_use use; /* the last one */
		uint64_t bytes;
	} idle[WORKERS_MOST]; /* the one used last stands last */
	unsigned n;
	uint64_t bytes, most_bytes;
};

void workers_init(struct workers *workers, struct psr_pool *io, uint64_t most_bytes);
void workers_fini(struct workers *workers);

/* The flow's own; else nobody's, of the same size if there is one, and the one used last, whose buffers are in the
 * caches; else a new one while all idle ones and `bytes` fit into most_bytes; else the one that rests longest. NULL
 * without memory. */
struct draw_worker *workers_take(struct workers *workers, const struct workers_use *use, uint64_t bytes);
void workers_put(struct workers *workers, const struct workers_use *use, struct draw_worker *worker);
void workers_forget(struct workers *workers, uint64_t flow); /* the flow is gone: its workers are nobody's */
void workers_free(struct workers *workers, uint64_t bytes); /* so many or more, those that rest longest first */

#endif
