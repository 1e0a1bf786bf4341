/* Facets of a trimmed patch: its triangles, divided where they are off the surface. */
#include <math.h>
#include <string.h>
#include "base/vec.h"
#include "trim_grid.h"

#define MOST_DEPTH 24    /* halves of halves */

struct corner {
	double uv[2], at[3];
	uint32_t cell[2];
};

struct dividing {
	struct facets *facets;
	const struct trim_grid *grid;
	const struct dpoint_trimmed_options *options;
};

static void find_place(struct corner *c, const struct dividing *d)
{
	trim_find_cell(c->cell, d->grid, c->uv);
	trim_place(c->at, d->grid, c->cell, c->uv, d->options);
}

/* Finds the middle of a side. Returns how far it is from the chord, or 0 without looking where normals turn too little
 * for what is allowed: an arc of a length and a turn is off its chord by an eighth of their product, its chord is at
 * most 4.3 % shorter if it turns by 1, and normals turn by as much as the grid's cells let them. */
static double find_middle(struct corner *middle, const struct corner *a, const struct corner *b,
                          const struct dividing *d)
{
	double along[3], away[3], square, t, turn = 0;

	v3d_sub(along, b->at, a->at);
	square = v3d_dot(along, along);
	for (int k = 0; k < 2; k++)
		turn += (fabs((double)a->cell[k] - b->cell[k]) + 1) * d->options->turn;
	if (turn <= 1 && 1.043 * turn * sqrt(square) / 8 <= d->options->facet)
		return 0;
	for (int k = 0; k < 2; k++)
		middle->uv[k] = 0.5 * (a->uv[k] + b->uv[k]);
	find_place(middle, d);
	v3d_sub(away, middle->at, a->at);
	t = square > 0 ? fmin(fmax(v3d_dot(away, along) / square, 0), 1) : 0;
	v3d_add_scaled(away, away, -t, along);
	return v3d_length(away);
}

static int put(const struct dividing *d, const struct corner *a, const struct corner *b, const struct corner *c)
{
	const struct corner *corner[3] = { a, b, c };
	float at[3][3];

	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 3; k++)
			at[i][k] = (float)corner[i]->at[k];
	return facets_add(d->facets, at[0], at[1], at[2]);
}

/* A side is divided in both of its triangles or in none, as it is the side that tells: so neighbours meet. */
static int divide(const struct dividing *d, const struct corner *a, const struct corner *b, const struct corner *c,
                  int depth)
{
	const struct corner *corner[3] = { a, b, c };
	struct corner middle[3];
	double off[3];
	int worst = 0, rc;

	for (int i = 0; i < 3; i++) {
		off[i] = find_middle(&middle[i], corner[i], corner[(i + 1) % 3], d);
		worst = off[i] > off[worst] ? i : worst;
	}
	if (!(off[worst] > d->options->facet) || depth >= MOST_DEPTH)
		return put(d, a, b, c);
	rc = divide(d, corner[worst], &middle[worst], corner[(worst + 2) % 3], depth + 1);
	return rc == PSR_OK ? divide(d, &middle[worst], corner[(worst + 1) % 3], corner[(worst + 2) % 3], depth + 1) : rc;
}

int trim_put_facets(struct dpoint_surface *surface, const struct trim_grid *grid, const struct psr_patch *patch,
                    const struct dpoint_trimmed_options *options)
{
	const struct dividing d = { &surface->facets, grid, options };
	int rc = PSR_OK;

	for (uint32_t t = 0; t < patch->n_triangles && rc == PSR_OK; t++) {
		struct corner corner[3];

		for (int i = 0; i < 3; i++) {
			memcpy(corner[i].uv, patch->corner[patch->triangle[t][i]], sizeof corner[i].uv);
			find_place(&corner[i], &d);
		}
		if (surface->facets.n > TRIM_MOST_CELLS)
			return PSR_ERR_LIMIT;
		rc = divide(&d, &corner[0], &corner[1], &corner[2], 0);
	}
	return rc;
}
