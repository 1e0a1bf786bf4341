#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "shares_sim.h"

static void flows_that_always_want_cores_never_part_by_more_than_an_index_a_core(void **state)
{
	(void)state;
	for (uint64_t seed = 0; seed < 40; seed++) {
		struct sim sim;

		sim_init(&sim, 1 + (int)(seed % MAX_CORES), 2 + (int)(seed % 7), seed);
		for (int i = 0; i < sim.n_flows; i++)
			submit(&sim, endless(i, POOL_RESTING, 10 * US << random_below(&sim.random, 11)));
		while (sim.steps < 10000) {
			uint64_t least = UINT64_MAX, most = 0;

			step(&sim, NEVER);
			for (int i = 0; i < sim.n_flows; i++) {
				least = used(&sim, i) < least ? used(&sim, i) : least;
				most = used(&sim, i) > most ? used(&sim, i) : most;
			}
			assert_in_range(most - least, 0, bound_of(&sim));
		}
	}
}

/* Frames of 5 loops with serial parts, two at a time, beside endless loops: indices of 20 us to 20 ms. */
static void shares_are_equal_in_any_two_seconds(void **state)
{
	static const uint64_t index_us[] = { 20, 200, 2000, 20000 };
	struct sim sim;

	(void)state;
	for (int n_cores = 1; n_cores <= 3; n_cores++) {
		uint64_t history[4][64];

		sim_init(&sim, n_cores, 4, 1);
		for (int k = 0; k < 64; k++) {
			for (uint64_t until = sim.now + 100 * MS; sim.now < until; step(&sim, until)) {
				for (int i = 0; i < 4; i++) {
					int n_live = 0;

					for (int j = 0; j < MAX_JOBS; j++)
						n_live += sim.job[j].is_live && sim.job[j].flow == i;
					for (; n_live < 4; n_live++)
						submit(&sim, (struct kind){ .flow = i, .class = POOL_MOVING, .n = 16, .phases = 5,
						                            .serial_ns = index_us[i] * US / 2, .index_ns = index_us[i] * US });
				}
			}
			for (int i = 0; i < 4; i++) {
				history[i][k] = used(&sim, i);
				if (k >= 20)
					assert_in_range(history[i][k] - history[i][k - 20], (uint64_t)n_cores * 450 * MS,
					                (uint64_t)n_cores * 550 * MS);
			}
		}
	}
}

static struct kind random_kind(struct sim *sim, int flow)
{
	struct kind kind = { .flow = flow };

	kind.class = (enum pool_class)random_below(&sim->random, 3);
	kind.n = 1 + random_below(&sim->random, 40);
	kind.phases = 1 + random_below(&sim->random, 6);
	kind.serial_ns = 1 * US << random_below(&sim->random, 11);
	kind.index_ns = 1 * US << random_below(&sim->random, 13);
	return kind;
}

/* Work conservation and refining's place are asserted in step(). */
static void random_jobs_keep_cores_busy_and_refining_last(void **state)
{
	uint64_t steps = 0;

	(void)state;
	for (uint64_t seed = 0; steps < 1000000; seed++) {
		struct sim sim;

		sim_init(&sim, 1 + (int)(seed % MAX_CORES), 2 + (int)(seed % 7), seed);
		while (sim.steps < 10000) {
			int n_live = 0;

			for (int i = 0; i < MAX_JOBS; i++)
				n_live += sim.job[i].is_live;
			if (n_live < MAX_JOBS && random_below(&sim.random, 40) == 0)
				submit(&sim, random_kind(&sim, (int)random_below(&sim.random, (uint32_t)sim.n_flows)));
			step(&sim, sim.now + 5 * MS);
		}
		steps += sim.steps;
	}
}

static void a_flow_that_wakes_waits_for_one_index(void **state)
{
	(void)state;
	for (uint64_t seed = 0; seed < 80; seed++) {
		struct sim sim;

		sim_init(&sim, 1 + (int)(seed % 4), 5, seed);
		for (int i = 1; i < 5; i++)
			submit(&sim, endless(i, i == 4 ? POOL_REFINING : POOL_RESTING, 5 * MS >> random_below(&sim.random, 8)));
		for (int k = 0; k < 50; k++) {
			/* long enough for the others to use as much as its last frame took */
			while (!is_idle(&sim, 0))
				step(&sim, NEVER);
			run_until(&sim, sim.now + 5 * MS + random_below(&sim.random, 10000000));
			submit(&sim, (struct kind){ .class = POOL_MOVING, .n = 8, .phases = 3, .serial_ns = 50 * US,
			                            .index_ns = 20 * US });
		}
		assert_in_range(sim.longest_wait, 0, sim.longest);
	}
}

static void idle_time_is_not_saved_up(void **state)
{
	struct sim sim;
	uint64_t before;

	(void)state;
	sim_init(&sim, 2, 2, 1);
	submit(&sim, endless(0, POOL_MOVING, 1 * MS));
	run_until(&sim, 10000 * MS);
	submit(&sim, endless(1, POOL_MOVING, 1 * MS));
	before = used(&sim, 0);
	run_until(&sim, 10100 * MS);
	assert_in_range(used(&sim, 1), 100 * MS - bound_of(&sim), 100 * MS + bound_of(&sim));
	assert_in_range(used(&sim, 0) - before, 100 * MS - bound_of(&sim), 100 * MS + bound_of(&sim));
}

/* Flow 0 has a serial part of 10 s; then it wants all cores. */
static void a_flow_that_could_use_one_core_is_owed_little(void **state)
{
	struct sim sim;
	uint64_t before;

	(void)state;
	sim_init(&sim, 4, 2, 1);
	submit(&sim, (struct kind){ .class = POOL_MOVING, .n = 1000000, .phases = 1, .serial_ns = 4000 * MS, .index_ns = 1 * MS });
	submit(&sim, endless(1, POOL_MOVING, 1 * MS));
	while (!sim.job[0].is_in_loop)
		step(&sim, NEVER);
	before = used(&sim, 1);
	run_until(&sim, sim.now + 100 * MS);
	sim.longest = 1 * MS; /* from here on */
	assert_in_range(used(&sim, 1) - before, 200 * MS - SHARES_OWED_NS - bound_of(&sim), 200 * MS);
}

/* Flow 1 refined for seconds on idle cores: that is not held against it. */
static void refining_on_idle_cores_costs_no_share(void **state)
{
	struct sim sim;
	uint64_t before;

	(void)state;
	sim_init(&sim, 2, 2, 1);
	submit(&sim, endless(1, POOL_REFINING, 1 * MS));
	run_until(&sim, 5000 * MS);
	submit(&sim, endless(0, POOL_MOVING, 1 * MS));
	submit(&sim, endless(1, POOL_MOVING, 1 * MS));
	before = used(&sim, 1);
	run_until(&sim, 5200 * MS);
	assert_in_range(used(&sim, 1) - before, 200 * MS - bound_of(&sim), 200 * MS + bound_of(&sim));
}

static void within_a_flow_moving_comes_before_rest_and_older_before_younger(void **state)
{
	struct shares shares;
	struct shares_flow flow;
	struct shares_claim rest, first, second;

	(void)state;
	shares_init(&shares);
	shares_flow_init(&flow);
	shares_enter(&shares, &rest, &flow, POOL_RESTING, 0);
	shares_enter(&shares, &first, &flow, POOL_MOVING, 0);
	shares_enter(&shares, &second, &flow, POOL_MOVING, 0);
	shares_want(&shares, &rest, 1, 0);
	assert_ptr_equal(shares_best(&shares, 0), &rest);
	shares_begin(&rest, 0);
	assert_null(shares_rival(&shares, &rest, 0));
	shares_want(&shares, &second, 1, 0);
	assert_ptr_equal(shares_rival(&shares, &rest, 0), &second);
	shares_want(&shares, &first, 1, 0);
	assert_ptr_equal(shares_best(&shares, 0), &first);
	shares_end(&rest, 0, 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(flows_that_always_want_cores_never_part_by_more_than_an_index_a_core),
		cmocka_unit_test(shares_are_equal_in_any_two_seconds),
		cmocka_unit_test(random_jobs_keep_cores_busy_and_refining_last),
		cmocka_unit_test(a_flow_that_wakes_waits_for_one_index),
		cmocka_unit_test(idle_time_is_not_saved_up),
		cmocka_unit_test(a_flow_that_could_use_one_core_is_owed_little),
		cmocka_unit_test(refining_on_idle_cores_costs_no_share),
		cmocka_unit_test(within_a_flow_moving_comes_before_rest_and_older_before_younger),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
