/* Patches of exact surfaces. Include after cmocka.h. */
#ifndef TESTS_DPOINT_PATCHES_H
#define TESTS_DPOINT_PATCHES_H

#include <math.h>
#include "dpoint/patch.h"

#define ROOT_HALF 0.70710678118654752440

/* A whole turn as four quadratic quarters. */
static const double turn_knots[12] = { 0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4 };
static const double half_turn_knots[8] = { 0, 0, 0, 1, 1, 2, 2, 2 };
static const double turn[9][3] = { /* x, y, weight */
	{ 1, 0, 1 }, { 1, 1, ROOT_HALF }, { 0, 1, 1 }, { -1, 1, ROOT_HALF }, { -1, 0, 1 },
	{ -1, -1, ROOT_HALF }, { 0, -1, 1 }, { 1, -1, ROOT_HALF }, { 1, 0, 1 },
};

struct revolved {
	double control[81][4];
	struct dpoint_patch patch;
};

/* The circle's points from..from + n - 1, scaled by r and moved out by `out`, turned around z: n is 9 for a torus, 5
 * from point 6 on for a sphere. Outside is outside. */
static inline void revolve(struct revolved *s, double out, double r, int from, int n)
{
	for (int i = 0; i < 9; i++)
		for (int j = 0; j < n; j++) {
			const double *a = turn[i], *b = turn[(from + j) % 8];
			double *p = s->control[i * n + j];

			p[0] = a[0] * (out + r * b[0]);
			p[1] = a[1] * (out + r * b[0]);
			p[2] = r * b[1];
			p[3] = a[2] * b[2];
		}
	s->patch = (struct dpoint_patch){ { 2, 2 }, { 9, (uint32_t)n }, { turn_knots, n == 9 ? turn_knots : half_turn_knots },
		(const double (*)[4])s->control };
}

/* A cylinder around z: height from -1 to 1. */
static inline void cylinder(struct revolved *s, double r)
{
	static const double line[4] = { 0, 0, 1, 1 };

	for (int i = 0; i < 9; i++)
		for (int j = 0; j < 2; j++) {
			double *p = s->control[i * 2 + j];

			p[0] = r * turn[i][0];
			p[1] = r * turn[i][1];
			p[2] = 2 * j - 1;
			p[3] = turn[i][2];
		}
	s->patch = (struct dpoint_patch){ { 2, 1 }, { 9, 2 }, { turn_knots, line }, (const double (*)[4])s->control };
}

/* z = (a x^2 + 2 b x y + c y^2) / 2 over -1..1, as a Bezier patch. */
static inline void quadric(struct revolved *s, double a, double b, double c)
{
	static const double bezier[6] = { 0, 0, 0, 1, 1, 1 };
	static const double square[3] = { 1, -1, 1 }; /* t^2 */

	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++) {
			double *p = s->control[i * 3 + j];

			p[0] = i - 1;
			p[1] = j - 1;
			p[2] = 0.5 * (a * square[i] + 2 * b * p[0] * p[1] + c * square[j]);
			p[3] = 1;
		}
	s->patch = (struct dpoint_patch){ { 2, 2 }, { 3, 3 }, { bezier, bezier }, (const double (*)[4])s->control };
}

#endif
