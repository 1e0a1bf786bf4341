/* Lists of places of the surface; and which small cells of space have one that faces one of six ways. */
#ifndef PSR_SAMPLE_MEND_PLACES_H
#define PSR_SAMPLE_MEND_PLACES_H

#include <stddef.h>
#include <stdint.h>
#include "sample/level.h"

struct spots {
	struct surface_spot *spot; /* free() it */
	size_t n, capacity;
};

int spots_add(struct spots *spots, const struct surface_spot *spot); /* MEMORY */

struct spot_cells {
	double width;
	uint64_t *key;
	size_t n, size; /* size: a power of two */
};

int spot_cells_init(struct spot_cells *cells, double width); /* MEMORY; spot_cells_fini() either way */
void spot_cells_fini(struct spot_cells *cells);

/* Whether there is one in p's cell that faces about like n; n: 0,0,0 for those that stand for all sides. */
int spot_cells_has(const struct spot_cells *cells, const float p[3], const float n[3]);
int spot_cells_add(struct spot_cells *cells, const float p[3], const float n[3]); /* MEMORY */

#endif
