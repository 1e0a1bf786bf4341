#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"
#include "sample/own/kept.h"
#include "sample/thin/choose.h"

#define RADIUS 0.01
#define N_SPOTS 4000
#define N_CANDIDATES 1500

static double next_random(uint64_t *state)
{
	*state ^= *state >> 12;
	*state ^= *state << 25;
	*state ^= *state >> 27;
	return (double)(*state * UINT64_C(2685821657736338717) >> 11) * 0x1p-53;
}

/* Within `reach` of a place, along each axis. */
static void scatter(uint64_t *state, const float around[3], double reach, float p[3])
{
	for (int k = 0; k < 3; k++)
		p[k] = around[k] + (float)((2 * next_random(state) - 1) * reach);
}

static void add_at(struct thin_candidates *list, const float p[3], uint32_t name)
{
	struct thin_candidate candidate = { .surface = name };

	memcpy(candidate.position, p, sizeof candidate.position);
	assert_int_equal(thin_candidates_add(list, &candidate), PSR_OK);
}

static int is_near_any(const struct thin_candidates *list, const struct place *place)
{
	for (uint32_t i = 0; i < list->n; i++)
		if (kept_covers_sheet(list->candidate[i].position, place->p, place->n, (float)RADIUS))
			return 1;
	return 0;
}

/* In a cube so small that candidates cover several places each, and some places have none. */
static void what_is_left_is_what_no_candidate_covers_and_the_rest_is_covered(void **state)
{
	static struct place place[N_SPOTS], all[N_SPOTS];
	static const float middle[3] = { 0.3f, -0.2f, 0.1f };
	struct thin_candidates list = { NULL, 0, 0 }, every = { NULL, 0, 0 };
	uint64_t random = 7;
	size_t n = N_SPOTS, n_left = 0;

	(void)state;
	for (int i = 0; i < N_SPOTS; i++) {
		scatter(&random, middle, 0.1, place[i].p);
		v3f_set(place[i].n, 0, 0, 0);
		place[i].n[i % 3] = 1;
		place[i].surface = (uint32_t)i;
	}
	memcpy(all, place, sizeof all);
	for (uint32_t i = 0; i < N_CANDIDATES; i++) {
		float p[3];

		scatter(&random, middle, 0.1, p);
		add_at(&list, p, i);
		add_at(&every, p, i);
	}
	assert_int_equal(thin_choose(&list, place, &n, RADIUS), PSR_OK);
	for (int i = 0; i < N_SPOTS; i++) {
		int is_left = n_left < n && place[n_left].surface == (uint32_t)i;

		assert_int_equal(is_left, !is_near_any(&every, &all[i]));
		assert_int_equal(is_left, !is_near_any(&list, &all[i]));
		n_left += (size_t)is_left;
	}
	assert_int_equal(n_left, n);
	assert_in_range(n, 1, N_SPOTS - 1);
	assert_in_range(list.n, 1, N_CANDIDATES - 1);
	for (uint32_t i = 1; i < list.n; i++)
		assert_true(list.candidate[i - 1].surface < list.candidate[i].surface);
	free(list.candidate);
	free(every.candidate);
}

/* Crowds of places, each with a candidate in its middle that covers it all and others that do not. */
static void one_candidate_is_chosen_where_one_covers_all(void **state)
{
	enum { CROWDS = 50, OTHERS = 20, SPOTS = 30 };
	static struct place place[CROWDS * SPOTS];
	struct thin_candidates list = { NULL, 0, 0 };
	uint64_t random = 11;
	size_t n = 0;

	(void)state;
	for (uint32_t crowd = 0; crowd < CROWDS; crowd++) {
		const float middle[3] = { (float)crowd * 5 * (float)RADIUS, 0, (float)(crowd % 7) * (float)RADIUS };
		float p[3];

		for (int i = 0; i < SPOTS; i++, n++) {
			scatter(&random, middle, 0.55 * RADIUS, place[n].p); /* 0.55 sqrt(3) < 1 */
			v3f_set(place[n].n, 0, 1, 0);
		}
		/* These are further from the nearer corners than the middle is, and reach no place on the other side. */
		for (int i = 0; i < OTHERS; i++) {
			v3f_set(p, middle[0] + (float)(0.9 * RADIUS * (i % 2 == 0 ? 1 : -1)), middle[1] + (float)(0.01 * RADIUS * i),
			        middle[2]);
			add_at(&list, p, 0);
		}
		add_at(&list, middle, 1);
	}
	assert_int_equal(thin_choose(&list, place, &n, RADIUS), PSR_OK);
	assert_int_equal(n, 0);
	assert_int_equal(list.n, CROWDS);
	for (uint32_t i = 0; i < list.n; i++)
		assert_int_equal(list.candidate[i].surface, 1);
	free(list.candidate);
}

static void nothing_is_chosen_of_nothing(void **state)
{
	struct thin_candidates list = { NULL, 0, 0 };
	struct place place = { { 0, 0, 0 }, { 0, 0, 1 }, 0 };
	static const float far_away[3] = { 0.5f, 0, 0 };
	size_t n = 1;

	(void)state;
	assert_int_equal(thin_choose(&list, &place, &n, RADIUS), PSR_OK);
	assert_int_equal(n, 1);
	n = 0;
	add_at(&list, far_away, 0);
	assert_int_equal(thin_choose(&list, &place, &n, RADIUS), PSR_OK);
	assert_int_equal(list.n, 0);
	free(list.candidate);
}

/* d^2 - 0.4 across^2 <= r^2: along the sheet as far as the radius; across it no further either; at 45 degrees d^2 is
 * 1 / 0.8 of r^2. */
static void across_a_sheet_a_sample_reaches_further_than_a_ball(void **state)
{
	static const float origin[3], n[3] = { 0, 0, 1 };

	(void)state;
	for (int sign = -1; sign <= 1; sign += 2) {
		const float along[2][3] = { { 0.99f * (float)sign, 0, 0 }, { 1.01f * (float)sign, 0, 0 } };
		const float across[2][3] = { { 0, 0, 0.99f * (float)sign }, { 0, 0, 1.01f * (float)sign } };
		const float oblique[2][3] = { { 0.79f, 0, 0.79f * (float)sign }, { 0.80f, 0, 0.80f * (float)sign } };

		for (int i = 0; i < 2; i++) {
			assert_int_equal(kept_covers_sheet(along[i], origin, n, 1), i == 0);
			assert_int_equal(kept_covers_sheet(across[i], origin, n, 1), i == 0);
			assert_int_equal(kept_covers_sheet(oblique[i], origin, n, 1), i == 0);
		}
	}
}

static void cells_remember_places_on_both_sides_of_0_by_the_way_that_they_face(void **state)
{
	static const float WAY[3][3] = { { 0, 0, 0 }, { 0.1f, -0.9f, 0.2f }, { 0.1f, 0.9f, 0.2f } };
	struct place_cells cells;

	(void)state;
	assert_int_equal(place_cells_init(&cells, 0.25), PSR_OK);
	for (int i = -2000; i < 2000; i++) {
		const float p[3] = { (float)i * 0.5f + 0.1f, -0.1f, 0.1f }, beside[3] = { (float)i * 0.5f + 0.3f, -0.1f, 0.1f };
		const float here[3] = { (float)i * 0.5f + 0.2f, -0.2f, 0.2f };

		for (int way = 0; way < 3; way++) {
			assert_int_equal(place_cells_has(&cells, p, WAY[way]), 0);
			assert_int_equal(place_cells_add(&cells, p, WAY[way]), PSR_OK);
			assert_int_equal(place_cells_has(&cells, p, WAY[way]), 1);
			assert_int_equal(place_cells_has(&cells, here, WAY[way]), 1);
			assert_int_equal(place_cells_has(&cells, beside, WAY[way]), 0);
		}
	}
	place_cells_fini(&cells);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(what_is_left_is_what_no_candidate_covers_and_the_rest_is_covered),
		cmocka_unit_test(one_candidate_is_chosen_where_one_covers_all),
		cmocka_unit_test(nothing_is_chosen_of_nothing),
		cmocka_unit_test(across_a_sheet_a_sample_reaches_further_than_a_ball),
		cmocka_unit_test(cells_remember_places_on_both_sides_of_0_by_the_way_that_they_face),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
