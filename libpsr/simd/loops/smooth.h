/* Anti-aliasing by a pixel's neighbours ([G] 9.1.1). */
#include <math.h>
#include <string.h>
#include "base/maths.h"
#include "simd/smooth.h"

#define MOST_BEHIND 6 /* eighths: lines a pixel wide must not vanish */

#define MARGIN SMOOTH_REACH
#define ROWS (2 * MARGIN + 1)

/* A row and MARGIN pixels on each side of it: [MARGIN] is the first. `near` is linear in the picture on any plane:
 * 1 / z' in perspective, else -z'. NaN outside of the picture: every comparison fails. */
struct smooth_row {
	float near[SMOOTH_WIDTH + 2 * MARGIN], limit[SMOOTH_WIDTH + 2 * MARGIN];
	int32_t light[3][SMOOTH_WIDTH + 2 * MARGIN]; /* squared codes, close to linear */
	int32_t is_empty;
};

static void clear_smooth_row(struct smooth_row *row, uint32_t first, uint32_t end)
{
	for (uint32_t i = first; i < end; i++) {
		row->near[i] = row->limit[i] = NAN;
		row->light[0][i] = row->light[1][i] = row->light[2][i] = 0;
	}
}

static void load_smooth_row(struct smooth_row *row, const struct smooth_target *t, uint32_t x0, uint32_t n, int64_t y)
{
	const int is_inside = y >= 0 && y < (int64_t)t->height;
	const uint32_t first = x0 < MARGIN ? MARGIN - x0 : 0, left = t->width - x0, all = n + 2 * MARGIN;
	const uint32_t end = is_inside ? (left + MARGIN < all ? left + MARGIN : all) : first;
	const ptrdiff_t at = (ptrdiff_t)(is_inside ? y : 0) * t->width + x0 - MARGIN;
	const uint8_t *code = t->from + 3 * at;
	const float *z = t->depth + at;
	int32_t has_any = 0;

	for (uint32_t i = first; i < end; i++) {
		const float near = t->perspective ? 1 / z[i] : -z[i];

		row->near[i] = near;
		row->limit[i] = near * t->scale - t->offset;
		has_any |= z[i] < INFINITY;
	}
	row->is_empty = !has_any;
	for (uint32_t i = first; i < end; i++) {
		const int32_t r = code[3 * i], g = code[3 * i + 1], b = code[3 * i + 2];

		row->light[0][i] = r * r;
		row->light[1][i] = g * g;
		row->light[2][i] = b * b;
	}
	clear_smooth_row(row, 0, first);
	clear_smooth_row(row, end, all);
}

/* Masks of the neighbours that count. */
struct smooth_masks {
	int32_t above, below, left, right, corner[4];
};

static inline int32_t add_sides(const int32_t *a, const int32_t *o, const int32_t *b, const struct smooth_masks *m)
{
	return ((a[0] & m->above) + (b[0] & m->below)) + ((o[-1] & m->left) + (o[1] & m->right));
}

static inline int32_t add_corners(const int32_t *a, const int32_t *b, const struct smooth_masks *m)
{
	return ((a[-1] & m->corner[0]) + (a[1] & m->corner[1])) + ((b[-1] & m->corner[2]) + (b[1] & m->corner[3]));
}

/* How much a surface falls over the two pixels before and after a step from a pixel to the next: the lesser of both, 0
 * where it rises on a side; negative where it rises on both. The surface may fall by so much in the step. */
static void smooth_falls(float *restrict fall, const float *near2, const float *near, const float *next,
                         const float *next2, uint32_t n)
{
	for (uint32_t i = 0; i < n; i++) {
		const float before = near2[i] - near[i], after = next[i] - next2[i];
		const int is_less = before < after;
		const float least = psr_choose(is_less, before, after), most = psr_choose(is_less, after, before);

		fall[i] = psr_choose(least > 0, least, psr_where(most < 0, most));
	}
}

/* The falls beside a row: [i] of the step from pixel i to the next one right; and down from a row to the next, by the
 * parity of the upper row. */
struct smooth_steps {
	float right[SMOOTH_WIDTH + 2 * MARGIN], vertical[2][SMOOTH_WIDTH + 2 * MARGIN];
};

static inline float down_by(float fall)
{
	return psr_where(fall > 0, fall);
}

/* Whether a step that may fall by so much stays on one surface. */
static inline int32_t is_same(float fall, float rise, float near, float limit, float other, float others_limit)
{
	return -((other >= limit - fall) & (near >= others_limit - rise));
}

/* Returns how many pixels have a neighbour behind. `row` points to the middle one of ROWS. */
static uint32_t smooth_pixels(int32_t *restrict pixel, const struct smooth_row *const *row, const float *rightward,
                              const float *downward, const float *from_above, uint32_t n)
{
	const struct smooth_row *up = row[-1], *own = row[0], *down = row[1];
	uint32_t n_edges = 0;

	for (uint32_t i = MARGIN; i < n + MARGIN; i++) {
		const float near = own->near[i], limit = own->limit[i];
		const float right = down_by(rightward[i]), right_up = down_by(-rightward[i]);
		const float left = down_by(-rightward[i - 1]), left_up = down_by(rightward[i - 1]);
		const float below = down_by(downward[i]), below_up = down_by(-downward[i]);
		const float above = down_by(-from_above[i]), above_up = down_by(from_above[i]);
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
			{ 0 },
		};
		const int32_t sides = behind.above + behind.below + behind.left + behind.right;
		const int32_t corners = behind.corner[0] + behind.corner[1] + behind.corner[2] + behind.corner[3];
		const int32_t others = 4 + (same.above + same.below + same.left + same.right);
		const int32_t edges = -(2 * sides + corners), through = edges < MOST_BEHIND ? edges : MOST_BEHIND;
		const float share = (float)(8 - through) * (1 / 64.0f);
		const float rest = (float)through / (float)(8 * (edges ? edges : 1));
		int32_t code[3];

		for (int c = 0; c < 3; c++) {
			const int32_t *a = up->light[c] + i, *o = own->light[c] + i, *b = down->light[c] + i;
			const float front = (float)((4 + others) * o[0] + add_sides(a, o, b, &same));
			const float back = (float)(2 * add_sides(a, o, b, &behind) + add_corners(a, b, &behind));

			code[c] = (int32_t)(__builtin_sqrtf(front * share + back * rest) + 0.5f);
		}
		pixel[i - MARGIN] = code[0] | code[1] << 8 | code[2] << 16;
		n_edges += edges > 0;
	}
	return n_edges;
}

static uint32_t smooth(const struct smooth_target *t, uint32_t x0, uint32_t x1, uint32_t y0, uint32_t y1)
{
	const uint32_t n = x1 - x0;
	struct smooth_row rows[ROWS];
	const struct smooth_row *row[ROWS];
	struct smooth_steps steps;
	int32_t pixel[SMOOTH_WIDTH];
	uint32_t n_edges = 0;

	for (uint32_t y = y0; y < y0 + ROWS - 1; y++)
		load_smooth_row(&rows[y % ROWS], t, x0, n, (int64_t)y - MARGIN);
	for (uint32_t y = y0; y < y1; y++) {
		uint8_t *to = t->to + 3 * ((size_t)y * t->width + x0);

		load_smooth_row(&rows[(y + ROWS - 1) % ROWS], t, x0, n, (int64_t)y + MARGIN);
		for (uint32_t k = 0; k < ROWS; k++)
			row[k] = &rows[(y + k) % ROWS];
		if (row[MARGIN]->is_empty) {
			memcpy(to, t->from + 3 * ((size_t)y * t->width + x0), 3 * (size_t)n);
			continue;
		}
		const struct smooth_row *own = row[MARGIN];
		float *below = steps.vertical[y % 2], *above = steps.vertical[(y + 1) % 2];
		const int is_first = y == y0 || row[MARGIN - 1]->is_empty;

		smooth_falls(steps.right + 2, own->near, own->near + 2, own->near + 3, own->near + 5, n + 1);
		smooth_falls(below + MARGIN, row[1]->near + MARGIN, own->near + MARGIN, row[4]->near + MARGIN,
		             row[6]->near + MARGIN, n);
		if (is_first)
			smooth_falls(above + MARGIN, row[0]->near + MARGIN, row[2]->near + MARGIN, own->near + MARGIN,
			             row[5]->near + MARGIN, n);
		n_edges += smooth_pixels(pixel, row + MARGIN, steps.right, below, above, n);
		for (uint32_t i = 0; i + 1 < n; i++) /* writes a byte of the next pixel, too */
			memcpy(to + 3 * (size_t)i, &pixel[i], 4);
		memcpy(to + 3 * (size_t)(n - 1), &pixel[n - 1], 3);
	}
	return n_edges;
}
