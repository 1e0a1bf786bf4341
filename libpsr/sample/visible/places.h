/* Places of the surface: lists of them, and which small cells of space have one. */
#ifndef PSR_SAMPLE_VISIBLE_PLACES_H
#define PSR_SAMPLE_VISIBLE_PLACES_H

#include "base/table.h"
#include "ray/ray.h"

struct place {
	float p[3], n[3]; /* n: unit, on the side that counts */
	uint32_t surface; /* a side: surface.h */
};

struct places {
	struct place *place; /* free() it */
	size_t n, capacity;
};

int places_add(struct places *places, const struct place *place); /* MEMORY */

/* A ray to a place from outside of the object: one-sided faces let rays through that come from behind them. Whatever
 * is met before PLACE_AWAY - 0.01 pixels hides the place. view: unit, towards the viewer. */
#define PLACE_AWAY 3
void place_ray(const struct place *place, const double view[3], struct ray *ray);

/* Cells of space that have a place that faces one of six ways; n of 0, 0, 0: that stands for all sides. */
struct place_cells {
	double width;
	struct table table;
};

int place_cells_init(struct place_cells *cells, double width); /* MEMORY; place_cells_fini() either way */
void place_cells_fini(struct place_cells *cells);
int place_cells_has(const struct place_cells *cells, const float p[3], const float n[3]);
int place_cells_add(struct place_cells *cells, const float p[3], const float n[3]); /* MEMORY */

#endif
