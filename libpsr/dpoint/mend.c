/* Flat points over cells that no candidate covers. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"
#include "bound.h"
#include "choice.h"
#include "rectangle.h"

#define AROUND 3 /* levels of the tree: a cell is looked at with seven around it */

/* Along a side of a cell, and across it: half of what the cell takes of both, from its middle on. next: the side comes
 * so many after the longest. is_own: with the normal of the cell's plane, and not that of the surface. */
static int local_of_cell(struct dpoint_local *local, double extent[2], const struct dpoint_cell *cell, int next,
                         int is_own)
{
	double side[4][3], diagonal[2][3], most = 0;
	int along = 0;

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
			along = c;
		}
	along = (along + next) % 4;
	if (is_own || v3d_dot(local->axis[2], local->axis[2]) == 0) {
		double normal[3];

		v3d_cross(normal, diagonal[0], diagonal[1]);
		v3d_scale(local->axis[2], normal, v3d_dot(normal, local->axis[2]) < 0 ? -1 : 1);
	}
	if (v3d_normalize(local->axis[2], local->axis[2]) == 0)
		return 0;
	v3d_add_scaled(local->axis[0], side[along], -v3d_dot(side[along], local->axis[2]), local->axis[2]);
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
static enum dpoint_made flat_patch(struct dpoint_candidate *out, const struct dpoint_surface *surface, uint32_t at,
                                   const struct dpoint_cover_options *options, int next, int is_own)
{
	const struct dpoint_cell *cell = &surface->cell[at];
	struct dpoint_local local;
	double extent[2];
	struct dpoint_candidate like = { .point.attr = cell->attr, .part = cell->part, .cell = at };
	int is_good = local_of_cell(&local, extent, cell, next, is_own);

	for (int k = 0; k < 2; k++) {
		const double reach = extent[k] + 0.015 * (extent[0] + extent[1]) + 1.01 * options->slack;
		const unsigned class = dpoint_delta_class((float)fmin(reach, 0.8));

		like.delta[k] = dpoint_delta_of_class(class > 0 ? class - 1 : 0);
	}
	return dpoint_candidate_make(out, is_good ? &local : NULL, &like);
}

int plane_over(struct dpoint_candidate *out, const struct dpoint_surface *surface, uint32_t cell,
               const struct dpoint_cover_options *options)
{
	return flat_patch(out, surface, cell, options, 0, 1) != DPOINT_BAD;
}

/* Kinds of patches over a cell. From SECOND on they are as the flat one, along other sides. */
enum kind { BENT, FLAT, OWN, SECOND, THIRD, FOURTH, N_KINDS };

struct mending {
	struct dpoint_surface *surface;
	const struct dpoint_cover_options *options;
	const struct tally *tally;
	uint32_t *own;           /* the candidate of each cell, or UINT32_MAX; NULL: patches are flat */
	double error;            /* that patches should be within; 0: the first kind will do */
	enum kind first, n_kinds; /* those from the first on and before n_kinds are tried */
	struct bound_view view;
};

/* Points that mend cover their cells whatever these look like. */
static struct dpoint_cover_options any_of(const struct dpoint_cover_options *options)
{
	return (struct dpoint_cover_options){ .sine = options->sine, .slack = options->slack, .angle = 1, .height = 1,
		                                  .is_within_parts = options->is_within_parts, .looks = 255 };
}

static int is_covered(const struct mending *m, const struct dpoint_candidate *c, uint32_t at)
{
	const struct dpoint_cover_options any = any_of(m->options);
	struct rectangle r;
	struct looking look;

	looking_init(&look, m->surface, m->tally->cover->tree, &any);
	rectangle_of(&r, c, &any);
	rectangle_shorten(&r, any.slack);
	return rectangle_covers(&look, &r, &m->surface->cell[at]);
}

static int patch_of(struct dpoint_candidate *out, const struct mending *m, uint32_t at, enum kind kind)
{
	if (kind != BENT)
		return flat_patch(out, m->surface, at, m->options, kind > OWN ? kind - OWN : 0, kind == OWN) != DPOINT_BAD;
	if (m->own[at] == UINT32_MAX)
		return 0;
	*out = m->surface->candidate[m->own[at]];
	return rectangle_around(out->delta, out, &m->surface->cell[at], m->options) && is_covered(m, out, at);
}

static double error_of(struct bound_view *view, const struct dpoint_surface *surface, const struct dpoint_candidate *c,
                       const struct dpoint_cover_options *options, double least)
{
	float extent[2];

	dpoint_candidate_extent(extent, c, options->sine);
	return bound_least(view, &surface->facets, &c->point, extent, least);
}

/* Finds the first kind of patch that is within the error, or the nearest. Returns 0 where none is near the surface at
 * all; *is_bad: there is none of any kind. */
static int bounded_patch(struct dpoint_candidate *out, int *is_bad, struct mending *m, uint32_t at, enum kind first)
{
	struct dpoint_candidate patch;
	double least = INFINITY;

	*is_bad = 1;
	for (enum kind kind = first; kind < m->n_kinds && least > m->error && !m->view.is_failed; kind++) {
		double error;

		if (!patch_of(&patch, m, at, kind))
			continue;
		*is_bad = 0;
		error = error_of(&m->view, m->surface, &patch, m->options, m->error);
		if (error < least) {
			least = error;
			*out = patch;
		}
	}
	return least < INFINITY;
}

/* Whether a cell was left open since its neighbours look different: then its shape is as good as theirs. Strips have no
 * look. */
static int is_left_by_look(const struct mending *m, size_t node)
{
	const struct cell_tree *tree = m->tally->cover->tree;
	const uint32_t at = tree->order[tree->node[node].begin];
	struct look_range all, look;

	look_range_of(&all, m->surface->cell[at].attr);
	for (int i = 0; i < AROUND && node > 0; i++)
		node = (node - 1) / 2;
	for (uint32_t c = tree->node[node].begin; c < tree->node[node].end; c++) {
		const struct dpoint_cell *cell = &m->surface->cell[tree->order[c]];

		look_range_of(&look, cell->attr);
		if (cell->part != DPOINT_BEYOND)
			look_range_join(&all, &look);
	}
	return look_range_width(&all) > m->options->looks;
}

static int put_patch(struct mending *m, uint32_t at, size_t node)
{
	struct dpoint_candidate patch, *candidate;
	int is_there, is_bad;

	if (m->error > 0) {
		is_there = bounded_patch(&patch, &is_bad, m, at, is_left_by_look(m, node) ? BENT : m->first);
	} else {
		is_there = (m->own != NULL && patch_of(&patch, m, at, BENT)) || patch_of(&patch, m, at, FLAT);
		is_bad = !is_there;
	}
	if (m->view.is_failed)
		return PSR_ERR_MEMORY;
	m->surface->n_bad += (uint64_t)is_bad;
	if (!is_there)
		return PSR_OK;
	candidate = dpoint_surface_candidate(m->surface);
	if (candidate == NULL)
		return PSR_ERR_MEMORY;
	*candidate = patch;
	return PSR_OK;
}

static int patch_below(struct mending *m, size_t i)
{
	const struct cell_tree *tree = m->tally->cover->tree;
	uint32_t cell;
	int rc;

	if (m->tally->least[i] > 0 || m->tally->own[i] > 0)
		return PSR_OK;
	if (cell_node_is_leaf(&tree->node[i])) {
		cell = tree->order[tree->node[i].begin];
		return m->surface->cell[cell].part != DPOINT_BEYOND ? put_patch(m, cell, i) : PSR_OK;
	}
	rc = patch_below(m, 2 * i + 1);
	return rc == PSR_OK ? patch_below(m, 2 * i + 2) : rc;
}

static int find_own(struct mending *m)
{
	const struct dpoint_surface *surface = m->surface;

	m->own = malloc((surface->n_cells + 1) * sizeof *m->own);
	if (m->own == NULL)
		return PSR_ERR_MEMORY;
	memset(m->own, 0xff, surface->n_cells * sizeof *m->own);
	for (uint32_t i = 0; i < surface->n_candidates; i++)
		m->own[surface->candidate[i].cell] = i;
	return PSR_OK;
}

static int cover_any(struct dpoint_cover *cover, const struct dpoint_surface *surface,
                     const struct dpoint_cover_options *options, const struct dpoint_work *work)
{
	const struct dpoint_cover_options any = any_of(options);

	return cover_candidates(cover, surface, &any, work);
}

int dpoint_mend(struct dpoint_surface *surface, struct dpoint_cover *cover,
                const struct dpoint_cover_options *options, struct psr_pool *pool, const struct psr_cancel *cancel)
{
	const struct dpoint_work work = { pool, cancel };
	struct tally tally;
	struct mending m = { .surface = surface, .options = options, .tally = &tally, .error = (double)options->error,
		                 .n_kinds = OWN + 1 };
	int rc;

	if (cover->tree == NULL)
		return PSR_OK;
	rc = tally_init(&tally, cover);
	if (rc == PSR_OK)
		tally_add_all(&tally);
	/* Rims cut cells of patches to slanted pieces, and triangles of meshes are such: a rectangle along the longest side
	 * of one that ends at an edge goes beyond it, by half a sample and more. */
	if (surface->facets.n > 0 && !surface->is_cloud && !(options->error > 0)) {
		m.error = 0.25 * (double)options->height;
		m.first = surface->margin > 0 ? BENT : FLAT;
		m.n_kinds = N_KINDS;
	}
	if (rc == PSR_OK && (m.error > 0 || surface->is_cloud))
		rc = find_own(&m);
	if (rc == PSR_OK)
		rc = patch_below(&m, 0);
	free(m.own);
	bound_view_fini(&m.view);
	tally_fini(&tally);
	return rc == PSR_OK ? cover_any(cover, surface, options, &work) : rc;
}

int mend_planes(struct dpoint_surface *surface, struct dpoint_cover *cover, const uint8_t *is_open,
                const struct dpoint_cover_options *options, const struct dpoint_work *work)
{
	struct bound_view view = { .seen = NULL };
	int rc = PSR_OK;

	for (uint32_t i = 0; i < surface->n_cells && rc == PSR_OK; i++) {
		struct dpoint_candidate plane, *candidate;

		if (!is_open[i] || !plane_over(&plane, surface, i, options) ||
		    (options->error > 0 &&
		     !(error_of(&view, surface, &plane, options, (double)options->error) <= (double)options->error)))
			continue;
		candidate = view.is_failed ? NULL : dpoint_surface_candidate(surface);
		if (candidate == NULL)
			rc = PSR_ERR_MEMORY;
		else
			*candidate = plane;
	}
	bound_view_fini(&view);
	return rc == PSR_OK ? cover_any(cover, surface, options, work) : rc;
}
