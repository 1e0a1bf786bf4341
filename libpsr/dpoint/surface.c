#include "surface.h"

#include <stdlib.h>
#include <string.h>
#include "base/array.h"

void dpoint_surface_init(struct dpoint_surface *surface)
{
	memset(surface, 0, sizeof *surface);
}

void dpoint_surface_fini(struct dpoint_surface *surface)
{
	free(surface->cell);
	free(surface->candidate);
	free(surface->face);
	free(surface->lean);
	facets_fini(&surface->facets);
	memset(surface, 0, sizeof *surface);
}

int dpoint_surface_reserve(struct dpoint_surface *surface, size_t n_cells, size_t n_candidates, size_t n_facets)
{
	return n_cells < UINT32_MAX && n_candidates < UINT32_MAX &&
	       ARRAY_ROOM(surface->cell, n_cells, surface->cells_room) &&
	       ARRAY_ROOM(surface->candidate, n_candidates, surface->candidates_room) &&
	       ARRAY_ROOM(surface->facets.facet, n_facets, surface->facets.room);
}

struct dpoint_cell *dpoint_surface_cell(struct dpoint_surface *surface)
{
	if (surface->n_cells == UINT32_MAX || !ARRAY_ROOM(surface->cell, surface->n_cells, surface->cells_room))
		return NULL;
	memset(&surface->cell[surface->n_cells], 0, sizeof *surface->cell);
	return &surface->cell[surface->n_cells++];
}

struct dpoint_candidate *dpoint_surface_candidate(struct dpoint_surface *surface)
{
	if (surface->n_candidates == UINT32_MAX ||
	    !ARRAY_ROOM(surface->candidate, surface->n_candidates, surface->candidates_room))
		return NULL;
	return &surface->candidate[surface->n_candidates++];
}

enum dpoint_made dpoint_candidate_make(struct dpoint_candidate *out, const struct dpoint_local *local,
                                       const struct dpoint_candidate *like)
{
	static const struct dpoint_box box = { { 0, 0, 0 }, { 1, 1, 1 } };
	struct dpoint_word word;
	struct dpoint point;
	const enum dpoint_made made = local != NULL ? dpoint_make(&point, local) : DPOINT_BAD;

	if (made == DPOINT_BAD)
		return made;
	point.attr = like->point.attr;
	*out = *like;
	dpoint_pack(&word, &point, &box);
	dpoint_unpack(&out->point, &word, &box);
	memcpy(out->point.at, point.at, sizeof point.at);
	return made;
}

int dpoint_surface_put(struct dpoint_surface *surface, const struct dpoint_local *local,
                       const struct dpoint_candidate *like)
{
	struct dpoint_candidate made_one, *candidate;
	const enum dpoint_made made = dpoint_candidate_make(&made_one, local, like);

	surface->n_bad += made == DPOINT_BAD;
	surface->n_clamped += made == DPOINT_CLAMPED;
	if (made == DPOINT_BAD)
		return PSR_OK;
	candidate = dpoint_surface_candidate(surface);
	if (candidate == NULL)
		return PSR_ERR_MEMORY;
	*candidate = made_one;
	return PSR_OK;
}
