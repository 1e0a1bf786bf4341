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

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_scan_at_survey_coordinates_keeps_its_triangles),
		cmocka_unit_test(vertices_are_read_in_every_form),
		cmocka_unit_test(colors_of_vertices_stay),
		cmocka_unit_test(indices_from_the_end_are_counted_in_vertices),
		cmocka_unit_test(a_vertex_that_is_not_finite_costs_its_faces_only),
		cmocka_unit_test(a_vertex_that_is_no_number_is_refused_with_its_line),
	};

	return cmocka_run_group_tests_name("import_obj", tests, make_folder, remove_folder);
}
