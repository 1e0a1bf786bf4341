#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <liblzf/lzf.h>
#include <math.h>
#include "base/srgb.h"
#include "scan.h"

#define MAX_FILE 8192

struct file {
	uint8_t at[MAX_FILE];
	size_t n;
};

static void put(struct file *f, const void *bytes, size_t n)
{
	assert_true(f->n + n <= MAX_FILE);
	memcpy(f->at + f->n, bytes, n);
	f->n += n;
}

static void put_text(struct file *f, const char *text)
{
	put(f, text, strlen(text));
}

static void put_whole(struct file *f, uint64_t x, size_t n)
{
	for (size_t i = 0; i < n; i++)
		put(f, &(uint8_t){ (uint8_t)(x >> 8 * i) }, 1);
}

static void put_float(struct file *f, float x)
{
	uint32_t bits;

	memcpy(&bits, &x, sizeof bits);
	put_whole(f, bits, 4);
}

static struct psr_mesh *accept_pcd(const struct file *f)
{
	return accept(import_pcd, "x.pcd", f->at, f->n);
}

static void refuse_pcd(const struct file *f, int code, const char *part)
{
	refuse_scan(import_pcd, "x.pcd", f->at, f->n, code, part);
}

/* Padding, a float, two unused values, doubles, and a colour. */
static const char *const header =
	"# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS _ x _ y z rgb\nSIZE 1 4 2 8 8 4\nTYPE U F I F F F\n"
	"COUNT 3 1 2 1 1 1\nWIDTH 3\nHEIGHT 2\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 6\n";

/* Field k of point i. */
static void put_field(struct file *f, int k, uint32_t i)
{
	double y = 0.5 + i * (double)i, z = 1 - (double)i;
	uint64_t bits;

	switch (k) {
	case 0:
		put(f, "abc", 3);
		break;
	case 1:
		put_float(f, (float)i + 0.25f);
		break;
	case 2:
		put_whole(f, 0xfffefffdu, 4);
		break;
	case 5:
		put_whole(f, 0xff8000 + i, 4); /* as a float: red all, green half, blue i */
		break;
	default:
		memcpy(&bits, k == 3 ? &y : &z, sizeof bits);
		put_whole(f, bits, 8);
	}
}

static void make_binary(struct file *f)
{
	f->n = 0;
	put_text(f, header);
	put_text(f, "DATA binary\n");
	for (uint32_t i = 0; i < 6; i++)
		for (int k = 0; k < 6; k++)
			put_field(f, k, i);
}

static void make_compressed(struct file *f)
{
	static struct file plain, packed;

	plain.n = 0;
	for (int k = 0; k < 6; k++)
		for (uint32_t i = 0; i < 6; i++)
			put_field(&plain, k, i);
	packed.n = lzf_compress(plain.at, (unsigned)plain.n, packed.at, (unsigned)plain.n - 1);
	assert_true(packed.n > 0);
	f->n = 0;
	put_text(f, header);
	put_text(f, "DATA binary_compressed\n");
	put_whole(f, packed.n, 4);
	put_whole(f, plain.n, 4);
	put(f, packed.at, packed.n);
}

static void make_text(struct file *f)
{
	f->n = 0;
	put_text(f, header);
	put_text(f, "DATA ascii\n");
	for (uint32_t i = 0; i < 6; i++) {
		const uint32_t bits = 0xff8000 + i;
		char line[256];
		float rgb;

		memcpy(&rgb, &bits, sizeof rgb);
		snprintf(line, sizeof line, "97 98 ? %.9g -3 -2 %.17g %.17g %.9g\r\n", i + 0.25, 0.5 + i * (double)i,
		         1 - (double)i, (double)rgb);
		put_text(f, line);
	}
}

static void all_three_forms_of_data_hold_the_same_points(void **state)
{
	static struct file f;

	(void)state;
	for (int form = 0; form < 3; form++) {
		(form == 0 ? make_binary : form == 1 ? make_compressed : make_text)(&f);
		struct psr_mesh *m = accept_pcd(&f);

		assert_int_equal(m->n_points, 6);
		assert_int_equal(m->n_triangles, 0);
		for (uint32_t i = 0; i < 6; i++) {
			const float *c = m->point_color[i];

			assert_true(m->point[i][0] == i + 0.25);
			assert_true(m->point[i][1] == 0.5 + i * (double)i);
			assert_true(m->point[i][2] == 1 - (double)i);
			assert_true(c[0] == 1 && c[1] == psr_srgb_to_linear[128] && c[2] == psr_srgb_to_linear[i] && c[3] == 1);
		}
		assert_true(m->material[0].two_sided && m->material[0].base_color[0] == 1);
		assert_string_equal(m->warning, "");
		psr_mesh_destroy(m);
	}
}

static struct psr_mesh *accept_text(const char *text)
{
	return accept(import_pcd, "x.pcd", text, strlen(text));
}

static void integers_of_all_sizes_are_coordinates(void **state)
{
	static struct file f;

	(void)state;
	f.n = 0;
	put_text(&f, "FIELDS x y z rgba\nSIZE 1 2 8 4\nTYPE I U I U\nWIDTH 2\nHEIGHT 1\nDATA binary\n");
	put_whole(&f, 0xfe, 1);
	put_whole(&f, 0xfffe, 2);
	put_whole(&f, UINT64_MAX - 4, 8);
	put_whole(&f, 0x12ff0080, 4);
	put_whole(&f, 7, 1);
	put_whole(&f, 8, 2);
	put_whole(&f, 9, 8);
	put_whole(&f, 0, 4);
	struct psr_mesh *m = accept_pcd(&f);

	assert_true(m->point[0][0] == -2 && m->point[0][1] == 65534 && m->point[0][2] == -5);
	assert_true(m->point[1][0] == 7 && m->point[1][1] == 8 && m->point[1][2] == 9);
	assert_true(m->point_color[0][0] == 1 && m->point_color[0][1] == 0);
	assert_true(m->point_color[0][2] == psr_srgb_to_linear[128] && m->point_color[0][3] == 1);
	psr_mesh_destroy(m);
	m = accept_text("FIELDS x y z rgb\nTYPE I I I I\nPOINTS 1\nDATA ascii\n1 2 3 -16777216");
	assert_true(m->point_color[0][0] == 0); /* opaque black of 32 bits */
	psr_mesh_destroy(m);
}

static void normals_are_kept_and_points_without_a_place_left_out(void **state)
{
	struct psr_mesh *m;

	(void)state;
	m = accept_text("FIELDS normal_x normal_y normal_z x y z\nPOINTS 3\nDATA ascii\n"
	                "0 0 2 1 2 3\n0 1 0 nan nan nan\n1 0 0 4 5 6\n");
	assert_int_equal(m->n_points, 2);
	assert_int_equal(m->n_dropped_primitives, 1);
	assert_true(m->point_normal[0][2] == 1 && m->point_normal[1][0] == 1);
	assert_null(m->point_color);
	assert_true(m->material[0].base_color[0] == IMPORT_GRAY);
	psr_mesh_destroy(m);
}

static void intensity_is_gray_where_there_is_no_color(void **state)
{
	struct psr_mesh *m;

	(void)state;
	m = accept_text("FIELDS x y z intensity\nPOINTS 5\nDATA ascii\n0 0 0 0\n1 0 0 2.5\n2 0 0 -7\n3 0 0 10\n4 0 0 nan\n");
	for (int c = 0; c < 3; c++) {
		assert_true(m->point_color[0][c] == 0);
		assert_float_equal(m->point_color[1][c], 0.25, 1.0 / 65535);
		assert_true(m->point_color[2][c] == 0);
		assert_true(m->point_color[3][c] == 1);
		assert_true(m->point_color[4][c] == 0);
	}
	psr_mesh_destroy(m);
	m = accept_text("FIELDS x y z intensity\nPOINTS 2\nDATA ascii\n0 0 0 0\n1 0 0 0\n");
	assert_true(m->point_color[0][0] == IMPORT_GRAY);
	psr_mesh_destroy(m);
	m = accept_text("FIELDS x y z rgb intensity\nPOINTS 1\nDATA ascii\n0 0 0 0 9\n");
	assert_true(m->point_color[0][0] == 0);
	psr_mesh_destroy(m);
}

static void a_viewpoint_is_left_aside_with_a_warning(void **state)
{
	struct psr_mesh *m;

	(void)state;
	m = accept_text("FIELDS x y z\nPOINTS 1\nVIEWPOINT 0 0 5 1 0 0 0\nDATA ascii\n1 2 3");
	assert_true(m->point[0][2] == 3);
	assert_non_null(strstr(m->warning, "viewpoint"));
	psr_mesh_destroy(m);
}

static void headers_that_lie_are_refused(void **state)
{
	static const struct {
		const char *text;
		int code;
		const char *part;
	} lies[] = {
		{ "", PSR_ERR_FORMAT, "line 1: the PCD header ends without DATA" },
		{ "FIELDS x y z\nPOINTS 1\n", PSR_ERR_FORMAT, "line 3: the PCD header ends without DATA" },
		{ "POINTS 1\nDATA ascii\n1 2 3\n", PSR_ERR_FORMAT, "no FIELDS" },
		{ "FIELDS\nPOINTS 1\nDATA ascii\n", PSR_ERR_FORMAT, "line 1: FIELDS names no field" },
		{ "FIELDS x y z\nFIELDS x y z\n", PSR_ERR_FORMAT, "line 2: this line stands twice" },
		{ "FIELDS x y z\nCOLUMNS x y z\n", PSR_ERR_FORMAT, "line 2: this line stands twice" },
		{ "SIZE 4\nFIELDS x\n", PSR_ERR_FORMAT, "line 1: SIZE, TYPE and COUNT come after FIELDS" },
		{ "FIELDS x y z\nSIZE 4 4\n", PSR_ERR_FORMAT, "for each of its names" },
		{ "FIELDS x y z\nSIZE 4 4 3\n", PSR_ERR_FORMAT, "a SIZE is" },
		{ "FIELDS x y z\nSIZE 4 4 4.5\n", PSR_ERR_FORMAT, "a SIZE is" },
		{ "FIELDS x y z\nTYPE F F X\n", PSR_ERR_FORMAT, "a TYPE is" },
		{ "FIELDS x y z\nCOUNT 1 1 0\n", PSR_ERR_FORMAT, "a COUNT is" },
		{ "FIELDS x y z\nCOUNT 1 1 65537\n", PSR_ERR_FORMAT, "a COUNT is" },
		{ "FIELDS x y z\nSIZE 4 2 4\nPOINTS 1\nDATA binary\n", PSR_ERR_FORMAT, "a float of 2 bytes" },
		{ "FIELDS x y z\nPOINTS -1\n", PSR_ERR_FORMAT, "take a whole number" },
		{ "FIELDS x y z\nWIDTH nan\n", PSR_ERR_FORMAT, "take a whole number" },
		{ "FIELDS x y z\nVIEWPOINT 0 0 0 one\n", PSR_ERR_FORMAT, "VIEWPOINT takes" },
		{ "FIELDS x y z\nPOINTS 1\nDATA zip\n", PSR_ERR_FORMAT, "line 3: DATA is ascii" },
		{ "FIELDS x y z\nDATA ascii\n1 2 3\n", PSR_ERR_FORMAT, "no points" },
		{ "FIELDS x y z\nPOINTS 0\nDATA ascii\n1 2 3\n", PSR_ERR_FORMAT, "no points" },
		{ "FIELDS x y z\nWIDTH 2\nHEIGHT 2\nPOINTS 5\nDATA ascii\n", PSR_ERR_FORMAT, "5 points, but a width of 2" },
		{ "FIELDS x y z\nWIDTH 2\nHEIGHT 0\nPOINTS 0\nDATA ascii\n", PSR_ERR_FORMAT, "a height of 0" },
		{ "FIELDS x y z\nWIDTH 1e9\nHEIGHT 1e9\nDATA ascii\n", PSR_ERR_LIMIT, "more than" },
		{ "FIELDS x y z\nPOINTS 9e15\nDATA binary_compressed\n12345678", PSR_ERR_LIMIT, "more than" },
		{ "FIELDS x y z\nPOINTS 100000000\nDATA ascii\n1 2 3\n", PSR_ERR_FORMAT, "room for only 1" },
		{ "FIELDS x y z\nPOINTS 2\nDATA binary\n123456789012345678901234", PSR_OK, "" },
		{ "FIELDS x y z\nPOINTS 2\nDATA binary\n12345678901234567890123", PSR_ERR_FORMAT, "room for only 1" },
		{ "FIELDS x y z\nPOINTS 2\nDATA ascii\n1 2 3 4 5\n\n\n", PSR_ERR_FORMAT, "point 2 of 2, below line 3" },
		{ "FIELDS x y z\nPOINTS 1\nDATA ascii\n1 two 3\n", PSR_ERR_FORMAT, "point 1 of 1" },
		{ "FIELDS x y\nPOINTS 1\nDATA ascii\n1 2\n", PSR_ERR_FORMAT, "no field z" },
		{ "FIELDS x y z\nCOUNT 1 1 2\nPOINTS 1\nDATA ascii\n1 2 3 4\n", PSR_ERR_FORMAT, "no field z of one value" },
		{ "FIELDS x y z\nPOINTS 1\nDATA binary_compressed\n1234567", PSR_ERR_FORMAT, "cut short" },
	};

	(void)state;
	for (size_t i = 0; i < sizeof lies / sizeof lies[0]; i++)
		if (lies[i].code == PSR_OK)
			psr_mesh_destroy(accept_text(lies[i].text));
		else
			refuse_scan(import_pcd, "x.pcd", lies[i].text, strlen(lies[i].text), lies[i].code, lies[i].part);
}

static void a_header_of_too_many_fields_is_refused(void **state)
{
	static struct file f;

	(void)state;
	f.n = 0;
	put_text(&f, "FIELDS x y z");
	for (int i = 0; i < 253; i++)
		put_text(&f, " _");
	put_text(&f, "\nPOINTS 1\nDATA ascii\n1 2 3");
	for (int i = 0; i < 253; i++)
		put_text(&f, " 0");
	psr_mesh_destroy(accept_pcd(&f));
	f.n = 0;
	put_text(&f, "FIELDS x y z");
	for (int i = 0; i < 254; i++)
		put_text(&f, " _");
	refuse_pcd(&f, PSR_ERR_FORMAT, "line 1: too many words");
}

static void cut_files_are_refused_at_every_length(void **state)
{
	static struct file f;

	(void)state;
	for (int form = 0; form < 3; form++) {
		(form == 0 ? make_binary : form == 1 ? make_compressed : make_text)(&f);
		const size_t whole = form < 2 ? f.n : f.n - 2 - 1; /* the last number may be shorter, and ends without a line's end */

		for (f.n = 0; f.n < whole; f.n++) {
			struct psr_error err;
			struct psr_mesh *m = read_scan(import_pcd, "x.pcd", f.at, f.n, &err);

			if (form == 2 && m != NULL && f.n > whole - 16) { /* a shorter last number */
				psr_mesh_destroy(m);
				continue;
			}
			assert_null(m);
			assert_int_equal(err.code, PSR_ERR_FORMAT);
		}
	}
}

/* Sizes that claim too much, and each byte of the packed points changed. */
static void compressed_points_that_lie_are_refused(void **state)
{
	static struct file f;
	size_t first;

	(void)state;
	make_compressed(&f);
	first = (size_t)((const uint8_t *)memmem(f.at, f.n, "compressed\n", 11) - f.at) + 11;
	f.at[first + 4] ^= 1;
	refuse_pcd(&f, PSR_ERR_FORMAT, "compressed bytes promise");
	f.at[first + 4] ^= 1;
	f.at[first + 3] = 0x80;
	refuse_pcd(&f, PSR_ERR_FORMAT, "cut short");
	f.at[first + 3] = 0;
	f.at[first + 8] = 0xff; /* refers to what lies before the first byte */
	refuse_pcd(&f, PSR_ERR_FORMAT, "damaged");
	for (size_t at = first + 8; at < f.n; at++)
		for (int bit = 0; bit < 8; bit++) {
			struct psr_error err;

			make_compressed(&f);
			f.at[at] ^= (uint8_t)(1 << bit);
			psr_mesh_destroy(read_scan(import_pcd, "x.pcd", f.at, f.n, &err));
			assert_true(err.code == PSR_OK || err.code == PSR_ERR_FORMAT);
		}
	/* A few bytes that claim gigabytes. */
	f.n = 0;
	put_text(&f, "FIELDS x y z\nPOINTS 100000000\nDATA binary_compressed\n");
	put_whole(&f, 3, 4);
	put_whole(&f, 1200000000, 4);
	put_text(&f, "abc");
	refuse_pcd(&f, PSR_ERR_FORMAT, "3 compressed bytes promise 1200000000");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(all_three_forms_of_data_hold_the_same_points),
		cmocka_unit_test(integers_of_all_sizes_are_coordinates),
		cmocka_unit_test(normals_are_kept_and_points_without_a_place_left_out),
		cmocka_unit_test(intensity_is_gray_where_there_is_no_color),
		cmocka_unit_test(a_viewpoint_is_left_aside_with_a_warning),
		cmocka_unit_test(headers_that_lie_are_refused),
		cmocka_unit_test(a_header_of_too_many_fields_is_refused),
		cmocka_unit_test(cut_files_are_refused_at_every_length),
		cmocka_unit_test(compressed_points_that_lie_are_refused),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
