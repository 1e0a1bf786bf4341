#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "base/srgb.h"
#include <unistd.h>
#include "import/cloud/las_source.h"
#include "scan.h"

#define MAX_FILE 8192

/* Bytes of a point of each format, and where its color stands. */
static const unsigned size_of[11] = { 20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67 };
static const unsigned color_of[11] = { 0, 0, 20, 28, 0, 28, 0, 30, 30, 0, 30 };

struct file {
	uint8_t at[MAX_FILE];
	size_t n;
	unsigned minor, format;
};

static void put(struct file *f, size_t at, int n, uint64_t x)
{
	for (int i = 0; i < n; i++)
		f->at[at + (size_t)i] = (uint8_t)(x >> 8 * i);
}

static void put_double(struct file *f, size_t at, double x)
{
	uint64_t bits;

	memcpy(&bits, &x, sizeof bits);
	put(f, at, 8, bits);
}

static size_t header_of(const struct file *f)
{
	return f->minor >= 4 ? 375 : f->minor == 3 ? 235 : 227;
}

static size_t point_at(const struct file *f, unsigned i)
{
	return header_of(f) + 54 + 10 + (size_t)i * (size_of[f->format] + 3);
}

/* n points with three bytes of their own each, behind one variable length record of 10 bytes; millimetres at survey
 * coordinates. Point i is at (i, i * i, -i) mm from there, intensity 100 * i. */
static void make(struct file *f, unsigned minor, unsigned format, unsigned n)
{
	memset(f, 0, sizeof *f);
	f->minor = minor;
	f->format = format;
	memcpy(f->at, "LASF", 4);
	put(f, 24, 1, 1);
	put(f, 25, 1, minor);
	put(f, 94, 2, header_of(f));
	put(f, 96, 4, point_at(f, 0));
	put(f, 100, 4, 1);
	put(f, 104, 1, format);
	put(f, 105, 2, size_of[format] + 3);
	put(f, 107, 4, format < 6 ? n : 0);
	for (int c = 0; c < 3; c++) {
		put_double(f, 131 + 8 * (size_t)c, 0.001);
		put_double(f, 155 + 8 * (size_t)c, c == 0 ? 412345.5 : c == 1 ? 5312345.25 : -100);
	}
	if (minor >= 4)
		put(f, 247, 8, n);
	put(f, header_of(f) + 20, 2, 10);
	f->n = point_at(f, n);
	assert_true(f->n <= MAX_FILE);
	for (unsigned i = 0; i < n; i++) {
		const size_t p = point_at(f, i);

		put(f, p, 4, i);
		put(f, p + 4, 4, i * i);
		put(f, p + 8, 4, (uint32_t)-(int)i);
		put(f, p + 12, 2, 100 * i);
		put(f, p + (format >= 6 ? 16 : 15), 1, 2); /* ground */
	}
}

static void color(struct file *f, unsigned i, unsigned r, unsigned g, unsigned b)
{
	put(f, point_at(f, i) + color_of[f->format], 2, r);
	put(f, point_at(f, i) + color_of[f->format] + 2, 2, g);
	put(f, point_at(f, i) + color_of[f->format] + 4, 2, b);
}

static struct psr_mesh *accept_las(const struct file *f)
{
	return accept(import_las, "x.las", f->at, f->n);
}

static void refuse_las(const struct file *f, int code, const char *part)
{
	refuse_scan(import_las, "x.las", f->at, f->n, code, part);
}

static void every_version_and_point_format_keeps_its_millimetres(void **state)
{
	(void)state;
	static struct file f;

	for (unsigned minor = 2; minor <= 4; minor++)
		for (unsigned format = 0; format < 11; format++) {
			make(&f, minor, format, 9);
			if (minor < 4)
				put(&f, 107, 4, 9);
			struct psr_mesh *m = accept_las(&f);

			assert_int_equal(m->n_points, 9);
			for (unsigned i = 0; i < 9; i++) {
				assert_true(m->point[i][0] == i * 0.001 + 412345.5);
				assert_true(m->point[i][1] == i * i * 0.001 + 5312345.25);
				assert_true(m->point[i][2] == -(double)i * 0.001 - 100);
			}
			psr_mesh_destroy(m);
		}
}

static void colors_of_16_bits_are_srgb_coded(void **state)
{
	(void)state;
	static struct file f;

	for (unsigned format = 2; format < 11; format++) {
		if (color_of[format] == 0)
			continue;
		make(&f, 4, format, 3);
		color(&f, 0, 65535, 0, 128 * 257);
		color(&f, 1, 256, 128 * 257, 65535);
		struct psr_mesh *m = accept_las(&f);
		const float *c = m->point_color[0];

		assert_true(c[0] == 1 && c[1] == 0 && c[2] == psr_srgb_to_linear[128] && c[3] == 1);
		/* between two codes: 256 / 257 of the first */
		assert_true(fabs(m->point_color[1][0] - psr_srgb_to_linear[1] * 256.0 / 257) < 1e-9);
		assert_true(m->material[0].base_color[0] == 1 && m->material[0].two_sided);
		psr_mesh_destroy(m);
	}
}

static void colors_of_8_bits_in_16_are_found_out(void **state)
{
	(void)state;
	static struct file f;

	make(&f, 2, 3, 3);
	color(&f, 0, 255, 0, 128);
	struct psr_mesh *m = accept_las(&f);

	assert_true(m->point_color[0][0] == 1 && m->point_color[0][2] == psr_srgb_to_linear[128]);
	assert_true(m->point_color[1][0] == 0);
	psr_mesh_destroy(m);
}

static void intensity_is_gray_where_there_is_no_color(void **state)
{
	(void)state;
	static struct file f;

	for (unsigned format = 0; format < 4; format++) { /* those with room for colors have none in them */
		make(&f, 2, format, 5);
		struct psr_mesh *m = accept_las(&f);

		for (unsigned i = 0; i < 5; i++)
			for (int c = 0; c < 3; c++)
				assert_true(m->point_color[i][c] == (float)(i / 4.0));
		psr_mesh_destroy(m);
	}
	make(&f, 2, 0, 5);
	for (unsigned i = 0; i < 5; i++)
		put(&f, point_at(&f, i) + 12, 2, 0);
	struct psr_mesh *m = accept_las(&f);

	assert_null(m->point_color);
	assert_true(m->material[0].base_color[0] == IMPORT_GRAY);
	psr_mesh_destroy(m);
}

static void noise_and_withheld_points_are_left_out_and_counted(void **state)
{
	(void)state;
	static struct file f;

	make(&f, 2, 1, 9);
	put(&f, point_at(&f, 1) + 15, 1, 7);
	put(&f, point_at(&f, 2) + 15, 1, 18);
	put(&f, point_at(&f, 3) + 15, 1, 0x80 | 2);
	put(&f, point_at(&f, 4) + 15, 1, 0x60 | 2); /* synthetic and key-point: kept */
	struct psr_mesh *m = accept_las(&f);

	assert_int_equal(m->n_points, 6);
	assert_int_equal(m->n_dropped_primitives, 3);
	assert_non_null(strstr(m->warning, "left out: 3"));
	assert_true(m->point[1][0] == 4 * 0.001 + 412345.5);
	psr_mesh_destroy(m);
	make(&f, 4, 7, 9);
	put(&f, point_at(&f, 1) + 16, 1, 7);
	put(&f, point_at(&f, 2) + 16, 1, 18);
	put(&f, point_at(&f, 3) + 15, 1, 4);
	put(&f, point_at(&f, 4) + 15, 1, 0xfb);
	put(&f, point_at(&f, 5) + 16, 1, 7 + 32); /* a class of its own here */
	m = accept_las(&f);
	assert_int_equal(m->n_points, 6);
	psr_mesh_destroy(m);
	for (unsigned i = 0; i < 9; i++)
		put(&f, point_at(&f, i) + 16, 1, 7);
	refuse_las(&f, PSR_ERR_FORMAT, "9 lines and points were left out");
}

static void compressed_files_name_the_tool_to_unpack_them(void **state)
{
	(void)state;
	static struct file f;

	make(&f, 2, 1, 3);
	put(&f, 104, 1, 128 + 1);
	refuse_las(&f, PSR_ERR_UNSUPPORTED, "laszip -i");
	make(&f, 4, 6, 3);
	memcpy(f.at + header_of(&f) + 2, "laszip encoded", 14);
	refuse_las(&f, PSR_ERR_UNSUPPORTED, "pdal translate");
	refuse_scan(import_las, "x.LAZ", "????", 4, PSR_ERR_UNSUPPORTED, "las2las");
}

static void headers_that_lie_are_refused(void **state)
{
	(void)state;
	static struct file f;
	static const struct {
		unsigned minor, at;
		int n;
		uint64_t value;
		int code;
		const char *part;
	} lies[] = {
		{ 2, 0, 4, 0, PSR_ERR_FORMAT, "LASF" },
		{ 2, 24, 1, 2, PSR_ERR_UNSUPPORTED, "2.2" },
		{ 2, 25, 1, 5, PSR_ERR_UNSUPPORTED, "1.5" },
		{ 2, 94, 2, 226, PSR_ERR_FORMAT, "226 bytes" },
		{ 4, 94, 2, 374, PSR_ERR_FORMAT, "374 bytes" },
		{ 2, 94, 2, 65535, PSR_ERR_FORMAT, "65535 bytes" },
		{ 2, 96, 4, 226, PSR_ERR_FORMAT, "byte 226" },
		{ 2, 96, 4, 0xffffffff, PSR_ERR_FORMAT, "byte 4294967295" },
		{ 2, 100, 4, 2, PSR_ERR_FORMAT, "2 variable length records, but there is room for only 1" },
		{ 2, 100, 4, 0xffffffff, PSR_ERR_FORMAT, "room for only 1" },
		{ 2, 227 + 20, 2, 11, PSR_ERR_FORMAT, "reaches into the points" },
		{ 2, 104, 1, 11, PSR_ERR_UNSUPPORTED, "point format 11" },
		{ 2, 105, 2, 27, PSR_ERR_FORMAT, "27 bytes, but point format 1 takes 28" },
		{ 2, 105, 2, 0, PSR_ERR_FORMAT, "0 bytes" },
		{ 2, 107, 4, 4, PSR_ERR_FORMAT, "4 points, but the file has room for only 3" },
		{ 2, 107, 4, 0, PSR_ERR_FORMAT, "no points" },
		{ 4, 247, 8, UINT64_MAX, PSR_ERR_FORMAT, "18446744073709551615 points" },
		{ 2, 131, 8, 0, PSR_ERR_FORMAT, "scale or offset of x" },
		{ 2, 139, 8, UINT64_C(0x7ff0000000000000), PSR_ERR_FORMAT, "scale or offset of y" },
		{ 2, 171, 8, UINT64_C(0x7ff8000000000000), PSR_ERR_FORMAT, "scale or offset of z" },
	};

	for (size_t i = 0; i < sizeof lies / sizeof lies[0]; i++) {
		make(&f, lies[i].minor, 1, 3);
		put(&f, lies[i].at, lies[i].n, lies[i].value);
		refuse_las(&f, lies[i].code, lies[i].part);
	}
}

static void cut_files_are_refused_at_every_length(void **state)
{
	(void)state;
	static struct file f;

	for (unsigned minor = 2; minor <= 4; minor++) {
		make(&f, minor, 3, 3);
		/* the last point's own bytes are a part of it */
		for (f.n = 0; f.n < point_at(&f, 3); f.n++)
			refuse_las(&f, PSR_ERR_FORMAT, "");
	}
}

static void coordinates_that_overflow_are_left_out(void **state)
{
	(void)state;
	static struct file f;

	make(&f, 2, 0, 5);
	put_double(&f, 131, 1e300);
	put(&f, point_at(&f, 2), 4, 0x7fffffff);
	struct psr_mesh *m = accept_las(&f);

	assert_int_equal(m->n_points, 4);
	assert_int_equal(m->n_dropped_primitives, 1);
	psr_mesh_destroy(m);
}

/* Opens the first n bytes of the file as a source. */
static int open_source(struct octree_source *source, const struct file *f, size_t n, struct psr_error *err)
{
	char path[] = "/tmp/psr-las-XXXXXX";
	const int fd = mkstemp(path);
	int rc;

	assert_true(fd >= 0 && write(fd, f->at, n) == (ssize_t)n);
	close(fd);
	rc = las_source_open(source, path, err);
	source->name = "x.las";
	unlink(path);
	return rc;
}

static void a_source_gives_the_points_of_the_mesh_and_gives_them_again(void **state)
{
	(void)state;
	for (unsigned minor = 0; minor <= 4; minor++)
		for (unsigned format = 0; format < (minor >= 4 ? 11 : minor == 3 ? 6 : minor == 2 ? 4 : 2); format++)
			for (int gray = 0; gray < 2; gray++) {
				struct octree_source source;
				struct octree_point point[10];
				struct psr_mesh *m;
				struct file f;
				size_t n;

				make(&f, minor, format, 9);
				for (unsigned i = 0; i < 9 && color_of[format] > 0 && !gray; i++)
					color(&f, i, 1000 * i, 65535 - i, 300);
				put(&f, point_at(&f, 3) + (format >= 6 ? 16 : 15), 1, 7); /* noise */
				m = accept_las(&f);
				assert_int_equal(open_source(&source, &f, f.n, NULL), PSR_OK);
				assert_int_equal(source.n_points, 9);
				for (int time = 0; time < 2; time++) {
					assert_int_equal(source.rewind(source.userdata, NULL), PSR_OK);
					assert_int_equal(source.read(&n, point, 10, source.userdata, NULL), PSR_OK);
					assert_int_equal(n, m->n_points);
					for (size_t i = 0; i < n; i++)
						for (int c = 0; c < 3; c++) {
							assert_true(point[i].at[c] == m->point[i][c]);
							assert_int_equal(point[i].color[c], psr_linear_to_srgb(m->point_color[i][c]));
						}
					assert_int_equal(source.read(&n, point, 10, source.userdata, NULL), PSR_OK);
					assert_int_equal(n, 0);
				}
				las_source_close(&source);
				psr_mesh_destroy(m);
			}
}

/* LAS 1.4, tables 7 to 17: where each point format has them. */
static void a_source_tells_intensity_return_class_and_time(void **state)
{
	static const int time_of[11] = { 0, 20, 0, 20, 20, 20, 22, 22, 22, 22, 22 };

	(void)state;
	for (unsigned format = 0; format < 11; format++) {
		struct octree_source source;
		struct octree_point point[4];
		struct file f;
		size_t n;

		make(&f, 4, format, 3);
		put(&f, 107, 4, 3);
		for (unsigned i = 0; i < 3; i++) {
			const size_t p = point_at(&f, i);

			put(&f, p + 14, 1, format >= 6 ? 0x90 + i : 0x80 | 5 << 3 | (i + 1)); /* of 9; of 5, at the end of a line */
			put(&f, p + (format >= 6 ? 16 : 15), 1, format >= 6 ? 64 + i : 0x20 | (3 + i)); /* synthetic */
			if (time_of[format] > 0)
				put_double(&f, p + (size_t)time_of[format], 1e9 + 0.25 * i);
		}
		assert_int_equal(open_source(&source, &f, f.n, NULL), PSR_OK);
		assert_int_equal(source.scan, time_of[format] > 0 ? 15 : 7);
		assert_int_equal(source.rewind(source.userdata, NULL), PSR_OK);
		assert_int_equal(source.read(&n, point, 4, source.userdata, NULL), PSR_OK);
		assert_int_equal(n, 3);
		for (unsigned i = 0; i < 3; i++) {
			assert_int_equal(point[i].intensity, 100 * i);
			assert_int_equal(point[i].returns, format >= 6 ? 0x90 + i : 0x50 + i + 1);
			assert_int_equal(point[i].class, format >= 6 ? 64 + i : 3 + i);
			assert_true(point[i].time == (time_of[format] > 0 ? 1e9 + 0.25 * i : 0.0));
		}
		las_source_close(&source);
	}
}

static void a_source_that_is_cut_short_is_refused(void **state)
{
	struct octree_source source;
	struct psr_error err;
	struct file f;

	(void)state;
	make(&f, 4, 7, 3);
	for (size_t n = 0; n < f.n - 3; n += 5) {
		assert_int_equal(open_source(&source, &f, n, &err), PSR_ERR_FORMAT);
		assert_int_equal(err.code, PSR_ERR_FORMAT);
	}
	assert_int_equal(las_source_open(&source, "/nowhere/x.las", &err), PSR_ERR_NOT_FOUND);
	assert_int_equal(las_source_open(&source, "/tmp", &err), PSR_ERR_IO);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_version_and_point_format_keeps_its_millimetres),
		cmocka_unit_test(colors_of_16_bits_are_srgb_coded),
		cmocka_unit_test(colors_of_8_bits_in_16_are_found_out),
		cmocka_unit_test(intensity_is_gray_where_there_is_no_color),
		cmocka_unit_test(noise_and_withheld_points_are_left_out_and_counted),
		cmocka_unit_test(compressed_files_name_the_tool_to_unpack_them),
		cmocka_unit_test(headers_that_lie_are_refused),
		cmocka_unit_test(cut_files_are_refused_at_every_length),
		cmocka_unit_test(coordinates_that_overflow_are_left_out),
		cmocka_unit_test(a_source_gives_the_points_of_the_mesh_and_gives_them_again),
		cmocka_unit_test(a_source_tells_intensity_return_class_and_time),
		cmocka_unit_test(a_source_that_is_cut_short_is_refused),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
