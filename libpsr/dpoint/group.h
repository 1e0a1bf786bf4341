/* A model in memory: points in groups of up to 64, each with a box that its words count in, and one delta a side. */
#ifndef PSR_DPOINT_GROUP_H
#define PSR_DPOINT_GROUP_H

#include "surface.h"

#define DPOINT_GROUP 64
#define DPOINT_MOST_BOX 0.6f /* of a side: half a step is below 2e-5, the slack of coverage */

struct dpoint_group {
	struct dpoint_box box;
	float delta[2];
	float middle[3], radius;  /* of a sphere that holds all rectangles, and S_p above them */
	float axis[3], chord;     /* all normals by (6), of unit length, are within this distance of the axis */
	uint32_t first, n;        /* words; 1..DPOINT_GROUP */
};

struct dpoint_groups {
	struct dpoint_group *group;
	struct dpoint_word *word;
	size_t n_groups, n_words;
};

/* Makes groups of the kept candidates, by their deltas, then along a Morton curve. sine: of epsilon. MEMORY;
 * dpoint_groups_fini() even then. */
int dpoint_groups_make(struct dpoint_groups *groups, const struct dpoint_surface *surface,
                       const struct dpoint_choice *choice, float sine);
void dpoint_groups_fini(struct dpoint_groups *groups);

#endif
