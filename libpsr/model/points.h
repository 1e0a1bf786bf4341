/* The differential points of a model ([K]), and models made of them. */
#ifndef PSR_MODEL_POINTS_H
#define PSR_MODEL_POINTS_H

#include "dpoint/group.h"
#include "model/blocks.h"

#define POINTS_CLUSTER 64 /* groups of a cluster, at most */

/* What is drawn: groups of a set, in its order. */
struct psr_points {
	/* What culling reads. Has clusters, flags, masks, spheres, and where some group is of one side, cones; one level.
	 * Has no projections, depths or attributes. */
	struct psr_blocks groups;
	const struct dpoint_set *set;
	float graze; /* dpoint.h */
	uint64_t n_bytes;
};

/* Makes what is drawn of a valid set, which must outlive it, for a resolution. FORMAT: a rectangle reaches beyond what
 * spheres can tell, 2 on any axis; MEMORY. */
int psr_points_create(struct psr_points **out, const struct dpoint_set *set, uint32_t resolution, const char *name,
                      struct psr_error *err);
void psr_points_destroy(struct psr_points *points); /* NULL is fine */

/* Returns the attributes of a point of a group, with the normal in its middle. */
static inline uint64_t psr_points_sample(const struct psr_points *points, uint32_t group, uint32_t lane)
{
	return points->set->word[points->set->group[group].first + lane].attr;
}

/* Return NULL if the model has no differential points. */
const struct psr_points *psr_model_points(const struct psr_model *model);
const struct dpoint_set *psr_model_point_set(const struct psr_model *model);

#endif
