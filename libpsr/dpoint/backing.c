#include "backing.h"

#include <math.h>
#include <string.h>
#include "sight.h"

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

/* A place of S_p. */
struct standing {
	const struct looking *l;
	const struct rectangle *r;
	struct sight_frame frame;
	lanes at, near; /* how much further along u, v and the normal it may be; lane 3: any */
};

static int may_back(const struct standing *s, size_t i)
{
	const struct cell_ball *ball = &s->l->tree->ball[i];
	const lanes p = sight_turned(s->frame.axis, sight_middle(ball) - s->frame.at);

	return lanes_all_are(lanes_size(p - s->at) <= sight_turned(s->frame.slant, sight_half(ball)) + s->near);
}

static int leaf_backs(const struct standing *s, uint32_t place)
{
	const struct looking *l = s->l;
	const struct dpoint_cell *cell = &l->surface->cell[l->tree->order[place]];
	float corner[4][3], middle[3] = { 0, 0, 0 };

	for (int c = 0; c < 4; c++) {
		const lanes seen = sight_turned(s->frame.axis, sight_place(cell->corner[c]) - s->frame.at);

		memcpy(corner[c], &seen, sizeof corner[c]);
		v3f_add_scaled(middle, middle, 0.25f, corner[c]);
	}
	return is_in((const float (*)[3])corner, s->at[0], s->at[1]) && rectangle_suits(l, s->r, cell, middle);
}

/* Returns the leaf of a cell that backs the place, of those below a node that may, of the cells begin..end; or 0. */
static size_t backing_below(const struct standing *s, size_t i, uint32_t begin, uint32_t end)
{
	const uint32_t half = begin + (end - begin) / 2;
	size_t found = 0;

	if (end - begin == 1)
		return leaf_backs(s, begin) ? i : 0;
	if (may_back(s, 2 * i + 1))
		found = backing_below(s, 2 * i + 1, begin, half);
	if (found == 0 && may_back(s, 2 * i + 2))
		found = backing_below(s, 2 * i + 2, half, end);
	return found;
}

static size_t backing_of(const struct standing *s, size_t i)
{
	return backing_below(s, i, s->l->tree->node[i].begin, s->l->tree->node[i].end);
}

/* The same of the whole tree, first near the leaf that was found last. A leaf counts where all nodes above it may back
 * the place, in whatever order they are asked. */
static size_t find_backing(const struct standing *s, size_t last)
{
	size_t way[64], n = 0, deepest = 0, found = 0;

	for (size_t i = last; i > 0; i = (i - 1) / 2)
		way[n++] = i;
	if (!may_back(s, 0))
		return 0;
	while (n > 0 && may_back(s, way[n - 1]))
		deepest = way[--n];
	found = backing_of(s, deepest);
	for (size_t i = deepest; i > 0 && found == 0; i = (i - 1) / 2) {
		const size_t other = i % 2 == 1 ? i + 1 : i - 1;

		if (may_back(s, other))
			found = backing_of(s, other);
	}
	return found;
}

int is_backed(size_t *last, const struct looking *l, const struct rectangle *r, float u, float v)
{
	struct standing s = { .l = l, .r = r, .at = { u, v, dpoint_height_at(r->lambda_u, r->rho, u, v), 0 },
		                  .near = { 0, 0, 2 * r->height, INFINITY } };
	size_t found;

	sight_frame_of(&s.frame, r);
	found = find_backing(&s, *last);
	if (found > 0)
		*last = found;
	return found > 0;
}
