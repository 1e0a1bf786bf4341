/* OBJ's vertices: in doubles, in every form that they are written in. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "base/srgb.h"
#include "files.h"
#include "import/assimp/obj.h"

#define SIDE 60

/* 2 cm apart at survey coordinates, where a float is 3 to 6 cm off; written as in a file of millimetres. */
static void survey_point(char text[3][32], int i, int j)
{
	snprintf(text[0], sizeof text[0], "%.3f", 637000.017 + 0.02 * i);
	snprintf(text[1], sizeof text[1], "%.3f", 851000.039 + 0.02 * j);
	snprintf(text[2], sizeof text[2], "%.3f", 112.5 + 0.001 * ((7 * i + 13 * j) % 5));
}

static void a_scan_at_survey_coordinates_keeps_its_triangles(void **state)
{
	(void)state;
	FILE *file = fopen(path_of("survey.obj"), "w");
	char text[3][32];

	assert_non_null(file);
	for (int j = 0; j <= SIDE; j++)
		for (int i = 0; i <= SIDE; i++) {
			survey_point(text, i, j);
			fprintf(file, "v %s %s %s\n", text[0], text[1], text[2]);
		}
	for (int j = 0; j < SIDE; j++)
		for (int i = 0; i < SIDE; i++) {
			const int a = j * (SIDE + 1) + i + 1;

			fprintf(file, "f %d %d %d %d\n", a, a + 1, a + SIDE + 2, a + SIDE + 1);
		}
	assert_int_equal(fclose(file), 0);
	struct psr_mesh *m = import("survey.obj");

	assert_int_equal(m->n_triangles, 2 * SIDE * SIDE);
	assert_int_equal(m->n_dropped_triangles, 0);
	for (uint32_t v = 0; v < m->n_vertices; v++) {
		const double *p = m->position[v];

		/* the double that C reads */
		survey_point(text, (int)lrint((p[0] - 637000.017) / 0.02), (int)lrint((p[1] - 851000.039) / 0.02));
		for (int c = 0; c < 3; c++)
			assert_true(p[c] == strtod(text[c], NULL));
	}
	psr_mesh_destroy(m);
}

/* A triangle of the lines `v`, whose corners are at (0.1, 0, 0), (1.1, 0, 0), (0.1, 1, 0). */
static struct psr_mesh *import_triangle(const char *v)
{
	char text[1024];

	snprintf(text, sizeof text, "# a triangle\n%sf 1 2 3\n", v);
	write_text("triangle.obj", text);
	struct psr_mesh *m = import("triangle.obj");

	assert_int_equal(m->n_triangles, 1);
	for (int c = 0; c < 3; c++) {
		const double *p = m->position[m->triangle[0][c]];

		if (!(p[0] == (c == 1 ? 1.1 : 0.1) && p[1] == (c == 2) && p[2] == 0.0))
			fail_msg("corner %d is at %.17g, %.17g, %.17g in:\n%s", c, p[0], p[1], p[2], text);
	}
	return m;
}

static void vertices_are_read_in_every_form(void **state)
{
	(void)state;
	static const char *const forms[] = {
		"v 0.1 0 0\nv 1.1 0 0\nv 0.1 1 0\n",
		"v 0.1 0 0\r\nv 1.1 0 0\r\nv 0.1 1 0\r\n",
		"v\t.1\t0\t0\n  v  1.1  0  0 \nv 1e-1 +1. -0\n",
		"v 0.1 0 0 # first 1 2 3\nv 1.1 0 0#second\nv 0.1 1 0\n#v 9 9 9\n",
		"v 0.1 \\\n0 0\nv 1.1 0 \\\r\n 0\nv 0.1 1 0\n",
		"v 0.2 0 0 2\nv 1.1 0 0 1\nv 0.05 0.5 0 0.5\n",
		"v 0,1 0 0\nv 1,1 0 0\nv 0,1 1 0\n",
		"vn 0 0 1\nv 0.1 0 0\nvt 0 0\nv 1.1 0 0\nvp 1 1\nv 0.1 1 0\n",
	};

	for (size_t i = 0; i < sizeof forms / sizeof forms[0]; i++)
		psr_mesh_destroy(import_triangle(forms[i]));
}

static void colors_of_vertices_stay(void **state)
{
	(void)state;
	struct psr_mesh *m = import_triangle("v 0.1 0 0 1 0 0\nv 1.1 0 0 0 1 0\nv 0.1 1 0 0 0 1\n");

	assert_non_null(m->color);
	for (int c = 0; c < 3; c++)
		for (int i = 0; i < 3; i++)
			assert_true(m->color[m->triangle[0][c]][i] == (i == c ? 1.0f : 0.0f));
	psr_mesh_destroy(m);
}

static void indices_from_the_end_are_counted_in_vertices(void **state)
{
	(void)state;
	write_text("relative.obj", "v 5 5 5\nv 0.1 0 0\nv 1.1 0 0\nv 0.1 1 0\nf -3 -2 -1\nv 0 0 7\nv 1 0 7\nv 0 1 7\nf -3 -2 -1\n");
	struct psr_mesh *m = import("relative.obj");

	assert_int_equal(m->n_triangles, 2);
	assert_true(m->position[m->triangle[0][0]][0] == 0.1 && m->position[m->triangle[1][2]][2] == 7.0);
	psr_mesh_destroy(m);
}

static void a_vertex_that_is_not_finite_costs_its_faces_only(void **state)
{
	(void)state;
	write_text("nan.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nv 1 1 1 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\n");
	struct psr_mesh *m = import("nan.obj");

	assert_int_equal(m->n_triangles, 1);
	assert_int_equal(m->n_dropped_triangles, 2);
	psr_mesh_destroy(m);
}

static void a_vertex_that_is_no_number_is_refused_with_its_line(void **state)
{
	(void)state;
	write_text("bad.obj", "# one\nv 0 0 0\nv 1 0 \\\n0\nv 0 1x 0\nf 1 2 3\n");
	refuse("bad.obj", PSR_ERR_FORMAT, "line 5: \"1x\" is no number");
}

/* With a coordinate of a texture that no face uses, Assimp reads it. */
static void assert_plain_as_through_assimp(const char *text, int is_plain)
{
	struct import_mesh im;
	struct psr_error err;
	char other[2048];

	assert_int_equal(import_mesh_init(&im, "plain.obj", &err), PSR_OK);
	if (obj_read_plain(&im, (const uint8_t *)text, strlen(text), &err) != is_plain)
		fail_msg("this is%s plain:\n%s", is_plain ? "" : " not", text);
	assert_int_equal(im.mesh->n_triangles > 0, is_plain);
	import_mesh_fini(&im);

	snprintf(other, sizeof other, "vt 0 0\n%s", text);
	write_text("plain.obj", text);
	write_text("other.obj", other);
	struct psr_mesh *a = import("plain.obj"), *b = import("other.obj");

	assert_int_equal(a->n_triangles, b->n_triangles);
	assert_int_equal(a->n_vertices, b->n_vertices);
	assert_int_equal(a->n_dropped_triangles, b->n_dropped_triangles);
	assert_int_equal(a->n_dropped_primitives, b->n_dropped_primitives);
	assert_int_equal(a->n_materials, b->n_materials);
	assert_memory_equal(a->material, b->material, sizeof *a->material);
	assert_string_equal(a->warning, b->warning);
	assert_null(a->color);
	assert_null(a->uv[0]);
	for (uint32_t i = 0; i < 3 * a->n_triangles; i++) {
		const uint32_t v = a->triangle[i / 3][i % 3], w = b->triangle[i / 3][i % 3];

		assert_int_equal(a->triangle_material[i / 3], 0);
		assert_memory_equal(a->position[v], b->position[w], sizeof *a->position);
		assert_memory_equal(a->normal[v], b->normal[w], sizeof *a->normal);
	}
	psr_mesh_destroy(a);
	psr_mesh_destroy(b);
}

#define CUBE \
	"v 0.1 0 0\nv 1 0 0\nv 1 1 0\nv 0.1 1 0\nv 0.1 0 1\nv 1 0 1\nv 1 1 1.00000000000000001\nv 0.1 1 1\n" \
	"f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"

static void a_plain_file_gives_the_mesh_that_assimp_gives(void **state)
{
	(void)state;
	static const char *const plain[] = {
		CUBE,
		"# a cube\no cube\ng all\ns 1\n" CUBE "s off\n# the end",
		"v 0 0 0\r\nv 4 0 0 \r\nv 4 4 0\r\nv 2 1 0\r\nv 0 4 0\r\n\r\nf 1 2 3 4 5\r\n", /* not convex */
		"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0\nv nan 0 0\nf 1 2 3\nf 4 2 3\nf 1 1 2\nf 5 2 3\n",
		"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nv 1 1 1\nf 2 4 3",
	};
	static const char *const other[] = {
		CUBE "g top\nf 5 6 7\n",
		CUBE "f 1 2\nl 1 2\n",
		CUBE "usemtl red\nf 5 7 6\n",
		CUBE "f -1 -2 -3\n",
		"v 0 0 0\nv 1 0 0\nv 1.5 1 2#0 7\nf 1 2 3\n",
		"v 0 0 0\nv 1 0 0\n# old\rv 0 1 0\nv 0 0 1\nf 1 2 3\n",
		"v 0 0 0\nv 1 0 0\nv 0 1 0 # up\nf 1 \\\n2 3\n",
	};

	for (size_t i = 0; i < sizeof plain / sizeof plain[0]; i++)
		assert_plain_as_through_assimp(plain[i], 1);
	for (size_t i = 0; i < sizeof other / sizeof other[0]; i++)
		assert_plain_as_through_assimp(other[i], 0);
}

static void a_plain_file_with_a_wrong_index_is_refused(void **state)
{
	(void)state;
	static const char *const faces[] = { "f 1 2 9\n", "f 1 2 99999999999999999999\n", "f 1 2 4294967297\n" };
	char text[256];

	for (size_t i = 0; i < sizeof faces / sizeof faces[0]; i++) {
		snprintf(text, sizeof text, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n%s", faces[i]);
		write_text("index.obj", text);
		refuse("index.obj", PSR_ERR_FORMAT, "");
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_scan_at_survey_coordinates_keeps_its_triangles),
		cmocka_unit_test(vertices_are_read_in_every_form),
		cmocka_unit_test(colors_of_vertices_stay),
		cmocka_unit_test(indices_from_the_end_are_counted_in_vertices),
		cmocka_unit_test(a_vertex_that_is_not_finite_costs_its_faces_only),
		cmocka_unit_test(a_vertex_that_is_no_number_is_refused_with_its_line),
		cmocka_unit_test(a_plain_file_gives_the_mesh_that_assimp_gives),
		cmocka_unit_test(a_plain_file_with_a_wrong_index_is_refused),
	};

	return cmocka_run_group_tests_name("import_obj", tests, make_folder, remove_folder);
}
