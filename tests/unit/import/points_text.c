/* Points as lines of numbers. */
#define _GNU_SOURCE
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "points.h"

static struct read r;

static void read_text(const char *name, const char *text)
{
	write_text(name, text);
	read_all(&r, name);
}

static void refuse_text(const char *name, const char *text, const char *words)
{
	write_text(name, text);
	refuse_points(name, PSR_ERR_FORMAT, words);
}

#define assert_at(i, x, y, z) assert_true(r.point[i].at[0] == (x) && r.point[i].at[1] == (y) && r.point[i].at[2] == (z))
#define assert_color(i, a, b, c)                                                                                 \
	assert_true(r.point[i].color[0] == (a) && r.point[i].color[1] == (b) && r.point[i].color[2] == (c))

static void columns_are_told_by_their_number(void **state)
{
	static const struct {
		const char *line;
		int has_color, has_normal;
	} rows[] = {
		{ "1 2 3", 0, 0 },
		{ "1 2 3 40", 1, 0 },
		{ "1 2 3 4 5", 0, 0 },
		{ "1 2 3 255 0 1", 1, 0 },
		{ "1 2 3 0 0.6 -0.8", 0, 1 },
		{ "1 2 3 77 255 0 1", 1, 0 },
		{ "1 2 3 255 0 1 0 0.6 -0.8", 1, 1 },
		{ "1 2 3 77 255 0 1 0 0.6 -0.8", 1, 1 },
	};

	(void)state;
	for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
		read_text("t.xyz", rows[i].line);
		assert_int_equal(r.n, 1);
		assert_at(0, 1.0, 2.0, 3.0);
		assert_int_equal(r.has_color, rows[i].has_color);
		assert_int_equal(r.has_normal, rows[i].has_normal);
		if (rows[i].has_color && i > 1)
			assert_color(0, 255, 0, 1);
		if (rows[i].has_normal)
			assert_true(r.point[0].normal[1] == 0.6f && r.point[0].normal[2] == -0.8f);
	}
}

/* Only where they cannot be anything else are they taken for decimal ones. */
static void commas_are_between_numbers(void **state)
{
	static const char *const lines[] = { "1,2,3", "1, 2, 3", "1 ,2 ,3", "1 , 2 , 3", "1,2,3 255 0 1", "1,2 3", "1.0,2 3", ",1,2,3," };

	(void)state;
	for (size_t i = 0; i < sizeof lines / sizeof *lines; i++) {
		read_text("t.xyz", lines[i]);
		assert_int_equal(r.n, 1);
		assert_at(0, 1.0, 2.0, 3.0);
	}
}

static void a_byte_order_mark_is_passed_over(void **state)
{
	(void)state;
	read_text("t.xyz", "\xef\xbb\xbf" "1 2 3\n4 5 6\n");
	assert_int_equal(r.n, 2);
	assert_at(0, 1.0, 2.0, 3.0);
	read_text("t.csv", "\xef\xbb\xbf" "z,y,x\n3,2,1\n");
	assert_int_equal(r.n, 1);
	assert_at(0, 1.0, 2.0, 3.0);
	read_text("t.pts", "\xef\xbb\xbf" "1\n1 2 3\n");
	assert_int_equal(r.n, 1);
	assert_at(0, 1.0, 2.0, 3.0);
	refuse_text("t.xyz", "\xff\xfe" "1\x20" "2 3\n", "UTF-16; save it as UTF-8");
	refuse_text("t.xyz", "\xef\xbb\xbf", "there are no points");
	refuse_text("t.xyz", "\xef\xbb" "1 2 3\n", "line 1: \"??1\" is not a number");
}

static void columns_are_told_by_their_names(void **state)
{
	(void)state;
	read_text("t.csv", "'Y';'X';'Time';'Z';'Blue';'Green';'Red'\n1,2,9,3,30,20,10\r\n\n 4,5,9,6,60,50,40\n");
	assert_int_equal(r.n, 2);
	assert_at(0, 2.0, 1.0, 3.0);
	assert_at(1, 5.0, 4.0, 6.0);
	assert_color(1, 40, 50, 60);
	read_text("t.asc", "# a scan\n//X Y Z R G B Nx Ny Nz Intensity\n2\n1 2 3 4 5 300 0 0 1 7\n1 2 4 4 5 65535 0 0 1 8\n");
	assert_int_equal(r.n, 2);
	assert_at(0, 1.0, 2.0, 3.0);
	assert_color(1, 0, 0, 255);
	assert_true(r.has_normal && r.point[0].normal[2] == 1.0f);
	refuse_text("t.xyz", "x y z r g b\n1 2 3\n", "line 2: 3 numbers, but the names of columns promise 6");
}

static void colors_of_0_to_1_and_of_16_bits_are_found_out(void **state)
{
	(void)state;
	read_text("t.xyz", "1 2 3 0 0.5 1\n1 2 4 0.25 0 0\n");
	assert_color(0, 0, 128, 255);
	assert_color(1, 64, 0, 0);
	read_text("t.xyz", "1 2 3 0 257 65535\n1 2 4 -1 nan inf\n");
	assert_color(0, 0, 1, 255);
	assert_color(1, 0, 0, 255);
}

static void intensities_are_gray_from_black_to_white(void **state)
{
	(void)state;
	read_text("t.xyz", "1 2 3 -100\n1 2 4 100\n1 2 5 0\n");
	assert_color(0, 0, 0, 0);
	assert_color(1, 255, 255, 255);
	assert_color(2, 188, 188, 188); /* linear 0.5 */
	read_text("t.xyz", "1 2 3 5\n1 2 4 5\n");
	assert_true(r.has_color); /* from 0 to 5 */
	read_text("t.xyz", "1 2 3 0\n1 2 4 0\n");
	assert_false(r.has_color);
}

static void places_keep_every_digit(void **state)
{
	(void)state;
	read_text("t.xyz", "412345.6789012345 5312345.001 -1234.5e-3\n+1e3 .5 5.\n");
	assert_at(0, 412345.6789012345, 5312345.001, -1.2345);
	assert_at(1, 1000.0, 0.5, 5.0);
}

static void points_without_a_finite_place_are_left_out_and_counted(void **state)
{
	(void)state;
	read_text("t.xyz", "nan nan nan\n1 2 3\n1 inf 3\n1e999 1 1\n4 5 6\n");
	assert_int_equal(r.n, 2);
	assert_int_equal(r.left_out, 3);
	assert_at(1, 4.0, 5.0, 6.0);
	refuse_text("t.xyz", "nan 1 1\n1 nan 3\n", "none of its 2 points has a finite place");
}

static void scans_of_pts_come_one_after_the_other(void **state)
{
	(void)state;
	read_text("t.pts", "2\n1 2 3 -5 255 0 1\n4 5 6 7 8 9 10\n0\n1 \n7 8 9 0 0 0 0\n\n");
	assert_int_equal(r.n, 3);
	assert_int_equal(r.promised, 3);
	assert_at(2, 7.0, 8.0, 9.0);
	assert_color(1, 8, 9, 10);
}

#define PTX_HEADER "2\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n"

static void scans_of_ptx_are_put_in_their_places(void **state)
{
	(void)state;
	read_text("t.ptx", PTX_HEADER "1 0 0 0\n0 1 0 0\n0 0 1 0\n100 200 300 1\n1 2 3 0.5\n0 0 0 0.5\n4 5 6 1\n0 0 0 0\n"
	                   PTX_HEADER "0 1 0 0\n-1 0 0 0\n0 0 1 0\n0 0 0 1\n1 2 3 0\n0 0 0 0\n0 0 0 0\n0 0 0 0\n");
	assert_int_equal(r.n, 3);
	assert_true(r.has_color);
	assert_at(0, 101.0, 202.0, 303.0);
	assert_at(1, 104.0, 205.0, 306.0);
	assert_at(2, -2.0, 1.0, 3.0);
	refuse_text("t.ptx", PTX_HEADER "1 0 0 0\n0 1 0 0\n0 0 1 0\n1 2 3 1\n0 0 0 1\n0 0 0 1\n0 0 0 1\n0 0 0 1\n",
	            "no points");
}

static void what_is_wrong_is_named_with_its_line(void **state)
{
	(void)state;
	refuse_text("t.xyz", "1 2 3\n1 2 three\n", "line 2: \"three\" is not a number");
	refuse_text("t.xyz", "1 2 3\n1,5 -2 3,25 \n", "line 2: decimal commas");
	refuse_text("t.xyz", "1,5;2,5;3,5;255;0;0\n", "line 1: decimal commas");
	refuse_text("t.xyz", "1 2 3\n\n1 2", "line 3: 2 numbers, but a point has 3; is the file cut short?");
	refuse_text("t.xyz", "1 2 3 4 5 6\n1 2 3 4 5\n4 5 6 1 2 3\n", "line 2: 5 numbers, but a point has 6");
	refuse_text("t.xyz", "# nothing\n", "no points");
	refuse_text("t.pts", "3\n1 2 3\n4 5 6\n", "line 1 promises 3 points, but the file has only 2 more");
	refuse_text("t.pts", "1\n1 2 3\n4 5 6\n", "line 3: 3 numbers instead of 1, which say how many points come");
	refuse_text("t.pts", "-1\n1 2 3\n", "line 1: -1 is not a number of points");
	refuse_text("t.pts", "1e300\n1 2 3\n", "not a number of points");
	refuse_text("t.pts", "900000000000\n1 2 3\n", "only 1 more");
	refuse_text("t.ptx", "1e12\n1e12\n", "line 2: too many points");
	refuse_text("t.ptx", "1e6\n1e12\n", "line 3: the file ends before a scan begins");
	refuse_text("t.ptx", PTX_HEADER "1 0 0 0\n0 1 0 0\n0 nan 1 0\n", "line 9: the matrix of the scan is not finite");
	refuse_text("t.ptx", PTX_HEADER "1 0 0\n", "line 7: 3 numbers instead of 4");
}

static void a_line_that_never_ends_is_refused(void **state)
{
	const size_t n = 3 << 20;
	char *text = malloc(n);

	(void)state;
	assert_non_null(text);
	memset(text, '1', n);
	memcpy(text, "1 2 3\n", 6);
	write_bytes(path_of("t.xyz"), text, n);
	refuse_points("t.xyz", PSR_ERR_FORMAT, "a line of more than 65536 bytes");
	free(text);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(columns_are_told_by_their_number),
		cmocka_unit_test(commas_are_between_numbers),
		cmocka_unit_test(a_byte_order_mark_is_passed_over),
		cmocka_unit_test(columns_are_told_by_their_names),
		cmocka_unit_test(colors_of_0_to_1_and_of_16_bits_are_found_out),
		cmocka_unit_test(intensities_are_gray_from_black_to_white),
		cmocka_unit_test(places_keep_every_digit),
		cmocka_unit_test(points_without_a_finite_place_are_left_out_and_counted),
		cmocka_unit_test(scans_of_pts_come_one_after_the_other),
		cmocka_unit_test(scans_of_ptx_are_put_in_their_places),
		cmocka_unit_test(what_is_wrong_is_named_with_its_line),
		cmocka_unit_test(a_line_that_never_ends_is_refused),
	};

	return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
