/* Which cells each candidate covers. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/array.h"
#include "base/vec.h"
#include "rectangle.h"
#include "sight.h"

#define CHUNK 256 /* candidates */

struct covering {
	struct looking look;
	struct dpoint_cover *cover;
	size_t first, first_chunk; /* of this turn: chunks begin at the first candidate */
	int is_failed;
};


struct found {
	uint32_t *node;
	size_t n, room, n_cells;
	int is_failed;
};

/* A rectangle, and what cells are within: lane 3 is anything. */
struct within {
	const struct looking *look;
	const struct rectangle *rectangle;
	struct sight_frame frame;
	lanes limit;
};

/* rectangle_covers(), in lanes. */
static int covers(const struct within *w, const struct dpoint_cell *cell)
{
	const lanes most = { w->limit[0], w->limit[1], INFINITY, INFINITY };
	lanes middle = lanes_all(0);
	float at[3];

	if (w->look->options->is_within_parts && cell->part != w->rectangle->part)
		return 0;
	for (int c = 0; c < 4; c++) {
		const lanes p = sight_turned(w->frame.axis, sight_place(cell->corner[c]) - w->frame.at);

		if (!lanes_all_are(lanes_size(p) <= most))
			return 0;
		middle += lanes_all(0.25f) * p;
	}
	memcpy(at, &middle, sizeof at);
	return rectangle_suits(w->look, w->rectangle, cell, at);
}

/* The covered nodes of a subtree, of cells begin..end of the tree's order. */
static void search(struct found *found, const struct within *w, size_t i, uint32_t begin, uint32_t end)
{
	const struct looking *l = w->look;

	for (;;) {
		const struct cell_ball *ball = &l->tree->ball[i];
		const lanes seen = sight_turned(w->frame.axis, sight_middle(ball) - w->frame.at), size = lanes_size(seen);
		const uint32_t half = begin + (end - begin) / 2;

		if (!lanes_all_are(size <= w->limit + sight_turned(w->frame.slant, sight_half(ball))))
			return;
		if (end - begin == 1) {
			if (!covers(w, &l->surface->cell[l->tree->order[begin]]))
				return;
			break;
		}
		if (size[0] + ball->radius <= w->limit[0] && size[1] + ball->radius <= w->limit[1]) {
			float p[3];

			memcpy(p, &seen, sizeof p);
			if (rectangle_covers_node(l, w->rectangle, i, p))
				break;
		}
		search(found, w, 2 * i + 1, begin, half);
		i = 2 * i + 2;
		begin = half;
	}
	if (!ARRAY_ROOM(found->node, found->n, found->room)) {
		found->is_failed = 1;
		return;
	}
	found->node[found->n++] = (uint32_t)i;
	found->n_cells += end - begin;
}

static void search_all(struct found *found, const struct looking *l, const struct rectangle *r)
{
	struct within w = { .look = l, .rectangle = r, .limit = { r->extent[0], r->extent[1], r->deep, INFINITY } };

	sight_frame_of(&w.frame, r);
	search(found, &w, 0, l->tree->node[0].begin, l->tree->node[0].end);
}

static void keep_margin(struct rectangle *r, const struct dpoint_candidate *c,
                        const struct dpoint_cover_options *options)
{
	for (int k = 0; k < 2; k++)
		if (r->extent[k] < c->delta[k] || c->delta[k] >= options->delta)
			r->extent[k] *= 1 - options->margin;
}

static void look(int chunk, void *userdata)
{
	struct covering *covering = userdata;
	const struct looking *l = &covering->look;
	struct dpoint_cover *cover = covering->cover;
	const size_t begin = covering->first + (size_t)chunk * CHUNK;
	const size_t end = begin + CHUNK < cover->n_candidates ? begin + CHUNK : cover->n_candidates;
	struct found found = { .node = NULL };
	size_t at = 0;

	for (size_t i = begin; i < end; i++) {
		struct rectangle r;
		const size_t before = found.n, n_cells = found.n_cells;

		rectangle_of(&r, &l->surface->candidate[i], l->options);
		if (l->options->margin > 0)
			keep_margin(&r, &l->surface->candidate[i], l->options);
		rectangle_shorten(&r, l->options->slack);
		if (r.extent[0] > 0 && r.extent[1] > 0)
			search_all(&found, l, &r);
		cover->n[i] = (uint32_t)(found.n - before);
		cover->size[i] = (uint32_t)(found.n_cells - n_cells);
	}
	cover->chunk[covering->first_chunk + (size_t)chunk] = found.node;
	for (size_t i = begin; i < end; i++) {
		cover->list[i] = found.node + at;
		at += cover->n[i];
	}
	if (found.is_failed)
		__atomic_store_n(&covering->is_failed, 1, __ATOMIC_RELAXED);
}

int cover_candidates(struct dpoint_cover *cover, const struct dpoint_surface *surface,
                     const struct dpoint_cover_options *options, const struct dpoint_work *work)
{
	struct covering covering = { .cover = cover, .first = cover->n_candidates, .first_chunk = cover->n_chunks };
	const size_t n = surface->n_candidates, n_chunks = (n - cover->n_candidates + CHUNK - 1) / CHUNK;
	const uint32_t **list = realloc(cover->list, (n + 1) * sizeof *list);
	uint32_t *counts, *sizes;
	void **chunk;
	int rc;

	if (list != NULL)
		cover->list = list;
	counts = realloc(cover->n, (n + 1) * sizeof *counts);
	if (counts != NULL)
		cover->n = counts;
	sizes = realloc(cover->size, (n + 1) * sizeof *sizes);
	if (sizes != NULL)
		cover->size = sizes;
	chunk = realloc(cover->chunk, (cover->n_chunks + n_chunks + 1) * sizeof *chunk);
	if (chunk != NULL)
		cover->chunk = chunk;
	if (list == NULL || counts == NULL || sizes == NULL || chunk == NULL)
		return PSR_ERR_MEMORY;
	memset(chunk + cover->n_chunks, 0, n_chunks * sizeof *chunk);
	memset(counts + cover->n_candidates, 0, (n - cover->n_candidates) * sizeof *counts);
	cover->n_candidates = n;
	cover->n_chunks += n_chunks;
	looking_init(&covering.look, surface, cover->tree, options);
	rc = psr_pool_for_until(work->pool, work->cancel, (int)n_chunks, look, &covering);
	return rc == PSR_OK && covering.is_failed ? PSR_ERR_MEMORY : rc;
}

int dpoint_cover_init(struct dpoint_cover *cover, const struct dpoint_surface *surface,
                      const struct dpoint_cover_options *options, struct psr_pool *pool,
                      const struct psr_cancel *cancel)
{
	const struct dpoint_work work = { pool, cancel };
	int rc;

	memset(cover, 0, sizeof *cover);
	cover->n_cells = surface->n_cells;
	if (surface->n_cells == 0)
		return PSR_OK;
	cover->tree = calloc(1, sizeof *cover->tree);
	if (cover->tree == NULL)
		return PSR_ERR_MEMORY;
	rc = cell_tree_init(cover->tree, surface->cell, surface->n_cells, pool);
	return rc == PSR_OK ? cover_candidates(cover, surface, options, &work) : rc;
}

void dpoint_cover_fini(struct dpoint_cover *cover)
{
	for (size_t i = 0; i < cover->n_chunks && cover->chunk != NULL; i++)
		free(cover->chunk[i]);
	free(cover->chunk);
	if (cover->tree != NULL)
		cell_tree_fini(cover->tree);
	free(cover->tree);
	free(cover->list);
	free(cover->n);
	free(cover->size);
	memset(cover, 0, sizeof *cover);
}
