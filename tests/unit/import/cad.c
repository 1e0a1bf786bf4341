/* Two pins of an assembly, 50 mm apart: red-brown cylinders of radius 10 and height 20. */
#define _GNU_SOURCE
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include <unistd.h>
#include "base/infile.h"
#include "dpoint/patch.h"
#include "import/import.h"
#include "files.h"

static int has_module;

static struct psr_mesh *read_pins(const char *path, uint32_t resolution)
{
	struct psr_import_options options;
	struct psr_mesh *mesh = NULL;
	struct psr_error err = { 0, "" };

	psr_import_options_default(&options);
	options.resolution = resolution;
	if (psr_mesh_import(&mesh, path, &options, &err) != PSR_OK)
		fail_msg("%s", err.text);
	return mesh;
}

/* Corners are within `edge` mm of the surface, which is the tolerance of its edges, and middles of sides within an
 * eighth of a pixel, of 70 / 256 mm. Normals are the surface's, of radius 10 mm, at a place as near to the corner, and
 * floats. */
static void check_pins(const char *path, double edge)
{
	struct psr_mesh *mesh = read_pins(path, 256);
	double area = 0;

	for (uint32_t t = 0; t < mesh->n_triangles; t++) {
		const double (*p)[3] = (const double (*)[3])mesh->position;
		const uint32_t *c = mesh->triangle[t];
		const struct psr_material *material;
		double a[3], b[3];

		for (int k = 0; k < 3; k++) {
			a[k] = p[c[1]][k] - p[c[0]][k];
			b[k] = p[c[2]][k] - p[c[0]][k];
		}
		area += sqrt(pow(a[1] * b[2] - a[2] * b[1], 2) + pow(a[2] * b[0] - a[0] * b[2], 2) +
		             pow(a[0] * b[1] - a[1] * b[0], 2)) / 2;
		for (int i = 0; i < 3; i++) {
			const uint32_t v = c[i], w = c[(i + 1) % 3];
			const double from = p[v][0] > 25 ? 50 : 0, x = p[v][0] - from, r = hypot(x, p[v][1]);
			const double middle = hypot((x + p[w][0] - from) / 2, (p[v][1] + p[w][1]) / 2);
			const float *n = mesh->normal[v];

			assert_true(fabs(r - 10) < edge && p[v][2] > -edge && p[v][2] < 20 + edge);
			if (fabsf(n[2]) < 0.5f) {
				assert_true(fabs((double)n[0] - x / 10) < edge / 10 + FLT_EPSILON &&
				            fabs((double)n[1] - p[v][1] / 10) < edge / 10 + FLT_EPSILON);
				assert_true(middle > 10 - 70.0 / 256 / 8 - edge);
			} else {
				assert_true(fabsf(n[2] - (p[v][2] > 10 ? 1.0f : -1.0f)) < 1e-6f);
			}
		}
		material = &mesh->material[mesh->triangle_material[t]];
		assert_true(fabsf(material->base_color[0] - 0.5f) < 0.01f && fabsf(material->base_color[2] - 0.125f) < 0.01f);
		assert_true(material->base_color[3] == 1 && material->alpha == PSR_ALPHA_OPAQUE);
	}
	/* Of polygons of at least 30 sides (0.2 radians): at most 1 - cos(pi / 30) = 0.6 % of a cylinder's side less, and
	 * 0.8 % of its ends. */
	assert_true(area > 2 * 600 * M_PI * 0.992 && area < 2 * 600 * M_PI);
	assert_true(mesh->up[2] == 1);
	psr_mesh_destroy(mesh);
}

static void step_has_places_normals_and_colors(void **state)
{
	(void)state;
	if (!has_module)
		skip();
	check_pins("tests/data/import/pins.step", 1e-7);
}

static void iges_has_places_normals_and_colors(void **state)
{
	(void)state;
	if (!has_module)
		skip();
	/* Open CASCADE reads the circles of cylinders as splines, and gives such an edge this tolerance. */
	check_pins("tests/data/import/pins.iges", 1e-5);
}

/* At a ball's poles triangles have no area: the file's one face has, and nothing of it is left out. */
static void poles_are_no_faces_without_area(void **state)
{
	struct psr_import_options options;
	struct psr_mesh *mesh = NULL;

	(void)state;
	if (!has_module)
		skip();
	psr_import_options_default(&options);
	options.has_patches = 1;
	assert_int_equal(psr_mesh_import(&mesh, "tests/data/import/ball.step", &options, NULL), PSR_OK);
	assert_int_equal(mesh->n_patches, 1);
	assert_int_equal(mesh->n_dropped_triangles, 0);
	assert_string_equal(mesh->warning, "");
	psr_mesh_destroy(mesh);
}

/* Deflection is absolute: four times as fine takes twice the sides, once the angle does not decide any more. */
static void a_finer_model_has_more_triangles(void **state)
{
	struct psr_mesh *coarse, *fine;

	(void)state;
	if (!has_module)
		skip();
	coarse = read_pins("tests/data/import/pins.step", 256);
	fine = read_pins("tests/data/import/pins.step", 8192);
	assert_true(fine->n_triangles > 2 * coarse->n_triangles);
	psr_mesh_destroy(coarse);
	psr_mesh_destroy(fine);
}

/* The span that u and v are in, and where they are in it. */
static void find_span(struct dpoint_span *span, double in[2], const struct dpoint_patch *patch, const double uv[2])
{
	for (int k = 0; k < 2; k++) {
		const double *knot = patch->knot[k];
		uint32_t i = (uint32_t)patch->degree[k];

		while (i + 1 < patch->n[k] && !(uv[k] < knot[i + 1] && knot[i] < knot[i + 1]))
			i++;
		span->at[k] = i;
		in[k] = (uv[k] - knot[i]) / (knot[i + 1] - knot[i]);
	}
}

/* Patches' corners are within `edge` of a pin, and have its normals: so a pin's side is one, and each of its ends. */
static void check_patches(const char *path, double edge)
{
	struct psr_import_options options;
	struct psr_mesh *mesh = NULL;
	struct psr_error err = { 0, "" };
	uint32_t n_triangles = 0;

	psr_import_options_default(&options);
	options.has_patches = 1;
	if (psr_mesh_import(&mesh, path, &options, &err) != PSR_OK)
		fail_msg("%s", err.text);
	assert_int_equal(mesh->n_patches, 6);
	for (uint32_t t = 0; t < mesh->n_triangles; t++)
		assert_true(mesh->triangle_patch[t] < mesh->n_patches);
	for (uint32_t i = 0; i < mesh->n_patches; i++) {
		const struct psr_patch *p = &mesh->patch[i];
		const struct dpoint_patch surface = { { p->degree[0], p->degree[1] }, { p->n[0], p->n[1] },
			                                  { p->knot[0], p->knot[1] }, (const double (*)[4])p->control };

		assert_int_equal(import_patch_check(p, mesh->n_materials, NULL), PSR_OK);
		n_triangles += p->n_triangles;
		for (uint32_t c = 0; c < p->n_corners; c++) {
			struct dpoint_local local;
			struct dpoint_span span;
			double in[2], x, r;

			find_span(&span, in, &surface, p->corner[c]);
			assert_true(dpoint_patch_local(&local, &surface, &span, in));
			x = local.at[0] - (local.at[0] > 25 ? 50 : 0);
			r = hypot(x, local.at[1]);
			assert_true(fabs(r - 10) < edge && local.at[2] > -edge && local.at[2] < 20 + edge);
			if (fabs(local.axis[2][2]) > 0.5)
				assert_true(fabs(local.axis[2][2] - (local.at[2] > 10 ? 1 : -1)) < 1e-9);
			else
				assert_true(fabs(local.axis[2][0] - x / r) < edge && fabs(local.axis[2][1] - local.at[1] / r) < edge);
		}
	}
	assert_true(n_triangles >= mesh->n_triangles);
	psr_mesh_destroy(mesh);
}

static void faces_are_patches_on_request(void **state)
{
	struct psr_mesh *mesh;

	(void)state;
	if (!has_module)
		skip();
	check_patches("tests/data/import/pins.step", 1e-6);
	check_patches("tests/data/import/pins.iges", 1e-5);
	mesh = read_pins("tests/data/import/pins.step", 256);
	assert_true(mesh->n_patches == 0 && mesh->triangle_patch == NULL);
	psr_mesh_destroy(mesh);
}

/* A face of degree 16, which no patch may have: z = -24 v (1 - v) (1 - x / 8)^16 over 16 x 8, with y = 8 v. Its triangles
 * are what there is, so they are off by an eighth of a pixel at most, also where patches were asked for; those of patches
 * are coarser. Open CASCADE looks at middles of triangles, which are off by 4/9 of what their sides are together: a side
 * by 3/2 of it, if another one is as long, as curvature measures them, and both make up the third. */
static void faces_without_a_patch_have_fine_triangles(void **state)
{
	struct psr_import_options options;
	struct psr_mesh *mesh = NULL;
	double worst = 0;

	(void)state;
	if (!has_module)
		skip();
	psr_import_options_default(&options);
	options.has_patches = 1;
	options.resolution = 256;
	assert_int_equal(psr_mesh_import(&mesh, "tests/data/import/wave.step", &options, NULL), PSR_OK);
	assert_int_equal(mesh->n_patches, 0);
	for (uint32_t t = 0; t < mesh->n_triangles; t++)
		for (int i = 0; i < 3; i++) {
			const double *a = mesh->position[mesh->triangle[t][i]], *b = mesh->position[mesh->triangle[t][(i + 1) % 3]];
			const double x = 1 - (a[0] + b[0]) / 16, v = (a[1] + b[1]) / 16, across = 24 * v * (1 - v);
			const double along_x = 2 * across * pow(x, 15), along_y = 3 * (1 - 2 * v) * pow(x, 16);

			worst = fmax(worst, fabs((a[2] + b[2]) / 2 + across * pow(x, 16)) / sqrt(1 + along_x * along_x + along_y * along_y));
		}
	if (!(worst <= 1.5 * 16.0 / 256 / 8))
		fail_msg("%g", worst);
	psr_mesh_destroy(mesh);
}

/* By one thread and by two. */
static void threads_change_nothing(void **state)
{
	struct psr_import_options options;
	struct psr_mesh *mesh[2] = { NULL, NULL };

	(void)state;
	if (!has_module)
		skip();
	psr_import_options_default(&options);
	options.has_patches = 1;
	for (int i = 0; i < 2; i++) {
		options.n_threads = i + 1;
		assert_int_equal(psr_mesh_import(&mesh[i], "tests/data/import/pins.step", &options, NULL), PSR_OK);
	}
	assert_true(mesh[0]->n_triangles == mesh[1]->n_triangles && mesh[0]->n_vertices == mesh[1]->n_vertices);
	assert_memory_equal(mesh[0]->triangle, mesh[1]->triangle, mesh[0]->n_triangles * sizeof *mesh[0]->triangle);
	assert_memory_equal(mesh[0]->position, mesh[1]->position, mesh[0]->n_vertices * sizeof *mesh[0]->position);
	psr_mesh_destroy(mesh[0]);
	psr_mesh_destroy(mesh[1]);
}

static void expect_end(const char *path, const char *name, const char *why)
{
	uint8_t *bytes = NULL;
	size_t n = 0;

	assert_int_equal(infile_read(&bytes, &n, path, 1 << 20, NULL), PSR_OK);
	for (size_t length = 200; length + 100 < n; length += 97) {
		write_bytes(path_of(name), bytes, length);
		refuse(name, PSR_ERR_FORMAT, why);
	}
	free(bytes);
}

static void a_file_that_ends_in_the_middle_is_told(void **state)
{
	(void)state;
	expect_end("tests/data/import/pins.step", "cut.step", "the STEP file ends in the middle");
	expect_end("tests/data/import/pins.iges", "cut.igs", "the IGES file ends in the middle");
}

/* Without any one of its entities the file is read, with what can be, or refused, and then what lacks it is named. */
static void an_entity_that_is_missing_ends_nothing_else(void **state)
{
	uint8_t *bytes = NULL, *rest;
	size_t n = 0, n_refused = 0, n_named = 0;

	(void)state;
	if (!has_module)
		skip();
	assert_int_equal(infile_read(&bytes, &n, "tests/data/import/pins.step", 1 << 20, NULL), PSR_OK);
	rest = malloc(n);
	assert_non_null(rest);
	for (size_t begin = 1, end; begin < n; begin = end) {
		struct psr_mesh *mesh = NULL;
		struct psr_error err = { 0, "" };
		int rc;

		for (end = begin + 1; end < n && !(bytes[end] == '#' && bytes[end - 1] == '\n'); end++)
			;
		/* The last of them goes on to the end of the file. */
		if (bytes[begin] != '#' || end == n)
			continue;
		memcpy(rest, bytes, begin);
		memcpy(rest + begin, bytes + end, n - end);
		write_bytes(path_of("lacks.step"), rest, n - (end - begin));
		rc = psr_mesh_import(&mesh, path_of("lacks.step"), NULL, &err);
		assert_true(rc == PSR_OK || rc == PSR_ERR_FORMAT);
		n_refused += rc != PSR_OK;
		n_named += rc != PSR_OK && strstr(err.text, "refers to an entity that it does not have (Unresolved Reference, Ent.Id.#") != NULL;
		psr_mesh_destroy(mesh);
	}
	assert_true(n_named > 0 && n_named <= n_refused);
	free(bytes);
	free(rest);
}

static void a_coordinate_beyond_all_numbers_is_told(void **state)
{
	uint8_t *bytes = NULL;
	char *at;
	size_t n = 0;

	(void)state;
	if (!has_module)
		skip();
	assert_int_equal(infile_read(&bytes, &n, "tests/data/import/pins.step", 1 << 20, NULL), PSR_OK);
	bytes[n - 1] = 0;
	at = strstr((char *)bytes, "CARTESIAN_POINT('',(10.,-2.449293598295E-15,");
	assert_non_null(at);
	memcpy(strstr(at, "E-15"), "E999", 4);
	write_bytes(path_of("far.step"), bytes, n - 1);
	refuse("far.step", PSR_ERR_FORMAT, "has a coordinate that is not finite");
	free(bytes);
}

/* Text with the frame of a file, whose entities are none, is Open CASCADE's to refuse. */
static void other_contents_are_told(void **state)
{
	(void)state;
	write_text("empty.step", "");
	refuse("empty.step", PSR_ERR_FORMAT, "empty");
	write_text("empty.iges", "");
	refuse("empty.iges", PSR_ERR_FORMAT, "empty");
	write_text("a.step", "no part");
	refuse("a.step", PSR_ERR_FORMAT, "not a STEP file: it does not begin with ISO-10303-21;");
	write_text("a.igs", "no part");
	refuse("a.igs", PSR_ERR_FORMAT, "not an IGES file in lines of 80 bytes: column 73 of the first has no S");
	if (has_module) {
		write_text("hollow.stp", "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n#1=NONSENSE(;\nENDSEC;\nEND-ISO-10303-21;\n");
		refuse("hollow.stp", PSR_ERR_FORMAT, "the STEP file cannot be read: ");
	}
}

static void without_the_module_it_is_named(void **state)
{
	struct psr_mesh *mesh = NULL;
	struct psr_error err = { 0, "" };

	(void)state;
	setenv("PSR_CAD_MODULE", "/nowhere/module.so", 1);
	assert_int_equal(psr_mesh_import(&mesh, "tests/data/import/pins.step", NULL, &err), PSR_ERR_UNSUPPORTED);
	assert_non_null(strstr(err.text, "the CAD module cannot be loaded"));
	assert_non_null(strstr(err.text, "libocct-data-exchange-dev"));
	setenv("PSR_CAD_MODULE", "libm.so.6", 1);
	assert_int_equal(psr_mesh_import(&mesh, "tests/data/import/pins.step", NULL, &err), PSR_ERR_VERSION);
	unsetenv("PSR_CAD_MODULE");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(without_the_module_it_is_named), /* first: it is loaded once */
		cmocka_unit_test(step_has_places_normals_and_colors),
		cmocka_unit_test(iges_has_places_normals_and_colors),
		cmocka_unit_test(poles_are_no_faces_without_area),
		cmocka_unit_test(a_finer_model_has_more_triangles),
		cmocka_unit_test(faces_are_patches_on_request),
		cmocka_unit_test(faces_without_a_patch_have_fine_triangles),
		cmocka_unit_test(threads_change_nothing),
		cmocka_unit_test(a_file_that_ends_in_the_middle_is_told),
		cmocka_unit_test(an_entity_that_is_missing_ends_nothing_else),
		cmocka_unit_test(a_coordinate_beyond_all_numbers_is_told),
		cmocka_unit_test(other_contents_are_told),
	};

	has_module = has_cad_module();
	return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
