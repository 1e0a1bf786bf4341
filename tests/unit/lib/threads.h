/* Which tests the thread sanitizer runs. Include after cmocka.h. */
#ifndef TESTS_UNIT_LIB_THREADS_H
#define TESTS_UNIT_LIB_THREADS_H

/* Call before cmocka_run_group_tests(): under the thread sanitizer, only tests with "thread" in their names run. The
 * others of such a program draw on one thread, take ten times as long there, and could show it nothing. */
static inline void only_threads_under_tsan(void)
{
#ifdef __SANITIZE_THREAD__
	cmocka_set_test_filter("*thread*");
#endif
}

#endif
