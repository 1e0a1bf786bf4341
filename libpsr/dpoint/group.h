/* Points in groups of up to 64, as a file has them: each group has a box that its words count in, and one delta a
 * side, or each point has its own. */
#ifndef PSR_DPOINT_GROUP_H
#define PSR_DPOINT_GROUP_H

#include "surface.h"

#define DPOINT_GROUP 64
#define DPOINT_OWN_DELTA 255  /* the class of a group whose points have their own */
#define DPOINT_MOST_BOX 0.16f /* of a side: half a step is below 2e-5, the slack of coverage */

enum dpoint_group_flag {
	DPOINT_TWO_SIDED = 1, /* seen from the back it is shaded with its normals turned; else it is not seen */
	DPOINT_LEANING = 2,   /* its normals lean: groups of these are the last ones */
};

struct dpoint_group {
	struct dpoint_box box;
	uint32_t first;      /* word */
	uint8_t n;           /* words, 1..DPOINT_GROUP */
	uint8_t delta[2];    /* classes, 0 to DPOINT_DELTA_CLASSES - 1; DPOINT_OWN_DELTA in a set with `delta` */
	uint8_t flags;
};
_Static_assert(sizeof(struct dpoint_group) == 32, "groups are used as they are in files");

/* What a model has: read only. Words of groups follow each other, in their order. */
struct dpoint_set {
	uint32_t n_groups, n_points;
	uint32_t n_lean;     /* how many points lean: the last ones */
	float sine;          /* of epsilon: dpoint_sine() */
	float height;        /* how far what is drawn is from the surface, at most; inner units */
	const struct dpoint_group *group;
	const struct dpoint_word *word;
	const uint8_t (*delta)[2]; /* classes by word; NULL: points have those of their groups */
	const struct dpoint_lean *lean; /* of the last n_lean points; NULL: there are none */
};

/* Returns how many bytes words, groups, deltas and leans take, in memory as in a plain file. */
static inline size_t dpoint_set_bytes(const struct dpoint_set *set)
{
	const size_t point = sizeof *set->word + (set->delta != NULL ? sizeof *set->delta : 0);

	return set->n_points * point + set->n_groups * sizeof *set->group + set->n_lean * sizeof *set->lean;
}

/* Returns what limits the extents of point k of a group. */
static inline struct dpoint_limit dpoint_limit_of(const struct dpoint_set *set, const struct dpoint_group *group,
                                                  uint32_t k)
{
	const uint8_t *delta = set->delta != NULL ? set->delta[group->first + k] : group->delta;

	return (struct dpoint_limit){ set->sine, { dpoint_delta_of_class(delta[0]), dpoint_delta_of_class(delta[1]) } };
}

/* Returns how point k of a group leans; NULL: not at all. */
static inline const struct dpoint_lean *dpoint_lean_of(const struct dpoint_set *set, const struct dpoint_group *group,
                                                       uint32_t k)
{
	return group->flags & DPOINT_LEANING ? &set->lean[group->first + k - (set->n_points - set->n_lean)] : NULL;
}

/* The quadric that is drawn for a point: its height over the tangent plane at u, v. It is S_p's up to the fourth
 * order. */
static inline float dpoint_quadric_at(float lambda_u, float rho, float u, float v)
{
	return 0.5f * lambda_u * (u * u + rho * (v * v));
}

/* Bounds of a group: a sphere that holds its points' quadrics over their rectangles. */
struct dpoint_sphere {
	float middle[3], radius;
};
void dpoint_group_sphere(struct dpoint_sphere *sphere, const struct dpoint_set *set, uint32_t group);

/* Returns the least cosine between an axis and the normals of a group's points, those by [K] (6) and those of the
 * quadrics alike. axis NULL: fills `mean`, of unit length, or 0,0,0, and returns the cosine to that. */
float dpoint_group_cosine(float mean[3], const float axis[3], const struct dpoint_set *set, uint32_t group);

/* Points to be grouped. */
struct dpoint_grouping {
	const struct dpoint_surface *surface;
	const struct dpoint_choice *choice;
	float sine;
	const uint8_t *is_two_sided; /* by part; NULL: none is */
};

/* Makes groups of the kept candidates: those of one part's sides along a Morton curve, and groups along another one,
 * those that lean behind all others.
 * Points of a group have one delta, or all points have their own where that takes fewer bytes. A delta that is no class
 * becomes the next smaller one. The caller frees what it points to by dpoint_set_fini(). set->height is 0.
 * MEMORY; LIMIT: 2^32 points. */
int dpoint_set_make(struct dpoint_set *set, const struct dpoint_grouping *grouping);
void dpoint_set_fini(struct dpoint_set *set);

#endif
