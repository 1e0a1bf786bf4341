#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include "base/mem.h"
#include "base/vec.h"

static void arrays_begin_on_a_cache_line_and_hold_what_was_asked(void **state)
{
	(void)state;
	for (size_t n = 0; n < 300; n += 7) {
		unsigned char *memory = psr_alloc_array(n, 3);

		assert_non_null(memory);
		assert_int_equal((uintptr_t)memory % PSR_ALIGNMENT, 0);
		memset(memory, 0xa5, 3 * n);
		psr_free(memory);
	}
	psr_free(NULL);
}

static void products_that_overflow_get_no_memory(void **state)
{
	volatile size_t half = SIZE_MAX / 2, large = (size_t)1 << 33;

	(void)state;
	assert_null(psr_alloc_array(half, 3));
	assert_null(psr_alloc_array(large, large));
	assert_null(psr_alloc_array(large << 30, 1));
}

static void huge_memory_is_zero_and_aligned_and_ends_where_it_should(void **state)
{
	static const size_t sizes[] = { 1, 4096, 4097, (2 << 20) - 1, 2 << 20, (2 << 20) + 1, 5000001 };

	(void)state;
	assert_null(psr_alloc_huge(0));
	psr_free_huge(NULL, 5);
	for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
		unsigned char *memory = psr_alloc_huge(sizes[i]);

		assert_non_null(memory);
		assert_int_equal((uintptr_t)memory % (sizes[i] >= 2 << 20 ? 2 << 20 : PSR_ALIGNMENT), 0);
		for (size_t at = 0; at < sizes[i]; at += 1021)
			assert_int_equal(memory[at], 0);
		memset(memory, 1, sizes[i]);
		psr_free_huge(memory, sizes[i]);
	}
}

static void matrices_turn_there_and_back(void **state)
{
	/* A turn with rational entries, so that every product below is exact. */
	const double turn[3][3] = { { 0, 1, 0 }, { 0, 0, 1 }, { 1, 0, 0 } };
	double v[3] = { 1, 2, 3 }, w[3], square[3][3];

	(void)state;
	m3d_apply(w, turn, v);
	assert_true(w[0] == 2 && w[1] == 3 && w[2] == 1);
	m3d_apply_transposed(w, turn, w);
	assert_memory_equal(v, w, sizeof v);
	m3d_multiply(square, turn, turn);
	m3d_apply(w, (const double(*)[3])square, v);
	assert_true(w[0] == 3 && w[1] == 1 && w[2] == 2);
	assert_true(m3d_determinant(turn) == 1);
}

static void vectors_do_what_their_names_say(void **state)
{
	float a[3] = { 3, 0, 4 }, b[3] = { 0, 2, 0 }, r[3];

	(void)state;
	v3f_cross(r, a, b);
	assert_true(r[0] == -8 && r[1] == 0 && r[2] == 6);
	assert_true(v3f_dot(a, a) == 25 && v3f_length(a) == 5);
	v3f_add_scaled(r, a, 0.5f, b);
	assert_true(r[0] == 3 && r[1] == 1 && r[2] == 4);
	assert_true(v3f_normalize(r, a) == 5 && r[0] == 3.0f / 5 && r[2] == 4.0f / 5);
}

static void vectors_without_a_direction_are_not_normalised(void **state)
{
	float zero[3] = { 0, 0, 0 }, large[3] = { 3e38f, 0, 0 }, none[3] = { NAN, 0, 0 }, r[3];

	(void)state;
	assert_true(v3f_normalize(r, zero) == 0 && r[0] == 0);
	assert_true(v3f_normalize(r, large) == 0 && r[0] == 3e38f);
	assert_true(v3f_normalize(r, none) == 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(arrays_begin_on_a_cache_line_and_hold_what_was_asked),
		cmocka_unit_test(products_that_overflow_get_no_memory),
		cmocka_unit_test(huge_memory_is_zero_and_aligned_and_ends_where_it_should),
		cmocka_unit_test(matrices_turn_there_and_back),
		cmocka_unit_test(vectors_do_what_their_names_say),
		cmocka_unit_test(vectors_without_a_direction_are_not_normalised),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
