/* Points as they come, of each format. */
#define _GNU_SOURCE
#include <liblzf/lzf.h>
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "points.h"

#define MAX_FILE 8192
#define N 5

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

static void put_whole(struct file *f, uint64_t x, size_t n, int is_big)
{
	for (size_t i = 0; i < n; i++)
		put(f, &(uint8_t){ (uint8_t)(x >> 8 * (is_big ? n - 1 - i : i)) }, 1);
}

static void put_double(struct file *f, double x, int is_big)
{
	uint64_t bits;

	memcpy(&bits, &x, sizeof bits);
	put_whole(f, bits, 8, is_big);
}

/* At survey coordinates, in millimetres; a grey that doubles. */
static double place(int i, int c)
{
	return (c == 0 ? 412000000.0 + 1001.0 * i : c == 1 ? 5312000000.0 - 7.0 * i : 123.0 + i * i) / 1000.0;
}

static uint8_t color(int i, int c)
{
	return (uint8_t)(i == 0 && c == 0 ? 255 : 10 * i + c);
}

/* ---- files of the same points ---- */

#define PLY_VERTEX "element vertex 5\nproperty double x\nproperty double y\nproperty double z\nproperty uchar red\n" \
	"property uchar green\nproperty uchar blue\n"

static void put_line(struct file *f, int i, const char *between)
{
	char line[256];

	snprintf(line, sizeof line, "%.3f %.3f %.3f %s%d %d %d\n", place(i, 0), place(i, 1), place(i, 2), between, color(i, 0),
	         color(i, 1), color(i, 2));
	put_text(f, line);
}

static void make_xyz(struct file *f)
{
	for (int i = 0; i < N; i++)
		put_line(f, i, "");
}

static void make_pts(struct file *f)
{
	put_text(f, "5\n");
	for (int i = 0; i < N; i++)
		put_line(f, i, "-17 ");
}

static void make_ptx(struct file *f)
{
	put_text(f, "1\n5\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
	for (int i = 0; i < N; i++)
		put_line(f, i, "0.5 ");
}

static void make_ply_text(struct file *f)
{
	put_text(f, "ply\nformat ascii 1.0\nelement face 2\nproperty list uchar int vertex_indices\n" PLY_VERTEX
	            "end_header\n3 0 1 2\n4 0 1 2 3\n");
	for (int i = 0; i < N; i++)
		put_line(f, i, "");
}

static void put_rows(struct file *f, int is_big)
{
	put(f, "\3\0\0\0\1\2\0", 7);
	for (int i = 0; i < N; i++) {
		for (int c = 0; c < 3; c++)
			put_double(f, place(i, c), is_big);
		for (int c = 0; c < 3; c++)
			put_whole(f, color(i, c), 1, is_big);
	}
}

#define PLY_FACES "element face 1\nproperty list uchar short vertex_indices\n"

static void make_ply_little(struct file *f)
{
	put_text(f, "ply\nformat binary_little_endian 1.0\n" PLY_FACES PLY_VERTEX "end_header\n");
	put_rows(f, 0);
}

static void make_ply_big(struct file *f)
{
	put_text(f, "ply\nformat binary_big_endian 1.0\n" PLY_FACES PLY_VERTEX "end_header\n");
	put_rows(f, 1);
}

#define PCD_HEADER "# .PCD v0.7\nFIELDS x y z rgb\nSIZE 8 8 8 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 5\nHEIGHT 1\n"

static uint32_t rgb(int i)
{
	return (uint32_t)color(i, 0) << 16 | (uint32_t)color(i, 1) << 8 | color(i, 2);
}

static void make_pcd_text(struct file *f)
{
	char line[256];

	put_text(f, PCD_HEADER "DATA ascii\n");
	for (int i = 0; i < N; i++) {
		snprintf(line, sizeof line, "%.3f %.3f %.3f %u\n", place(i, 0), place(i, 1), place(i, 2), rgb(i));
		put_text(f, line);
	}
}

static void make_pcd_binary(struct file *f)
{
	put_text(f, PCD_HEADER "DATA binary\n");
	for (int i = 0; i < N; i++) {
		for (int c = 0; c < 3; c++)
			put_double(f, place(i, c), 0);
		put_whole(f, rgb(i), 4, 0);
	}
}

static void make_pcd_compressed(struct file *f)
{
	static struct file plain, packed;

	plain.n = 0;
	for (int c = 0; c < 3; c++)
		for (int i = 0; i < N; i++)
			put_double(&plain, place(i, c), 0);
	for (int i = 0; i < N; i++)
		put_whole(&plain, rgb(i), 4, 0);
	packed.n = lzf_compress(plain.at, (unsigned)plain.n, packed.at, (unsigned)plain.n - 1);
	assert_true(packed.n > 0);
	put_text(f, PCD_HEADER "DATA binary_compressed\n");
	put_whole(f, packed.n, 4, 0);
	put_whole(f, plain.n, 4, 0);
	put(f, packed.at, packed.n);
}

/* Version 1.2, point format 2: colours of 8 bits in 16. */
static void make_las(struct file *f)
{
	memset(f->at, 0, 227);
	memcpy(f->at, "LASF", 4);
	f->at[24] = 1;
	f->at[25] = 2;
	f->n = 94;
	put_whole(f, 227, 2, 0);
	put_whole(f, 227, 4, 0);
	f->n = 104;
	put_whole(f, 2, 1, 0);
	put_whole(f, 26, 2, 0);
	put_whole(f, N, 4, 0);
	f->n = 131;
	for (int c = 0; c < 3; c++)
		put_double(f, 0.001, 0);
	for (int c = 0; c < 3; c++)
		put_double(f, c == 1 ? 5300000.0 : 0.0, 0);
	f->n = 227;
	for (int i = 0; i < N; i++) {
		for (int c = 0; c < 3; c++)
			put_whole(f, (uint64_t)(int64_t)round(1000.0 * (place(i, c) - (c == 1 ? 5300000.0 : 0.0))), 4, 0);
		put_whole(f, 0, 8, 0);
		for (int c = 0; c < 3; c++)
			put_whole(f, color(i, c), 2, 0);
	}
}

static const struct {
	const char *name;
	void (*make)(struct file *f);
	int is_text; /* what is cut from the last number leaves a number */
} formats[] = {
	{ "a.xyz", make_xyz, 1 },        { "a.txt", make_xyz, 1 },          { "a.pts", make_pts, 1 },
	{ "a.ptx", make_ptx, 1 },        { "a.ply", make_ply_text, 1 },     { "little", make_ply_little, 0 },
	{ "big.ply", make_ply_big, 0 },  { "a.pcd", make_pcd_text, 1 },     { "binary", make_pcd_binary, 0 },
	{ "packed", make_pcd_compressed, 0 }, { "a.las", make_las, 0 },
};

#define N_FORMATS (sizeof formats / sizeof *formats)

static struct read r;

static void every_format_gives_the_same_points(void **state)
{
	(void)state;
	for (size_t k = 0; k < N_FORMATS; k++) {
		struct file f = { .n = 0 };

		formats[k].make(&f);
		write_bytes(path_of(formats[k].name), f.at, f.n);
		read_all(&r, formats[k].name);
		assert_int_equal(r.n, N);
		assert_int_equal(r.promised, N);
		assert_true(r.has_color && !r.has_normal);
		for (int i = 0; i < N; i++)
			for (int c = 0; c < 3; c++) {
				/* A LAS file's own arithmetic rounds a sum of 5e6, twice. */
				assert_true(fabs(r.point[i].at[c] - place(i, c)) <= (k + 1 < N_FORMATS ? 0.0 : 0x1p-29));
				assert_int_equal(r.point[i].color[c], color(i, c));
			}
	}
}

/* Whatever is missing is an error that names the file; of a text without the end of its last number there is another
 * number left, and of text without a count there are fewer lines. */
static void files_cut_at_any_byte_are_refused(void **state)
{
	(void)state;
	for (size_t k = 0; k < N_FORMATS; k++) {
		struct file f = { .n = 0 };
		int n_accepted = 0;

		formats[k].make(&f);
		for (size_t n = 0; n < f.n; n++) {
			struct psr_error err = { 0, "" };
			int rc;

			write_bytes(path_of(formats[k].name), f.at, n);
			rc = try_points(&r, formats[k].name, &err);
			assert_int_equal(rc, err.code);
			n_accepted += rc == PSR_OK;
			if (rc != PSR_OK)
				assert_true((rc == PSR_ERR_FORMAT || rc == PSR_ERR_UNSUPPORTED) &&
				            strstr(err.text, formats[k].name) != NULL);
			else
				assert_true(formats[k].is_text && (r.n == N ? n + 12 > f.n : r.n < N && formats[k].make == make_xyz));
		}
		assert_true(formats[k].is_text == (n_accepted > 0));
	}
}

/* ---- files that are larger than a window ---- */

#define MANY 200000

static double far_place(uint64_t i, int c)
{
	return (double)(i * (c + 1) % 9973) / 8.0 + (double)i;
}

static void check_many(const char *name)
{
	static struct octree_point point[4096];
	struct octree_source source;
	struct psr_error err;
	uint64_t at = 0;

	if (octree_source_open(&source, path_of(name), &err) != PSR_OK ||
	    source.rewind(source.userdata, &err) != PSR_OK)
		fail_msg("%s", err.text);
	for (size_t n = 1; n > 0;) {
		if (source.read(&n, point, 4096, source.userdata, &err) != PSR_OK)
			fail_msg("%s", err.text);
		for (size_t i = 0; i < n; i++, at++)
			for (int c = 0; c < 3; c++)
				assert_true(point[i].at[c] == far_place(at, c));
	}
	assert_int_equal(at, MANY);
	octree_source_close(&source);
}

/* Rows of text have from five to hundreds of characters; one has more than a window. */
static void points_behind_the_first_window_are_the_same(void **state)
{
	static const struct {
		const char *name, *head;
		int has_list;
	} files[] = {
		{ "many.xyz", "", 0 },
		{ "many.pts", "200000\n", 0 },
		{ "many.pcd", "# .PCD v0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 200000\nHEIGHT 1\nDATA ascii\n",
		  0 },
		{ "many.ply", "ply\nformat ascii 1.0\nelement vertex 200000\nproperty double x\nproperty double y\n"
		              "property double z\nproperty list int int odd\nend_header\n", 1 },
	};

	(void)state;
	for (size_t k = 0; k < sizeof files / sizeof *files; k++) {
		FILE *file = fopen(path_of(files[k].name), "wb");

		assert_non_null(file);
		fputs(files[k].head, file);
		for (uint64_t i = 0; i < MANY; i++) {
			fprintf(file, "%.17g %.17g%*s%.17g", far_place(i, 0), far_place(i, 1), i % 97 == 0 ? (int)(i % 611) + 1 : 1, "",
			        far_place(i, 2));
			if (files[k].has_list) {
				fprintf(file, " %d", i == MANY / 2 ? 800000 : (int)(i % 3));
				for (uint64_t j = 0; j < (i == MANY / 2 ? 800000 : i % 3); j++)
					fputs(" 7", file);
			}
			fputs(i % 5 == 0 ? "\r\n" : "\n", file);
		}
		assert_int_equal(fclose(file), 0);
		check_many(files[k].name);
	}
}

/* Point i is at i, i, i. */
static void make_counted(FILE *file, const char *head, int is_binary)
{
	fputs(head, file);
	for (int i = 0; i < MANY; i++) {
		const double at[3] = { i, i, i };

		if (is_binary)
			assert_int_equal(fwrite(at, sizeof at, 1, file), 1);
		else
			fprintf(file, "%d %d %d\n", i, i, i);
	}
	assert_int_equal(fclose(file), 0);
}

/* A part of 10,000 of 200,000 points: runs of 512 points or of 16 KB, some 800 lines, of which one in 20 is read: 1,700 of
 * these are longer than a run of either kind. A text's lines grow from 6 to 21 characters, so that its first window
 * promises up to a third more of them than there are. */
static void a_part_of_a_file_is_spread_over_all_of_it(void **state)
{
	static const struct {
		const char *name, *head;
		int is_binary;
	} files[] = {
		{ "part.xyz", "", 0 },
		{ "part.ply", "ply\nformat binary_little_endian 1.0\nelement vertex 200000\nproperty double x\nproperty double y\n"
		              "property double z\nend_header\n", 1 },
		{ "part.pcd", "# .PCD v0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nWIDTH 200000\nDATA binary\n", 1 },
	};
	static struct octree_point point[1000], again[1000];

	(void)state;
	for (size_t k = 0; k < 3; k++) {
		struct octree_source source;
		double last = -1.0, widest = 0.0;
		uint64_t n_points = 0;

		make_counted(fopen(path_of(files[k].name), "wb"), files[k].head, files[k].is_binary);
		assert_int_equal(octree_source_open_part(&source, path_of(files[k].name), 10000, NULL), PSR_OK);
		assert_int_equal(source.rewind(source.userdata, NULL), PSR_OK);
		for (size_t n = 1; n > 0; n_points += n) {
			assert_int_equal(source.read(&n, point, 1000, source.userdata, NULL), PSR_OK);
			for (size_t i = 0; i < n; i++) {
				assert_true(point[i].at[0] > last && point[i].at[0] == floor(point[i].at[0]) &&
				            point[i].at[1] == point[i].at[0] && point[i].at[2] == point[i].at[0]);
				widest = fmax(widest, point[i].at[0] - last);
				last = point[i].at[0];
			}
		}
		assert_true(widest < 20 * 1700 && last > MANY - 20 * 1700);
		assert_true(n_points >= 7000 && n_points <= 13000);
		assert_true(source.n_points >= 7000 && source.n_points <= 13000);
		assert_int_equal(source.rewind(source.userdata, NULL), PSR_OK);
		for (uint64_t at = 0, n = 1; n > 0; at += n) {
			size_t got;

			assert_int_equal(source.read(&got, again, 1000, source.userdata, NULL), PSR_OK);
			n = got;
			assert_true(n > 0 || at == n_points);
		}
		octree_source_close(&source);
		assert_int_equal(octree_source_open_part(&source, path_of(files[k].name), MANY + MANY / 2, NULL), PSR_OK);
		octree_source_close(&source);
	}
}

static void a_part_of_a_las_file_is_spread_over_it(void **state)
{
	struct octree_source source;
	static struct octree_point point[4096];
	struct file f = { .n = 0 };
	size_t n;

	(void)state;
	make_las(&f);
	FILE *file = fopen(path_of("part.las"), "wb");

	assert_non_null(file);
	f.at[107] = (uint8_t)(40960 & 255);
	f.at[108] = (uint8_t)(40960 >> 8);
	assert_int_equal(fwrite(f.at, 227, 1, file), 1);
	for (uint32_t i = 0; i < 40960; i++) {
		uint8_t p[26] = { (uint8_t)i, (uint8_t)(i >> 8) };

		assert_int_equal(fwrite(p, sizeof p, 1, file), 1);
	}
	assert_int_equal(fclose(file), 0);
	assert_int_equal(octree_source_open_part(&source, path_of("part.las"), 4096, NULL), PSR_OK);
	assert_int_equal(source.n_points, 4096);
	assert_int_equal(source.rewind(source.userdata, NULL), PSR_OK);
	assert_int_equal(source.read(&n, point, 4096, source.userdata, NULL), PSR_OK);
	assert_int_equal(n, 4096);
	for (size_t i = 0; i < n; i++) /* runs of 512, one of ten */
		assert_int_equal((int)round(1000.0 * point[i].at[0]), (int)(i / 512 * 5120 + i % 512));
	octree_source_close(&source);
}

static void an_error_far_in_a_file_names_its_line(void **state)
{
	FILE *file = fopen(path_of("far.ply"), "wb");

	(void)state;
	assert_non_null(file);
	fputs("ply\nformat ascii 1.0\nelement vertex 200000\nproperty double x\nproperty double y\nproperty double z\n"
	      "end_header\n", file);
	for (int i = 0; i < MANY; i++)
		fprintf(file, "%d %d %s\n", i, i + 1, i == 150000 ? "here" : "0");
	assert_int_equal(fclose(file), 0);
	struct octree_source source;
	struct octree_point point[100];
	struct psr_error err = { 0, "" };
	size_t n = 1;

	assert_int_equal(octree_source_open(&source, path_of("far.ply"), NULL), PSR_OK);
	for (int rc = PSR_OK; rc == PSR_OK && n > 0;)
		rc = source.read(&n, point, 100, source.userdata, &err);
	octree_source_close(&source);
	assert_non_null(strstr(err.text, "line 150008: vertex 150000 has a value that is not a number"));
}

static void a_file_that_becomes_shorter_is_an_error(void **state)
{
	struct octree_source source;
	struct octree_point point[4096];
	struct psr_error err;
	size_t n = 1;
	int rc = PSR_OK;

	(void)state;
	FILE *file = fopen(path_of("short.xyz"), "wb");

	assert_non_null(file);
	for (int i = 0; i < MANY; i++)
		fprintf(file, "%d %d 0\n", i, i);
	assert_int_equal(fclose(file), 0);
	assert_int_equal(octree_source_open(&source, path_of("short.xyz"), NULL), PSR_OK);
	assert_int_equal(truncate(path_of("short.xyz"), 1 << 20), 0);
	while (rc == PSR_OK && n > 0)
		rc = source.read(&n, point, 4096, source.userdata, &err);
	octree_source_close(&source);
	assert_int_equal(rc, PSR_ERR_IO);
	assert_non_null(strstr(err.text, "became shorter"));
}

static void normals_and_points_without_a_place_come_as_they_are(void **state)
{
	(void)state;
	write_text("n.ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
	                    "property float nx\nproperty float ny\nproperty float nz\nproperty float r\nproperty float g\n"
	                    "property float b\nend_header\n1 2 3 0 0 1 0 0.5 1\nnan 1 2 0 0 1 1 1 1\n4 5 6 0 -2 0 1 1 1\n");
	read_all(&r, "n.ply");
	assert_true(r.n == 2 && r.left_out == 1 && r.has_normal && r.has_color);
	assert_true(r.point[1].normal[1] == -2.0f && r.point[1].at[2] == 6.0);
	assert_true(r.point[0].color[0] == 0 && r.point[0].color[1] == 188 && r.point[0].color[2] == 255); /* linear 0.5 */
	write_text("n.pcd", "FIELDS x y z normal_x normal_y normal_z intensity\nWIDTH 3\nDATA ascii\n1 2 3 0 0 1 0\n"
	                    "nan nan nan 0 0 0 0\n4 5 6 0 -2 0 9\n");
	read_all(&r, "n.pcd");
	assert_true(r.n == 2 && r.left_out == 1 && r.has_normal && r.has_color);
	assert_true(r.point[1].normal[1] == -2.0f && r.point[1].at[2] == 6.0);
}

static void what_is_no_file_of_points_is_refused_with_advice(void **state)
{
	(void)state;
	write_text("a.e57", "ASTM-E57 and so on");
	refuse_points("a.e57", PSR_ERR_UNSUPPORTED, "pdal translate IN.e57 OUT.las");
	write_text("a.laz", "?");
	refuse_points("a.laz", PSR_ERR_UNSUPPORTED, "laszip -i IN.laz");
	write_text("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
	refuse_points("a.off", PSR_ERR_UNSUPPORTED, "not a file of points");
	write_text("a.bin", "no points at all\n");
	refuse_points("a.bin", PSR_ERR_UNSUPPORTED, "LAS, PLY, PCD, PTS, PTX, or lines of numbers");
	write_text("a.ply", "");
	refuse_points("a.ply", PSR_ERR_FORMAT, "the file is empty");
	refuse_points("nowhere.las", PSR_ERR_NOT_FOUND, "No such file");
	refuse_points(".", PSR_ERR_IO, "not a file");
	write_text("b.ply", "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\n"
	                    "end_header\n");
	refuse_points("b.ply", PSR_ERR_FORMAT, "no points");
	write_text("c.ply", "ply\nformat ascii 1.0\nelement vertex 9\nproperty float x\nproperty float y\nend_header\n"
	                    "1 2 3 4 5 6 7 8 9 1 2 3 4 5 6 7 8 9");
	refuse_points("c.ply", PSR_ERR_FORMAT, "no property z");
}

static void only_files_of_points_alone_suit(void **state)
{
	static const char *const head = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
	                                "property float z\n";
	char text[512];

	(void)state;
	snprintf(text, sizeof text, "%send_header\n1 2 3\n", head);
	write_text("s.ply", text);
	assert_true(octree_source_suits(path_of("s.ply")));
	snprintf(text, sizeof text, "%selement face 1\nproperty list uchar int vertex_indices\nend_header\n1 2 3\n1 0\n", head);
	write_text("s.ply", text);
	assert_false(octree_source_suits(path_of("s.ply")));
	write_text("s.txt", "1 2 3\n");
	assert_true(octree_source_suits(path_of("s.txt")));
	write_text("s.obj", "v 1 2 3\n");
	assert_false(octree_source_suits(path_of("s.obj")));
	write_text("s.e57", "ASTM-E57");
	assert_true(octree_source_suits(path_of("s.e57"))); /* to be told how to convert it */
	assert_false(octree_source_suits(path_of("nowhere.las")));
}

static void clouds_stand_upright(void **state)
{
	static const double near[3] = { -1.0, -1.0, -1.0 }, far[3] = { 500000.0, 0.0, 0.0 };
	struct octree_source source;

	(void)state;
	write_text("u.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
	                    "property float z\nend_header\n1 2 3\n");
	assert_int_equal(octree_source_open(&source, path_of("u.ply"), NULL), PSR_OK);
	assert_int_equal(octree_source_up(&source, near, 2.0), 1);
	assert_int_equal(octree_source_up(&source, far, 2.0), 2);
	octree_source_close(&source);
	write_text("u.xyz", "1 2 3\n");
	assert_int_equal(octree_source_open(&source, path_of("u.xyz"), NULL), PSR_OK);
	assert_int_equal(octree_source_up(&source, near, 2.0), 2);
	octree_source_close(&source);
}

static void a_file_of_noise_alone_says_so(void **state)
{
	struct file f = { .n = 0 };

	(void)state;
	make_las(&f);
	for (int i = 0; i < N; i++)
		f.at[227 + 26 * i + 15] = 7;
	write_bytes(path_of("noise.las"), f.at, f.n);
	refuse_points("noise.las", PSR_ERR_FORMAT, "all of its points are marked as noise");
}

static void compressed_points_beyond_the_limit_are_refused(void **state)
{
	char text[512];

	(void)state;
	snprintf(text, sizeof text, "# .PCD v0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nWIDTH %llu\nDATA binary_compressed\n....",
	         (unsigned long long)(POINTS_MOST_UNPACKED / 24 + 1));
	write_text("huge.pcd", text);
	refuse_points("huge.pcd", PSR_ERR_LIMIT, "write them as \"DATA binary\"");
	write_text("more.pcd", "# .PCD v0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 65536 65536 65536\n"
	                       "WIDTH 1099511627776\nDATA binary_compressed\n....");
	refuse_points("more.pcd", PSR_ERR_FORMAT, "no field x of one value");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_format_gives_the_same_points),
		cmocka_unit_test(files_cut_at_any_byte_are_refused),
		cmocka_unit_test(points_behind_the_first_window_are_the_same),
		cmocka_unit_test(a_part_of_a_file_is_spread_over_all_of_it),
		cmocka_unit_test(a_part_of_a_las_file_is_spread_over_it),
		cmocka_unit_test(an_error_far_in_a_file_names_its_line),
		cmocka_unit_test(a_file_that_becomes_shorter_is_an_error),
		cmocka_unit_test(normals_and_points_without_a_place_come_as_they_are),
		cmocka_unit_test(what_is_no_file_of_points_is_refused_with_advice),
		cmocka_unit_test(only_files_of_points_alone_suit),
		cmocka_unit_test(clouds_stand_upright),
		cmocka_unit_test(a_file_of_noise_alone_says_so),
		cmocka_unit_test(compressed_points_beyond_the_limit_are_refused),
	};

	return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
