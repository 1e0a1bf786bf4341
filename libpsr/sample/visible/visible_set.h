/* Which parts of the surface can be seen from outside: views from all around mark what they meet, as [G] 6.3 marks
 * blocks. */
#ifndef PSR_SAMPLE_VISIBLE_VISIBLE_SET_H
#define PSR_SAMPLE_VISIBLE_VISIBLE_SET_H

#include <stddef.h>
#include <stdint.h>
#include "base/pool.h"
#include "ray/ray.h"

struct seen {
	double cell;      /* side of a cubic cell, inner units */
	size_t size;      /* a power of two */
	uint64_t n_cells;
	unsigned n_views; /* looked along so far */
	uint64_t *table;  /* cells, with the way that what was met in them faces; only grows, so its order does not
	                   * matter */
};

int seen_init(struct seen *seen, double ds); /* MEMORY; seen_fini() either way */

/* Looks from directions all around, others than before until there were 8,192, a ray every fourth pixel: until of what
 * 64 of them met at most one in `enough` places had not been seen by any earlier one, or until there were 512.
 * MEMORY. */
#define SEEN_ENOUGH 4000 /* to begin with: nearly all that is unseen then are rims of what is seen */
#define SEEN_LEAST_VIEWS 64
#define SEEN_MOST_VIEWS 512
int seen_look(struct seen *seen, const struct ray_scene *scene, uint64_t enough, struct psr_pool *pool);
void seen_fini(struct seen *seen);

/* What was seen of cells half as wide. MEMORY; seen_fini() either way. */
int seen_coarsen(struct seen *seen, const struct seen *finer);

/* Whether anything near p that faces like n (unit, on the side that was met) was seen. */
int seen_is(const struct seen *seen, const float p[3], const float n[3]);

/* Puts a place down as seen that the views missed. MEMORY. */
int seen_add(struct seen *seen, const float p[3], const float n[3]);

#endif
