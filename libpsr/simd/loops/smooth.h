/* Anti-aliasing by a pixel's neighbours ([G] 9.1.1). */
#include <math.h>
#include <string.h>
#include "simd/smooth.h"

#define MOST_BEHIND 6 /* eighths: lines a pixel wide must not vanish */

/* A row and a pixel on each side of it: [1] is the first. */
struct smooth_row {
	float z[SMOOTH_WIDTH + 2], limit[SMOOTH_WIDTH + 2]; /* NaN outside of the picture: every comparison fails */
	int32_t light[3][SMOOTH_WIDTH + 2];                 /* squared codes, close to linear */
	int32_t is_empty;
};

static void load_smooth_row(struct smooth_row *row, const struct smooth_target *t, uint32_t x0, uint32_t n, int64_t y)
{
	const int is_inside = y >= 0 && y < (int64_t)t->height;
	const uint32_t first = is_inside && x0 ? 0 : 1, end = x0 + n < t->width ? n + 2 : n + 1;
	const ptrdiff_t at = (ptrdiff_t)(is_inside ? y : 0) * t->width + x0 - 1;
	const uint8_t *code = t->from + 3 * at;
	const float *z = t->depth + at;

	row->z[0] = row->limit[0] = row->z[n + 1] = row->limit[n + 1] = NAN;
	for (int c = 0; c < 3; c++)
		row->light[c][0] = row->light[c][n + 1] = 0;
	row->is_empty = 1;
	if (!is_inside) {
		for (uint32_t i = 0; i < n + 2; i++) {
			row->z[i] = row->limit[i] = NAN;
			row->light[0][i] = row->light[1][i] = row->light[2][i] = 0;
		}
		return;
	}
	int32_t has_any = 0;
	for (uint32_t i = first; i < end; i++) {
		row->z[i] = z[i];
		row->limit[i] = z[i] * t->scale + t->offset;
		has_any |= z[i] < INFINITY;
	}
	row->is_empty = !has_any;
	for (uint32_t i = first; i < end; i++) {
		const int32_t r = code[3 * i], g = code[3 * i + 1], b = code[3 * i + 2];

		row->light[0][i] = r * r;
		row->light[1][i] = g * g;
		row->light[2][i] = b * b;
	}
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

static inline int32_t is_same(float z, float limit, float other, float others_limit)
{
	return -((other <= limit) & (z <= others_limit));
}

/* Returns how many pixels have a neighbour behind. */
static uint32_t smooth_pixels(int32_t *restrict pixel, const struct smooth_row *restrict up,
                              const struct smooth_row *restrict own, const struct smooth_row *restrict down, uint32_t n)
{
	uint32_t n_edges = 0;

	for (uint32_t i = 1; i <= n; i++) {
		const float z = own->z[i], limit = own->limit[i];
		const struct smooth_masks behind = {
			-(up->z[i] > limit), -(down->z[i] > limit), -(own->z[i - 1] > limit), -(own->z[i + 1] > limit),
			{ -(up->z[i - 1] > limit), -(up->z[i + 1] > limit), -(down->z[i - 1] > limit), -(down->z[i + 1] > limit) },
		};
		const struct smooth_masks same = {
			is_same(z, limit, up->z[i], up->limit[i]),
			is_same(z, limit, down->z[i], down->limit[i]),
			is_same(z, limit, own->z[i - 1], own->limit[i - 1]),
			is_same(z, limit, own->z[i + 1], own->limit[i + 1]),
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
		pixel[i - 1] = code[0] | code[1] << 8 | code[2] << 16;
		n_edges += edges > 0;
	}
	return n_edges;
}

static uint32_t smooth(const struct smooth_target *t, uint32_t x0, uint32_t x1, uint32_t y0, uint32_t y1)
{
	const uint32_t n = x1 - x0;
	struct smooth_row rows[3];
	int32_t pixel[SMOOTH_WIDTH];
	uint32_t n_edges = 0;

	for (uint32_t y = y0; y < y0 + 2; y++)
		load_smooth_row(&rows[y % 3], t, x0, n, (int64_t)y - 1);
	for (uint32_t y = y0; y < y1; y++) {
		uint8_t *to = t->to + 3 * ((size_t)y * t->width + x0);

		load_smooth_row(&rows[(y + 2) % 3], t, x0, n, (int64_t)y + 1);
		if (rows[(y + 1) % 3].is_empty) {
			memcpy(to, t->from + 3 * ((size_t)y * t->width + x0), 3 * (size_t)n);
			continue;
		}
		n_edges += smooth_pixels(pixel, &rows[y % 3], &rows[(y + 1) % 3], &rows[(y + 2) % 3], n);
		for (uint32_t i = 0; i + 1 < n; i++) /* writes a byte of the next pixel, too */
			memcpy(to + 3 * (size_t)i, &pixel[i], 4);
		memcpy(to + 3 * (size_t)(n - 1), &pixel[n - 1], 3);
	}
	return n_edges;
}
