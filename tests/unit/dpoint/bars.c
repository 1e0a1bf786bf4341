#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdlib.h>
#include <cmocka.h>
#include "base/random.h"
#include "dpoint/bars.h"

#define MOST 60

/* Coarse numbers, so that many are equal. */
static struct bar bar_at_random(uint64_t *seed)
{
	return (struct bar){ { 0.25f * (float)random_below(seed, 16), 0.25f * (float)random_below(seed, 16) }, { 1, 1 } };
}

static int is_nearer(const struct bar *a, float u, float v)
{
	return a->at[0] <= u && a->at[1] <= v;
}

/* All bars that were put, one by one, tell the same as those that are left. */
static void what_is_behind_others_changes_nothing(void **state)
{
	uint64_t seed = 3;

	(void)state;
	for (int turn = 0; turn < 300; turn++) {
		struct bars bars = { .bar = NULL };
		struct bar all[MOST];
		const int n = (int)random_below(&seed, MOST);

		for (int i = 0; i < n; i++) {
			all[i] = bar_at_random(&seed);
			bars_put(&bars, &all[i]);
			for (size_t k = 1; k < bars.n; k++)
				assert_true(bars.bar[k].at[0] > bars.bar[k - 1].at[0] && bars.bar[k].at[1] < bars.bar[k - 1].at[1]);
		}
		for (float u = -0.25f; u < 4.25f; u += 0.125f)
			for (float v = -0.25f; v < 4.25f; v += 0.125f) {
				const float extent[2] = { u, v };
				int is_behind = 0, is_within = 0;

				for (int i = 0; i < n; i++) {
					is_behind |= is_nearer(&all[i], u, v);
					is_within |= all[i].at[0] < u && all[i].at[1] < v;
				}
				assert_int_equal(bars_is_behind(&bars, u, v), is_behind);
				assert_int_equal(bars_are_within(&bars, extent), is_within);
			}
		assert_int_equal(bars.is_failed, 0);
		free(bars.bar);
	}
}

/* No bar is within the rectangle, and no rectangle of those that end at bars is worth more: without an overhang a
 * rectangle's worth is its area. */
static void the_best_rectangle_has_no_bar_within(void **state)
{
	uint64_t seed = 5;

	(void)state;
	for (int turn = 0; turn < 300; turn++) {
		struct bars bars = { .bar = NULL };
		struct bar all[MOST];
		const int n = (int)random_below(&seed, MOST);
		float extent[2] = { 4, 3 }, best = 0;

		for (int i = 0; i < n; i++) {
			all[i] = bar_at_random(&seed);
			bars_put(&bars, &all[i]);
		}
		bars_end(extent, &bars, (const float[2]){ 0, 0 }, 0);
		for (float u = 0; u <= 4; u += 0.25f)
			for (float v = 0; v <= 3; v += 0.25f) {
				int is_free = 1;

				for (int i = 0; i < n; i++)
					is_free &= !(all[i].at[0] < u && all[i].at[1] < v);
				best = is_free && u * v > best ? u * v : best;
			}
		assert_float_equal(extent[0] * extent[1], best, 0);
		for (int i = 0; i < n; i++)
			assert_false(all[i].at[0] < extent[0] && all[i].at[1] < extent[1]);
		free(bars.bar);
	}
}

/* Cells on an axis of the rectangle end it the overhang away. As narrow as that, it would be a sliver, which they
 * cannot end in its length. */
static void a_rectangle_is_no_sliver_along_its_bars(void **state)
{
	const float overhang = 5e-4f;

	(void)state;
	for (int k = 0; k < 2; k++) {
		struct bars bars = { .bar = NULL };
		struct bar bar = { .at = { 0 } };
		float extent[2];

		bar.at[k] = overhang;
		bar.at[1 - k] = 0.004f;
		extent[k] = 0.0016f;
		extent[1 - k] = 0.0442f;
		bars_put(&bars, &bar);
		bars_end(extent, &bars, (const float[2]){ 0, 0 }, overhang);
		assert_float_equal(extent[k], 0.0016f, 0);
		assert_float_equal(extent[1 - k], 0.004f, 0);
		free(bars.bar);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(what_is_behind_others_changes_nothing),
		cmocka_unit_test(the_best_rectangle_has_no_bar_within),
		cmocka_unit_test(a_rectangle_is_no_sliver_along_its_bars),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
