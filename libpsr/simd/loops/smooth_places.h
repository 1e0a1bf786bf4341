/* What samples weigh in smoothing, by where in their pixels they lie. */
#ifndef PSR_SIMD_LOOPS_SMOOTH_PLACES_H
#define PSR_SIMD_LOOPS_SMOOTH_PLACES_H

#include <stddef.h>
#include <string.h>
#include "base/maths.h"
#include "simd/gaps.h"
#include "simd/smooth.h"

/* Pixels together, a vector of floats: the fewer, the more runs are of one surface. */
#ifndef SMOOTH_RUN
#define SMOOTH_RUN 8
#endif
/* What the mean of a surface's pixels, half of them its own, weighs beside its samples: 256 of 128^2. */
#define SMOOTH_MEAN_OWN 128.0f
#define SMOOTH_MEAN_SIDE 32.0f

/* Masks of the neighbours that count. */
struct smooth_masks {
	int32_t above, below, left, right, corner[4];
};

static inline float masked(float value, int32_t mask)
{
	return psr_float_from_bits(psr_bits_from_float(value) & (uint32_t)mask);
}

/* What the samples of a row weigh, of 128: [k][i] of pixel i - 1 of the piece in the one before it (k 0), in its own
 * and in the one behind it, by their columns and by their rows. */
struct smooth_weights {
	float across[3][SMOOTH_WIDTH + SMOOTH_RUN], down[3][SMOOTH_WIDTH + SMOOTH_RUN];
	/* By run, and by run and a pixel more on each side. */
	uint8_t has_own[SMOOTH_WIDTH / SMOOTH_RUN + 1], has_any[SMOOTH_WIDTH / SMOOTH_RUN + 1];
};

/* A quadratic B-spline at the eighths 1, 3, 5 and 7 of a pixel: 3/4 - d^2 at a distance d of up to a half of the
 * middle, (3/2 - d)^2 / 2 up to one and a half. */
static inline void weigh_quarter(float *before, float *own, float *after, int32_t quarter, int32_t is_there)
{
	const float from = 2 * (float)quarter + 1, to = 8 - from, off = from - 4;

	*before = masked(to * to, is_there);
	*own = masked(96 - 2 * (off * off), is_there);
	*after = masked(from * from, is_there);
}

/* The same for a run of places. */
static void weigh_run(struct smooth_weights *w, const uint8_t *place, size_t first)
{
	for (size_t i = first; i < first + SMOOTH_RUN; i++) {
		const int32_t code = place[i], is_there = -(code < PSR_PLACE_NONE);

		weigh_quarter(&w->across[0][i], &w->across[1][i], &w->across[2][i], code & 3, is_there);
		weigh_quarter(&w->down[0][i], &w->down[1][i], &w->down[2][i], code >> 2 & 3, is_there);
	}
}

static void weigh_nothing(struct smooth_weights *w, size_t first)
{
	for (int k = 0; k < 3; k++) {
		memset(&w->across[k][first], 0, SMOOTH_RUN * sizeof *w->across[k]);
		memset(&w->down[k][first], 0, SMOOTH_RUN * sizeof *w->down[k]);
	}
}

_Static_assert(SMOOTH_RUN % 8 == 0 && PSR_PLACE_NONE == 16, "as the next two have");

/* Whether any of a run's places, each at most PSR_PLACE_NONE, is one. */
static inline int has_place(const uint8_t *place)
{
	const uint64_t none = UINT64_C(0x1010101010101010);
	uint64_t all = none;

	for (size_t i = 0; i < SMOOTH_RUN; i += 8) {
		uint64_t some;

		memcpy(&some, place + i, sizeof some);
		all &= some;
	}
	return all != none;
}

static inline int has_place_of_two(const uint8_t *place)
{
	return (place[0] & place[1]) != PSR_PLACE_NONE;
}

/* What the weights of an earlier row were stays where both have none. */
static void load_weights(struct smooth_weights *w, const struct smooth_target *t, uint32_t x0, uint32_t n, int64_t y)
{
	const int is_inside = y >= 0 && y < (int64_t)t->height;
	const size_t first = x0 == 0, left = t->width + 1 - x0, end = left < n + 2 ? left : n + 2;
	uint8_t place[SMOOTH_WIDTH + 2 * SMOOTH_RUN];

	memset(place, PSR_PLACE_NONE, sizeof place);
	if (is_inside)
		memcpy(place + first, t->place + (size_t)y * t->width + x0 + first - 1, end - first);
	for (size_t i = 0, k = 0; i < n + 2; i += SMOOTH_RUN, k++) {
		const int has_own = has_place(place + i);

		if (has_own)
			weigh_run(w, place, i);
		else if (w->has_own[k])
			weigh_nothing(w, i);
		w->has_own[k] = (uint8_t)has_own;
		w->has_any[k] = (uint8_t)(has_own | has_place_of_two(place + i + SMOOTH_RUN));
	}
}

/* What a pixel and those around it weigh, by row: their samples, and their parts of the mean. */
struct smooth_shares {
	float row[3][3], whole; /* 1 / the sum of all */
};

static inline float weight_of(const struct smooth_weights *w, int j, int i, size_t x)
{
	return w->across[1 - i][x + (size_t)(1 + i)] * w->down[1 - j][x + (size_t)(1 + i)];
}

/* Of pixel x; `w` points to the three rows around it. The part of a side that does not count is the pixel's. */
static inline void find_shares_around(struct smooth_shares *s, const struct smooth_weights *const *w, size_t x,
                                      const struct smooth_masks *m)
{
	const float side = SMOOTH_MEAN_SIDE;
	const float others = (float)(4 + (m->above + m->below + m->left + m->right));
	float all = 0;

	for (int i = 0; i < 2; i++) {
		s->row[0][2 * i] = masked(weight_of(w[0], -1, 2 * i - 1, x), m->corner[i]);
		s->row[2][2 * i] = masked(weight_of(w[2], 1, 2 * i - 1, x), m->corner[2 + i]);
	}
	s->row[0][1] = masked(weight_of(w[0], -1, 0, x) + side, m->above);
	s->row[1][0] = masked(weight_of(w[1], 0, -1, x) + side, m->left);
	s->row[1][1] = weight_of(w[1], 0, 0, x) + (SMOOTH_MEAN_OWN + side * others);
	s->row[1][2] = masked(weight_of(w[1], 0, 1, x) + side, m->right);
	s->row[2][1] = masked(weight_of(w[2], 1, 0, x) + side, m->below);
	for (int j = 0; j < 3; j++)
		all += (s->row[j][0] + s->row[j][1]) + s->row[j][2];
	s->whole = 1 / all;
}

static inline float add_shares(const float *a, const float *o, const float *b, const struct smooth_shares *s)
{
	const float above = (a[-1] * s->row[0][0] + a[0] * s->row[0][1]) + a[1] * s->row[0][2];
	const float beside = (o[-1] * s->row[1][0] + o[0] * s->row[1][1]) + o[1] * s->row[1][2];
	const float below = (b[-1] * s->row[2][0] + b[0] * s->row[2][1]) + b[1] * s->row[2][2];

	return ((above + beside) + below) * s->whole;
}

static inline void place_run(uint8_t *restrict place, const uint64_t *word, const uint16_t *weight, uint32_t n)
{
	uint32_t low[SMOOTH_RUN], high[SMOOTH_RUN];

	for (uint32_t i = 0; i < n; i++) {
		low[i] = (uint32_t)word[i];
		high[i] = (uint32_t)(word[i] >> 32);
	}
	for (uint32_t i = 0; i < n; i++) {
		const uint32_t is_empty = (low[i] == (uint32_t)PSR_WORD_EMPTY) & (high[i] == (uint32_t)(PSR_WORD_EMPTY >> 32));
		const uint32_t none = 0u - (is_empty | (weight[i] < GAPS_WHOLE / 2));

		place[i] = (uint8_t)((low[i] & (PSR_PLACE_NONE - 1) & ~none) | (PSR_PLACE_NONE & none));
	}
}

static inline void smooth_places(uint8_t *restrict place, const uint64_t *word, const uint16_t *weight, uint32_t n)
{
	const uint32_t whole = n / SMOOTH_RUN * SMOOTH_RUN;

	for (uint32_t x = 0; x < whole; x += SMOOTH_RUN)
		place_run(place + x, word + x, weight + x, SMOOTH_RUN);
	place_run(place + whole, word + whole, weight + whole, n - whole);
}

#endif
