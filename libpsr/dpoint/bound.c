/* A convex part of the quadric is within the error of a facet if its corners are, less what the quadric departs from
 * their hull, as the distance from a convex set is a convex function: (u, v) = sum of l_i (u_i, v_i) of the corners is
 * off from the same mean of their places by w = sum of l_i q_i - q = (a Var(u) + b Var(v)) / 2, and a variance is at
 * most a quarter of the squared width. Half of the greatest departure, with its sign, moves the corners, so that the
 * other half is left. A part that no single facet suffices for is cut along the facet's sides, or in halves. */
#include "bound_seen.h"

#include <math.h>
#include <string.h>
#include "base/array.h"
#include "base/vec.h"
#include "psr/error.h"

#define MOST_CORNERS 16
#define MOST_DEPTH 64
#define FEW 8          /* facets that are tried one by one */
#define MANY 24        /* which halves are first to have fewer of */
#define SURELY 1e-9    /* inner units */
#define FINEST 32      /* of an error: smaller parts are not cut */

/* A convex part of the rectangle. */
struct part {
	double corner[MOST_CORNERS][2];
	int n;
};

struct bounding {
	struct bound_view *view;
	double error;
	double *place;
};

static inline double lesser(double a, double b)
{
	return b < a ? b : a;
}

static inline double greater(double a, double b)
{
	return b > a ? b : a;
}

/* ---- distances ---- */

static void place_at(double p[3], const struct bound_view *view, double u, double v)
{
	v3d_set(p, u, v, 0.5 * (view->a * u * u + view->b * v * v));
}

/* The facet that is nearest to the place, of those within the error. Boxes that are further than the nearest one so far
 * are not looked into; SURELY is more than distances are rounded by. likely: one that may be near, or NULL. */
static const struct bound_seen *nearest(const struct bounding *b, const double p[3], size_t begin, size_t end,
                                        const struct bound_seen *likely)
{
	const struct bound_seen *best = NULL;
	double least = b->error * b->error;
	struct bound_box reach;

	if (likely != NULL)
		least = lesser(least, bound_distance2(likely, p));
	bound_box_reach(&reach, p, p, lesser(b->error, sqrt(least) + SURELY));
	for (size_t i = begin; i < end; i++) {
		const struct bound_seen *seen = &b->view->seen[b->view->list[i]];
		double d;

		if (bound_is_apart(&seen->box, &reach))
			continue;
		d = bound_distance2(seen, p);
		if (d <= least) {
			least = d;
			best = seen;
			bound_box_reach(&reach, p, p, lesser(b->error, sqrt(d) + SURELY));
		}
	}
	return best;
}

/* What a convex part of the quadric departs from its corners' hull by, and how much of it moves the corners. */
struct bend {
	double departure, shift;
};

static int suffices(const struct bounding *b, const struct bound_seen *seen, const struct part *part,
                    const struct bend *bend)
{
	const double most = b->error - bend->departure;

	for (int i = 0; i < part->n; i++) {
		double p[3];

		place_at(p, b->view, part->corner[i][0], part->corner[i][1]);
		p[2] += bend->shift;
		if (!(bound_distance2(seen, p) <= most * most))
			return 0;
	}
	return 1;
}

/* ---- parts ---- */

static void put(struct part *part, const double at[2])
{
	part->corner[part->n][0] = at[0];
	part->corner[part->n++][1] = at[1];
}

/* Cuts where line[0] u + line[1] v + line[2] is 0. Returns 0 where less than `least` of the part is on either side. */
static int cut_part(struct part side[2], const struct part *part, const double line[3], double least)
{
	double value[MOST_CORNERS], low = 0, high = 0;

	for (int i = 0; i < part->n; i++) {
		value[i] = line[0] * part->corner[i][0] + line[1] * part->corner[i][1] + line[2];
		low = lesser(low, value[i]);
		high = greater(high, value[i]);
	}
	side[0].n = side[1].n = 0;
	if (-low <= least || high <= least)
		return 0;
	for (int i = 0; i < part->n; i++) {
		const int next = (i + 1) % part->n;

		if (value[i] >= 0)
			put(&side[0], part->corner[i]);
		if (value[i] <= 0)
			put(&side[1], part->corner[i]);
		if ((value[i] < 0) != (value[next] < 0) && value[i] != 0 && value[next] != 0) {
			const double t = value[i] / (value[i] - value[next]);
			const double at[2] = { part->corner[i][0] + t * (part->corner[next][0] - part->corner[i][0]),
				                   part->corner[i][1] + t * (part->corner[next][1] - part->corner[i][1]) };

			put(&side[0], at);
			put(&side[1], at);
		}
	}
	return 1;
}

/* Along a side of the facet, as the rectangle sees it. */
static int cut_along(struct part side[2], const struct part *part, const struct bound_seen *seen, double least)
{
	for (int i = 0; i < 3; i++) {
		const double u = seen->side[i][0], v = seen->side[i][1], length = sqrt(u * u + v * v);
		double line[3];

		if (!(length > 1e-9))
			continue;
		line[0] = -v / length;
		line[1] = u / length;
		line[2] = -(line[0] * seen->corner[i][0] + line[1] * seen->corner[i][1]);
		if (cut_part(side, part, line, least))
			return 1;
	}
	return 0;
}

/* Adds the listed facets that are within the error of the box to the list. */
static int filter(const struct bounding *b, size_t begin, size_t end, const double low[3], const double high[3])
{
	struct bound_view *view = b->view;
	struct bound_box reach;

	if (!ARRAY_ROOM(view->list, view->n_list + (end - begin), view->list_room)) {
		view->is_failed = 1;
		return 0;
	}
	bound_box_reach(&reach, low, high, b->error);
	for (size_t i = begin; i < end; i++) {
		view->list[view->n_list] = view->list[i];
		view->n_list += !bound_is_apart(&view->seen[view->list[i]].box, &reach);
	}
	return view->n_list > end;
}

static void box_of(double low[3], double high[3], const struct bound_view *view, const struct part *part)
{
	double w[2];

	for (int k = 0; k < 2; k++) {
		low[k] = high[k] = part->corner[0][k];
		for (int i = 1; i < part->n; i++) {
			low[k] = lesser(low[k], part->corner[i][k]);
			high[k] = greater(high[k], part->corner[i][k]);
		}
	}
	bound_rise(w, view, low, high);
	low[2] = w[0];
	high[2] = w[1];
}

static void middle_of(double at[2], const struct part *part)
{
	at[0] = at[1] = 0;
	for (int i = 0; i < part->n; i++)
		for (int k = 0; k < 2; k++)
			at[k] += part->corner[i][k] / part->n;
}

/* Whether the facet that is nearest to the part's middle suffices; it becomes *seen, or NULL if none is near. */
static int nearest_suffices(const struct bound_seen **seen, const struct bounding *b, const struct part *part,
                            const struct bend *bend, size_t begin, size_t end, const struct bound_seen *likely)
{
	double middle[3];

	place_at(middle, b->view, b->place[0], b->place[1]);
	*seen = nearest(b, middle, begin, end, likely);
	return *seen != NULL && suffices(b, *seen, part, bend);
}

static int any_suffices(const struct bounding *b, const struct part *part, const struct bend *bend, size_t begin)
{
	const struct bound_view *view = b->view;

	for (size_t i = begin; i < view->n_list; i++)
		if (suffices(b, &view->seen[view->list[i]], part, bend))
			return 1;
	return 0;
}

/* Facets are those of the list from `begin` on. likely: one that is tried first, as it was near to what the part was
 * cut from; or NULL. A short list is looked through before it becomes shorter: that often is the end of it. */
static int part_holds(const struct bounding *b, const struct part *part, size_t begin, int depth,
                      const struct bound_seen *likely)
{
	struct bound_view *view = b->view;
	const size_t end = view->n_list;
	double low[3], high[3], bends[2], size;
	const struct bound_seen *seen = NULL;
	struct part side[2];
	struct bend bend;
	size_t n, top;
	int is_whole, is_crowded, axis, holds;

	box_of(low, high, view, part);
	middle_of(b->place, part);
	for (int k = 0; k < 2; k++)
		bends[k] = (k == 0 ? view->a : view->b) * (high[k] - low[k]) * (high[k] - low[k]) / 16;
	bend = (struct bend){ fabs(bends[0]) + fabs(bends[1]), -bends[0] - bends[1] };
	is_whole = bend.departure <= b->error / 4;
	if (is_whole && likely != NULL && suffices(b, likely, part, &bend))
		return 1;
	if (is_whole && end - begin <= MANY) {
		if (nearest_suffices(&seen, b, part, &bend, begin, end, likely))
			return 1;
		if (seen == NULL)
			return 0;
	}
	if (!filter(b, begin, end, low, high))
		return 0;
	n = view->n_list - end;
	size = greater(high[0] - low[0], high[1] - low[1]);
	is_crowded = n > MANY && 4 * n < 3 * (end - begin) && size > b->error / 2;
	if (is_whole && !is_crowded) {
		if (seen == NULL && nearest_suffices(&seen, b, part, &bend, end, view->n_list, likely))
			return 1;
		if (seen == NULL)
			return 0;
		if (n <= FEW && any_suffices(b, part, &bend, end))
			return 1;
	}
	if (size <= b->error / FINEST || depth >= MOST_DEPTH)
		return 0;
	axis = is_whole ? high[1] - low[1] > high[0] - low[0] : fabs(bends[1]) > fabs(bends[0]);
	if (seen == NULL || part->n > MOST_CORNERS - 4 || !cut_along(side, part, seen, lesser(size, b->error) / 16)) {
		double line[3] = { axis == 0, axis == 1, -0.5 * (low[axis] + high[axis]) };

		if (!cut_part(side, part, line, 0))
			return 0;
	}
	top = view->n_list;
	holds = part_holds(b, &side[0], end, depth + 1, seen);
	view->n_list = top;
	return holds && part_holds(b, &side[1], end, depth + 1, seen);
}

/* What fails mostly does so at a corner, or in the middle of a side. */
static int outline_holds(const struct bounding *b, const float extent[2])
{
	for (int i = 0; i < 9; i++) {
		double p[3];

		place_at(p, b->view, (i % 3 - 1) * (double)extent[0], (i / 3 - 1) * (double)extent[1]);
		memcpy(b->place, p, 2 * sizeof *p);
		if (nearest(b, p, 0, b->view->n_list, NULL) == NULL)
			return 0;
	}
	return 1;
}

static int holds(struct bound_view *view, const float extent[2], double error, double place[2], int is_likely)
{
	const double u = extent[0], v = extent[1];
	const struct part all = { { { -u, -v }, { u, -v }, { u, v }, { -u, v } }, 4 };
	double somewhere[2];
	const struct bounding b = { view, error, place != NULL ? place : somewhere };

	view->n_list = 0;
	for (size_t i = 0; i < view->n_seen; i++) {
		if (!ARRAY_ROOM(view->list, i, view->list_room)) {
			view->is_failed = 1;
			return 0;
		}
		view->list[view->n_list++] = (uint32_t)i;
	}
	return (is_likely || outline_holds(&b, extent)) && part_holds(&b, &all, 0, 0, NULL) && !view->is_failed;
}

int bound_holds(struct bound_view *view, const float extent[2], double error, double place[2])
{
	return holds(view, extent, error, place, 0);
}

int bound_likely_holds(struct bound_view *view, const float extent[2], double error)
{
	return holds(view, extent, error, NULL, 1);
}

double bound_least(struct bound_view *view, const struct facets *facets, const struct dpoint *point,
                   const float extent[2], double least)
{
	for (double error = least; error < 8; error *= 2) {
		if (bound_look(view, facets, point, extent, error) != PSR_OK)
			return INFINITY;
		if (bound_holds(view, extent, error, NULL))
			return error;
	}
	return INFINITY;
}
