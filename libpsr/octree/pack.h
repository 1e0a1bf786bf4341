/* The byte codes of an octree, packed. All integers are little-endian:
 *
 *   u8  levels
 *   u8  packing     enum octree_packing
 *   u8  cut         a depth: subtrees of its nodes are packed in chunks
 *   u8  0
 *   u32 n_chunks
 *   u64 n_codes, n_leaves
 *   u8  codes of the depths above the cut, the root's first, each depth in Morton order
 *   n_chunks times:
 *     u32 n_roots, n_codes, n_leaves, n_bytes
 *   the chunks' bytes (codes.h)
 *
 * A chunk has at most OCTREE_CHUNK leaves, and is unpacked without the others, so threads share the work. */
#ifndef PSR_OCTREE_PACK_H
#define PSR_OCTREE_PACK_H

#include <stddef.h>
#include "codes.h"
#include "base/pool.h"

#define OCTREE_CHUNK (1u << 20)

/* Packs the codes. The same bytes with any pool, which may be NULL. *bytes is of malloc(). MEMORY. */
int octree_pack(uint8_t **bytes, size_t *n_bytes, const struct octree *tree, enum octree_packing packing,
                struct psr_pool *pool, struct psr_error *err);

/* Unpacks a tree without attributes, of the cube from 0 to 1. FORMAT for what octree_pack() does not write; LIMIT: it
 * promises more than max_leaves; MEMORY. Takes memory for what the bytes hold, some 10 KB a byte at worst, and never
 * for what they promise. */
int octree_unpack(struct octree **out, const uint8_t *bytes, size_t n_bytes, uint64_t max_leaves,
                  struct psr_pool *pool, struct psr_error *err);

#endif
