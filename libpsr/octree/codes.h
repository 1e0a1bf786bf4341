/* The stream of byte codes, level by level. Both ways of packing adapt to the codes as they come. */
#ifndef PSR_OCTREE_CODES_H
#define PSR_OCTREE_CODES_H

#include "coder.h"
#include "levels.h"

enum octree_packing {
	OCTREE_FAST,  /* each bit by the parent's code, the octant, and the code so far */
	OCTREE_SMALL, /* each bit by several contexts of neighbours, mixed */
	OCTREE_STEPS, /* beside one of the others, for octree_pack(): a beginning of the bytes is a coarser tree */
};

/* Codes go level by level; a stream may end after any level and another one go on, with all that the model has learnt.
 * `levels` grows when decoding. */
struct codes_job {
	struct octree_levels *levels;
	enum octree_packing packing;
	int level;        /* the next one */
	/* Of this folder alone: */
	struct coder *coder;
	uint64_t n_codes; /* that may still come, decoding */
	int rc;
	void *model;
};

/* Begins with the first level of some levels, whose roots and height are set. MEMORY. */
int octree_codes_begin(struct codes_job *job, struct octree_levels *levels, enum octree_packing packing);
void octree_codes_end(struct codes_job *job); /* zeros are fine */

/* Appends the codes of the levels below `end` that are not there yet to a coder that has begun, or reads them. Reading
 * stops with FORMAT when there are more than n_codes. MEMORY. */
int octree_codes_pack(struct codes_job *job, struct coder *coder, int end);
int octree_codes_unpack(struct codes_job *job, struct coder *coder, int end, uint64_t n_codes);

/* The models of the two ways, of their files alone. */
void *codes_fast_model(void);  /* NULL without memory; free() */
void *codes_mixed_model(void);
void codes_fast_level(struct codes_job *job, int is_decoding);
void codes_mixed_level(struct codes_job *job, int is_decoding);

/* How many nodes the next level has. */
uint32_t codes_count(const struct codes_job *job);

/* Around a level that is read: makes room for its codes; tells its first children. Both set job->rc. */
void codes_begin_level(struct codes_job *job, uint32_t n);
void codes_end_level(struct codes_job *job, uint32_t n);

#endif
