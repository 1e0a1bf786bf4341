/* Each bit of a code by contexts, each with a probability of its own, and by a sum of what parts of what is around the
 * octant add. Their logits are weighed, and the weights learn, too. Integers alone. */
#include "codes_node.h"

#define SPARSE 3       /* fewer nodes for each of the level above: codes_sparse.c in place of codes_dense.c */
#define FEW_NODES 4096 /* of a level teach too little for the next one to forget it */

void codes_mixed_level(struct codes_job *job, int is_decoding)
{
	const uint32_t n = codes_count(job), n_above = job->level > 0 ? job->levels->at[job->level - 1].n : 0;
	const int is_sparse = n < SPARSE * (uint64_t)n_above;

	if (n_above >= FEW_NODES)
		codes_model_forget(job->model, is_sparse);
	if (!is_decoding) {
		octree_levels_walk(job->levels, job->level, is_sparse ? codes_sparse_pack : codes_dense_pack, job);
		return;
	}
	codes_begin_level(job, n);
	if (job->rc == PSR_OK)
		octree_levels_walk(job->levels, job->level, is_sparse ? codes_sparse_unpack : codes_dense_unpack, job);
	codes_end_level(job, n);
}
