/* Elements of an array, by the cubic cell of space that each is in. The array is the caller's: of each element it keeps
 * the next one of the same cell. */
#ifndef PSR_BASE_GRID_H
#define PSR_BASE_GRID_H

#include "table.h"

#define GRID_NONE UINT32_MAX

struct grid {
	double width;         /* of a cell */
	struct table bricks;  /* of 2 x 2 x 2 cells: a search mostly needs one or two */
};

int grid_init(struct grid *grid, double width); /* MEMORY; grid_fini() either way */
void grid_fini(struct grid *grid);

/* Puts element i, which is at p, before all others of its cell: *next is the first of these, or GRID_NONE. MEMORY. */
int grid_put(struct grid *grid, const float p[3], uint32_t i, uint32_t *next);

/* First element of the cell of integer coordinates at (position / width, rounded down); GRID_NONE. */
uint32_t grid_first(const struct grid *grid, const int at[3]);

/* First elements of all cells with any that the cube of half-side radius <= 4 widths around p touches; returns how
 * many. */
#define GRID_MOST_AROUND 729
int grid_around(const struct grid *grid, const float p[3], double radius, uint32_t first[GRID_MOST_AROUND]);

#endif
