#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <fenv.h>
#include <pthread.h>
#include <signal.h>
#include <string.h>
#include "psr/error.h"
#include "base/fiber.h"

struct walk {
	struct fiber *fiber;
	int n_steps, at;
	pthread_t seen[8]; /* the thread of each step */
};

static void step_by_step(void *userdata)
{
	struct walk *walk = userdata;
	int own = 0; /* on the fiber's stack */

	for (; own < walk->n_steps; own++) {
		walk->at = own;
		walk->seen[own] = pthread_self();
		fiber_leave(walk->fiber);
	}
}

static void *enter(void *userdata)
{
	struct walk *walk = userdata;

	return fiber_enter(walk->fiber) ? walk : NULL;
}

static void it_goes_on_where_it_left_on_any_thread(void **state)
{
	struct walk walk = { .n_steps = 8 };
	pthread_t thread;
	void *result;

	(void)state;
	assert_int_equal(fiber_create(&walk.fiber), PSR_OK);
	fiber_set(walk.fiber, step_by_step, &walk);
	for (int i = 0; i < 8; i++) {
		assert_int_equal(pthread_create(&thread, NULL, enter, &walk), 0);
		assert_int_equal(pthread_join(thread, &result), 0);
		assert_non_null(result);
		assert_int_equal(walk.at, i);
		assert_true(pthread_equal(walk.seen[i], thread));
	}
	assert_int_equal(fiber_enter(walk.fiber), 0); /* the function returns on this thread */
	fiber_destroy(walk.fiber);
}

static void it_runs_one_function_after_the_other(void **state)
{
	struct walk walk = { .n_steps = 1 };

	(void)state;
	assert_int_equal(fiber_create(&walk.fiber), PSR_OK);
	for (int i = 0; i < 100; i++) {
		fiber_set(walk.fiber, step_by_step, &walk);
		assert_int_equal(fiber_enter(walk.fiber), 1);
		assert_int_equal(fiber_enter(walk.fiber), 0);
	}
	fiber_destroy(walk.fiber);
	assert_int_equal(fiber_create(&walk.fiber), PSR_OK);
	fiber_destroy(walk.fiber); /* it never ran */
	fiber_destroy(NULL);
}

static void use_stack(void *userdata)
{
	volatile unsigned char block[1 << 20];

	memset((void *)block, 7, sizeof block);
	*(int *)userdata = block[sizeof block - 1];
}

static void it_has_a_megabyte_of_stack(void **state)
{
	struct fiber *fiber;
	int value = 0;

	(void)state;
	assert_int_equal(fiber_create(&fiber), PSR_OK);
	fiber_set(fiber, use_stack, &value);
	assert_int_equal(fiber_enter(fiber), 0);
	assert_int_equal(value, 7);
	fiber_destroy(fiber);
}

struct surroundings {
	struct fiber *fiber;
	int rounding[2], blocks_usr1;
};

static void look_around(void *userdata)
{
	struct surroundings *s = userdata;
	sigset_t mask;

	s->rounding[0] = fegetround();
	fiber_leave(s->fiber);
	s->rounding[1] = fegetround();
	pthread_sigmask(SIG_SETMASK, NULL, &mask);
	s->blocks_usr1 = sigismember(&mask, SIGUSR1);
}

static void it_has_the_default_rounding_and_the_signals_of_its_first_thread(void **state)
{
	struct surroundings s = { 0 };
	sigset_t mask;

	(void)state;
	assert_int_equal(fiber_create(&s.fiber), PSR_OK);
	fiber_set(s.fiber, look_around, &s);
	fesetround(FE_UPWARD);
	assert_int_equal(fiber_enter(s.fiber), 1);
	assert_int_equal(fegetround(), FE_UPWARD);
	sigemptyset(&mask);
	sigaddset(&mask, SIGUSR1);
	pthread_sigmask(SIG_BLOCK, &mask, NULL);
	assert_int_equal(fiber_enter(s.fiber), 0);
	assert_int_equal(fegetround(), FE_UPWARD);
	fesetround(FE_TONEAREST);
	pthread_sigmask(SIG_SETMASK, NULL, &mask);
	assert_true(sigismember(&mask, SIGUSR1));
	assert_int_equal(s.rounding[0], FE_TONEAREST);
	assert_int_equal(s.rounding[1], FE_TONEAREST);
	assert_false(s.blocks_usr1);
	fiber_destroy(s.fiber);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(it_goes_on_where_it_left_on_any_thread),
		cmocka_unit_test(it_runs_one_function_after_the_other),
		cmocka_unit_test(it_has_a_megabyte_of_stack),
		cmocka_unit_test(it_has_the_default_rounding_and_the_signals_of_its_first_thread),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
