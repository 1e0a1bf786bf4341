/* Rays that slip through between rectangles, and points in their way. */
#include "seal.h"

#include <stdlib.h>
#include <string.h>
#include "lean.h"
#include "sealed.h"

#define CHUNK 512 /* cells */
#define BEHIND 6  /* of options->height: three samples of a mesh's resolution ([G] 7.2) */

static void look(int chunk, void *userdata)
{
	struct sealing *s = userdata;
	const size_t begin = (size_t)chunk * CHUNK;
	const size_t end = begin + CHUNK < s->surface->n_cells ? begin + CHUNK : s->surface->n_cells;
	struct nearby nearby = { NULL, 0, 0, 0 };

	for (size_t i = begin; i < end; i++)
		if (s->is_open[i])
			s->is_open[i] = (uint8_t)!s->is_closed(s, &nearby, (uint32_t)i);
	if (nearby.is_failed)
		__atomic_store_n(&s->is_failed, 1, __ATOMIC_RELAXED);
	free(nearby.near);
}

static int make_lids(struct sealing *s, const struct dpoint_choice *choice, struct psr_pool *pool)
{
	struct dpoint_cell *cell = malloc((choice->n_kept + 1) * sizeof *cell);
	size_t n = 0;
	int rc;

	s->lid = malloc((choice->n_kept + 1) * sizeof *s->lid);
	if (cell == NULL || s->lid == NULL) {
		free(cell);
		return PSR_ERR_MEMORY;
	}
	for (size_t i = 0; i < s->surface->n_candidates; i++)
		if (choice->is_kept[i]) {
			lid_make(&s->lid[n], &s->surface->candidate[i], s->options);
			lid_corners(&cell[n], &s->lid[n]);
			n++;
		}
	rc = cell_tree_init(&s->tree, cell, n, pool);
	free(cell);
	return rc;
}

static void find_over(struct sealing *s, const struct dpoint_choice *choice, const struct dpoint_cover *cover)
{
	uint32_t n = 0;

	memset(s->over, 0xff, s->surface->n_cells * sizeof *s->over);
	for (uint32_t i = 0; i < cover->n_candidates; i++) {
		for (uint32_t k = 0; k < cover->n[i] && choice->is_kept[i]; k++) {
			const struct cell_node *node = &cover->tree->node[cover->list[i][k]];

			for (uint32_t c = node->begin; c < node->end; c++)
				s->over[cover->tree->order[c]] = n;
		}
		n += choice->is_kept[i];
	}
}

void sealing_init(struct sealing *s, const struct dpoint_surface *surface, const struct dpoint_cover_options *options)
{
	*s = (struct sealing){ .surface = surface, .options = options, .behind = BEHIND * options->height };
	for (int d = 0; d < AROUND_GRAZING; d++) {
		double sine, cosine;

		psr_sincos(d * (2 * 3.14159265358979 / AROUND_GRAZING), &sine, &cosine);
		s->around[d][0] = (float)cosine;
		s->around[d][1] = (float)sine;
	}
}

int sealing_look(struct sealing *s, const struct dpoint_choice *choice, const struct dpoint_work *work)
{
	int rc = make_lids(s, choice, work->pool);

	if (rc == PSR_OK)
		rc = psr_pool_for_until(work->pool, work->cancel, (int)((s->surface->n_cells + CHUNK - 1) / CHUNK), look, s);
	cell_tree_fini(&s->tree);
	free(s->lid);
	memset(&s->tree, 0, sizeof s->tree);
	s->lid = NULL;
	return rc == PSR_OK && s->is_failed ? PSR_ERR_MEMORY : rc;
}

int keep_added(struct dpoint_choice *choice, size_t before, size_t n)
{
	uint8_t *is_kept = realloc(choice->is_kept, n + 1);

	if (is_kept == NULL)
		return PSR_ERR_MEMORY;
	choice->is_kept = is_kept;
	memset(is_kept + before, 1, n - before);
	choice->n_kept += n - before;
	return PSR_OK;
}

int seal(struct dpoint_surface *surface, struct dpoint_choice *choice, struct dpoint_cover *cover,
         uint8_t *is_tiled, const struct dpoint_cover_options *options, const struct dpoint_work *work)
{
	struct sealing s;
	size_t before;
	int rc;

	if (choice->n_kept == 0 || surface->is_cloud)
		return PSR_OK;
	sealing_init(&s, surface, options);
	s.is_closed = is_sealed;
	s.is_open = malloc(surface->n_cells);
	s.over = malloc(surface->n_cells * sizeof *s.over);
	rc = s.is_open != NULL && s.over != NULL ? PSR_OK : PSR_ERR_MEMORY;
	if (rc == PSR_OK) {
		for (size_t i = 0; i < surface->n_cells; i++)
			s.is_open[i] = is_tiled == NULL || !is_tiled[i];
		find_over(&s, choice, cover);
		rc = sealing_look(&s, choice, work);
	}
	free(s.over); /* of these lids */
	s.over = NULL;
	if (rc == PSR_OK)
		rc = keep_over_open(choice, cover, s.is_open);
	if (rc == PSR_OK)
		rc = sealing_look(&s, choice, work);
	if (rc == PSR_OK && is_tiled != NULL) {
		rc = tile_open(is_tiled, surface, choice, cover, options, s.is_open, work);
		for (size_t i = 0; i < surface->n_cells; i++)
			s.is_open[i] &= !is_tiled[i];
	}
	before = surface->n_candidates;
	if (rc == PSR_OK)
		rc = mend_planes(surface, cover, s.is_open, options, work);
	if (rc == PSR_OK)
		rc = keep_added(choice, before, surface->n_candidates);
	free(s.is_open);
	return rc;
}
