/* How far the rectangle of each candidate may reach. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/array.h"
#include "base/vec.h"
#include "rectangle.h"

#define CHUNK 256    /* candidates */
#define FIRST 0.125f /* of an extent: where growing begins */

/* A cell that does not suit: the rectangle has to end at `at` along u, or along v. */
struct bar {
	float at[2];
};

struct bars {
	struct bar *bar;
	size_t n, room;
	int is_failed;
};

struct fitting {
	struct looking look;
	struct dpoint_candidate *candidate;
	size_t n;
	float overhang;
	int is_failed;
};

float dpoint_delta_of_class(unsigned class)
{
	static const float quarter[4] = { 1.0f, 0.84089641525f, 0.70710678119f, 0.59460355750f };

	return ldexpf(quarter[class % 4], -(int)(class / 4));
}

unsigned dpoint_delta_class(float delta)
{
	unsigned class = 0;

	while (class < 63 && dpoint_delta_of_class(class) > delta)
		class++;
	return class;
}

/* Where a cell's corners begin, from the middle of the rectangle on. */
static struct bar bar_of(const float corner[4][3])
{
	struct bar bar;

	for (int k = 0; k < 2; k++) {
		float low = corner[0][k], high = corner[0][k];

		for (int c = 1; c < 4; c++) {
			low = fminf(low, corner[c][k]);
			high = fmaxf(high, corner[c][k]);
		}
		bar.at[k] = low > 0 ? low : high < 0 ? -high : 0;
	}
	return bar;
}

/* The surface that goes on beside the rectangle leaves S_p gradually: a cell that S_p runs through, or that is within
 * some heights of it, is of that surface. One that looks back is of another. */
static void look_at(struct bars *bars, const struct fitting *f, const struct rectangle *r,
                    const struct dpoint_cell *cell, float radius)
{
	float corner[4][3], middle[3] = { 0, 0, 0 };
	struct bar bar;

	for (int c = 0; c < 4; c++) {
		rectangle_sees(corner[c], r, cell->corner[c]);
		v3f_add_scaled(middle, middle, 0.25f, corner[c]);
	}
	bar = bar_of((const float (*)[3])corner);
	if (bar.at[0] + f->overhang >= r->extent[0] || bar.at[1] + f->overhang >= r->extent[1] ||
	    v3f_dot(cell->normal, r->axis[2]) < -0.5f || rectangle_suits(&f->look, r, cell, middle) ||
	    fabsf(middle[2] - dpoint_height_at(r->lambda_u, r->rho, middle[0], middle[1])) > 2 * radius + 4 * r->height)
		return;
	for (int k = 0; k < 2; k++)
		bar.at[k] += f->overhang;
	if (ARRAY_ROOM(bars->bar, bars->n, bars->room))
		bars->bar[bars->n++] = bar;
	else
		bars->is_failed = 1;
}

static void search(struct bars *bars, const struct fitting *f, const struct rectangle *r, size_t i)
{
	const struct cell_node *node = &f->look.tree->node[i];
	float p[3];

	rectangle_sees(p, r, node->middle);
	if (!(fabsf(p[0]) <= r->extent[0] + node->radius && fabsf(p[1]) <= r->extent[1] + node->radius &&
	      fabsf(p[2]) <= r->deep + 4 * r->height + 2 * node->radius))
		return;
	if (cell_node_is_leaf(node)) {
		look_at(bars, f, r, &f->look.surface->cell[f->look.tree->order[node->begin]], node->radius);
	} else if (!rectangle_covers_node(&f->look, r, node, p)) {
		search(bars, f, r, 2 * i + 1);
		search(bars, f, r, 2 * i + 2);
	}
}

static int compare(const void *a, const void *b)
{
	const struct bar *x = a, *y = b;

	return x->at[0] < y->at[0] ? -1 : x->at[0] > y->at[0];
}

/* The greatest rectangle that no bar is in: along u it ends at a bar, along v at the least of those before. */
static void largest_without(float extent[2], struct bars *bars)
{
	float v = extent[1], best[2] = { 0, 0 };

	qsort(bars->bar, bars->n, sizeof *bars->bar, compare);
	for (size_t i = 0; i <= bars->n; i++) {
		const float u = i < bars->n ? bars->bar[i].at[0] : extent[0];

		if (u * v > best[0] * best[1]) {
			best[0] = u;
			best[1] = v;
		}
		if (i < bars->n)
			v = fminf(v, bars->bar[i].at[1]);
	}
	extent[0] = best[0];
	extent[1] = best[1];
}

/* Grows along u and along v until bars are in the way, or the extents are those of epsilon and delta. */
static void fit(struct dpoint_candidate *c, struct bars *bars, const struct fitting *f)
{
	struct rectangle r;
	float most[2], now[2];
	int is_growing[2] = { 1, 1 }, is_first = 1;

	rectangle_of(&r, c, f->look.options);
	for (int k = 0; k < 2; k++) {
		most[k] = r.extent[k];
		now[k] = FIRST * most[k];
	}
	while ((is_growing[0] || is_growing[1]) && !bars->is_failed) {
		float grown[2];

		for (int k = 0; k < 2; k++) {
			r.extent[k] = grown[k] = is_growing[k] && !is_first ? fminf(2 * now[k], most[k]) : now[k];
			r.deep = 2 * fabsf(r.lambda_u) * fmaxf(r.extent[0] * r.extent[0], r.extent[1] * r.extent[1]) + r.height;
		}
		is_first = 0;
		bars->n = 0;
		search(bars, f, &r, 0);
		largest_without(r.extent, bars);
		for (int k = 0; k < 2; k++) {
			is_growing[k] &= r.extent[k] == grown[k] && grown[k] < most[k];
			now[k] = r.extent[k];
		}
		/* What was free stays free: the largest one may be another. */
		if (now[0] == 0 || now[1] == 0)
			break;
	}
	for (int k = 0; k < 2; k++)
		if (now[k] < most[k])
			c->delta[k] = dpoint_delta_of_class(dpoint_delta_class(now[k]));
}

static void fit_chunk(int chunk, void *userdata)
{
	struct fitting *f = userdata;
	struct bars bars = { NULL, 0, 0, 0 };

	for (size_t i = (size_t)chunk * CHUNK; i < f->n && i < (size_t)(chunk + 1) * CHUNK; i++)
		fit(&f->candidate[i], &bars, f);
	free(bars.bar);
	if (bars.is_failed)
		__atomic_store_n(&f->is_failed, 1, __ATOMIC_RELAXED);
}

int dpoint_fit(struct dpoint_surface *surface, const struct dpoint_cover_options *options, float overhang,
               struct psr_pool *pool, const struct psr_cancel *cancel)
{
	struct fitting f = { .candidate = surface->candidate, .n = surface->n_candidates, .overhang = overhang };
	struct cell_tree tree;
	int rc;

	if (surface->n_cells == 0 || surface->n_candidates == 0)
		return PSR_OK;
	rc = cell_tree_init(&tree, surface->cell, surface->n_cells);
	looking_init(&f.look, surface, &tree, options);
	if (rc == PSR_OK)
		rc = psr_pool_for_until(pool, cancel, (int)((f.n + CHUNK - 1) / CHUNK), fit_chunk, &f);
	cell_tree_fini(&tree);
	return rc == PSR_OK && f.is_failed ? PSR_ERR_MEMORY : rc;
}
