/* Which cells suit a rectangle. */
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <string.h>
#include <cmocka.h>
#include "base/random.h"
#include "dpoint/rectangle.h"

static float real(uint64_t *seed, float low, float high)
{
	return (float)random_in(seed, (double)low, (double)high);
}

static void candidate_at_random(struct dpoint_candidate *c, uint64_t *seed)
{
	float away[3];

	*c = (struct dpoint_candidate){ .part = 1, .delta = { 0.125f, 0.125f } };
	for (int k = 0; k < 3; k++) {
		c->point.at[k] = real(seed, -1, 1);
		c->point.normal[k] = real(seed, -1, 1);
		away[k] = real(seed, -1, 1);
	}
	v3f_normalize(c->point.normal, c->point.normal);
	v3f_cross(c->point.u, c->point.normal, away);
	v3f_normalize(c->point.u, c->point.u);
	c->point.lambda_u = ldexpf(random_below(seed, 2) == 0 ? 1 : -1, (int)random_below(seed, 14) - 3);
	c->point.lambda_u *= real(seed, 1, 2);
	c->point.rho = real(seed, -1, 1);
}

/* A cell that is off by up to 1.2 times what may be. */
static void cell_at_random(struct dpoint_cell *cell, float at[3], const struct rectangle *r, float angle, uint64_t *seed)
{
	const float off = real(seed, -1.2f * r->height, 1.2f * r->height), turn = real(seed, 0, 1.2f * angle);
	float n[3], across[3], tilt[3], normal[3];

	for (int k = 0; k < 2; k++)
		at[k] = real(seed, -1.5f * r->extent[k], 1.5f * r->extent[k]);
	at[2] = dpoint_height_at(r->lambda_u, r->rho, at[0], at[1]) + off;
	dpoint_normal_at(n, r->lambda_u, r->rho, at[0], at[1]);
	v3f_normalize(n, n);
	for (int k = 0; k < 3; k++)
		tilt[k] = real(seed, -1, 1);
	v3f_cross(across, n, tilt);
	v3f_normalize(across, across);
	for (int k = 0; k < 3; k++)
		n[k] = cosf(turn) * n[k] + sinf(turn) * across[k];
	for (int k = 0; k < 3; k++)
		normal[k] = n[0] * r->axis[0][k] + n[1] * r->axis[1][k] + n[2] * r->axis[2][k];
	*cell = (struct dpoint_cell){ .part = 1 };
	v3f_normalize(cell->normal, normal);
}

/* More than a quarter of those that suit are told, also where the angle is hardly more than what rounding allows. */
static void what_surely_suits_does(void **state)
{
	static const float angle[] = { 0.0101f, 0.035f, 0.3f, 1, 3.2f };
	uint64_t seed = 11;

	(void)state;
	for (size_t a = 0; a < sizeof angle / sizeof *angle; a++) {
		const struct dpoint_cover_options options = { .sine = dpoint_sine(0.01), .angle = angle[a], .height = 1e-3f };
		int n_suit = 0, n_sure = 0;
		struct looking look;

		looking_init(&look, NULL, NULL, &options);
		for (int i = 0; i < 200000; i++) {
			struct dpoint_candidate c;
			struct dpoint_cell cell;
			struct rectangle r;
			float at[3], off;

			candidate_at_random(&c, &seed);
			rectangle_of(&r, &c, &options);
			cell_at_random(&cell, at, &r, fminf(angle[a], 1.5f), &seed);
			off = fabsf(at[2] - dpoint_height_at(r.lambda_u, r.rho, at[0], at[1]));
			if (rectangle_surely_suits(&look, &r, &cell, at)) {
				assert_true(rectangle_suits_off(&look, &r, &cell, at, off));
				n_sure++;
			}
			n_suit += rectangle_suits_off(&look, &r, &cell, at, off);
		}
		assert_true(4 * n_sure > n_suit);
	}
}

static void what_is_of_another_look_or_beyond_does_not_surely_suit(void **state)
{
	const struct dpoint_cover_options options = { .sine = dpoint_sine(0.01), .angle = 0.1f, .height = 1e-3f };
	const struct dpoint_candidate c = { .point = { .normal = { 0, 0, 1 }, .u = { 1, 0, 0 } },
		                                .delta = { 0.125f, 0.125f } };
	const float middle[3] = { 0, 0, 0 };
	struct dpoint_cell cell = { .normal = { 0, 0, 1 } };
	struct looking look;
	struct rectangle r;

	(void)state;
	looking_init(&look, NULL, NULL, &options);
	rectangle_of(&r, &c, &options);
	assert_true(rectangle_surely_suits(&look, &r, &cell, middle));
	cell.attr = 1ull << 32;
	assert_false(rectangle_surely_suits(&look, &r, &cell, middle));
	cell.attr = 0;
	cell.part = DPOINT_BEYOND;
	assert_false(rectangle_surely_suits(&look, &r, &cell, middle));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(what_surely_suits_does),
		cmocka_unit_test(what_is_of_another_look_or_beyond_does_not_surely_suit),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
