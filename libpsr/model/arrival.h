/* A .psr file as it arrives: every byte is checked against the hashes at its beginning before it counts. */
#ifndef PSR_MODEL_ARRIVAL_H
#define PSR_MODEL_ARRIVAL_H

#include "octree/pack.h"
#include "psr/error.h"

/* What is known by now. */
struct arrival_facts {
	uint64_t n_taken, n_checked; /* bytes; those that are known to be right */
	uint64_t n_file;             /* of the whole file; 0: not known yet, as everything below */
	uint64_t hash;               /* of its header, which stands for all of it */
	int n_steps;                 /* of a packed octree: the file up to a step's `end` opens as a coarser model; */
	struct octree_step step[OCTREE_MOST_STEPS]; /* 0: no such octree, or not known yet */
	int has_steps;               /* whether there will be some */
};

struct arrival;

int arrival_create(struct arrival **out); /* MEMORY */
void arrival_destroy(struct arrival *arrival); /* NULL is fine */
const struct arrival_facts *arrival_facts(const struct arrival *arrival);

/* Takes the next bytes. FORMAT: this is no .psr file, or it is damaged: says where; then only arrival_rewind() may
 * follow. VERSION, MEMORY. */
int arrival_take(struct arrival *arrival, const uint8_t *bytes, size_t n, struct psr_error *err);

/* Forgets the bytes that are not checked: the next ones are those from n_checked on. */
void arrival_rewind(struct arrival *arrival);

#endif
