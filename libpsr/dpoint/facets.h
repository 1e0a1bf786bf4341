/* The source surface as triangles, in inner units: what drawn points are measured against. */
#ifndef PSR_DPOINT_FACETS_H
#define PSR_DPOINT_FACETS_H

#include <stddef.h>
#include <stdint.h>

struct facet {
	float corner[3][3];
};

struct facet_box {
	float low[3], high[3];
};

/* Boxes of halves of halves: node i has the children 2 i + 1 and 2 i + 2. */
struct facets {
	struct facet *facet;
	struct facet_box *node; /* NULL before facets_sort() */
	size_t n, room;
};

int facets_add(struct facets *facets, const float a[3], const float b[3], const float c[3]); /* MEMORY */
int facets_sort(struct facets *facets); /* when all are there, and again after others: in the order of a Morton curve.
                                         * MEMORY */
void facets_fini(struct facets *facets); /* zeros are fine */

/* Calls fn for runs of facets, so that each facet whose box meets `box` is in one of them. Ends where fn returns
 * another value than 0, and returns that. */
int facets_search(const struct facets *facets, const struct facet_box *box,
                  int (*fn)(const struct facet *facet, size_t n, void *userdata), void *userdata);

#endif
