#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "base/srgb.h"
#include "scan.h"

enum { ASCII, LITTLE, BIG };

static const char *const format_name[] = { "ascii", "binary_little_endian", "binary_big_endian" };

/* A file that grows. */
struct file {
	uint8_t at[1 << 16];
	size_t n;
	int format;
};

static void text(struct file *f, const char *format, ...) __attribute__((format(printf, 2, 3)));

static void text(struct file *f, const char *format, ...)
{
	va_list args;

	va_start(args, format);
	f->n += (size_t)vsnprintf((char *)f->at + f->n, sizeof f->at - f->n, format, args);
	va_end(args);
	assert_true(f->n < sizeof f->at);
}

static void begin(struct file *f, int format)
{
	f->n = 0;
	f->format = format;
	text(f, "ply\nformat %s 1.0\n", format_name[format]);
}

static void put_bits(struct file *f, uint64_t bits, int n)
{
	for (int i = 0; i < n; i++)
		f->at[f->n++] = (uint8_t)(bits >> 8 * (f->format == LITTLE ? i : n - 1 - i));
}

/* A value as one of the types by its old name; text ends in a blank. */
static void put(struct file *f, const char *type, double x)
{
	float single = (float)x;
	uint64_t bits;
	uint32_t low;

	if (f->format == ASCII) {
		text(f, "%.17g ", x);
	} else if (strcmp(type, "double") == 0) {
		memcpy(&bits, &x, sizeof bits);
		put_bits(f, bits, 8);
	} else if (strcmp(type, "float") == 0) {
		memcpy(&low, &single, sizeof low);
		put_bits(f, low, 4);
	} else {
		put_bits(f, (uint64_t)(int64_t)x, strstr(type, "char") != NULL ? 1 : strstr(type, "short") != NULL ? 2 : 4);
	}
}

static void end_row(struct file *f)
{
	if (f->format == ASCII)
		text(f, "\n");
}

static struct psr_mesh *accept_ply(const struct file *f)
{
	return accept(import_ply, "x.ply", f->at, f->n);
}

static struct psr_mesh *accept_text(const char *ply)
{
	return accept(import_ply, "x.ply", ply, strlen(ply));
}

static void refuse_text(const char *ply, int code, const char *part)
{
	refuse_scan(import_ply, "x.ply", ply, strlen(ply), code, part);
}

#define ASCII_HEADER "ply\nformat ascii 1.0\n"
#define XYZ "property float x\nproperty float y\nproperty float z\n"
#define LIST "property list uchar int vertex_indices\n"
#define END "end_header\n"

static const double *corner(const struct psr_mesh *m, uint32_t t, int c)
{
	return m->position[m->triangle[t][c]];
}

/* The normal of triangle t times twice its area. */
static void cross_of(double out[3], const struct psr_mesh *m, uint32_t t)
{
	const double *a = corner(m, t, 0), *b = corner(m, t, 1), *c = corner(m, t, 2);

	for (int i = 0; i < 3; i++) {
		int j = (i + 1) % 3, k = (i + 2) % 3;

		out[i] = (b[j] - a[j]) * (c[k] - a[k]) - (b[k] - a[k]) * (c[j] - a[j]);
	}
}

/* A tetrahedron with corners at 0 and 100 (which every type can say), each property of another type, among others that
 * nobody knows. */
static void every_type_reads_the_same_in_every_format(void **state)
{
	(void)state;
	static const char *const type[] = { "char", "uchar", "short", "ushort", "int", "uint", "float", "double" };
	static const char *const new_type[] = { "int8",  "uint8",  "int16",   "uint16",
		                                    "int32", "uint32", "float32", "float64" };
	static const double position[4][3] = { { 0, 0, 0 }, { 100, 0, 0 }, { 0, 100, 0 }, { 0, 0, 100 } };
	static const unsigned face[4][3] = { { 0, 2, 1 }, { 0, 1, 3 }, { 0, 3, 2 }, { 1, 2, 3 } };
	static struct file f;

	for (int format = ASCII; format <= BIG; format++)
		for (int x = 0; x < 8; x++)
			for (int y = 0; y < 8; y++) {
				int z = (x + y) % 8, count = y % 6, index = x;

				begin(&f, format);
				text(&f, "comment made by hand\nobj_info num_cols 512\nelement vertex 4\nproperty %s z\n", type[z]);
				text(&f, "property list %s %s history\nproperty %s x\n", type[count], type[z], new_type[x]);
				text(&f, "property %s confidence\nproperty %s y\n", type[y], new_type[y]);
				text(&f, "element camera 2\nproperty %s view_px\nproperty list uchar %s k\n", type[x], new_type[y]);
				text(&f, "element face 4\nproperty %s flags\nproperty list %s %s vertex_index\n", type[y], type[count],
				     new_type[index]);
				text(&f, "property list uchar double weights\n" END);
				for (int v = 0; v < 4; v++) {
					put(&f, type[z], position[v][2]);
					put(&f, type[count], v % 3);
					for (int i = 0; i < v % 3; i++)
						put(&f, type[z], 7);
					put(&f, type[x], position[v][0]);
					put(&f, type[y], 99);
					put(&f, type[y], position[v][1]);
					end_row(&f);
				}
				for (int c = 0; c < 2; c++) {
					put(&f, type[x], 5);
					put(&f, "uchar", c);
					for (int i = 0; i < c; i++)
						put(&f, type[y], 6);
					end_row(&f);
				}
				for (int t = 0; t < 4; t++) {
					put(&f, type[y], 1);
					put(&f, type[count], 3);
					for (int c = 0; c < 3; c++)
						put(&f, type[index], face[t][c]);
					put(&f, "uchar", 1);
					put(&f, "double", 0.5);
					end_row(&f);
				}
				struct psr_mesh *m = accept_ply(&f);

				assert_int_equal(m->n_triangles, 4);
				assert_int_equal(m->n_vertices, 12); /* edges of a tetrahedron are sharp */
				for (uint32_t t = 0; t < 4; t++)
					for (int c = 0; c < 3; c++)
						assert_memory_equal(corner(m, t, c), position[face[t][c]], sizeof position[0]);
				assert_true(m->material[0].two_sided && m->material[0].base_color[0] == IMPORT_GRAY);
				psr_mesh_destroy(m);
			}
}

static void negative_values_keep_their_sign(void **state)
{
	(void)state;
	static const char *const type[] = { "char", "short", "int", "float", "double" };
	static const double least[] = { -128, -32768, -2147483648.0, -3.5, -1e-300 };
	static struct file f;

	for (int format = ASCII; format <= BIG; format++)
		for (int k = 0; k < 5; k++) {
			begin(&f, format);
			text(&f, "element vertex 2\nproperty %s x\nproperty %s y\nproperty %s z\n" END, type[k], type[k], type[k]);
			for (int v = 0; v < 2; v++) {
				for (int c = 0; c < 3; c++)
					put(&f, type[k], v == 1 ? least[k] : -c);
				end_row(&f);
			}
			struct psr_mesh *m = accept_ply(&f);

			assert_int_equal(m->n_points, 2);
			assert_true(m->point[0][1] == -1 && m->point[0][2] == -2 && m->point[1][0] == least[k]);
			psr_mesh_destroy(m);
		}
}

/* Numbers as people and programs write them are the nearest doubles, as C's own function gives in the C locale. */
static void text_is_read_to_the_last_bit(void **state)
{
	(void)state;
	static const char *const shape[] = { "%.17g", "%.6f", "%.3e", "%.12g", "%+.9E", "%.0f", "%g", "%.25f" };
	uint64_t random = 88172645463325252u;
	char word[3][512];

	for (int i = 0; i < 20000; i++) {
		char ply[2048];

		for (int c = 0; c < 3; c++) {
			double x;

			random ^= random << 13;
			random ^= random >> 7;
			random ^= random << 17;
			if (i % 2 == 0)
				memcpy(&x, &random, sizeof x);
			else
				x = ((double)(random >> 12) / 2251799813685248.0 - 1) * pow(10, (double)(random % 13) - 5);
			if (!(fabs(x) < 1e90))
				x = 3;
			snprintf(word[c], sizeof word[c], shape[(i + c) % 8], x);
			if (strlen(word[c]) > 120)
				snprintf(word[c], sizeof word[c], "%.17g", x);
		}
		snprintf(ply, sizeof ply, ASCII_HEADER "element vertex 1\n" XYZ END "%s %s\t%s\n", word[0], word[1], word[2]);
		struct psr_mesh *m = accept_text(ply);

		for (int c = 0; c < 3; c++) {
			double want = strtod(word[c], NULL);

			if (memcmp(&m->point[0][c], &want, sizeof want) != 0)
				fail_msg("%s was read as %.17g", word[c], m->point[0][c]);
		}
		psr_mesh_destroy(m);
	}
}

static void numbers_may_be_short_and_long(void **state)
{
	(void)state;
	struct psr_mesh *m = accept_text(ASCII_HEADER "element vertex 4\n" XYZ END
	                                              "1. .5 +2\n-.25e1 1E+2 0000000000000000000000000000001\n"
	                                              "12345678901234567890123 0.00000000000000000000000000001 1e-400\n"
	                                              "nan -inf 1.#QNAN\n");

	assert_int_equal(m->n_points, 3);
	assert_int_equal(m->n_dropped_primitives, 1);
	assert_true(m->point[0][0] == 1 && m->point[0][1] == 0.5 && m->point[0][2] == 2);
	assert_true(m->point[1][0] == -2.5 && m->point[1][1] == 100 && m->point[1][2] == 1);
	assert_true(m->point[2][0] == 12345678901234567890123.0 && m->point[2][1] == 1e-29 && m->point[2][2] == 0);
	psr_mesh_destroy(m);
}

static void survey_coordinates_keep_their_millimetres(void **state)
{
	(void)state;
	static struct file f;
	static const double p[2][3] = { { 412345.678, 5312345.679, 431.001 }, { 412345.679, 5312345.681, 431.002 } };

	for (int format = ASCII; format <= BIG; format++) {
		begin(&f, format);
		text(&f, "element vertex 2\nproperty double x\nproperty double y\nproperty double z\n" END);
		for (int v = 0; v < 2; v++) {
			for (int c = 0; c < 3; c++)
				put(&f, "double", p[v][c]);
			end_row(&f);
		}
		struct psr_mesh *m = accept_ply(&f);

		assert_memory_equal(m->point, p, sizeof p);
		psr_mesh_destroy(m);
	}
	/* a writer that says "float" but prints all digits means them */
	struct psr_mesh *m = accept_text(ASCII_HEADER "element vertex 1\n" XYZ END "412345.678 5312345.679 431.001\n");

	assert_memory_equal(m->point, p, sizeof p[0]);
	psr_mesh_destroy(m);
}

static void lines_may_end_in_any_way(void **state)
{
	(void)state;
	static const char *const end[] = { "\n", "\r\n", "\r" };
	static struct file f;

	for (int k = 0; k < 3; k++)
		for (int format = ASCII; format <= BIG; format++) {
			const char *e = end[k];

			f.n = 0;
			f.format = format;
			text(&f, "ply%sformat  %s 1.0%s", e, format_name[format], e);
			text(&f, "element vertex 3%s\tproperty char x%sproperty char y %sproperty char z%send_header%s", e, e, e, e,
			     e);
			/* in binary the first byte is a newline's code */
			for (int i = 0; i < 9; i++) {
				put(&f, "char", 10 + i * i % 7);
				if (format == ASCII && i % 3 == 2)
					text(&f, "%s", e);
			}
			struct psr_mesh *m = accept_ply(&f);

			assert_int_equal(m->n_points, 3);
			for (int i = 0; i < 9; i++)
				assert_true(m->point[i / 3][i % 3] == 10 + i * i % 7);
			psr_mesh_destroy(m);
		}
}

static void polygons_are_cut_and_small_ones_counted(void **state)
{
	(void)state;
	/* an arrow head whose notch is at the origin, and lines and points */
	struct psr_mesh *m = accept_text(ASCII_HEADER "element vertex 4\n" XYZ "element face 4\n" LIST END
	                                              "0 0 0\n2 -1 0\n0 3 0\n-2 -1 0\n4 0 1 2 3\n2 0 1\n0\n1 3\n");
	double area = 0, n[3];

	assert_int_equal(m->n_triangles, 2);
	assert_int_equal(m->n_dropped_primitives, 3);
	assert_non_null(strstr(m->warning, "fewer than three corners were left out: 3"));
	for (uint32_t t = 0; t < 2; t++) {
		cross_of(n, m, t);
		assert_true(n[2] > 0);
		area += n[2] / 2;
	}
	assert_true(area == 6); /* 8 for the triangle, less 2 for the notch */
	psr_mesh_destroy(m);
}

static void faces_may_come_before_vertices(void **state)
{
	(void)state;
	struct psr_mesh *m = accept_text(ASCII_HEADER "element junk 2\nproperty int a\nelement face 1\n" LIST
	                                              "element vertex 3\n" XYZ END "1\n2\n3 0 1 2\n0 0 0\n1 0 0\n0 1 0\n");

	assert_int_equal(m->n_triangles, 1);
	assert_true(corner(m, 0, 1)[0] == 1 && corner(m, 0, 2)[1] == 1);
	psr_mesh_destroy(m);
}

static void strips_turn_every_other_triangle_and_start_anew(void **state)
{
	(void)state;
	static struct file f;
	/* two rows of a 2 x 4 grid as one strip, then the second row again from below: all face up */
	static const int strip[] = { 0, 4, 1, 5, 2, 6, 3, 7, -1, 4, 8, 5, 9, 9, -1, 5, 9, 6 };
	const int n = (int)(sizeof strip / sizeof strip[0]);

	for (int with_normals = 0; with_normals < 2; with_normals++)
		for (int format = ASCII; format <= BIG; format++) {
			begin(&f, format);
			text(&f, "element vertex 12\n" XYZ);
			for (int c = 0; c < 3 && with_normals; c++)
				text(&f, "property char n%c\n", "xyz"[c]);
			text(&f, "element tristrips 1\nproperty list int int vertex_indices\n" END);
			for (int v = 0; v < 12; v++) {
				put(&f, "float", v % 4);
				put(&f, "float", -(v / 4));
				put(&f, "float", 0);
				for (int c = 0; c < 3 && with_normals; c++)
					put(&f, "char", c == 2);
				end_row(&f);
			}
			put(&f, "int", n);
			for (int i = 0; i < n; i++)
				put(&f, "int", strip[i]);
			end_row(&f);
			struct psr_mesh *m = accept_ply(&f);

			assert_int_equal(m->n_triangles, 6 + 2 + 1);
			assert_int_equal(m->n_vertices, 10 + 1 - 1);
			for (uint32_t t = 0; t < m->n_triangles; t++) {
				double c[3];

				cross_of(c, m, t);
				assert_true(c[0] == 0 && c[1] == 0 && c[2] == 1);
				assert_true(m->normal[m->triangle[t][0]][2] == 1);
			}
			psr_mesh_destroy(m);
		}
}

static void colors_of_vertices_are_linear_light(void **state)
{
	(void)state;
	static const struct {
		const char *type, *name[4];
		double value[4], linear[4];
	} kinds[] = {
		{ "uchar", { "red", "green", "blue", "alpha" }, { 255, 128, 0, 51 }, { 1, -128, 0, 0.2 } },
		{ "uchar",
		  { "diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha" },
		  { 0, 64, 255, 255 },
		  { 0, -64, 1, 1 } },
		{ "ushort", { "r", "g", "b", "a" }, { 65535, 128 * 257, 0, 13107 }, { 1, -128, 0, 0.2 } },
		{ "float", { "red", "green", "blue", "alpha" }, { 0.25, 0.5, 1, 0.75 }, { 0.25, 0.5, 1, 0.75 } },
		{ "int", { "red", "green", "blue", "alpha" }, { 255, 128, 0, 51 }, { 1, -128, 0, 0.2 } },
	};
	static struct file f;

	for (size_t k = 0; k < sizeof kinds / sizeof kinds[0]; k++)
		for (int with_face = 0; with_face < 2; with_face++)
			for (int format = ASCII; format <= BIG; format++) {
				begin(&f, format);
				text(&f, "element vertex 3\n" XYZ);
				for (int c = 3; c >= 0; c--)
					text(&f, "property %s %s\n", kinds[k].type, kinds[k].name[c]);
				text(&f, "element face %d\n" LIST END, with_face);
				for (int v = 0; v < 3; v++) {
					for (int c = 0; c < 3; c++)
						put(&f, "float", v == c);
					for (int c = 3; c >= 0; c--)
						put(&f, kinds[k].type, kinds[k].value[c]);
					end_row(&f);
				}
				for (int i = -1; with_face && i < 3; i++)
					put(&f, i < 0 ? "uchar" : "int", i < 0 ? 3 : i);
				struct psr_mesh *m = accept_ply(&f);

				assert_int_equal(m->n_points, with_face ? 0 : 3);
				for (int c = 0; c < 4; c++) {
					double want = kinds[k].linear[c];
					float got = with_face ? m->color[0][c] : m->point_color[0][c];

					/* negative: the code of a table */
					assert_true(got == (want < 0 ? psr_srgb_to_linear[(int)-want] : (float)want));
				}
				assert_true(m->material[0].base_color[0] == 1);
				psr_mesh_destroy(m);
			}
}

/* As MeshLab writes what was painted by faces: its vertices are white, all of them. */
static void colors_of_faces_count_where_vertices_have_one_color(void **state)
{
	(void)state;
	for (int differ = 0; differ < 2; differ++) {
		char ply[1024];

		snprintf(ply, sizeof ply,
		         ASCII_HEADER "element vertex 3\n" XYZ "property uchar red\nproperty uchar green\nproperty uchar blue\n"
		                      "element face 1\n" LIST
		                      "property uchar red\nproperty uchar green\nproperty uchar blue\n" END
		                      "0 0 0 255 255 255\n1 0 0 255 255 255\n1 1 0 255 255 %d\n3 0 1 2 255 0 0\n",
		         differ ? 0 : 255);
		struct psr_mesh *m = accept_text(ply);

		for (int c = 0; c < 3; c++)
			assert_true(m->color[m->triangle[0][c]][1] == (differ ? 1.0f : 0.0f));
		psr_mesh_destroy(m);
	}
}

static void colors_of_faces_split_their_vertices(void **state)
{
	(void)state;
	static const char *const normals[] = { "", "property float nx\nproperty float ny\nproperty float nz\n" };
	static const char *const n[] = { "", " 0 0 1" };

	for (int k = 0; k < 2; k++) {
		char ply[1024];

		snprintf(ply, sizeof ply,
		         ASCII_HEADER "element vertex 4\n" XYZ "%selement face 2\n" LIST
		                      "property uchar red\nproperty uchar green\nproperty uchar blue\n" END
		                      "0 0 0%s\n1 0 0%s\n1 1 0%s\n0 1 0%s\n3 0 1 2 255 0 0\n3 0 2 3 0 0 255\n",
		         normals[k], n[k], n[k], n[k], n[k]);
		struct psr_mesh *m = accept_text(ply);

		assert_int_equal(m->n_vertices, 6);
		for (int c = 0; c < 3; c++) {
			assert_true(m->color[m->triangle[0][c]][0] == 1 && m->color[m->triangle[0][c]][2] == 0);
			assert_true(m->color[m->triangle[1][c]][0] == 0 && m->color[m->triangle[1][c]][2] == 1);
			assert_true(m->normal[m->triangle[1][c]][2] == 1);
		}
		assert_true(m->material[0].base_color[0] == 1);
		psr_mesh_destroy(m);
	}
}

static void normals_and_texture_coordinates_come_along(void **state)
{
	(void)state;
	static const char *const name[][2] = { { "s", "t" }, { "u", "v" }, { "texture_u", "texture_v" } };

	for (int k = 0; k < 3; k++) {
		char ply[1024];

		snprintf(ply, sizeof ply,
		         ASCII_HEADER "element vertex 4\n" XYZ "property float nx\nproperty float ny\nproperty float nz\n"
		                      "property float %s\nproperty float %s\nelement face 2\n" LIST END
		                      "0 0 0 0 0 2 0 0\n1 0 0 0 0 1 1 0\n1 1 0 0 3 4 1 0.75\n"
		                  "0 1 0 0 0 1 0 1\n3 0 1 2\n3 0 2 3\n",
		         name[k][0], name[k][1]);
		struct psr_mesh *m = accept_text(ply);
		const uint32_t *v = m->triangle[0];

		assert_int_equal(m->n_vertices, 4);
		assert_true(m->normal[v[0]][2] == 1 && m->normal[v[2]][1] == 0.6f && m->normal[v[2]][2] == 0.8f);
		/* v grows upwards in the file */
		assert_true(m->uv[0][v[2]][0] == 1 && m->uv[0][v[2]][1] == 0.25f && m->uv[0][v[0]][1] == 1);
		psr_mesh_destroy(m);
	}
}

static void a_missing_texture_is_left_out_with_a_warning(void **state)
{
	(void)state;
	/* as MeshLab writes them: a name in a comment, two coordinates a corner */
	struct psr_mesh *m = accept_text(ASCII_HEADER
	                                 "comment TextureFile not here.png \nelement vertex 3\n" XYZ "element face 1\n" LIST
	                                 "property list uchar float texcoord\nproperty int texnumber\n" END
	                                 "0 0 0\n1 0 0\n0 1 0\n3 0 1 2 6 0 0 1 0 0 1 0\n");

	assert_non_null(strstr(m->warning, "\"not here.png\""));
	assert_int_equal(m->material[0].base_texture.image, -1);
	for (int c = 0; c < 3; c++) {
		assert_true(m->uv[0][m->triangle[0][c]][0] == (c == 1));
		assert_true(m->uv[0][m->triangle[0][c]][1] == (c == 2 ? 0 : 1));
	}
	psr_mesh_destroy(m);
}

static void lines_are_left_out_and_counted(void **state)
{
	(void)state;
	struct psr_mesh *m = accept_text(ASCII_HEADER "element vertex 2\n" XYZ "element face 0\n" LIST
	                                              "element edge 1\nproperty int vertex1\nproperty int vertex2\n" END
	                                              "0 0 0\n1 0 0\n0 1\n");

	assert_int_equal(m->n_points, 2);
	assert_int_equal(m->n_dropped_primitives, 1);
	assert_non_null(strstr(m->warning, "lines were left out: 1"));
	psr_mesh_destroy(m);
}

static void a_comment_without_the_word_is_passed_over(void **state)
{
	(void)state;
	struct psr_mesh *m = accept_text(ASCII_HEADER "Created by hand\nelement vertex 1\n" XYZ END "0 0 0\n");

	assert_non_null(strstr(m->warning, "line 3"));
	psr_mesh_destroy(m);
}

static void headers_that_lie_are_refused(void **state)
{
	(void)state;
	static const struct {
		const char *ply;
		int code;
		const char *part;
	} lies[] = {
		{ "plyx\nformat ascii 1.0\n" END, PSR_ERR_FORMAT, "\"ply\"" },
		{ "ply\n" END, PSR_ERR_FORMAT, "line 2: the header ends without a format" },
		{ "ply\nformat ascii 1.0\nelement vertex 3\n", PSR_ERR_FORMAT, "no end_header" },
		{ "ply\nformat ascii 1.1\n" END, PSR_ERR_UNSUPPORTED, "version 1.1" },
		{ "ply\nformat binary 1.0\n" END, PSR_ERR_FORMAT, "line 2: the format is not ascii" },
		{ ASCII_HEADER "format ascii 1.0\n" END, PSR_ERR_FORMAT, "line 3: a second format" },
		{ ASCII_HEADER "element vertex\n" END, PSR_ERR_FORMAT, "line 3: expected \"element NAME COUNT\"" },
		{ ASCII_HEADER "element vertex -1\n" END, PSR_ERR_FORMAT, "line 3: expected" },
		{ ASCII_HEADER "element vertex 1\n" XYZ "element vertex 1\n" END, PSR_ERR_FORMAT,
		  "line 7: a second element \"vertex\"" },
		{ ASCII_HEADER "element vertex 1\n" XYZ "property int x\n" END, PSR_ERR_FORMAT,
		  "line 7: a second property \"x\" of \"vertex\"" },
		{ ASCII_HEADER "property int x\n" END, PSR_ERR_FORMAT, "line 3: a property before any element" },
		{ ASCII_HEADER "element vertex 1\nproperty quad x\n" END, PSR_ERR_FORMAT, "line 4: \"quad\" is not a type" },
		{ ASCII_HEADER "element vertex 1\nproperty list float int x\n" END, PSR_ERR_FORMAT, "line 4: the length" },
		{ ASCII_HEADER "element vertex 1\nproperty int\n" END, PSR_ERR_FORMAT, "line 4: expected" },
		{ ASCII_HEADER "element vertex 1\nproperty float x\nproperty float y\n" END "1 2\n", PSR_ERR_FORMAT,
		  "line 3: the element vertex has no property z" },
		{ ASCII_HEADER "element face 0\n" LIST END, PSR_ERR_FORMAT, "no element vertex" },
		{ ASCII_HEADER "element vertex 1\n" XYZ "element face 1\nproperty int vertex_indices\n" END "1 2 3\n4\n",
		  PSR_ERR_FORMAT, "line 7: the element \"face\" has no list of vertex_indices" },
		{ ASCII_HEADER "element vertex 99999999999999999999999\n" XYZ END "1 2 3\n", PSR_ERR_FORMAT,
		  "line 3: the header" },
		{ ASCII_HEADER "element vertex 3\n" XYZ END "1 2 3\n1 2 3\n", PSR_ERR_FORMAT, "3 elements \"vertex\"" },
		{ ASCII_HEADER "element vertex 0\n" XYZ END, PSR_ERR_FORMAT, "no triangle or point" },
	};

	for (size_t i = 0; i < sizeof lies / sizeof lies[0]; i++)
		refuse_text(lies[i].ply, lies[i].code, lies[i].part);
}

static void rows_that_lie_are_refused_with_their_place(void **state)
{
	(void)state;
#define TRIANGLE ASCII_HEADER "element vertex 3\n" XYZ "element face 1\n" LIST END "0 0 0\n1 0 0\n"
	static const struct {
		const char *ply, *part;
	} lies[] = {
		{ TRIANGLE "0 1 0\n3 0 1 3\n", "line 13: face 0 refers to vertex 3, but there are only 3" },
		{ TRIANGLE "0 1 0\n3 0 1 -1\n", "line 13: face 0 refers to vertex -1" },
		{ TRIANGLE "0 1 0\n3 0 1 1.5\n", "refers to vertex 1.5" },
		{ TRIANGLE "0 1 0\n3 0 1 nan\n", "face 0 refers to vertex" },
		{ TRIANGLE "0 1 0\n-3 0 1 2\n", "line 13: face 0 has a list of -3 items" },
		{ TRIANGLE "0 1 0\n1e30 0 1 2\n", "face 0 has a list of" },
		{ TRIANGLE "0 1 0\n200 0 1 2\n", "face 0 has a list of 200 items, but the file ends before" },
		{ TRIANGLE "0 1 0\n4 0 1 2\n", "face 0 " },
		{ TRIANGLE "0 1 0\n3 0 1\n", "face 0 " },
		{ TRIANGLE "0 1\n3 0 1 2 \n", "line 13: vertex 2 does not have the 3 properties" },
		{ TRIANGLE "0 1 0 4\n3 0 1 2\n", "line 12: vertex 2 does not have the 3 properties" },
		{ TRIANGLE "0 one 0\n3 0 1 2\n", "line 12: vertex 2 has a value that is not a number" },
		{ TRIANGLE "0 0x1 0\n3 0 1 2\n", "line 12: vertex 2 has a value that is not a number" },
		{ TRIANGLE "0 1,5 0\n3 0 1 2\n", "line 12: vertex 2 has a value that is not a number" },
	};

	for (size_t i = 0; i < sizeof lies / sizeof lies[0]; i++)
		refuse_text(lies[i].ply, PSR_ERR_FORMAT, lies[i].part);
}

static void lists_that_claim_everything_are_refused_at_once(void **state)
{
	(void)state;
	static struct file f;

	for (int format = LITTLE; format <= BIG; format++) {
		begin(&f, format);
		text(&f, "element vertex 1\n" XYZ "element face 1\nproperty list uint uint vertex_indices\n" END);
		for (int c = 0; c < 3; c++)
			put(&f, "float", c);
		put(&f, "uint", 4294967295.0);
		put(&f, "uint", 0);
		refuse_scan(import_ply, "x.ply", f.at, f.n, PSR_ERR_FORMAT, "face 0 has a list of 4294967295 items");
	}
}

static void cut_files_are_refused_at_every_length(void **state)
{
	(void)state;
	static struct file f;

	for (int format = ASCII; format <= BIG; format++) {
		begin(&f, format);
		text(&f, "comment c\nelement vertex 4\n" XYZ "property uchar red\nproperty uchar green\nproperty uchar blue\n");
		text(&f, "element face 2\n" LIST "property double area\n" END);
		for (int v = 0; v < 4; v++) {
			for (int c = 0; c < 3; c++)
				put(&f, "float", c == v);
			for (int c = 0; c < 3; c++)
				put(&f, "uchar", 9);
			end_row(&f);
		}
		for (int t = 0; t < 2; t++) {
			put(&f, "uchar", 3);
			for (int c = 0; c < 3; c++)
				put(&f, "int", t + c);
			put(&f, "double", 0.5);
			end_row(&f);
		}
		psr_mesh_destroy(accept_ply(&f));
		/* text: "0.5 \n" may lose its end and be a number still */
		for (size_t n = 0; n < f.n - (format == ASCII ? 5 : 0); n++) {
			struct psr_error err;

			assert_null(read_scan(import_ply, "x.ply", f.at, n, &err));
			assert_true(err.code == PSR_ERR_FORMAT || err.code == PSR_ERR_UNSUPPORTED);
		}
	}
}

static void what_is_not_finite_is_left_out(void **state)
{
	(void)state;
	struct psr_mesh *m = accept_text(ASCII_HEADER "element vertex 5\n" XYZ "element face 4\n" LIST END
	                                              "0 0 0\n1 0 0\n0 1 0\nnan 0 0\n9 9 9\n"
	                                              "3 0 1 2\n3 0 1 3\n3 1 1 2\n3 2 0 1\n");

	assert_int_equal(m->n_triangles, 1);
	assert_int_equal(m->n_vertices, 3);
	assert_int_equal(m->n_dropped_triangles, 3); /* not finite, without area, there twice */
	psr_mesh_destroy(m);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_type_reads_the_same_in_every_format),
		cmocka_unit_test(negative_values_keep_their_sign),
		cmocka_unit_test(text_is_read_to_the_last_bit),
		cmocka_unit_test(numbers_may_be_short_and_long),
		cmocka_unit_test(survey_coordinates_keep_their_millimetres),
		cmocka_unit_test(lines_may_end_in_any_way),
		cmocka_unit_test(polygons_are_cut_and_small_ones_counted),
		cmocka_unit_test(faces_may_come_before_vertices),
		cmocka_unit_test(strips_turn_every_other_triangle_and_start_anew),
		cmocka_unit_test(colors_of_vertices_are_linear_light),
		cmocka_unit_test(colors_of_faces_count_where_vertices_have_one_color),
		cmocka_unit_test(colors_of_faces_split_their_vertices),
		cmocka_unit_test(normals_and_texture_coordinates_come_along),
		cmocka_unit_test(a_missing_texture_is_left_out_with_a_warning),
		cmocka_unit_test(lines_are_left_out_and_counted),
		cmocka_unit_test(a_comment_without_the_word_is_passed_over),
		cmocka_unit_test(headers_that_lie_are_refused),
		cmocka_unit_test(rows_that_lie_are_refused_with_their_place),
		cmocka_unit_test(lists_that_claim_everything_are_refused_at_once),
		cmocka_unit_test(cut_files_are_refused_at_every_length),
		cmocka_unit_test(what_is_not_finite_is_left_out),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
