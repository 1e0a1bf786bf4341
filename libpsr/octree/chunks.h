/* Packed trees: what pack.c writes and unpack.c reads. */
#ifndef PSR_OCTREE_CHUNKS_H
#define PSR_OCTREE_CHUNKS_H

#include "pack.h"

#define CHUNKS_HEADER 16
#define CHUNKS_STEP 32
#define CHUNKS_ENTRY 12 /* and 4 a stream */
#define CHUNKS_WAY_FAST 5
#define CHUNKS_WAY_SMALL 6
#define CHUNKS_WAY_OLDER_FAST 0 /* these two have the same codes and other attributes */
#define CHUNKS_WAY_OLDER_SMALL 4

/* What a step adds to a chunk. */
struct chunk_step {
	uint32_t n_codes, n_leaves;  /* leaves: the chunk's nodes of the step's depth */
	uint64_t leaf;               /* the first one among those of all chunks */
	struct coder coder, attribute[OCTREE_STREAMS];
};

struct chunk {
	uint32_t n_roots, n_leaves;  /* leaves: while the tree is packed */
	uint32_t root;               /* its first root */
	struct octree_levels levels; /* of its roots */
	struct chunk_step *step;
	int rc;
};

/* Returns the leaves of a chunk in the tree that ends with a step. */
static inline struct octree_attributes chunk_attributes(const struct chunk_step *step, const struct octree *tree)
{
	return (struct octree_attributes){ tree->normal != NULL ? tree->normal + step->leaf : NULL,
		                               tree->offset != NULL ? tree->offset + step->leaf : NULL,
		                               tree->color != NULL ? tree->color + step->leaf : NULL,
		                               tree->material != NULL ? tree->material + step->leaf : NULL };
}

/* Returns the chunk's levels down to a depth, whose nodes are then leaves. The arrays stay the chunk's. */
static inline struct octree_levels chunk_levels(const struct chunk *chunk, int height)
{
	struct octree_levels levels = chunk->levels;

	levels.height = height;
	return levels;
}

/* Returns which streams a tree has: bit s for stream s. */
static inline unsigned chunk_streams(const struct octree *tree)
{
	return (unsigned)(tree->normal != NULL) << OCTREE_NORMAL_STREAM
	       | (unsigned)(tree->offset != NULL) << OCTREE_OFFSET_STREAM
	       | (unsigned)(tree->color != NULL) << OCTREE_COLOR_STREAM
	       | (unsigned)(tree->material != NULL) << OCTREE_MATERIAL_STREAM;
}

/* Returns whether a tree of these streams may be packed in steps: offsets along no normals have no means. */
static inline int chunk_may_step(unsigned streams)
{
	return (streams >> OCTREE_NORMAL_STREAM & 1) != 0 || (streams >> OCTREE_OFFSET_STREAM & 1) == 0;
}

static inline size_t chunk_entry_bytes(unsigned streams)
{
	return CHUNKS_ENTRY + 4 * (size_t)__builtin_popcount(streams);
}

/* Makes n_chunks chunks of n_steps steps, in one piece of memory that starts with the chunks. NULL without memory. */
struct chunk *chunks_create(uint32_t n_chunks, int n_steps);
void chunks_destroy(struct chunk *chunk, uint32_t n); /* not the coders' bytes; NULL is fine */

#endif
