/* What lies beyond the rims of a trimmed patch. */
#include <math.h>
#include "base/vec.h"
#include "trim_grid.h"

#define MOST_PARTS 4096    /* of a side along a rim */
#define FINE 4             /* parts a cell: fitting sees the box around each, along a rectangle that leans from it */

struct rims {
	struct dpoint_surface *surface;
	const struct trim_grid *grid;
	const struct psr_patch *patch;
	const struct dpoint_trimmed_options *options;
};

/* A quadrilateral from a side outwards, on the tangent plane. */
static int put_beyond(struct rims *s, double end[2][3], const double out[3], double width, const double normal[3],
                      uint32_t part)
{
	struct dpoint_cell *cell = dpoint_surface_cell(s->surface);

	if (cell == NULL)
		return PSR_ERR_MEMORY;
	for (int p = 0; p < 4; p++)
		for (int k = 0; k < 3; k++)
			cell->corner[p][k] = (float)(end[p == 1 || p == 2][k] + (p < 2 ? 0 : width) * out[k]);
	for (int k = 0; k < 3; k++)
		cell->normal[k] = (float)normal[k];
	cell->part = part;
	cell->attr = part != DPOINT_BEYOND ? s->options->attr : 0;
	return PSR_OK;
}

/* The part of a side between two places of its parameters. */
static int put_rim_part(struct rims *s, const double from[2], const double to[2], int is_end)
{
	const double middle[2] = { 0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1]) };
	struct dpoint_local local;
	double end[2][3], along[3], out[3];
	uint32_t cell[2];
	int rc;

	/* Both ends are of the side's own surface: that of its middle, if a knot is at one of them. */
	trim_find_cell(cell, s->grid, middle);
	if (!trim_local(&local, s->grid, cell, middle, s->options))
		return PSR_OK;
	for (int e = 0; e < 2; e++) {
		trim_find_cell(cell, s->grid, e == 0 ? from : to);
		trim_place(end[e], s->grid, cell, e == 0 ? from : to, s->options);
	}
	v3d_sub(along, end[1], end[0]);
	v3d_cross(out, along, local.axis[2]);
	if (!(v3d_normalize(out, out) > 0))
		return PSR_OK;
	rc = put_beyond(s, end, out, s->options->hem, local.axis[2], s->patch->material);
	return rc == PSR_OK && is_end ? put_beyond(s, end, out, s->options->cell, local.axis[2], DPOINT_BEYOND) : rc;
}

static int put_rim(struct rims *s, const double a[2], const double b[2], int is_end)
{
	double end[2][3], side[3];
	uint32_t cell[2], n;
	int rc = PSR_OK;

	trim_find_cell(cell, s->grid, a);
	trim_place(end[0], s->grid, cell, a, s->options);
	trim_find_cell(cell, s->grid, b);
	trim_place(end[1], s->grid, cell, b, s->options);
	v3d_sub(side, end[1], end[0]);
	n = (uint32_t)fmin(fmax(ceil(FINE * v3d_length(side) / s->options->cell), 1), MOST_PARTS);
	for (uint32_t i = 0; i < n && rc == PSR_OK; i++) {
		double from[2], to[2];

		for (int k = 0; k < 2; k++) {
			from[k] = a[k] + (b[k] - a[k]) * i / n;
			to[k] = i + 1 < n ? a[k] + (b[k] - a[k]) * (i + 1) / n : b[k];
		}
		rc = put_rim_part(s, from, to, is_end);
	}
	return rc;
}

int trim_put_rims(struct dpoint_surface *surface, const struct trim_grid *grid, const struct psr_patch *patch,
                  const struct dpoint_trimmed_options *options)
{
	struct rims s = { surface, grid, patch, options };
	int rc = PSR_OK;

	for (uint32_t t = 0; t < patch->n_triangles; t++)
		for (int i = 0; i < 3 && rc == PSR_OK; i++) {
			const uint32_t *corner = patch->triangle[t];
			const unsigned rim = patch->rim[t];

			if (surface->n_cells > TRIM_MOST_CELLS)
				return PSR_ERR_LIMIT;
			if (rim >> i & 1)
				rc = put_rim(&s, patch->corner[corner[i]], patch->corner[corner[(i + 1) % 3]], rim >> (3 + i) & 1);
		}
	return rc;
}
