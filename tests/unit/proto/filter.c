/* The row filter: worked examples of PROTOCOL.md, and round trips of all shapes. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "base/random.h"
#include "psr/proto.h"

static void color_is_byte_differences_in_place(void **state)
{
	static const uint8_t in[18] = { 10, 20, 30, 11, 18, 30, 0, 255, 31, 9, 20, 40, 9, 20, 40, 8, 21, 39 };
	static const uint8_t expected[18] = { 10, 20, 30, 1, 254, 0, 245, 237, 1, 255, 0, 10, 0, 0, 0, 255, 1, 255 };
	uint8_t out[18];

	(void)state;
	psr_filter_rows(out, in, 3, 2, 3, 1);
	assert_memory_equal(out, expected, 18);
}

static void depth_is_word_differences_in_byte_planes(void **state)
{
	/* Rows 1.0, 1.5 and +inf, 1.0: 3f800000 3fc00000 / 7f800000 3f800000. */
	static const uint8_t in[16] = { 0, 0, 0x80, 0x3f, 0, 0, 0xc0, 0x3f, 0, 0, 0x80, 0x7f, 0, 0, 0x80, 0x3f };
	/* Differences 3f800000 00400000 / 40000000 c0000000, each row as four planes of two bytes. */
	static const uint8_t expected[16] = { 0, 0, 0, 0, 0x80, 0x40, 0x3f, 0, 0, 0, 0, 0, 0, 0, 0x40, 0xc0 };
	uint8_t out[16];

	(void)state;
	psr_filter_rows(out, in, 2, 2, 1, 4);
	assert_memory_equal(out, expected, 16);
}

static void components_of_a_pixel_are_apart(void **state)
{
	/* Two normals in one row: (1, 2, 3), (0, 2, 0x103) as i16. */
	static const uint8_t in[12] = { 1, 0, 2, 0, 3, 0, 0, 0, 2, 0, 3, 1 };
	static const uint8_t expected[12] = { 1, 2, 3, 0xff, 0, 0, 0, 0, 0, 0xff, 0, 1 };
	uint8_t out[12];

	(void)state;
	psr_filter_rows(out, in, 2, 1, 3, 2);
	assert_memory_equal(out, expected, 12);
}

static void every_shape_comes_back(void **state)
{
	static const unsigned component_bytes[] = { 1, 2, 4, 8 };
	uint64_t random = 3;

	(void)state;
	for (unsigned b = 0; b < 4; b++)
		for (unsigned c = 1; c <= 3; c++)
			for (uint32_t w = 1; w <= 19; w += w < 4 ? 1 : 5)
				for (uint32_t h = 1; h <= 4; h++) {
					size_t n = (size_t)w * h * c * component_bytes[b];
					uint8_t *in = malloc(n), *mid = malloc(n), *out = malloc(n);

					assert_true(in && mid && out);
					for (size_t i = 0; i < n; i++)
						in[i] = (uint8_t)random_next(&random);
					psr_filter_rows(mid, in, w, h, c, component_bytes[b]);
					psr_unfilter_rows(out, mid, w, h, c, component_bytes[b]);
					assert_memory_equal(in, out, n);
					free(in);
					free(mid);
					free(out);
				}
}

static void a_constant_plane_is_zero_but_for_its_first_pixel(void **state)
{
	uint8_t in[6 * 5 * 4], out[6 * 5 * 4];

	(void)state;
	for (size_t i = 0; i < sizeof in; i++)
		in[i] = (uint8_t)(0x11 * (i % 4 + 1));
	psr_filter_rows(out, in, 6, 5, 1, 4);
	for (size_t i = 0; i < sizeof out; i++)
		assert_int_equal(out[i], i < 24 && i % 6 == 0 ? 0x11 * (i / 6 + 1) : 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(color_is_byte_differences_in_place),
		cmocka_unit_test(depth_is_word_differences_in_byte_planes),
		cmocka_unit_test(components_of_a_pixel_are_apart),
		cmocka_unit_test(every_shape_comes_back),
		cmocka_unit_test(a_constant_plane_is_zero_but_for_its_first_pixel),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
