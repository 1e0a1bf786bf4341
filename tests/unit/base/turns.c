/* Turns of threads: how the system is asked for them. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include "base/turns.h"

#define MOST 64

static atomic_int may_end;

static void *wait_for_the_end(void *userdata)
{
	while (!atomic_load(&may_end)) {
		turns_let_others_in();
		sched_yield();
	}
	return userdata;
}

static int allowed(cpu_set_t *set)
{
	assert_int_equal(pthread_getaffinity_np(pthread_self(), sizeof *set, set), 0);
	return CPU_COUNT(set);
}

/* Starts n threads, keeps them apart, and returns how many processors all of them together may use, each counted once
 * a thread. */
static int keep_apart(int n, cpu_set_t *together)
{
	pthread_t thread[MOST];
	int sum = 0;

	atomic_store(&may_end, 0);
	for (int i = 0; i < n; i++)
		assert_int_equal(pthread_create(&thread[i], NULL, wait_for_the_end, NULL), 0);
	turns_keep_apart(thread, n);
	CPU_ZERO(together);
	for (int i = 0; i < n; i++) {
		cpu_set_t own;

		assert_int_equal(pthread_getaffinity_np(thread[i], sizeof own, &own), 0);
		CPU_OR(together, together, &own);
		sum += CPU_COUNT(&own);
	}
	atomic_store(&may_end, 1);
	for (int i = 0; i < n; i++)
		pthread_join(thread[i], NULL);
	return sum;
}

static void as_many_threads_as_processors_have_one_each(void **state)
{
	cpu_set_t all, together;
	const int n = allowed(&all);

	(void)state;
	if (n > MOST)
		skip();
	assert_int_equal(keep_apart(n, &together), n);
	assert_true(CPU_EQUAL(&together, &all));
}

static void more_or_fewer_threads_run_anywhere(void **state)
{
	cpu_set_t all, together;
	const int n = allowed(&all);

	(void)state;
	if (n >= MOST)
		skip();
	assert_int_equal(keep_apart(n + 1, &together), (n + 1) * n);
	if (n > 1)
		assert_int_equal(keep_apart(n - 1, &together), (n - 1) * n);
}

/* As a container does. */
static void processors_that_the_process_may_not_use_are_left_alone(void **state)
{
	cpu_set_t all, one, together;
	int last = CPU_SETSIZE - 1;

	(void)state;
	allowed(&all);
	while (!CPU_ISSET(last, &all))
		last--;
	CPU_ZERO(&one);
	CPU_SET(last, &one);
	assert_int_equal(pthread_setaffinity_np(pthread_self(), sizeof one, &one), 0);
	assert_int_equal(keep_apart(1, &together), 1);
	assert_true(CPU_EQUAL(&together, &one));
	assert_int_equal(pthread_setaffinity_np(pthread_self(), sizeof all, &all), 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(as_many_threads_as_processors_have_one_each),
		cmocka_unit_test(more_or_fewer_threads_run_anywhere),
		cmocka_unit_test(processors_that_the_process_may_not_use_are_left_alone),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
