/* Packed trees: what pack.c writes and unpack.c reads. */
#ifndef PSR_OCTREE_CHUNKS_H
#define PSR_OCTREE_CHUNKS_H

#include "pack.h"

#define CHUNKS_HEADER 24
#define CHUNKS_ENTRY 16 /* and 4 a stream */

struct chunk {
	uint32_t n_roots, n_codes, n_leaves;
	uint32_t root;               /* its first root */
	struct octree_levels levels; /* of its roots */
	struct coder coder, attribute[OCTREE_STREAMS];
	uint64_t leaf;               /* its first leaf */
	int rc;
};

/* Returns the leaves of a chunk. */
static inline struct octree_attributes chunk_attributes(const struct chunk *chunk, const struct octree *tree)
{
	return (struct octree_attributes){ tree->normal != NULL ? tree->normal + chunk->leaf : NULL,
		                               tree->offset != NULL ? tree->offset + chunk->leaf : NULL,
		                               tree->color != NULL ? tree->color + chunk->leaf : NULL };
}

/* Returns which streams a tree has: bit s for stream s. */
static inline unsigned chunk_streams(const struct octree *tree)
{
	return (unsigned)(tree->normal != NULL) << OCTREE_NORMAL_STREAM
	       | (unsigned)(tree->offset != NULL) << OCTREE_OFFSET_STREAM
	       | (unsigned)(tree->color != NULL) << OCTREE_COLOR_STREAM;
}

static inline size_t chunk_entry_bytes(unsigned streams)
{
	return CHUNKS_ENTRY + 4 * (size_t)__builtin_popcount(streams);
}

void chunks_destroy(struct chunk *chunk, uint32_t n); /* not the coders' bytes; NULL is fine */

#endif
