/* Which parts of the surface can be seen from outside: views from all around mark what they meet, as [G] 6.3 marks
 * blocks. */
#ifndef PSR_SAMPLE_VISIBLE_VISIBLE_SET_H
#define PSR_SAMPLE_VISIBLE_VISIBLE_SET_H

#include "base/table.h"
#include "base/pool.h"
#include "ray/ray.h"

struct visible_set {
	double width;       /* of a cell, inner units */
	unsigned n_views;   /* looked along so far */
	struct table table; /* keys alone: cells, and how what was met in them faces */
};

int visible_set_init(struct visible_set *set, double ds); /* MEMORY; visible_set_fini() either way */
void visible_set_fini(struct visible_set *set);

/* Looks from directions all around, others than before until there were 8,192, a ray every fourth pixel: until of what
 * 64 of them met at most one in `enough` places had not been seen by any earlier one, or until there were 512.
 * MEMORY. */
#define VISIBLE_ENOUGH 4000 /* to begin with: nearly all that is unseen then are rims of what is seen */
#define VISIBLE_LEAST_VIEWS 64
#define VISIBLE_MOST_VIEWS 512
int visible_set_look(struct visible_set *set, const struct ray_scene *scene, uint64_t enough, struct psr_pool *pool);

/* The same with cells twice as wide. MEMORY; visible_set_fini() either way. */
int visible_set_coarsen(struct visible_set *set, const struct visible_set *finer);

/* Whether anything near p that faces like n (unit, on the side that was met) was seen. */
int visible_set_has(const struct visible_set *set, const float p[3], const float n[3]);

/* Adds a place that the views missed. MEMORY. */
int visible_set_add(struct visible_set *set, const float p[3], const float n[3]);

#endif
