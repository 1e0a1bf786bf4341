/* The stream of byte codes, level by level. Both ways of packing adapt to the codes as they come. */
#ifndef PSR_OCTREE_CODES_H
#define PSR_OCTREE_CODES_H

#include "coder.h"
#include "levels.h"

enum octree_packing {
	OCTREE_FAST,  /* each bit by the parent's code, the octant, and the code so far */
	OCTREE_SMALL, /* each bit by several contexts of neighbours, mixed */
};

/* Appends the codes of all levels to a coder that has begun, or reads them. Reading fills levels whose roots and height
 * are set, and stops with FORMAT when there are more than n_codes. MEMORY. */
int octree_codes_pack(struct coder *coder, const struct octree_levels *levels, enum octree_packing packing);
int octree_codes_unpack(struct octree_levels *levels, struct coder *coder, uint64_t n_codes,
                        enum octree_packing packing);

/* The models of the two ways, of their files alone. `levels` grows when decoding. */
struct codes_job {
	struct coder *coder;
	struct octree_levels *levels;
	uint64_t n_codes; /* that may still come, decoding */
	int level, rc;
	void *model;
};
void *codes_fast_model(void);  /* NULL without memory; free() */
void *codes_mixed_model(void);
void codes_fast_level(struct codes_job *job, int is_decoding);
void codes_mixed_level(struct codes_job *job, int is_decoding);

/* Keeps a code that was read. Returns 0 once there is one too many, or none left in the stream, or no memory. */
static inline int codes_keep(struct codes_job *job, const struct coder *coder, uint8_t code)
{
	if (job->n_codes == 0 || coder->has_failed)
		job->rc = PSR_ERR_FORMAT;
	else if (!octree_level_put(&job->levels->at[job->level], code))
		job->rc = PSR_ERR_MEMORY;
	else
		job->n_codes--;
	return job->rc == PSR_OK;
}

#endif
