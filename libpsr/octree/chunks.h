/* Packed trees: what pack.c writes and unpack.c reads. */
#ifndef PSR_OCTREE_CHUNKS_H
#define PSR_OCTREE_CHUNKS_H

#include "pack.h"

#define CHUNKS_HEADER 24
#define CHUNKS_ENTRY 16

struct chunk {
	uint32_t n_roots, n_codes, n_leaves;
	uint32_t root;               /* its first root */
	struct octree_levels levels; /* of its roots */
	struct coder coder;
	int rc;
};

void chunks_destroy(struct chunk *chunk, uint32_t n); /* not the coders' bytes; NULL is fine */

#endif
