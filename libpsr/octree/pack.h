/* An octree, packed: byte codes, and what its leaves have, in one step or several. A step goes down to a depth of the
 * tree; with those before it, it is a tree that ends there ([B] 4.4). All integers are little-endian:
 *
 *   u8  levels
 *   u8  way         of the codes: 5 OCTREE_FAST, 6 OCTREE_SMALL; 0 and 4 are the same with older attributes, which are
 *                   read; 1 to 3 were in no release
 *   u8  cut         a depth: subtrees of its nodes are packed in chunks
 *   u8  streams     bit s: there is stream s of enum octree_stream
 *   u32 n_chunks
 *   u64 n_steps
 *   n_steps times:
 *     u64 depth       rising; the last is `levels`
 *     u64 n_codes, n_leaves  of the tree that ends here
 *     u64 end         of the step's bytes, from the beginning of all
 *   u8  codes of the depths above the cut, the root's first, each depth in Morton order
 *   n_chunks times u32 n_roots
 *   n_steps times:
 *     n_chunks times:
 *       u32 n_codes, n_leaves  of the depths that the step adds; of its own depth
 *       u32 n_bytes of the codes, then of each stream that there is
 *     all chunks' bytes of the codes (codes.h), then of each stream (attributes.h), of the nodes of the step's depth
 *
 * A chunk is subtrees of at most OCTREE_CHUNK leaves in all, and is unpacked without the others, so threads share the
 * work. What its codes' model has learnt goes on from step to step. The attributes of a step are those of
 * octree_coarser(); the next one does not need them. */
#ifndef PSR_OCTREE_PACK_H
#define PSR_OCTREE_PACK_H

#include <stddef.h>
#include "attributes.h"
#include "codes.h"
#include "base/pool.h"

#ifndef OCTREE_CHUNK /* builds for sanitizers have smaller ones */
#define OCTREE_CHUNK (1u << 20)
#endif
#define OCTREE_MOST_STEPS OCTREE_MOST_LEVELS
#define OCTREE_STEP_LEVELS 2   /* depths of a step: it has some 16 times the leaves of the one before */
#define OCTREE_FIRST_STEP 4096 /* a step of so few leaves is the first */

struct octree_step {
	int depth;
	uint64_t n_codes, n_leaves, end;
};

/* Reads the steps that packed bytes begin with, whether or not they are there; *step has OCTREE_MOST_STEPS. Returns
 * their number, or FORMAT. */
int octree_packed_steps(struct octree_step *step, const uint8_t *bytes, size_t n_bytes, struct psr_error *err);

/* Packs all that the tree has but its cube; with OCTREE_STEPS in steps, where it is large enough. The same bytes with
 * any pool, which may be NULL. *bytes is of malloc(). MEMORY. */
int octree_pack(uint8_t **bytes, size_t *n_bytes, const struct octree *tree, enum octree_packing packing,
                struct psr_pool *pool, struct psr_error *err);

/* Who unpacks: threads (NULL: the caller's alone), and who may stop them (NULL: nobody). They ask before each chunk,
 * and after each step and stream of one: some tenths of a second apart for chunks of a million leaves. */
struct octree_crew {
	struct psr_pool *pool;
	const struct psr_cancel *cancel;
};

/* Unpacks a tree of the cube from 0 to 1. Bytes that end with a step are a coarser tree. FORMAT for what octree_pack()
 * does not write; LIMIT: it promises more than max_leaves; MEMORY; CANCELLED. Takes memory for what the bytes hold,
 * some 10 KB a byte at worst, and never for what they promise. crew NULL: the caller alone, and nobody stops it. */
int octree_unpack(struct octree **out, const uint8_t *bytes, size_t n_bytes, uint64_t max_leaves,
                  const struct octree_crew *crew, struct psr_error *err);

/* The same into the arrays of a tree, which have room for just its counts. FORMAT, too, if the bytes are of other
 * levels or counts, or of attributes other than those whose arrays there are; the arrays may then have any content. */
int octree_unpack_into(struct octree *tree, const uint8_t *bytes, size_t n_bytes, const struct octree_crew *crew,
                       struct psr_error *err);

/* How many of the packed bytes are codes (with all that is no stream), of each stream of the leaves, and of streams of
 * coarser steps; they were unpacked before. */
struct octree_shares {
	uint64_t codes, stream[OCTREE_STREAMS], coarser;
};
void octree_packed_shares(struct octree_shares *shares, const uint8_t *bytes, size_t n_bytes);

#endif
