/* The pacer before simulated links, servers and users. --table prints what each link gets. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdio.h>
#include <string.h>
#include "tests/unit/lib/pace_world.h"

#define FPS 30.0
#define SETTLE_S 1.5

static const struct world plain = { .mbit = 30, .rtt_ms = 10, .draw_ms = 12, .decode_ms = 3, .cost_low = 1,
	                                .cost_high = 1, .move_s = 8, .total_s = 8 };

static const struct pace_wish wish = { .fps = FPS, .width = 1920, .height = 1080, .least_quality = 30,
	                                   .most_quality = 85, .most_scale = 4, .pass_limit = 4 };

static const double rates[] = { 1, 3, 10, 30, 100, 300, 1000 }, ways[] = { 0, 10, 50, 100, 300 };
#define N_RATES (sizeof rates / sizeof rates[0])
#define N_WAYS (sizeof ways / sizeof ways[0])

static double least_draw_ms(const struct world *world)
{
	return world->draw_ms * WORLD_NO_SMOOTH / (wish.most_scale * wish.most_scale);
}

/* Of the coarsest frame that the wish accepts. */
static double least_link_ms(const struct world *world)
{
	return 8e-3 * world->cost_high * world_bytes(wish.most_scale, wish.least_quality) / world->mbit;
}

/* Frames a second that can be had: link and server take so long, and two are under way at once. Where the way is too
 * long for the wished rate, each may work for PACE_WORK_FRAMES. */
static double feasible(const struct world *world)
{
	const double link_ms = least_link_ms(world), draw_ms = least_draw_ms(world);
	const double least_ms = draw_ms + link_ms + world->decode_ms / (wish.most_scale * wish.most_scale);
	const double way_ms = world->rtt_ms + world->jitter_ms, work_ms = PACE_WORK_FRAMES * 1e3 / FPS;
	double ms = 1e3 / FPS, cycle_ms = way_ms + least_ms;

	if (way_ms + work_ms > PACE_WINDOW * ms && cycle_ms < way_ms + work_ms)
		cycle_ms = way_ms + work_ms;
	ms = link_ms > ms ? link_ms : ms;
	ms = draw_ms > ms ? draw_ms : ms;
	return 1e3 / (cycle_ms / PACE_WINDOW > ms ? cycle_ms / PACE_WINDOW : ms);
}

static void print_row(struct world world)
{
	struct world_figures f;

	world_run(&world, &wish, 1);
	f = world_figures(SETTLE_S, world.total_s);
	printf("%7.0f %5.0f %6.0f | %6.1f %8.1f | %6.1f %6.1f | %5.2f %7u %7.1f %7.0f |", world.mbit, world.rtt_ms,
	       world.jitter_ms, f.fps, feasible(&world), f.p50_ms, f.p99_ms, f.scale, f.n_changes, f.quality, f.bytes);
	world.move_s = 2;
	world.rest_s = 9;
	world.total_s = 11;
	world_run(&world, &wish, 1);
	printf(" %7.0f\n", world_found()->sharp_ms);
}

static void print_table(void)
{
	printf("%7s %5s %6s | %6s %8s | %6s %6s | %5s %7s %7s %7s | %7s\n", "Mbit/s", "rtt", "jitter", "fps", "feasible",
	       "p50 ms", "p99 ms", "scale", "changes", "quality", "bytes", "sharp");
	for (unsigned r = 0; r < N_RATES; r++)
		for (unsigned w = 0; w < N_WAYS * 2; w++) {
			struct world world = plain;

			world.mbit = rates[r];
			world.rtt_ms = ways[w / 2];
			world.jitter_ms = w % 2 ? 10 : 0;
			print_row(world);
		}
}

/* ---- claims ---- */

/* A frame waits for at most one other, and takes its own time. Each takes at most a frame time on the link as foreseen;
 * the scene may have become dearer since; or it is the coarsest, and the link is slow. Jitter comes both ways. */
static double latency_bound_ms(const struct world *world)
{
	const double foreseen_ms = 1e3 / FPS * world->cost_high / world->cost_low, least_ms = least_link_ms(world);

	return world->rtt_ms + 2 * world->jitter_ms + 2 * (least_ms > foreseen_ms ? least_ms : foreseen_ms);
}

static void every_link(void (*claim)(struct world *world))
{
	for (unsigned r = 0; r < N_RATES; r++)
		for (unsigned w = 0; w < N_WAYS; w++)
			for (int jitter = 0; jitter < 2; jitter++) {
				struct world world = plain;

				world.mbit = rates[r];
				world.rtt_ms = ways[w];
				world.jitter_ms = jitter ? 10 : 0;
				claim(&world);
			}
}

static void fail_on(const struct world *world, const char *what, double found, const char *relation, double bound)
{
	fail_msg("%s is %g, expected %s %g, at %g Mbit/s, %g ms, jitter %g ms", what, found, relation, bound, world->mbit,
	         world->rtt_ms, world->jitter_ms);
}

#define assert_at_least(value, bound, world) \
	((value) >= (bound) ? (void)0 : fail_on(world, #value, (double)(value), "at least", (double)(bound)))
#define assert_at_most(value, bound, world) \
	((value) <= (bound) ? (void)0 : fail_on(world, #value, (double)(value), "at most", (double)(bound)))

static void holds_rate(struct world *world)
{
	const double surprise = world->cost_high / world->cost_low;
	struct world_figures f;

	world_run(world, &wish, 7);
	f = world_figures(SETTLE_S, world->total_s);
	assert_at_least(f.fps, 0.9 * feasible(world), world);
	assert_at_most(f.fps, 1.02 * FPS, world);
	assert_at_most(f.p99_ms, latency_bound_ms(world), world);
	assert_at_most(f.gap_ms, 1.6e3 / f.fps + 2 * world->jitter_ms + 2e3 / FPS * (surprise - 1), world);
	if (surprise == 1)
		assert_at_most(f.n_changes, world->total_s, world); /* one a second */
	assert_at_most(world_found()->most_open, PACE_WINDOW, world);
	assert_at_most(world_found()->most_unacked, PACE_WINDOW, world);
	assert_int_equal(world_found()->n_backwards, 0);
}

static void the_wished_rate_is_held_with_bounded_latency_on_every_link(void **state)
{
	(void)state;
	every_link(holds_rate);
}

static void holds_rate_of_changing_scenes(struct world *world)
{
	world->cost_low = 0.5;
	world->cost_high = 2;
	holds_rate(world);
}

static void scenes_that_cost_four_times_as_much_change_the_sharpness_not_the_rate(void **state)
{
	(void)state;
	every_link(holds_rate_of_changing_scenes);
}

static void becomes_sharp(struct world *world)
{
	const double sharp_s = 8e-6 * WORLD_SHARP_BYTES / world->mbit;
	double bound_ms;

	world->move_s = 1.1;
	world->rest_s = 1.5 * sharp_s + 2;
	world->total_s = 3 * (world->move_s + world->rest_s);
	world_run(world, &wish, 3);
	/* the request; a full window; its first frame; the server's pause; the sharp frame itself */
	bound_ms = 50 + world->rtt_ms + latency_bound_ms(world) + 100 + world->draw_ms + world->decode_ms + 1e3 * sharp_s +
	           1e3 * WORLD_SHARP_BYTES / WORLD_CODE_RATE;
	assert_int_equal(world_found()->n_late, 0);
	assert_int_equal(world_found()->n_rests, 3);
	assert_int_equal(world_found()->n_sharp, 3);
	assert_true(world_found()->is_last_shown);
	assert_at_most(world_found()->sharp_ms, bound_ms, world);
	assert_int_equal(world_found()->n_backwards, 0);
}

static void at_rest_the_sharp_frame_is_asked_for_within_100_ms_and_comes(void **state)
{
	(void)state;
	every_link(becomes_sharp);
}

static void falls_and_rises(struct world *world)
{
	const double falls_s = 4, rises_s = 8;
	struct world slow = *world;
	struct world_figures before, during, after;

	if (world->mbit < 30)
		return; /* a tenth of it carries no movement */
	slow.mbit /= 10;
	world->slow_from_s = falls_s;
	world->slow_to_s = rises_s;
	world->move_s = world->total_s = 14;
	world_run(world, &wish, 5);
	before = world_figures(SETTLE_S, falls_s);
	during = world_figures(falls_s + SETTLE_S, rises_s);
	after = world_figures(rises_s + SETTLE_S, world->total_s);
	assert_at_least(during.fps, 0.9 * feasible(&slow), world);
	assert_at_most(during.p99_ms, latency_bound_ms(&slow), world);
	assert_at_least(after.fps, 0.9 * feasible(world), world);
	assert_at_most(after.p99_ms, latency_bound_ms(world), world);
	if (world->jitter_ms == 0) /* with jitter, rungs change */
		assert_at_least(after.bytes, 0.95 * before.bytes, world);
	/* two frames of the old size stand before the slow link, no more */
	assert_at_most(world_found()->most_queue_ms, PACE_WINDOW * 10 * 1e3 / FPS, world);
}

static void a_link_that_falls_to_a_tenth_is_followed_down_and_up(void **state)
{
	(void)state;
	every_link(falls_and_rises);
}

static void draws_slowly(struct world *world)
{
	struct world_figures f;

	world->draw_ms = world->rtt_ms < 50 ? 200 : 100;
	world_run(world, &wish, 9);
	f = world_figures(SETTLE_S, world->total_s);
	assert_at_least(f.fps, 0.9 * feasible(world), world);
	assert_at_most(f.p99_ms, latency_bound_ms(world) + 2 * world->draw_ms / 16, world);
}

static void a_slow_server_draws_smaller_pictures(void **state)
{
	(void)state;
	every_link(draws_slowly);
}

static void a_slow_client_decodes_smaller_pictures(void **state)
{
	struct world world = plain;
	struct world_figures f;

	(void)state;
	world.mbit = 1000;
	world.decode_ms = 40;
	world_run(&world, &wish, 9);
	f = world_figures(SETTLE_S, world.total_s);
	assert_at_least(f.fps, 0.9 * feasible(&world), &world);
	assert_true(f.scale == 2);
}

static void a_slower_server_draws_as_many_as_it_can(void **state)
{
	struct world world = plain;
	struct world_figures f;

	(void)state;
	world.mbit = 1000;
	world.draw_ms = 3200;
	world_run(&world, &wish, 9);
	f = world_figures(SETTLE_S, world.total_s);
	assert_at_least(f.fps, 0.9 * 1e3 / (world.draw_ms / 16 * WORLD_NO_SMOOTH), &world);
	assert_at_most(f.p99_ms, world.rtt_ms + 2.2 * world.draw_ms / 16 * WORLD_NO_SMOOTH, &world);
}

static void moves_jerkily(struct world *world)
{
	world->move_s = 0.13;
	world->rest_s = 0.11;
	world->total_s = 8.16; /* ends moving: 34 turns */
	world_run(world, &wish, 11);
	assert_int_equal(world_found()->n_late, 0);
	assert_at_least(world_found()->n_asked, 33, world);
	assert_at_most(world_found()->most_unacked, PACE_WINDOW, world);
	assert_int_equal(world_found()->n_backwards, 0);
	assert_at_least(world_figures(SETTLE_S, world->total_s).fps, 2, world);
}

static void a_movement_in_jerks_never_chokes(void **state)
{
	(void)state;
	every_link(moves_jerkily);
}

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_wished_rate_is_held_with_bounded_latency_on_every_link),
		cmocka_unit_test(scenes_that_cost_four_times_as_much_change_the_sharpness_not_the_rate),
		cmocka_unit_test(at_rest_the_sharp_frame_is_asked_for_within_100_ms_and_comes),
		cmocka_unit_test(a_link_that_falls_to_a_tenth_is_followed_down_and_up),
		cmocka_unit_test(a_slow_server_draws_smaller_pictures),
		cmocka_unit_test(a_slow_client_decodes_smaller_pictures),
		cmocka_unit_test(a_slower_server_draws_as_many_as_it_can),
		cmocka_unit_test(a_movement_in_jerks_never_chokes),
	};

	if (argc > 1 && strcmp(argv[1], "--table") == 0) {
		print_table();
		return 0;
	}
	return cmocka_run_group_tests(tests, NULL, NULL);
}
