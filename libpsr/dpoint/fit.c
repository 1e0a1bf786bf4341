/* How far the rectangle of each candidate may reach. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "backing.h"
#include "bars.h"
#include "base/vec.h"
#include "bound.h"
#include "rectangle.h"
#include "sight.h"

#define CHUNK 256    /* candidates */
#define FIRST 0.125f /* of an extent: where growing begins */
#define LEAP 2       /* steps of growing that one look tries at once */
/* Nodes that a step of growing may look at: beyond, a rectangle stays as it is. So time is bounded. */
#define MOST_LOOKED 2048
#define LEAST_LOOKED 256
#define ALL_LOOKED (1u << 27) /* shared by all candidates of a turn */

/* What a thread looks with. */
struct search {
	struct bars bars;
	struct sight_frame frame;
	lanes box, per_widest; /* where what may end the rectangle is, along x, y and z from its place, and how much further
	                        * for each unit of a cell's radius; lane 3 of this and the next is anywhere */
	lanes limit;           /* along u, v and the normal */
	lanes sides;           /* along u and v alone: the rectangle's extents; the other lanes are anywhere, here and below */
	lanes free_one;        /* half-sides of a rectangle that is known to have none */
	float over[2];  /* how far the rectangle may reach over what ends it: the overhang, or half of a narrow one, which
	                 * nothing would end otherwise */
	int left;       /* how many nodes may still be looked at; below 0: there may be more bars */
	size_t backing; /* is_backed() */
	float step[LEAP][2]; /* extents of steps of growing that are tried at once with the one that is looked at */
	int n_steps;
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

/* A node as the rectangle sees it. */
struct sight {
	lanes p, reach;
	float radius;
	int is_out; /* none of its cells can end the rectangle */
};

/* Whether the surface goes on beyond a cell as S_p does: then the cell is of another sheet, which crosses it, or lies
 * close. Cells of a cloud overlap, so that this would be so of each. */
static int is_crossing(struct search *s, const struct fitting *f, const struct rectangle *r, const float middle[3],
                       float radius)
{
	const float away = sqrtf(middle[0] * middle[0] + middle[1] * middle[1]);
	const float beyond = away > 0 ? 1 + (radius + f->overhang) / away : 1;

	return !f->look.surface->is_cloud && is_backed(&s->backing, &f->look, r, middle[0], middle[1]) &&
	       is_backed(&s->backing, &f->look, r, middle[0] * beyond, middle[1] * beyond);
}

/* Whether all corners are too far away to end the rectangle, along u or along v. */
static inline int is_beyond(const lanes corner[4], const struct search *s)
{
	lanes low = -corner[0], high = corner[0], nearest;

	for (int c = 1; c < 4; c++) {
		low = lanes_greater(low, -corner[c]);
		high = lanes_greater(high, corner[c]);
	}
	nearest = lanes_greater(lanes_greater(-low, -high), lanes_all(0));
	return lanes_any(nearest + (lanes){ s->over[0], s->over[1], 0, 0 } >= s->sides);
}

/* Whether a step of growing before this one was around the cell, and had no bar of it, which is at its side: what a
 * step was around is not looked at again. */
static int is_past(const struct search *s, const struct sight *sight, const struct bar *bar)
{
	for (int i = 0; i < s->n_steps; i++)
		if (lanes_all_are(lanes_size(sight->p) + sight->reach <=
		                  (lanes){ s->step[i][0], s->step[i][1], INFINITY, INFINITY }))
			return bar->at[0] >= s->step[i][0] || bar->at[1] >= s->step[i][1];
	return 0;
}

/* The surface that goes on beside the rectangle leaves S_p gradually: a cell that S_p runs through, or that is within
 * some heights of it, is of that surface. One that looks back is of another. */
static void look_at(struct search *s, const struct fitting *f, const struct rectangle *r,
                    const struct dpoint_cell *cell, const struct sight *sight)
{
	const float radius = sight->radius;
	float corner[4][3], above[4], middle[3], off;
	lanes seen[4];
	struct bar bar;

	memcpy(middle, &sight->p, sizeof middle);
	if (rectangle_surely_suits(&f->look, r, cell, middle))
		return;
	for (int c = 0; c < 4; c++)
		seen[c] = sight_turned(s->frame.axis, sight_place(cell->corner[c]) - s->frame.at);
	if (is_beyond(seen, s) || v3f_dot(cell->normal, r->axis[2]) < -0.5f)
		return;
	v3f_set(middle, 0, 0, 0);
	for (int c = 0; c < 4; c++) {
		memcpy(corner[c], &seen[c], sizeof corner[c]);
		v3f_add_scaled(middle, middle, 0.25f, corner[c]);
	}
	off = fabsf(middle[2] - dpoint_height_at(r->lambda_u, r->rho, middle[0], middle[1]));
	if (off > 2 * radius + 4 * r->height || rectangle_suits_off(&f->look, r, cell, middle, off))
		return;
	for (int c = 0; c < 4; c++)
		above[c] = fabsf(corner[c][2] - dpoint_height_at(r->lambda_u, r->rho, corner[c][0], corner[c][1]));
	bar = bar_of((const float (*)[3])corner, above, r->height);
	for (int k = 0; k < 2; k++)
		bar.at[k] += s->over[k];
	if (bar.at[0] >= r->extent[0] || bar.at[1] >= r->extent[1] || bars_is_behind(&s->bars, bar.at[0], bar.at[1]) ||
	    is_past(s, sight, &bar) || is_crossing(s, f, r, middle, radius))
		return;
	bars_put(&s->bars, &bar);
}

static inline void see(struct sight *sight, const struct search *s, const struct cell_ball *ball)
{
	const lanes middle = sight_middle(ball), half = sight_half(ball), away = middle - s->frame.at;
	const lanes widest = lanes_all(half[3]);
	lanes size;

	sight->radius = middle[3];
	sight->is_out = 1;
	if (!lanes_all_are(lanes_size(away) <= half + s->box + s->per_widest * widest))
		return;
	sight->p = sight_turned(s->frame.axis, away);
	sight->reach = sight_turned(s->frame.slant, half);
	size = lanes_size(sight->p);
	sight->is_out = lanes_all_are(size + sight->reach <= s->free_one) ||
	                !lanes_all_are(size <= s->limit + (lanes){ 0, 0, 2, 0 } * widest + sight->reach);
}

static float distance2(const struct search *s, const struct cell_ball *ball)
{
	const lanes away = sight_middle(ball) - s->frame.at, square = away * away;

	return square[0] + square[1] + square[2];
}

static int is_behind(const struct search *s, const struct sight *sight)
{
	const lanes nearest = lanes_greater(lanes_size(sight->p) - sight->reach, lanes_all(0));

	return s->bars.n > 0 && bars_is_behind(&s->bars, nearest[0] + s->over[0], nearest[1] + s->over[1]);
}

/* A node of the cells begin..end of the tree's order, which is known without a look at it. */
struct below {
	size_t i;
	uint32_t begin, end;
};

static inline struct below half_of(const struct below *node, int second)
{
	const uint32_t half = node->begin + (node->end - node->begin) / 2;

	return second ? (struct below){ 2 * node->i + 2, half, node->end }
	              : (struct below){ 2 * node->i + 1, node->begin, half };
}

/* The node is not out. */
static void look_below(struct search *s, const struct fitting *f, const struct rectangle *r, struct below node,
                       const struct sight *known)
{
	const struct cell_tree *tree = f->look.tree;
	struct sight sight = *known, child[2];

	while (s->left >= 0 && !is_behind(s, &sight)) {
		const struct cell_ball *ball = &tree->ball[2 * node.i + 1];
		int second;

		if (node.end - node.begin == 1) {
			look_at(s, f, r, &f->look.surface->cell[tree->order[node.begin]], &sight);
			return;
		}
		if (rectangle_may_suit(&f->look, r, sight.radius)) {
			float p[3];

			memcpy(p, &sight.p, sizeof p);
			if (rectangle_suits_node(&f->look, r, node.i, p))
				return;
		}
		s->left -= 2;
		/* Most of the time goes into waiting for balls. Those of both children's children are side by side. */
		if (4 * node.i + 6 < tree->n_nodes)
			for (size_t k = 0; k < 2; k++)
				__builtin_prefetch(&tree->ball[4 * node.i + 3 + 2 * k]);
		for (size_t k = 0; k < 2; k++)
			see(&child[k], s, &ball[k]);
		if (child[0].is_out && child[1].is_out)
			return;
		second = child[0].is_out;
		/* The nearer half first: its bars are before most of the other's. */
		if (!child[0].is_out && !child[1].is_out) {
			second = !(distance2(s, &ball[1]) < distance2(s, &ball[0]));
			look_below(s, f, r, half_of(&node, !second), &child[!second]);
		}
		node = half_of(&node, second);
		sight = child[second];
	}
}

/* Finds the bars. Returns 0 if there may be more of them. */
static int find_bars(struct rectangle *r, const float free_one[2], struct search *s, const struct fitting *f)
{
	const struct cell_tree *tree = f->look.tree;
	struct sight all;

	r->deep = 2 * fabsf(r->lambda_u) * fmaxf(r->extent[0] * r->extent[0], r->extent[1] * r->extent[1]) + r->height;
	sight_frame_of(&s->frame, r);
	s->box = s->per_widest = lanes_all(INFINITY);
	for (int k = 0; k < 3; k++) {
		const float *u = r->slant[0], *v = r->slant[1], *n = r->slant[2];

		s->box[k] = 1.00001f * (u[k] * r->extent[0] + v[k] * r->extent[1] + n[k] * (r->deep + 4 * r->height));
		s->per_widest[k] = 1.00001f * (u[k] + v[k] + 2 * n[k]);
	}
	s->limit = (lanes){ r->extent[0], r->extent[1], r->deep + 4 * r->height, INFINITY };
	s->sides = (lanes){ r->extent[0], r->extent[1], INFINITY, INFINITY };
	s->free_one = (lanes){ free_one[0], free_one[1], INFINITY, INFINITY };
	s->bars.n = 0;
	s->left = f->looked - 1;
	see(&all, s, &tree->ball[0]);
	if (!all.is_out)
		look_below(s, f, r, (struct below){ 0, tree->node[0].begin, tree->node[0].end }, &all);
	return s->left >= 0;
}

/* Ends the rectangle at the bars. Returns 0 if that is not known of all of them. */
static int look_around(struct rectangle *r, const float free_one[2], struct search *s, const struct fitting *f)
{
	const int is_all = find_bars(r, free_one, s, f);

	bars_end(r->extent, &s->bars, free_one, f->overhang);
	return is_all;
}

/* The first steps of growing mostly find no bar: one look tells how many do not. Brings `now` from where growing begins
 * to the last of them, and is_first to 0 if there is one. Returns whether the bars are those of the step after it. */
static int leap(float now[2], int *is_first, const float most[2], struct rectangle *r, struct search *s,
                const struct fitting *f)
{
	int n = 0, n_free = 0, is_all;

	memcpy(r->extent, now, sizeof r->extent);
	for (; n < LEAP && (r->extent[0] < most[0] || r->extent[1] < most[1]); n++)
		for (int k = 0; k < 2; k++) {
			s->step[n][k] = r->extent[k];
			r->extent[k] = fminf(2 * r->extent[k], most[k]);
		}
	s->n_steps = n;
	is_all = n > 0 && find_bars(r, (const float[2]){ 0, 0 }, s, f);
	s->n_steps = 0;
	if (!is_all)
		return 0;
	while (n_free < n && !bars_are_within(&s->bars, s->step[n_free]))
		n_free++;
	if (n_free > 0) {
		memcpy(now, s->step[n_free - 1], sizeof s->step[0]);
		*is_first = 0;
	}
	return n_free == n;
}

/* Grows along u and along v until bars are in the way, or too much to look at, or the extents are those of epsilon and
 * delta. side: of the bars. */
static void grow(float now[2], float side[2], struct rectangle *r, struct search *s, const struct fitting *f)
{
	const float most[2] = { r->extent[0], r->extent[1] };
	/* From a square on: what a curvature makes short must not become shorter for the sake of the other side. */
	float first = fminf(fminf(most[0], most[1]), FIRST * fmaxf(most[0], most[1]));
	int is_growing[2] = { 1, 1 }, is_first = 1, is_known;

	now[0] = now[1] = first;
	side[0] = side[1] = 0;
	is_known = leap(now, &is_first, most, r, s, f);
	for (int k = 0; k < 2; k++)
		is_growing[k] = is_first || now[k] < most[k];
	for (; (is_growing[0] || is_growing[1]) && !s->bars.is_failed; is_known = 0) {
		float grown[2];

		for (int k = 0; k < 2; k++)
			r->extent[k] = grown[k] = is_growing[k] && !is_first ? fminf(2 * now[k], most[k]) : now[k];
		if (is_known) {
			bars_end(r->extent, &s->bars, now, f->overhang);
		} else if (!look_around(r, is_first ? (const float[2]){ 0, 0 } : now, s, f)) {
			if (!is_first || first < f->overhang)
				break;
			now[0] = now[1] = first /= 2;
			continue;
		}
		is_first = 0;
		for (int k = 0; k < 2; k++) {
			if (r->extent[k] < grown[k])
				side[k] = bars_side(&s->bars, r->extent, k);
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

static void set_over(struct search *s, const struct fitting *f, const float extent[2])
{
	for (int k = 0; k < 2; k++)
		s->over[k] = fminf(f->overhang, 0.5f * extent[k]);
}

/* An extent that bars end becomes that of the class below, and the point moves as much towards the bar: so its
 * rectangle still ends there. What then is in the way makes it shorter, without another move. */
static void fit(struct dpoint_candidate *c, struct search *s, const struct fitting *f)
{
	struct dpoint before;
	struct rectangle r;
	float most[2], now[2], side[2], by[2] = { 0, 0 };

	rectangle_of(&r, c, f->look.options);
	memcpy(most, r.extent, sizeof most);
	set_over(s, f, most);
	grow(now, side, &r, s, f);
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
	set_over(s, f, most);
	if (!look_around(&r, (const float[2]){ 0, 0 }, s, f)) {
		c->point = before;
		return;
	}
	for (int k = 0; k < 2; k++)
		if (r.extent[k] < most[k] - s->over[k])
			c->delta[k] = dpoint_delta_of_class(dpoint_delta_class(r.extent[k]));
}

static void fit_chunk(int chunk, void *userdata)
{
	struct fitting *f = userdata;
	struct search search = { .bars = { .bar = NULL } };
	struct bound_view view = { .seen = NULL };
	int rc = PSR_OK;

	for (size_t i = (size_t)chunk * CHUNK; i < f->n && i < (size_t)(chunk + 1) * CHUNK; i++) {
		const struct dpoint_candidate before = f->candidate[i];

		fit(&f->candidate[i], &search, f);
		if (f->look.options->error > 0 && rc == PSR_OK)
			rc = shrink_within(&f->candidate[i], &before, &view, &f->look);
	}
	free(search.bars.bar);
	bound_view_fini(&view);
	if (search.bars.is_failed || rc != PSR_OK)
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
	rc = cell_tree_init(&tree, surface->cell, surface->n_cells, pool);
	if (rc == PSR_OK)
		rc = fit_candidates(surface, &tree, 0, options, &work);
	cell_tree_fini(&tree);
	return rc;
}
