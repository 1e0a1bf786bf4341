/* Flat points over cells that no candidate covers. */
#include <math.h>
#include <string.h>
#include "base/vec.h"
#include "choice.h"
#include "rectangle.h"

/* The longest side of a cell, and across it: half of what the cell takes of both, from its middle on. */
static int local_of_cell(struct dpoint_local *local, double extent[2], const struct dpoint_cell *cell)
{
	double side[4][3], diagonal[2][3], most = 0;
	int longest = 0;

	memset(local, 0, sizeof *local);
	memset(extent, 0, 2 * sizeof *extent);
	for (int c = 0; c < 4; c++)
		for (int k = 0; k < 3; k++) {
			local->at[k] += 0.25 * cell->corner[c][k];
			local->axis[2][k] = cell->normal[k];
			side[c][k] = (double)cell->corner[(c + 1) % 4][k] - cell->corner[c][k];
			diagonal[c % 2][k] = (double)cell->corner[c % 2 + 2][k] - cell->corner[c % 2][k];
		}
	for (int c = 0; c < 4; c++)
		if (v3d_dot(side[c], side[c]) > most) {
			most = v3d_dot(side[c], side[c]);
			longest = c;
		}
	if (v3d_dot(local->axis[2], local->axis[2]) == 0)
		v3d_cross(local->axis[2], diagonal[0], diagonal[1]);
	if (v3d_normalize(local->axis[2], local->axis[2]) == 0)
		return 0;
	v3d_add_scaled(local->axis[0], side[longest], -v3d_dot(side[longest], local->axis[2]), local->axis[2]);
	if (v3d_normalize(local->axis[0], local->axis[0]) == 0)
		return 0;
	v3d_cross(local->axis[1], local->axis[2], local->axis[0]);
	for (int c = 0; c < 4; c++)
		for (int k = 0; k < 2; k++) {
			double away[3];

			for (int i = 0; i < 3; i++)
				away[i] = cell->corner[c][i] - local->at[i];
			extent[k] = fmax(extent[k], fabs(v3d_dot(away, local->axis[k])));
		}
	return 1;
}

/* Rounding turns the sides of a rectangle by pi / 256, and tilts it by a triangle of normals: 0.015 at most. */
static int put_patch(struct dpoint_surface *surface, uint32_t at, const struct dpoint_cover_options *options)
{
	const struct dpoint_cell *cell = &surface->cell[at];
	struct dpoint_local local;
	double extent[2];
	struct dpoint_candidate like = { .point.attr = cell->attr, .part = cell->part, .cell = at };
	int is_good = local_of_cell(&local, extent, cell);

	for (int k = 0; k < 2; k++) {
		const double reach = extent[k] + 0.015 * (extent[0] + extent[1]) + 1.01 * options->slack;
		const unsigned class = dpoint_delta_class((float)fmin(reach, 0.8));

		like.delta[k] = dpoint_delta_of_class(class > 0 ? class - 1 : 0);
	}
	return dpoint_surface_put(surface, is_good ? &local : NULL, &like);
}

static int patch_below(struct dpoint_surface *surface, const struct tally *tally, size_t i,
                       const struct dpoint_cover_options *options)
{
	const struct cell_tree *tree = tally->cover->tree;
	uint32_t cell;
	int rc;

	if (tally->least[i] > 0 || tally->own[i] > 0)
		return PSR_OK;
	if (cell_node_is_leaf(&tree->node[i])) {
		cell = tree->order[tree->node[i].begin];
		return surface->cell[cell].part != DPOINT_BEYOND ? put_patch(surface, cell, options) : PSR_OK;
	}
	rc = patch_below(surface, tally, 2 * i + 1, options);
	return rc == PSR_OK ? patch_below(surface, tally, 2 * i + 2, options) : rc;
}

int dpoint_mend(struct dpoint_surface *surface, struct dpoint_cover *cover,
                const struct dpoint_cover_options *options, struct psr_pool *pool, const struct psr_cancel *cancel)
{
	const struct dpoint_cover_options any = { options->sine, options->slack, 1, 1, options->is_within_parts, 0, 255 };
	const struct dpoint_work work = { pool, cancel };
	struct tally tally;
	int rc;

	if (cover->tree == NULL)
		return PSR_OK;
	rc = tally_init(&tally, cover);
	for (uint32_t i = 0; i < cover->n_candidates && rc == PSR_OK; i++)
		tally_add(&tally, i, 1);
	if (rc == PSR_OK)
		rc = patch_below(surface, &tally, 0, options);
	tally_fini(&tally);
	return rc == PSR_OK ? cover_candidates(cover, surface, &any, &work) : rc;
}
