/* The arrays of a model's blocks under construction. */
#ifndef PSR_SAMPLE_PACK_PACK_BLOCK_H
#define PSR_SAMPLE_PACK_PACK_BLOCK_H

#include "sample/levels/draft.h"

struct pack {
	const struct ray_scene *scene;
	const struct surface *surface;
	const struct draft *draft;
	struct psr_cluster *cluster;
	struct psr_run *run;
	int16_t *center[3];
	uint16_t *radius;
	int8_t *cone[3];
	uint8_t *cone_sine, *block_projection, *flags, *traits, *opacity;
	uint16_t *attr_offset, *depth;
	uint64_t *mask, *attr;
	uint32_t n_clusters, n_samples; /* so far */
	double box_min[3], box_max[3];  /* of level 0's samples so far, inner units */
};

/* Box of a block's samples in the space of its projection. */
void pack_box(const struct draft *draft, const struct draft_block *block, double min[3], double max[3]);

/* Fills entry i of the arrays of blocks, in order, and the next entries of the samples' arrays. */
void pack_block(struct pack *pack, uint32_t i, const struct draft_block *block);

/* Sets the sphere of a cluster from its blocks' spheres. */
void pack_bound_cluster(const struct psr_blocks *blocks, struct psr_cluster *cluster);

#endif
