/* A grid of cubic cells that finds elements of an array by place. The caller owns the array, and keeps for each element
 * the next one of the same cell. */
#ifndef PSR_BASE_GRID_H
#define PSR_BASE_GRID_H

#include "table.h"

#define GRID_NONE UINT32_MAX

struct grid {
	double width;         /* of a cell */
	struct table bricks;  /* a brick is 2 x 2 x 2 cells: a search mostly needs one or two bricks */
};

int grid_init(struct grid *grid, double width); /* MEMORY; grid_fini() either way */
void grid_fini(struct grid *grid);

/* Puts element i, which is at p, in front of the others of its cell: *next becomes the cell's former first element, or
 * GRID_NONE. MEMORY. */
int grid_put(struct grid *grid, const float p[3], uint32_t i, uint32_t *next);

/* Returns the first element of the cell of integer coordinates at (position / width, rounded down), or GRID_NONE. */
uint32_t grid_first(const struct grid *grid, const int at[3]);

/* Finds the cells that the cube of half-side radius <= 4 widths around p touches. Returns the number of those that are
 * not empty, and their first elements. */
#define GRID_MOST_AROUND 729
int grid_around(const struct grid *grid, const float p[3], double radius, uint32_t first[GRID_MOST_AROUND]);

#endif
