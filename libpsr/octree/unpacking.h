/* Packed trees during reading: unpack_head.c reads tables, unpack.c what they lead to. */
#ifndef PSR_OCTREE_UNPACKING_H
#define PSR_OCTREE_UNPACKING_H

#include "chunks.h"

struct unpacking {
	const uint8_t *at, *end;
	const uint8_t *begin;
	int levels, cut, depth;      /* depth: of the last step that is there */
	unsigned streams;
	enum octree_packing packing; /* of the codes */
	int is_older;                /* attributes are */
	uint32_t n_chunks;
	int n_steps;                 /* that are there */
	struct octree_step step[OCTREE_MOST_STEPS]; /* all */
	uint64_t n_codes, n_leaves, n_roots, n_top;
	const uint8_t *top;          /* codes above the cut */
	uint64_t first[OCTREE_MOST_LEVELS + 1]; /* of each depth up to the cut: its first code among these */
	uint64_t *path;              /* of the roots */
	struct chunk *chunk;
	struct octree_crew crew;
	struct octree *tree;         /* of the caller, or made once its codes are there */
	/* While codes are put into their places: the next node of each depth above the cut, chunk, root of it, and code of
	 * each of its levels. */
	uint64_t next_top[OCTREE_MOST_LEVELS];
	uint32_t next_chunk, next_root, next[OCTREE_MOST_LEVELS];
};

/* Read what stands before the codes above the cut, and say how many steps are there; these codes; and the tables of
 * chunks and steps, when `path` and `chunk` have room for them. FORMAT; LIMIT: more than max_leaves. */
int unpacking_read_header(struct unpacking *u, uint64_t max_leaves, struct psr_error *err);
int unpacking_read_top(struct unpacking *u, struct psr_error *err);
int unpacking_read_chunks(struct unpacking *u, struct psr_error *err);

#endif
