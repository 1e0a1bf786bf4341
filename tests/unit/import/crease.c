/* Normals made for files without: solids of revolution and plates with a hole, as STL, which shares no vertex. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "files.h"

#define DEGREES (M_PI / 180)
#define MAX_TRIANGLES 4096

static float soup[MAX_TRIANGLES][3][3];
static uint32_t n_soup;

static void add(const double a[3], const double b[3], const double c[3])
{
	assert_true(n_soup < MAX_TRIANGLES);
	for (int i = 0; i < 3; i++) {
		soup[n_soup][0][i] = (float)a[i];
		soup[n_soup][1][i] = (float)b[i];
		soup[n_soup][2][i] = (float)c[i];
	}
	n_soup++;
}

/* As a binary STL, whose facet normals are 0; with `crease` degrees. */
static struct psr_mesh *import_soup(double crease)
{
	static uint8_t bytes[84 + 50 * MAX_TRIANGLES];
	struct psr_import_options options;
	struct psr_error err = { 0, "" };
	struct psr_mesh *mesh = NULL;

	memset(bytes, 0, sizeof bytes);
	put_u32(bytes + 80, n_soup);
	for (uint32_t t = 0; t < n_soup; t++)
		memcpy(bytes + 84 + 50 * t + 12, soup[t], sizeof soup[t]);
	write_bytes(path_of("soup.stl"), bytes, 84 + 50 * (size_t)n_soup);
	psr_import_options_default(&options);
	options.crease = crease * DEGREES;
	if (psr_mesh_import(&mesh, path_of("soup.stl"), &options, &err) != PSR_OK)
		fail_msg("%s", err.text);
	return mesh;
}

static double default_crease(void)
{
	struct psr_import_options options;

	psr_import_options_default(&options);
	return options.crease / DEGREES;
}

static void on_circle(double p[3], double radius, double z, int i, int n)
{
	p[0] = radius > 0 ? radius * cos(2 * M_PI * (i % n) / n) : 0;
	p[1] = radius > 0 ? radius * sin(2 * M_PI * (i % n) / n) : 0;
	p[2] = z;
}

/* Turns a profile (radius, z) of n_rings around z in n steps; its outside is on its right. */
static void revolve(const double (*profile)[2], int n_rings, int n)
{
	for (int k = 0; k + 1 < n_rings; k++)
		for (int i = 0; i < n; i++) {
			double a[3], b[3], c[3], d[3];

			on_circle(a, profile[k][0], profile[k][1], i, n);
			on_circle(b, profile[k][0], profile[k][1], i + 1, n);
			on_circle(c, profile[k + 1][0], profile[k + 1][1], i, n);
			on_circle(d, profile[k + 1][0], profile[k + 1][1], i + 1, n);
			if (profile[k][0] > 0)
				add(a, b, d);
			if (profile[k + 1][0] > 0)
				add(a, d, c);
		}
}

/* The top (z = 0) of a plate of 20 x 20: long needles from a hole of n sides to the four corners. */
static void plate_top(double radius, int n)
{
	static const double corner[5][3] = { { 10, 10, 0 }, { -10, 10, 0 }, { -10, -10, 0 }, { 10, -10, 0 }, { 10, 10, 0 } };

	for (int i = 0; i < n; i++) {
		double a[3], b[3];
		const int quadrant = 4 * i / n, next = 4 * (i + 1) / n;

		on_circle(a, radius, 0, i, n);
		on_circle(b, radius, 0, i + 1, n);
		add(a, corner[quadrant], b);
		if (next != quadrant)
			add(b, corner[quadrant], corner[quadrant + 1]);
	}
}

static void face_normal(double n[3], const struct psr_mesh *m, uint32_t t)
{
	const double *a = m->position[m->triangle[t][0]], *b = m->position[m->triangle[t][1]],
	             *c = m->position[m->triangle[t][2]];
	double length;

	for (int i = 0; i < 3; i++)
		n[i] = (b[(i + 1) % 3] - a[(i + 1) % 3]) * (c[(i + 2) % 3] - a[(i + 2) % 3]) -
		       (b[(i + 2) % 3] - a[(i + 2) % 3]) * (c[(i + 1) % 3] - a[(i + 1) % 3]);
	length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
	for (int i = 0; i < 3; i++)
		n[i] /= length;
}

static const float *normal_at(const struct psr_mesh *m, uint32_t t, int c)
{
	return m->normal[m->triangle[t][c]];
}

static double cosine(const float a[3], const double b[3])
{
	return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* All corners of the faces of the plate's top: bit for bit. */
static void assert_top_is_flat(void)
{
	struct psr_mesh *m = import_soup(default_crease());
	uint32_t n_flat = 0;

	for (uint32_t t = 0; t < m->n_triangles; t++) {
		double face[3];

		face_normal(face, m, t);
		for (int c = 0; c < 3 && face[2] == 1.0; c++, n_flat++) {
			const float *n = normal_at(m, t, c);

			if (!(n[0] == 0.0f && n[1] == 0.0f && n[2] == 1.0f))
				fail_msg("a normal of the flat face is %g, %g, %g", n[0], n[1], n[2]);
		}
	}
	assert_int_equal(n_flat, 3 * 52);
	psr_mesh_destroy(m);
}

static void a_plate_stays_flat_around_a_chamfered_hole(void **state)
{
	(void)state;
	static const double chamfer[3][2] = { { 5, 0 }, { 4, -1 }, { 4, -2 } }, shallow[3][2] = { { 5, 0 }, { 4, -0.3 }, { 4, -2 } };

	n_soup = 0;
	plate_top(5, 48);
	revolve(chamfer, 3, 48);
	assert_top_is_flat();
	n_soup = 0;
	plate_top(5, 48);
	revolve(shallow, 3, 48);
	assert_top_is_flat();
}

static void a_plate_stays_flat_beside_a_fillet(void **state)
{
	(void)state;
	double profile[10][2] = { { 5, 0 } };

	for (int k = 1; k <= 8; k++) {
		profile[k][0] = 5 - sin(M_PI / 2 * k / 8);
		profile[k][1] = cos(M_PI / 2 * k / 8) - 1;
	}
	profile[9][0] = 4;
	profile[9][1] = -2;
	n_soup = 0;
	plate_top(5, 48);
	revolve((const double(*)[2])profile, 10, 48);
	assert_top_is_flat();
	/* The fillet itself is smooth: one normal a vertex of its inner rings, which are at z below 0 and above -1. */
	struct psr_mesh *m = import_soup(default_crease());
	uint32_t n_inner = 0;

	for (uint32_t v = 0; v < m->n_vertices; v++)
		n_inner += m->position[v][2] < -1e-6 && m->position[v][2] > -1 + 1e-6;
	assert_int_equal(n_inner, 7 * 48);
	psr_mesh_destroy(m);
}

static void cube(void)
{
	for (int axis = 0; axis < 3; axis++)
		for (int side = 0; side < 2; side++) {
			double p[4][3];

			for (int i = 0; i < 4; i++) {
				p[i][axis] = side;
				p[i][(axis + 1) % 3] = i == 1 || i == 2;
				p[i][(axis + 2) % 3] = i >= 2;
			}
			add(p[0], p[side ? 1 : 2], p[side ? 2 : 1]);
			add(p[0], p[side ? 2 : 3], p[side ? 3 : 2]);
		}
}

static void a_cube_has_three_normals_at_each_corner(void **state)
{
	(void)state;
	n_soup = 0;
	cube();
	struct psr_mesh *m = import_soup(default_crease());

	assert_int_equal(m->n_vertices, 24);
	for (uint32_t t = 0; t < 12; t++)
		for (int c = 0; c < 3; c++) {
			double face[3];

			face_normal(face, m, t);
			assert_true(cosine(normal_at(m, t, c), face) == 1.0);
		}
	psr_mesh_destroy(m);
}

static void a_crease_of_180_degrees_rounds_a_cube(void **state)
{
	(void)state;
	n_soup = 0;
	cube();
	struct psr_mesh *m = import_soup(180);

	assert_int_equal(m->n_vertices, 8);
	for (uint32_t v = 0; v < 8; v++)
		for (int i = 0; i < 3; i++)
			assert_true((m->normal[v][i] > 0) == (m->position[v][i] > 0.5) && fabsf(m->normal[v][i]) > 0.1f);
	psr_mesh_destroy(m);
}

static void a_crease_of_0_keeps_every_face(void **state)
{
	(void)state;
	static const double cylinder[4][2] = { { 0, 0 }, { 5, 0 }, { 5, 12 }, { 0, 12 } };

	n_soup = 0;
	revolve(cylinder, 4, 64);
	struct psr_mesh *m = import_soup(0);

	for (uint32_t t = 0; t < m->n_triangles; t++)
		for (int c = 0; c < 3; c++) {
			double face[3];

			face_normal(face, m, t);
			/* 1 - cosine is half the squared angle; the two halves of a side are one plane but for floats */
			assert_true(cosine(normal_at(m, t, c), face) > 1 - 1e-6);
		}
	psr_mesh_destroy(m);
}

static void the_side_of_a_cylinder_is_smooth_and_its_ends_flat(void **state)
{
	(void)state;
	static const double cylinder[4][2] = { { 0, 0 }, { 5, 0 }, { 5, 12 }, { 0, 12 } };

	for (int n = 16; n <= 64; n *= 2) {
		n_soup = 0;
		revolve(cylinder, 4, n);
		struct psr_mesh *m = import_soup(default_crease());

		/* on each rim two normals a place, and the middles of the ends */
		assert_int_equal(m->n_vertices, 4 * n + 2);
		for (uint32_t v = 0; v < m->n_vertices; v++) {
			const double *p = m->position[v];
			const float *normal = m->normal[v];

			if (normal[2] != 0.0f) {
				assert_true(fabsf(normal[2]) == 1.0f && (normal[2] > 0) == (p[2] > 6));
				continue;
			}
			/* Radial by symmetry, but for edges of 0.49 and more between floats of up to 5 (2^-22 off): 2 * 2^-22 / 0.49
			 * = 1e-6. */
			assert_true(fabs(normal[0] - p[0] / 5) < 2e-6 && fabs(normal[1] - p[1] / 5) < 2e-6);
		}
		psr_mesh_destroy(m);
	}
}

static void eight_sides_of_45_degrees_are_edges_by_default(void **state)
{
	(void)state;
	static const double cylinder[4][2] = { { 0, 0 }, { 5, 0 }, { 5, 12 }, { 0, 12 } };

	n_soup = 0;
	revolve(cylinder, 4, 8);
	struct psr_mesh *edged = import_soup(default_crease()), *smooth = import_soup(50);

	assert_int_equal(edged->n_vertices, 6 * 8 + 2);
	assert_int_equal(smooth->n_vertices, 4 * 8 + 2);
	psr_mesh_destroy(edged);
	psr_mesh_destroy(smooth);
}

/* All normals of such a tip together would give the axis, which is 31 degrees from each. */
static void the_tip_of_a_flat_cone_stays_pointed(void **state)
{
	(void)state;
	static const double cone[3][2] = { { 0, 0 }, { 5, 0 }, { 0, 3 } };

	for (int n = 16; n <= 64; n *= 2) {
		n_soup = 0;
		revolve(cone, 3, n);
		struct psr_mesh *m = import_soup(default_crease());

		for (uint32_t t = 0; t < m->n_triangles; t++)
			for (int c = 0; c < 3; c++) {
				double face[3];

				face_normal(face, m, t);
				/* 0.6 of 35 degrees: the mean of faces that are no further away is no further away */
				assert_true(cosine(normal_at(m, t, c), face) > cos(21 * DEGREES));
			}
		psr_mesh_destroy(m);
	}
}

/* Twelve steps of 30 degrees around, six from pole to pole. */
static void a_coarse_sphere_is_smooth(void **state)
{
	(void)state;
	double profile[7][2];

	for (int k = 0; k <= 6; k++) {
		profile[k][0] = k % 6 == 0 ? 0 : 5 * sin(M_PI * k / 6);
		profile[k][1] = -5 * cos(M_PI * k / 6);
	}
	n_soup = 0;
	revolve((const double(*)[2])profile, 7, 12);
	struct psr_mesh *m = import_soup(default_crease());

	assert_int_equal(m->n_vertices, 5 * 12 + 2);
	psr_mesh_destroy(m);
}

/* Programs compute the pole of a ball once for each meridian, and sin(pi) is no 0. */
static void a_sphere_is_smooth_whose_poles_differ_by_roundings(void **state)
{
	(void)state;
	const double radius = sin(M_PI);
	double from[3], to[3], pole[3], ring = sin(M_PI / 6), z = cos(M_PI / 6);

	assert_true(radius > 0);
	n_soup = 0;
	for (int end = -1; end <= 1; end += 2)
		for (int i = 0; i < 12; i++) {
			on_circle(pole, radius, end, i, 12);
			on_circle(from, ring, end * z, i, 12);
			on_circle(to, ring, end * z, i + 1, 12);
			add(pole, end > 0 ? from : to, end > 0 ? to : from);
		}
	struct psr_mesh *m = import_soup(default_crease());

	/* Shares of 12 corners that are alike all around leave nothing but floats' roundings. */
	for (uint32_t v = 0; v < m->n_vertices; v++)
		if (fabs(m->position[v][2]) > 0.99)
			assert_true(fabsf(m->normal[v][2]) > 1 - 1e-6f);
	psr_mesh_destroy(m);
}

/* Six sides of 42 degrees, which meet at 39; each of one triangle, or of two. */
static struct psr_mesh *import_pyramid(int is_cut)
{
	static const double top[3] = { 0, 0, 0.78 };

	n_soup = 0;
	for (int i = 0; i < 6; i++) {
		double a[3], b[3], middle[3];

		on_circle(a, 1, 0, i, 6);
		on_circle(b, 1, 0, i + 1, 6);
		for (int c = 0; c < 3; c++)
			middle[c] = (a[c] + b[c]) / 2;
		add(a, is_cut ? middle : b, top);
		if (is_cut)
			add(middle, b, top);
	}
	return import_soup(default_crease());
}

static void a_step_is_an_edge_between_flat_parts_and_none_between_single_triangles(void **state)
{
	(void)state;
	struct psr_mesh *rough = import_pyramid(0), *flat = import_pyramid(1);

	assert_int_equal(rough->n_vertices, 6 + 1);
	/* a side's two halves share all normals, but for what the positions' floats leave of them */
	for (uint32_t t = 0; t < flat->n_triangles; t++)
		for (int c = 0; c < 3; c++) {
			double face[3];

			face_normal(face, flat, t);
			assert_true(cosine(normal_at(flat, t, c), face) > 1 - 1e-6);
		}
	psr_mesh_destroy(rough);
	psr_mesh_destroy(flat);
}

static void normals_that_a_file_brings_are_kept_at_any_crease(void **state)
{
	(void)state;
	struct psr_import_options options;
	struct psr_mesh *m = NULL;

	write_text("n.ply", "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
	                    "property float nx\nproperty float ny\nproperty float nz\nelement face 2\n"
	                    "property list uchar int vertex_indices\nend_header\n"
	                    "0 0 0 0 0.6 0.8\n1 0 0 0 0 1\n0 1 0 0 1 0\n0 0 -1 1 0 0\n3 0 1 2\n3 0 3 1\n");
	psr_import_options_default(&options);
	options.crease = 0;
	assert_int_equal(psr_mesh_import(&m, path_of("n.ply"), &options, NULL), PSR_OK);
	assert_int_equal(m->n_vertices, 4);
	assert_true(m->normal[0][1] == 0.6f && m->normal[0][2] == 0.8f && m->normal[3][0] == 1.0f);
	psr_mesh_destroy(m);
}

static void options_outside_of_their_ranges_are_refused(void **state)
{
	(void)state;
	static const struct psr_import_options bad[] = {
		{ -0.1, 1, 0, 1024, 0 },  { 3.2, 1, 0, 1024, 0 }, { NAN, 1, 0, 1024, 0 }, { 0.6, 0, 0, 1024, 0 },
		{ 0.6, 257, 0, 1024, 0 }, { 0.6, 1, 0, 7, 0 },    { 0.6, 1, 0, 8193, 0 },
	};

	n_soup = 0;
	cube();
	psr_mesh_destroy(import_soup(35));
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
		struct psr_mesh *m = NULL;

		assert_int_equal(psr_mesh_import(&m, path_of("soup.stl"), &bad[i], NULL), PSR_ERR_ARG);
		assert_null(m);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_plate_stays_flat_around_a_chamfered_hole),
		cmocka_unit_test(a_plate_stays_flat_beside_a_fillet),
		cmocka_unit_test(a_cube_has_three_normals_at_each_corner),
		cmocka_unit_test(a_crease_of_180_degrees_rounds_a_cube),
		cmocka_unit_test(a_crease_of_0_keeps_every_face),
		cmocka_unit_test(the_side_of_a_cylinder_is_smooth_and_its_ends_flat),
		cmocka_unit_test(eight_sides_of_45_degrees_are_edges_by_default),
		cmocka_unit_test(the_tip_of_a_flat_cone_stays_pointed),
		cmocka_unit_test(a_coarse_sphere_is_smooth),
		cmocka_unit_test(a_sphere_is_smooth_whose_poles_differ_by_roundings),
		cmocka_unit_test(a_step_is_an_edge_between_flat_parts_and_none_between_single_triangles),
		cmocka_unit_test(normals_that_a_file_brings_are_kept_at_any_crease),
		cmocka_unit_test(options_outside_of_their_ranges_are_refused),
	};

	return cmocka_run_group_tests_name("import_crease", tests, make_folder, remove_folder);
}
