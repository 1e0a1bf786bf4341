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
	memset(surface, 0, sizeof *surface);
}

struct dpoint_cell *dpoint_surface_cell(struct dpoint_surface *surface)
{
	if (surface->n_cells == UINT32_MAX || !ARRAY_ROOM(surface->cell, surface->n_cells, surface->cells_room))
		return NULL;
	return &surface->cell[surface->n_cells++];
}

struct dpoint_candidate *dpoint_surface_candidate(struct dpoint_surface *surface)
{
	if (surface->n_candidates == UINT32_MAX ||
	    !ARRAY_ROOM(surface->candidate, surface->n_candidates, surface->candidates_room))
		return NULL;
	return &surface->candidate[surface->n_candidates++];
}

int dpoint_surface_put(struct dpoint_surface *surface, const struct dpoint_local *local,
                       const struct dpoint_candidate *like)
{
	static const struct dpoint_box box = { { 0, 0, 0 }, { 1, 1, 1 } };
	struct dpoint_candidate *candidate;
	struct dpoint_word word;
	struct dpoint point;
	enum dpoint_made made = local != NULL ? dpoint_make(&point, local) : DPOINT_BAD;

	surface->n_bad += made == DPOINT_BAD;
	surface->n_clamped += made == DPOINT_CLAMPED;
	if (made == DPOINT_BAD)
		return PSR_OK;
	candidate = dpoint_surface_candidate(surface);
	if (candidate == NULL)
		return PSR_ERR_MEMORY;
	point.attr = like->point.attr;
	*candidate = *like;
	dpoint_pack(&word, &point, &box);
	dpoint_unpack(&candidate->point, &word, &box);
	memcpy(candidate->point.at, point.at, sizeof point.at);
	return PSR_OK;
}
