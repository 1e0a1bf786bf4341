/* The grid that divides a trimmed patch's parameters. */
#ifndef PSR_DPOINT_TRIM_GRID_H
#define PSR_DPOINT_TRIM_GRID_H

#include "patch.h"
#include "trimmed.h"

#define TRIM_MOST_CELLS (1u << 22)
#define TRIM_MOST_MARKS (1u << 24)

struct trim_axis {
	uint32_t n;      /* columns, or rows */
	double *line;    /* n + 1, which rise; the first and the last are the corners' bounds */
	uint32_t *knot;  /* of each column: the lower knot of its span */
	double close;    /* what is nearer than this is at one place */
};

enum trim_state { TRIM_OUT, TRIM_IN, TRIM_RIM };

/* A side of a triangle that is a rim, and in inner units; and in which cells it is. */
struct trim_side {
	double end[2][3];
};
struct trim_mark {
	uint32_t side, next; /* of the same cell; UINT32_MAX: that was the last one */
};

struct trim_grid {
	struct dpoint_patch patch;
	struct trim_axis axis[2];
	uint8_t *state;  /* axis[0].n * axis[1].n, rows fastest: an enum trim_state; TRIM_RIM where a rim may be */
	uint32_t *first; /* of each cell: its mark, or UINT32_MAX */
	struct trim_side *side;
	struct trim_mark *mark;
	size_t n_sides, n_marks, sides_room, marks_room;
};

/* MEMORY, LIMIT; trim_fini() even then. */
int trim_init(struct trim_grid *grid, const struct psr_patch *patch, const struct dpoint_trimmed_options *options,
              struct psr_error *err);
void trim_fini(struct trim_grid *grid);

/* Finds the direction, not of unit length, of the rim that is nearest to a place, of those in its cell and the eight
 * around it. Returns 0 if there is none. */
int trim_along(double along[3], const struct trim_grid *grid, const uint32_t cell[2], const double at[3]);

/* Returns the column that x is in; of two the later, of none the nearest. */
uint32_t trim_find(const struct trim_axis *axis, double x);

static inline void trim_find_cell(uint32_t cell[2], const struct trim_grid *grid, const double uv[2])
{
	for (int k = 0; k < 2; k++)
		cell[k] = trim_find(&grid->axis[k], uv[k]);
}

/* Evaluate the patch at u and v, by the span of a cell that they are in. In inner units. trim_local() returns 0 where
 * there is no normal; the place is told in any case. */
void trim_place(double at[3], const struct trim_grid *grid, const uint32_t cell[2], const double uv[2],
                const struct dpoint_trimmed_options *options);
int trim_local(struct dpoint_local *local, const struct trim_grid *grid, const uint32_t cell[2], const double uv[2],
               const struct dpoint_trimmed_options *options);

/* trim_facets.c: adds the facets of struct dpoint_trimmed_options. MEMORY, LIMIT. */
int trim_put_facets(struct dpoint_surface *surface, const struct trim_grid *grid, const struct psr_patch *patch,
                    const struct dpoint_trimmed_options *options);

/* trim_rims.c: adds the hems and strips of struct dpoint_trimmed_options. MEMORY, LIMIT. */
int trim_put_rims(struct dpoint_surface *surface, const struct trim_grid *grid, const struct psr_patch *patch,
                  const struct dpoint_trimmed_options *options);

#endif
