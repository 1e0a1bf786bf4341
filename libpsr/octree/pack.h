/* An octree, packed: byte codes, and what its leaves have. All integers are little-endian:
 *
 *   u8  levels
 *   u8  packing     enum octree_packing
 *   u8  cut         a depth: subtrees of its nodes are packed in chunks
 *   u8  streams     bit s: there is stream s of enum octree_stream
 *   u32 n_chunks
 *   u64 n_codes, n_leaves
 *   u8  codes of the depths above the cut, the root's first, each depth in Morton order
 *   n_chunks times:
 *     u32 n_roots, n_codes, n_leaves
 *     u32 n_bytes of the codes, then of each stream that there is
 *   all chunks' bytes of the codes (codes.h), then of each stream (attributes.h)
 *
 * A chunk has at most OCTREE_CHUNK leaves, and is unpacked without the others, so threads share the work. All codes
 * come first: a beginning of the bytes may have all places and no colours. */
#ifndef PSR_OCTREE_PACK_H
#define PSR_OCTREE_PACK_H

#include <stddef.h>
#include "attributes.h"
#include "codes.h"
#include "base/pool.h"

#define OCTREE_CHUNK (1u << 20)

/* Packs all that the tree has but its cube. The same bytes with any pool, which may be NULL. *bytes is of malloc(). MEMORY. */
int octree_pack(uint8_t **bytes, size_t *n_bytes, const struct octree *tree, enum octree_packing packing,
                struct psr_pool *pool, struct psr_error *err);

/* Unpacks a tree of the cube from 0 to 1. FORMAT for what octree_pack() does not write; LIMIT: it
 * promises more than max_leaves; MEMORY. Takes memory for what the bytes hold, some 10 KB a byte at worst, and never
 * for what they promise. */
int octree_unpack(struct octree **out, const uint8_t *bytes, size_t n_bytes, uint64_t max_leaves,
                  struct psr_pool *pool, struct psr_error *err);

/* The same into the arrays of a tree, which have room for just its counts. FORMAT, too, if the bytes are of other
 * levels or counts, or of attributes other than those whose arrays there are; the arrays may then have any content. */
int octree_unpack_into(struct octree *tree, const uint8_t *bytes, size_t n_bytes, struct psr_pool *pool,
                       struct psr_error *err);

/* How many of the packed bytes are codes (with all that is no stream), and of each stream; they were unpacked before. */
struct octree_shares {
	uint64_t codes, stream[OCTREE_STREAMS];
};
void octree_packed_shares(struct octree_shares *shares, const uint8_t *bytes, size_t n_bytes);

#endif
