/* Anti-aliasing by a pixel's neighbours ([G] 9.1.1). */
#include <math.h>
#include <string.h>
#include "base/maths.h"
#include "smooth_places.h"

#define MOST_BEHIND 6 /* eighths: lines a pixel wide must not vanish */

#define MARGIN SMOOTH_REACH
#define ROWS (2 * MARGIN + 1)
#define FIRST 16 /* where pixels begin in a row: at a whole vector */
#define LENGTH (FIRST + SMOOTH_WIDTH + 16)

/* A row and MARGIN pixels on each side of it: [FIRST] is the first. `near` is linear in the picture on any plane:
 * 1 / z' in perspective, else -z'. NaN outside of the picture: every comparison fails. */
struct smooth_row {
	_Alignas(64) float near[LENGTH], limit[LENGTH];
	/* Squared codes, close to linear; of the row and those beside it. So small that sums are exact. */
	float light[3][LENGTH];
	int32_t is_empty;
};

_Static_assert(SMOOTH_WIDTH % SMOOTH_RUN == 0, "runs may reach beyond the last pixel, not beyond a row");

/* Of a row, what is in the picture: at + i of row[i], first <= i < end. */
struct smooth_span {
	size_t first, end;
	ptrdiff_t at;
};

static struct smooth_span smooth_span_of(const struct smooth_target *t, uint32_t x0, uint32_t n, int64_t y)
{
	const int is_inside = y >= 0 && y < (int64_t)t->height;
	const size_t first = FIRST - (x0 < MARGIN ? x0 : MARGIN), left = t->width - x0;
	const size_t end = FIRST + (left < n + MARGIN ? left : n + MARGIN);
	const ptrdiff_t row = (ptrdiff_t)(is_inside ? y : 0) * t->width;

	return (struct smooth_span){ first, is_inside ? end : first, row + (ptrdiff_t)x0 - FIRST };
}

static void load_nearness(struct smooth_row *row, const struct smooth_target *t, const struct smooth_span *in)
{
	const float *z = t->depth + in->at;
	int32_t has_any = 0;

	for (size_t i = in->first; i < in->end; i++) {
		const float near = t->perspective ? 1 / z[i] : -z[i];

		row->near[i] = near;
		row->limit[i] = near * t->scale - t->offset;
		has_any |= z[i] < INFINITY;
	}
	row->is_empty = !has_any;
	for (size_t i = 0; i < in->first; i++)
		row->near[i] = row->limit[i] = NAN;
	for (size_t i = in->end; i < LENGTH; i++)
		row->near[i] = row->limit[i] = NAN;
}

static void load_light(struct smooth_row *row, const struct smooth_target *t, const struct smooth_span *in)
{
	const uint8_t *code = t->from + 3 * in->at;

	for (size_t i = in->first; i < in->end; i++) {
		const int32_t r = code[3 * i], g = code[3 * i + 1], b = code[3 * i + 2];

		row->light[0][i] = (float)(r * r);
		row->light[1][i] = (float)(g * g);
		row->light[2][i] = (float)(b * b);
	}
	for (int c = 0; c < 3; c++) {
		memset(row->light[c], 0, in->first * sizeof *row->light[c]);
		memset(row->light[c] + in->end, 0, (LENGTH - in->end) * sizeof *row->light[c]);
	}
}

static inline float add_sides(const float *a, const float *o, const float *b, const struct smooth_masks *m)
{
	return (masked(a[0], m->above) + masked(b[0], m->below)) + (masked(o[-1], m->left) + masked(o[1], m->right));
}

static inline float add_corners(const float *a, const float *b, const struct smooth_masks *m)
{
	return (masked(a[-1], m->corner[0]) + masked(a[1], m->corner[1]))
	       + (masked(b[-1], m->corner[2]) + masked(b[1], m->corner[3]));
}

static inline int32_t smooth_code(float light)
{
	return (int32_t)(__builtin_sqrtf(light) + 0.5f);
}

static inline float lesser(float a, float b)
{
	return a < b ? a : b;
}

static inline float greater(float a, float b)
{
	return a > b ? a : b;
}

/* Of each run of a row, whether all pixels around it are of its surface, even if that may not fall: whether the
 * farthest around a pixel is within its limit, and it within all limits around it. Runs are looked at before any is
 * drawn: their chains of comparisons overlap. `row` points to the middle one of ROWS here and below. */
static void find_inside(int32_t is_inside[SMOOTH_WIDTH / SMOOTH_RUN], const struct smooth_row *const *row, uint32_t n)
{
	const float *up = row[-1]->near, *own = row[0]->near, *down = row[1]->near;
	const float *up_limit = row[-1]->limit, *own_limit = row[0]->limit, *down_limit = row[1]->limit;

	for (size_t k = 0; k * SMOOTH_RUN < n; k++) {
		int32_t is_one = 1;

		for (size_t i = FIRST + k * SMOOTH_RUN; i < FIRST + (k + 1) * SMOOTH_RUN; i++) {
			const float far = lesser(lesser(lesser(up[i - 1], up[i]), lesser(up[i + 1], own[i - 1])),
			                         lesser(lesser(own[i + 1], down[i - 1]), lesser(down[i], down[i + 1])));
			const float limit = greater(
				greater(greater(up_limit[i - 1], up_limit[i]), greater(up_limit[i + 1], own_limit[i - 1])),
				greater(greater(own_limit[i + 1], down_limit[i - 1]), greater(down_limit[i], down_limit[i + 1])));

			is_one &= (far >= own_limit[i]) & (own[i] >= limit);
		}
		is_inside[k] = is_one;
	}
}

/* Runs with pixels at the picture's border are not inside: what is beyond it is nobody's surface. */
static void leave_border(int32_t is_inside[SMOOTH_WIDTH / SMOOTH_RUN], const struct smooth_target *t, uint32_t x0,
                         uint32_t n, uint32_t y)
{
	const size_t n_runs = (n + SMOOTH_RUN - 1) / SMOOTH_RUN;

	if (y == 0 || y == t->height - 1)
		memset(is_inside, 0, n_runs * sizeof *is_inside);
	if (x0 == 0)
		is_inside[0] = 0;
	if (x0 + n_runs * SMOOTH_RUN >= t->width)
		is_inside[n_runs - 1] = 0;
}

static inline void smooth_inside(int32_t (*restrict code)[SMOOTH_WIDTH], size_t x,
                                 const struct smooth_row *const *row)
{
	for (int c = 0; c < 3; c++) {
		const float *a = row[-1]->light[c] + FIRST + x, *o = row[0]->light[c] + FIRST + x;
		const float *b = row[1]->light[c] + FIRST + x;

		for (ptrdiff_t i = 0; i < SMOOTH_RUN; i++)
			code[c][x + (size_t)i] = smooth_code((4 * o[i] + ((a[i] + b[i]) + (o[i - 1] + o[i + 1]))) * (1 / 8.0f));
	}
}

/* The same with samples. */
static inline void smooth_samples(int32_t (*restrict code)[SMOOTH_WIDTH], size_t x, const struct smooth_row *const *row,
                                  const struct smooth_weights *const *weights)
{
	static const struct smooth_masks all = { -1, -1, -1, -1, { -1, -1, -1, -1 } };

	for (size_t k = 0; k < SMOOTH_RUN; k++) {
		const size_t i = x + k + FIRST;
		struct smooth_shares shares;

		find_shares_around(&shares, weights, x + k, &all);
		for (int c = 0; c < 3; c++) {
			const float *a = row[-1]->light[c] + i, *o = row[0]->light[c] + i, *b = row[1]->light[c] + i;

			code[c][x + k] = smooth_code(add_shares(a, o, b, &shares));
		}
	}
}

/* How much a surface falls over the two pixels before and after a step from a pixel to the next: the lesser of both, 0
 * where it rises on a side; negative where it rises on both. The surface may fall by so much in the step. */
static inline void smooth_falls(float *restrict fall, const float *near2, const float *near, const float *next,
                                const float *next2, size_t n)
{
	for (size_t i = 0; i < n; i++) {
		const float before = near2[i] - near[i], after = next[i] - next2[i];
		const int is_less = before < after;
		const float least = psr_choose(is_less, before, after), most = psr_choose(is_less, after, before);

		fall[i] = psr_choose(least > 0, least, psr_where(most < 0, most));
	}
}

static inline float down_by(float fall)
{
	return psr_where(fall > 0, fall);
}

/* Whether a step that may fall by so much stays on one surface. */
static inline int32_t is_same(float fall, float rise, float near, float limit, float other, float others_limit)
{
	return -((other >= limit - fall) & (near >= others_limit - rise));
}

/* The same of a step aslant, along a row and a column, from a pixel above or below its limits. */
static inline int32_t is_same_aslant(float limit, float rise, float up, float near, float other, float others_limit)
{
	return -((other >= limit) & (near >= others_limit - rise - up));
}

/* Returns how many of the first n pixels have a neighbour behind. `weights` is NULL, or of the three rows in the middle.
 */
static inline __attribute__((always_inline)) uint32_t smooth_edges(int32_t (*restrict code)[SMOOTH_WIDTH], size_t x,
                                                                   size_t n, const struct smooth_row *const *row,
                                                                   const struct smooth_weights *const *weights)
{
	const size_t first = x + FIRST;
	const struct smooth_row *up = row[-1], *own = row[0], *down = row[1];
	const float *near_own = own->near + first;
	float rightward[SMOOTH_RUN + 1], downward[SMOOTH_RUN], from_above[SMOOTH_RUN];
	int32_t n_edges = 0;

	smooth_falls(rightward, near_own - 3, near_own - 1, near_own, near_own + 2, SMOOTH_RUN + 1);
	smooth_falls(downward, row[-2]->near + first, near_own, down->near + first, row[3]->near + first, SMOOTH_RUN);
	smooth_falls(from_above, row[-3]->near + first, up->near + first, near_own, row[2]->near + first, SMOOTH_RUN);
	for (size_t k = 0; k < SMOOTH_RUN; k++) {
		const size_t i = first + k;
		const float near = own->near[i], limit = own->limit[i];
		const float right = down_by(rightward[k + 1]), right_up = down_by(-rightward[k + 1]);
		const float left = down_by(-rightward[k]), left_up = down_by(rightward[k]);
		const float below = down_by(downward[k]), below_up = down_by(-downward[k]);
		const float above = down_by(-from_above[k]), above_up = down_by(from_above[k]);
		const float high = limit - above, low = limit - below;
		const struct smooth_masks behind = {
			-(up->near[i] < high), -(down->near[i] < low), -(own->near[i - 1] < limit - left),
			-(own->near[i + 1] < limit - right),
			{ -(up->near[i - 1] < high - left), -(up->near[i + 1] < high - right), -(down->near[i - 1] < low - left),
			  -(down->near[i + 1] < low - right) },
		};
		const struct smooth_masks same = {
			is_same(above, above_up, near, limit, up->near[i], up->limit[i]),
			is_same(below, below_up, near, limit, down->near[i], down->limit[i]),
			is_same(left, left_up, near, limit, own->near[i - 1], own->limit[i - 1]),
			is_same(right, right_up, near, limit, own->near[i + 1], own->limit[i + 1]),
			{ is_same_aslant(high - left, above_up, left_up, near, up->near[i - 1], up->limit[i - 1]),
			  is_same_aslant(high - right, above_up, right_up, near, up->near[i + 1], up->limit[i + 1]),
			  is_same_aslant(low - left, below_up, left_up, near, down->near[i - 1], down->limit[i - 1]),
			  is_same_aslant(low - right, below_up, right_up, near, down->near[i + 1], down->limit[i + 1]) },
		};
		const int32_t sides = behind.above + behind.below + behind.left + behind.right;
		const int32_t corners = behind.corner[0] + behind.corner[1] + behind.corner[2] + behind.corner[3];
		const int32_t others = 4 + (same.above + same.below + same.left + same.right);
		const int32_t edges = -(2 * sides + corners), through = edges < MOST_BEHIND ? edges : MOST_BEHIND;
		const float share = (float)(8 - through) * (1 / 8.0f);
		const float rest = (float)through / (float)(8 * (edges ? edges : 1));

		struct smooth_shares shares;

		if (weights != NULL)
			find_shares_around(&shares, weights, x + k, &same);
		for (int c = 0; c < 3; c++) {
			const float *a = up->light[c] + i, *o = own->light[c] + i, *b = down->light[c] + i;
			float front;

			if (weights != NULL)
				front = add_shares(a, o, b, &shares);
			else
				front = ((float)(4 + others) * o[0] + add_sides(a, o, b, &same)) * (1 / 8.0f);
			const float back = 2 * add_sides(a, o, b, &behind) + add_corners(a, b, &behind);

			code[c][x + k] = smooth_code(front * share + back * rest);
		}
		n_edges += (edges > 0) & (k < n);
	}
	return (uint32_t)n_edges;
}

/* Smooths a run, of which n pixels are in the piece. `weights`: NULL, or of the three rows in the middle. */
static uint32_t smooth_run(int32_t (*restrict code)[SMOOTH_WIDTH], size_t x, size_t n,
                           const struct smooth_row *const *row, int32_t is_inside,
                           const struct smooth_weights *const *weights)
{
	const size_t k = x / SMOOTH_RUN;

	if (weights != NULL && !(weights[0]->has_any[k] | weights[1]->has_any[k] | weights[2]->has_any[k]))
		weights = NULL;
	if (!is_inside)
		return weights != NULL ? smooth_edges(code, x, n, row, weights) : smooth_edges(code, x, n, row, NULL);
	if (weights != NULL)
		smooth_samples(code, x, row, weights);
	else
		smooth_inside(code, x, row);
	return 0;
}

static uint32_t smooth(const struct smooth_target *t, uint32_t x0, uint32_t x1, uint32_t y0, uint32_t y1)
{
	const uint32_t n = x1 - x0;
	struct smooth_row rows[ROWS];
	const struct smooth_row *row[ROWS];
	int32_t is_inside[SMOOTH_WIDTH / SMOOTH_RUN];
	struct smooth_weights weights[3];
	const struct smooth_weights *around[3];
	int32_t code[3][SMOOTH_WIDTH];
	uint32_t n_edges = 0;

	for (int k = 0; k < 3; k++)
		memset(weights[k].has_own, 1, sizeof weights[k].has_own); /* what is there is not known */
	for (int64_t y = (int64_t)y0 - MARGIN; y < (int64_t)y1 + MARGIN; y++) {
		const struct smooth_span in = smooth_span_of(t, x0, n, y), next = smooth_span_of(t, x0, n, y - MARGIN + 1);
		const int64_t own = y - MARGIN;

		load_nearness(&rows[(y + MARGIN) % ROWS], t, &in);
		if (own + 1 >= (int64_t)y0 - 1)
			load_light(&rows[(own + 1 + MARGIN) % ROWS], t, &next);
		if (t->place != NULL && own + 1 >= (int64_t)y0 - 1)
			load_weights(&weights[(own + 2) % 3], t, x0, n, own + 1);
		if (own < (int64_t)y0)
			continue;
		for (int64_t k = 0; k < ROWS; k++)
			row[k] = &rows[(own + k) % ROWS];
		for (int64_t k = 0; k < 3; k++)
			around[k] = &weights[(own + k) % 3];
		uint8_t *to = t->to + 3 * ((size_t)own * t->width + x0);

		if (row[MARGIN]->is_empty) {
			memcpy(to, t->from + 3 * ((size_t)own * t->width + x0), 3 * (size_t)n);
			continue;
		}
		find_inside(is_inside, row + MARGIN, n);
		leave_border(is_inside, t, x0, n, (uint32_t)own);
		for (uint32_t x = 0; x < n; x += SMOOTH_RUN)
			n_edges += smooth_run(code, x, n - x, row + MARGIN, is_inside[x / SMOOTH_RUN],
			                      t->place != NULL ? around : NULL);
		for (size_t i = 0; i < n; i++)
			for (size_t c = 0; c < 3; c++)
				to[3 * i + c] = (uint8_t)code[c][i];
	}
	return n_edges;
}
