/* The memory of models: who leaves, who waits for room, in which order. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "server/models/catalogue.h"
#include "fixture.h"

static char folder[PATH_MAX];
static struct catalogue catalogue;
static struct catalogue_model *model[4];
static uint64_t bytes; /* of each */

static void scan(void)
{
	struct catalogue_listing *listing;

	assert_int_equal(catalogue_scan(&listing, folder, NULL), PSR_OK);
	catalogue_adopt(&catalogue, listing);
}

static struct catalogue_model *load(const char *name)
{
	struct psr_model *plate = plate_create((uint32_t)name[0]);
	struct catalogue_model *added;
	const struct catalogue_loaded loaded = { .entry = catalogue_find(&catalogue, name), .model = plate, .key = "",
		                                     .reserved = psr_model_bytes(plate) };

	bytes = loaded.reserved;
	assert_int_equal(catalogue_reserve(&catalogue, bytes, name, NULL), PSR_OK);
	assert_int_equal(catalogue_add(&added, &catalogue, &loaded), PSR_OK);
	return added;
}

/* Models a, b, c, d, each with one user, in a memory for four. */
static int set_up(void **state)
{
	static const char *const names[] = { "a", "b", "c", "d" };
	char name[32];

	(void)state;
	folder_make(folder);
	catalogue_init(&catalogue, 1 << 30);
	for (int i = 0; i < 4; i++) {
		snprintf(name, sizeof name, "%s.psr", names[i]);
		file_write(folder, name, "x", 1);
	}
	scan();
	for (int i = 0; i < 4; i++)
		model[i] = load(names[i]);
	catalogue.max_bytes = 4 * bytes;
	return 0;
}

static int tear_down(void **state)
{
	(void)state;
	for (int i = 0; i < 4; i++)
		catalogue_unref(&catalogue, model[i]);
	catalogue_fini(&catalogue);
	folder_remove(folder);
	return 0;
}

static void expect_there(const char *expected)
{
	char there[5] = "";

	for (int i = 0; i < 4; i++)
		if (model[i]->model != NULL)
			there[strlen(there)] = (char)('a' + i);
	assert_string_equal(there, expected);
	assert_int_equal(catalogue.n_models, strlen(expected));
	assert_int_equal(catalogue.bytes, strlen(expected) * bytes);
}

static void bring(int i)
{
	assert_int_equal(catalogue_reserve(&catalogue, bytes, "x", NULL), PSR_OK);
	catalogue_return(&catalogue, model[i], plate_create((uint32_t)('a' + i)), bytes);
}

static void room_is_made_in_order_of_last_use_but_for_pinned_models(void **state)
{
	(void)state;
	catalogue_pin(&catalogue, model[1]);
	catalogue_pin(&catalogue, model[0]);
	catalogue_unpin(&catalogue, model[0]);
	assert_int_equal(catalogue.pinned, bytes);
	assert_int_equal(catalogue_make_room(&catalogue, 1), bytes);
	expect_there("abd");
	assert_int_equal(catalogue_make_room(&catalogue, bytes + 1), 2 * bytes);
	expect_there("b");
	assert_int_equal(catalogue_make_room(&catalogue, 1), 0);
	catalogue_unpin(&catalogue, model[1]);
	assert_int_equal(catalogue_make_room(&catalogue, 5 * bytes), bytes);
	expect_there("");
	assert_int_equal(catalogue.pinned, 0);
}

static void a_model_that_left_keeps_its_name_and_comes_back(void **state)
{
	(void)state;
	catalogue_make_room(&catalogue, bytes);
	expect_there("bcd");
	assert_int_equal(model[0]->card.n_samples, PLATE_SAMPLES);
	assert_ptr_equal(catalogue_model(catalogue_find(&catalogue, "a"), 0, 0), model[0]);
	assert_false(catalogue_is_loaded(catalogue_find(&catalogue, "a")));
	scan();
	assert_ptr_equal(catalogue_find(&catalogue, "a")->model, model[0]);
	catalogue_pin(&catalogue, model[0]); /* before it comes */
	bring(0);
	expect_there("abcd");
	assert_int_equal(catalogue.pinned, bytes);
	catalogue_make_room(&catalogue, 4 * bytes);
	expect_there("a");
	catalogue_unpin(&catalogue, model[0]);
}

static void what_cannot_come_back_leaves_last(void **state)
{
	(void)state;
	file_write(folder, "a.psr", "changed", 7);
	scan();
	assert_null(model[0]->entry);
	catalogue_make_room(&catalogue, 3 * bytes);
	expect_there("a");
	catalogue_make_room(&catalogue, bytes);
	expect_there("");
}

static void reading_the_same_again_brings_the_model_back(void **state)
{
	struct catalogue_model *again;

	(void)state;
	catalogue_make_room(&catalogue, 4 * bytes);
	again = load("b");
	assert_ptr_equal(again, model[1]);
	expect_there("b");
	catalogue_unref(&catalogue, again);
}

static void a_reservation_that_cannot_succeed_moves_nobody_out(void **state)
{
	struct psr_error error;

	(void)state;
	catalogue_pin(&catalogue, model[0]);
	assert_int_equal(catalogue_reserve(&catalogue, 4 * bytes, "x", &error), PSR_ERR_BUSY);
	assert_int_equal(catalogue_reserve(&catalogue, 4 * bytes + 1, "x", &error), PSR_ERR_LIMIT);
	expect_there("abcd");
	assert_int_equal(catalogue_reserve(&catalogue, 3 * bytes, "x", &error), PSR_OK);
	expect_there("a");
	assert_int_equal(catalogue_reserve(&catalogue, 1, "x", &error), PSR_ERR_BUSY);
	catalogue_release(&catalogue, 3 * bytes);
	catalogue_unpin(&catalogue, model[0]);
}

/* ---- claims ---- */

struct wait {
	struct catalogue_claim claim;
	uint64_t n;
	char name;
};

static char order[8]; /* of those that got their room */

static int try(void *userdata)
{
	struct wait *wait = userdata;

	if (catalogue_reserve(&catalogue, wait->n, "x", NULL) == PSR_ERR_BUSY)
		return 0;
	catalogue_unclaim(&catalogue, &wait->claim);
	order[strlen(order)] = wait->name;
	return 1;
}

static int try_quietly(void *userdata)
{
	struct wait *wait = userdata;

	if (catalogue_reserve(&catalogue, wait->n, "x", NULL) == PSR_ERR_BUSY)
		return 0;
	catalogue_unclaim(&catalogue, &wait->claim);
	wait->name = 'g'; /* got it */
	return 1;
}

static void claim(struct wait *wait, char name, uint64_t n)
{
	*wait = (struct wait){ .claim = { .try = try, .userdata = wait }, .n = n, .name = name };
	catalogue_claim(&catalogue, &wait->claim);
}

static void who_waits_for_room_gets_it_in_order_of_arrival(void **state)
{
	struct wait large, small, none;

	(void)state;
	memset(order, 0, sizeof order);
	catalogue_pin(&catalogue, model[0]);
	catalogue_pin(&catalogue, model[1]);
	claim(&large, 'L', 3 * bytes);
	claim(&small, 's', bytes); /* which would fit */
	claim(&none, 'n', 0);
	assert_string_equal(order, "");
	catalogue_unpin(&catalogue, model[1]);
	assert_string_equal(order, "L");
	catalogue_release(&catalogue, 3 * bytes);
	assert_string_equal(order, "Lsn");
	catalogue_release(&catalogue, bytes);
	catalogue_unpin(&catalogue, model[0]);
}

static void who_gives_up_lets_the_next_one_in(void **state)
{
	struct wait large, small;

	(void)state;
	memset(order, 0, sizeof order);
	catalogue_pin(&catalogue, model[0]);
	claim(&large, 'L', 4 * bytes);
	claim(&small, 's', bytes);
	assert_string_equal(order, "");
	catalogue_unclaim(&catalogue, &large.claim);
	assert_string_equal(order, "s");
	catalogue_release(&catalogue, bytes);
	catalogue_unpin(&catalogue, model[0]);
}

static void nobody_is_overtaken_for_ever(void **state)
{
	struct wait large;
	int n = 0;

	(void)state;
	assert_true(catalogue_overtake(&catalogue)); /* nobody waits */
	catalogue_pin(&catalogue, model[0]);
	claim(&large, 'L', 4 * bytes);
	while (n <= 1000 && catalogue_overtake(&catalogue))
		n++;
	assert_int_equal(n, 256);
	catalogue_unpin(&catalogue, model[0]);
	assert_true(catalogue_overtake(&catalogue));
	catalogue_release(&catalogue, 4 * bytes);
}

/* Users of a memory for four who claim room for one to three models, hold it for a while, or give up, in any order: it is
 * never more than there is, and whoever does not give up gets it. */
static void in_any_order_all_get_room_and_never_too_much(void **state)
{
	enum { N = 16 };
	static struct user {
		struct wait wait;
		enum { OUT, WAITS, HAS } now;
	} user[N];
	uint32_t seed = 1;
	int n_waiting = 0;

	(void)state;
	for (int step = 0; step < 200000 || n_waiting > 0; step++) {
		struct user *u;

		seed = seed * 1664525u + 1013904223u;
		u = &user[(seed >> 16) % N];
		if (u->now == OUT && step < 200000) {
			u->wait = (struct wait){ .n = (1 + (seed >> 8) % 3) * bytes, .name = 0 };
			u->wait.claim = (struct catalogue_claim){ .try = try_quietly, .userdata = &u->wait };
			u->now = WAITS;
			catalogue_claim(&catalogue, &u->wait.claim);
		} else if (u->now == HAS) {
			catalogue_release(&catalogue, u->wait.n);
			u->now = OUT;
		} else if (u->now == WAITS && seed >> 30 == 0 && step < 200000) {
			catalogue_unclaim(&catalogue, &u->wait.claim);
			u->now = OUT;
		}
		n_waiting = 0;
		for (int i = 0; i < N; i++) {
			if (user[i].now == WAITS && user[i].wait.name == 'g')
				user[i].now = HAS;
			n_waiting += user[i].now == WAITS;
		}
		assert_true(catalogue.bytes + catalogue.reserved <= catalogue.max_bytes);
		assert_true(step < 300000);
	}
	for (int i = 0; i < N; i++)
		if (user[i].now == HAS)
			catalogue_release(&catalogue, user[i].wait.n);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(room_is_made_in_order_of_last_use_but_for_pinned_models, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_model_that_left_keeps_its_name_and_comes_back, set_up, tear_down),
		cmocka_unit_test_setup_teardown(what_cannot_come_back_leaves_last, set_up, tear_down),
		cmocka_unit_test_setup_teardown(reading_the_same_again_brings_the_model_back, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_reservation_that_cannot_succeed_moves_nobody_out, set_up, tear_down),
		cmocka_unit_test_setup_teardown(who_waits_for_room_gets_it_in_order_of_arrival, set_up, tear_down),
		cmocka_unit_test_setup_teardown(who_gives_up_lets_the_next_one_in, set_up, tear_down),
		cmocka_unit_test_setup_teardown(nobody_is_overtaken_for_ever, set_up, tear_down),
		cmocka_unit_test_setup_teardown(in_any_order_all_get_room_and_never_too_much, set_up, tear_down),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
