/* How far the rectangle of each candidate may reach. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/array.h"
#include "base/vec.h"
#include "bound.h"
#include "rectangle.h"

#define CHUNK 256    /* candidates */
#define FIRST 0.125f /* of an extent: where growing begins */
/* Nodes that a step of growing may look at: beyond, a rectangle stays as it is. So time is bounded. */
#define MOST_LOOKED 2048
#define LEAST_LOOKED 256
#define ALL_LOOKED (1u << 27) /* shared by all candidates of a turn */

/* A cell that does not suit: the rectangle has to end at `at` along u, or along v. */
struct bar {
	float at[2];
	float side[2]; /* 1 or -1: which side it is on */
};

struct bars {
	struct bar *bar;
	size_t n, room;
	float free[2]; /* half-sides of a rectangle that is known to have none */
	int left;      /* how many nodes may still be looked at; below 0: there may be more bars */
	int is_failed;
};

struct fitting {
	struct looking look;
	struct dpoint_candidate *candidate;
	size_t n;
	float overhang;
	int looked;  /* nodes a step of growing */
	int is_failed;
};

unsigned dpoint_delta_class(float delta)
{
	unsigned class = 0;

	while (class + 1 < DPOINT_DELTA_CLASSES && dpoint_delta_of_class(class) > delta)
		class++;
	return class;
}

/* Where a cell begins, and on which side, told by those of its corners that are nearest to S_p: the others of a face
 * that falls away lean over or under the rectangle, and do not touch it. */
static struct bar bar_of(const float corner[4][3], const float above[4], float height)
{
	const float nearest = fminf(fminf(above[0], above[1]), fminf(above[2], above[3]));
	struct bar bar;

	for (int k = 0; k < 2; k++) {
		float low = INFINITY, high = -INFINITY;

		for (int c = 0; c < 4; c++) {
			if (above[c] > nearest + height)
				continue;
			low = fminf(low, corner[c][k]);
			high = fmaxf(high, corner[c][k]);
		}
		bar.at[k] = low > 0 ? low : high < 0 ? -high : 0;
		bar.side[k] = low + high < 0 ? -1 : 1;
	}
	return bar;
}

/* Whether a bar is nearer along both sides: what is behind it ends nothing. */
static int is_behind(const struct bars *bars, float u, float v)
{
	for (size_t i = 0; i < bars->n; i++)
		if (bars->bar[i].at[0] <= u && bars->bar[i].at[1] <= v)
			return 1;
	return 0;
}

static void put(struct bars *bars, const struct bar *bar)
{
	size_t n = 0;

	if (is_behind(bars, bar->at[0], bar->at[1]))
		return;
	for (size_t i = 0; i < bars->n; i++)
		if (!(bar->at[0] <= bars->bar[i].at[0] && bar->at[1] <= bars->bar[i].at[1]))
			bars->bar[n++] = bars->bar[i];
	bars->n = n;
	if (ARRAY_ROOM(bars->bar, bars->n, bars->room))
		bars->bar[bars->n++] = *bar;
	else
		bars->is_failed = 1;
}

/* Whether a convex quadrilateral holds the place u, v. */
static int is_in(const float corner[4][3], float u, float v)
{
	int n_left = 0, n_right = 0;

	for (int c = 0; c < 4; c++) {
		const float *a = corner[c], *b = corner[(c + 1) % 4];
		const float side = (b[0] - a[0]) * (v - a[1]) - (b[1] - a[1]) * (u - a[0]);

		n_left += side >= 0;
		n_right += side <= 0;
	}
	return n_left == 4 || n_right == 4;
}

/* Whether S_p is the surface at u, v: a cell that suits is there. */
static int is_backed(const struct fitting *f, const struct rectangle *r, float u, float v, size_t i)
{
	const struct cell_node *node = &f->look.tree->node[i];
	float p[3];

	rectangle_sees(p, r, node->middle);
	if (!(fabsf(p[0] - u) <= node->radius && fabsf(p[1] - v) <= node->radius &&
	      fabsf(p[2] - dpoint_height_at(r->lambda_u, r->rho, u, v)) <= node->radius + 2 * r->height))
		return 0;
	if (cell_node_is_leaf(node)) {
		const struct dpoint_cell *cell = &f->look.surface->cell[f->look.tree->order[node->begin]];
		float corner[4][3], middle[3] = { 0, 0, 0 };

		for (int c = 0; c < 4; c++) {
			rectangle_sees(corner[c], r, cell->corner[c]);
			v3f_add_scaled(middle, middle, 0.25f, corner[c]);
		}
		return is_in((const float (*)[3])corner, u, v) && rectangle_suits(&f->look, r, cell, middle);
	}
	return is_backed(f, r, u, v, 2 * i + 1) || is_backed(f, r, u, v, 2 * i + 2);
}

/* Whether the surface goes on beyond a cell as S_p does: then the cell is of another sheet, which crosses it, or lies
 * close. Cells of a cloud overlap, so that this would be so of each. */
static int is_crossing(const struct fitting *f, const struct rectangle *r, const float middle[3], float radius)
{
	const float away = sqrtf(middle[0] * middle[0] + middle[1] * middle[1]);
	const float beyond = away > 0 ? 1 + (radius + f->overhang) / away : 1;

	return !f->look.surface->is_cloud && is_backed(f, r, middle[0], middle[1], 0) &&
	       is_backed(f, r, middle[0] * beyond, middle[1] * beyond, 0);
}

/* The surface that goes on beside the rectangle leaves S_p gradually: a cell that S_p runs through, or that is within
 * some heights of it, is of that surface. One that looks back is of another. */
static void look_at(struct bars *bars, const struct fitting *f, const struct rectangle *r,
                    const struct dpoint_cell *cell, float radius)
{
	float corner[4][3], above[4], middle[3] = { 0, 0, 0 };
	struct bar bar;

	for (int c = 0; c < 4; c++) {
		rectangle_sees(corner[c], r, cell->corner[c]);
		above[c] = fabsf(corner[c][2] - dpoint_height_at(r->lambda_u, r->rho, corner[c][0], corner[c][1]));
		v3f_add_scaled(middle, middle, 0.25f, corner[c]);
	}
	bar = bar_of((const float (*)[3])corner, above, r->height);
	if (bar.at[0] + f->overhang >= r->extent[0] || bar.at[1] + f->overhang >= r->extent[1] ||
	    v3f_dot(cell->normal, r->axis[2]) < -0.5f || rectangle_suits(&f->look, r, cell, middle) ||
	    fabsf(middle[2] - dpoint_height_at(r->lambda_u, r->rho, middle[0], middle[1])) > 2 * radius + 4 * r->height ||
	    is_behind(bars, bar.at[0] + f->overhang, bar.at[1] + f->overhang) || is_crossing(f, r, middle, radius))
		return;
	for (int k = 0; k < 2; k++)
		bar.at[k] += f->overhang;
	put(bars, &bar);
}

static void search(struct bars *bars, const struct fitting *f, const struct rectangle *r, size_t i)
{
	const struct cell_node *node = &f->look.tree->node[i];
	float p[3], a[3], b[3];
	size_t near;

	if (--bars->left < 0)
		return;
	rectangle_sees(p, r, node->middle);
	if ((fabsf(p[0]) + node->radius <= bars->free[0] && fabsf(p[1]) + node->radius <= bars->free[1]) ||
	    !(fabsf(p[0]) <= r->extent[0] + node->radius && fabsf(p[1]) <= r->extent[1] + node->radius &&
	      fabsf(p[2]) <= r->deep + 4 * r->height + 2 * node->radius) ||
	    is_behind(bars, fmaxf(fabsf(p[0]) - node->radius, 0) + f->overhang,
	              fmaxf(fabsf(p[1]) - node->radius, 0) + f->overhang))
		return;
	if (cell_node_is_leaf(node)) {
		look_at(bars, f, r, &f->look.surface->cell[f->look.tree->order[node->begin]], node->radius);
	} else if (!rectangle_suits_node(&f->look, r, node, p)) {
		/* The nearer half first: its bars are before most of the other's. */
		v3f_sub(a, node[i + 1].middle, r->at);
		v3f_sub(b, node[i + 2].middle, r->at);
		near = v3f_dot(b, b) < v3f_dot(a, a) ? 2 * i + 2 : 2 * i + 1;
		search(bars, f, r, near);
		search(bars, f, r, 4 * i + 3 - near);
	}
}

static int compare(const void *a, const void *b)
{
	const struct bar *x = a, *y = b;

	return x->at[0] < y->at[0] ? -1 : x->at[0] > y->at[0];
}

/* What a rectangle is worth: its area without a margin, so that slivers, which cover no cell, are worth nothing. */
static float worth(float u, float v, const float margin[2])
{
	return fmaxf(u - margin[0], 0) * fmaxf(v - margin[1], 0);
}

/* The best rectangle that no bar is in, and that holds the free one: along u it ends at a bar, along v at the least of
 * those before. */
static void best_without(float extent[2], struct bars *bars, float overhang)
{
	const float margin[2] = { fminf(2 * overhang, extent[0] / 4), fminf(2 * overhang, extent[1] / 4) };
	float v = extent[1], best[2] = { bars->free[0], bars->free[1] };

	if (bars->n > 1)
		qsort(bars->bar, bars->n, sizeof *bars->bar, compare);
	for (size_t i = 0; i <= bars->n; i++) {
		const float u = i < bars->n ? bars->bar[i].at[0] : extent[0];

		if (u >= bars->free[0] && v >= bars->free[1] && worth(u, v, margin) > worth(best[0], best[1], margin)) {
			best[0] = u;
			best[1] = v;
		}
		if (i < bars->n)
			v = fminf(v, bars->bar[i].at[1]);
	}
	extent[0] = best[0];
	extent[1] = best[1];
}

/* Ends the rectangle at the bars. Returns 0 if that is not known of all of them. */
static int look_around(struct rectangle *r, const float free_one[2], struct bars *bars, const struct fitting *f)
{
	memcpy(bars->free, free_one, sizeof bars->free);
	r->deep = 2 * fabsf(r->lambda_u) * fmaxf(r->extent[0] * r->extent[0], r->extent[1] * r->extent[1]) + r->height;
	bars->n = 0;
	bars->left = f->looked;
	search(bars, f, r, 0);
	best_without(r->extent, bars, f->overhang);
	return bars->left >= 0;
}

/* Which side the bar is on that ends an extent; 0: none does. */
static float side_of(const struct bars *bars, const float extent[2], int k)
{
	for (size_t i = 0; i < bars->n; i++)
		if (bars->bar[i].at[k] == extent[k] && bars->bar[i].at[1 - k] < extent[1 - k] * 1.01f)
			return bars->bar[i].side[k];
	return 0;
}

/* Grows along u and along v until bars are in the way, or too much to look at, or the extents are those of epsilon and
 * delta. side: of the bars. */
static void grow(float now[2], float side[2], struct rectangle *r, struct bars *bars, const struct fitting *f)
{
	const float most[2] = { r->extent[0], r->extent[1] };
	/* From a square on: what a curvature makes short must not become shorter for the sake of the other side. */
	float first = fminf(fminf(most[0], most[1]), FIRST * fmaxf(most[0], most[1]));
	int is_growing[2] = { 1, 1 }, is_first = 1;

	for (int k = 0; k < 2; k++) {
		now[k] = first;
		side[k] = 0;
	}
	while ((is_growing[0] || is_growing[1]) && !bars->is_failed) {
		float grown[2];

		for (int k = 0; k < 2; k++)
			r->extent[k] = grown[k] = is_growing[k] && !is_first ? fminf(2 * now[k], most[k]) : now[k];
		if (!look_around(r, is_first ? (const float[2]){ 0, 0 } : now, bars, f)) {
			if (!is_first || first < f->overhang)
				break;
			now[0] = now[1] = first /= 2;
			continue;
		}
		is_first = 0;
		for (int k = 0; k < 2; k++) {
			if (r->extent[k] < grown[k])
				side[k] = side_of(bars, r->extent, k);
			is_growing[k] &= r->extent[k] == grown[k] && grown[k] < most[k];
			now[k] = r->extent[k];
		}
		if (!(now[0] > 0 && now[1] > 0))
			break;
	}
}

/* Moves a point along S_p, which bends on as it does. */
static void move(struct dpoint *p, const float by[2])
{
	static const struct dpoint_box box = { { 0, 0, 0 }, { 1, 1, 1 } };
	const float height = dpoint_height_at(p->lambda_u, p->rho, by[0], by[1]);
	float v[3], n[3], normal[3], at[3];
	struct dpoint_word word;

	v3f_cross(v, p->normal, p->u);
	dpoint_normal_at(n, p->lambda_u, p->rho, by[0], by[1]);
	for (int k = 0; k < 3; k++) {
		at[k] = p->at[k] + by[0] * p->u[k] + by[1] * v[k] + height * p->normal[k];
		normal[k] = n[0] * p->u[k] + n[1] * v[k] + n[2] * p->normal[k];
	}
	v3f_normalize(p->normal, normal);
	dpoint_pack(&word, p, &box);
	dpoint_unpack(p, &word, &box);
	memcpy(p->at, at, sizeof at);
}

/* An extent that bars end becomes that of the class below, and the point moves as much towards the bar: so its
 * rectangle still ends there. What then is in the way makes it shorter, without another move. */
static void fit(struct dpoint_candidate *c, struct bars *bars, const struct fitting *f)
{
	struct dpoint before;
	struct rectangle r;
	float most[2], now[2], side[2], by[2] = { 0, 0 };

	rectangle_of(&r, c, f->look.options);
	memcpy(most, r.extent, sizeof most);
	grow(now, side, &r, bars, f);
	if (now[0] >= most[0] && now[1] >= most[1])
		return;
	for (int k = 0; k < 2; k++) {
		if (now[k] < most[k]) {
			c->delta[k] = dpoint_delta_of_class(dpoint_delta_class(now[k]));
			by[k] = side[k] * fmaxf(0, now[k] - c->delta[k]);
		}
	}
	if (by[0] == 0 && by[1] == 0)
		return;
	before = c->point;
	move(&c->point, by);
	rectangle_of(&r, c, f->look.options);
	memcpy(most, r.extent, sizeof most);
	if (!look_around(&r, (const float[2]){ 0, 0 }, bars, f)) {
		c->point = before;
		return;
	}
	for (int k = 0; k < 2; k++)
		if (r.extent[k] < most[k] - f->overhang)
			c->delta[k] = dpoint_delta_of_class(dpoint_delta_class(r.extent[k]));
}

static void fit_chunk(int chunk, void *userdata)
{
	struct fitting *f = userdata;
	struct bars bars = { .bar = NULL };
	struct bound_view view = { .seen = NULL };
	int rc = PSR_OK;

	for (size_t i = (size_t)chunk * CHUNK; i < f->n && i < (size_t)(chunk + 1) * CHUNK; i++) {
		const struct dpoint_candidate before = f->candidate[i];

		fit(&f->candidate[i], &bars, f);
		if (f->look.options->error > 0 && rc == PSR_OK)
			rc = shrink_within(&f->candidate[i], &before, &view, &f->look);
	}
	free(bars.bar);
	bound_view_fini(&view);
	if (bars.is_failed || rc != PSR_OK)
		__atomic_store_n(&f->is_failed, 1, __ATOMIC_RELAXED);
}

int fit_candidates(struct dpoint_surface *surface, const struct cell_tree *tree, size_t first,
                   const struct dpoint_cover_options *options, const struct dpoint_work *work)
{
	struct fitting f = { .candidate = surface->candidate + first, .n = surface->n_candidates - first };
	int rc;

	f.overhang = options->overhang;
	f.looked = (int)fmin(fmax((double)ALL_LOOKED / ((double)f.n + 1), LEAST_LOOKED), MOST_LOOKED);
	looking_init(&f.look, surface, tree, options);
	rc = psr_pool_for_until(work->pool, work->cancel, (int)((f.n + CHUNK - 1) / CHUNK), fit_chunk, &f);
	return rc == PSR_OK && f.is_failed ? PSR_ERR_MEMORY : rc;
}

int dpoint_fit(struct dpoint_surface *surface, const struct dpoint_cover_options *options, struct psr_pool *pool,
               const struct psr_cancel *cancel)
{
	const struct dpoint_work work = { pool, cancel };
	struct cell_tree tree;
	int rc;

	if (surface->n_cells == 0 || surface->n_candidates == 0)
		return PSR_OK;
	rc = cell_tree_init(&tree, surface->cell, surface->n_cells);
	if (rc == PSR_OK)
		rc = fit_candidates(surface, &tree, 0, options, &work);
	cell_tree_fini(&tree);
	return rc;
}
