#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "base/srgb.h"
#include "files.h"

static const char square_obj[] = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";

/* A cube of side 1 without normals, as OFF; six squares, counter-clockwise from outside. */
static const char cube_off[] =
	"OFF\n8 6 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n"
	"4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 2 3 7 6\n4 1 2 6 5\n4 0 4 7 3\n";

static void assert_close(const float n[3], double x, double y, double z, double tolerance)
{
	assert_true(fabs(n[0] - x) <= tolerance && fabs(n[1] - y) <= tolerance && fabs(n[2] - z) <= tolerance);
}

static void an_obj_brings_its_colors_and_texture(void **state)
{
	(void)state;
	static const uint8_t pixels[24] = { 0, 0, 255, 0, 0, 255, 0, 0, 255, 0, 0, 255, 255, 0, 0, 255, 0, 0, 255, 0, 0,
		255 };
	uint8_t bmp[128];
	char text[1024];
	size_t n = make_bmp(bmp, 4, 2, pixels, sizeof pixels);

	write_bytes(path_of("t.bmp"), bmp, n);
	write_text("m.mtl", "newmtl a\nKd 1 0.5 0\nKs 0.5 0.5 0.5\nNs 30\nmap_Kd t.bmp\nnewmtl b\nKd 0 0 1\n");
	snprintf(text, sizeof text, "mtllib m.mtl\n%susemtl a\nf 1/1 2/2 3/3 4/4\nusemtl b\nf 1 2 3\n", square_obj);
	write_text("square.obj", text);
	struct psr_mesh *m = import("square.obj");
	const struct psr_material *a = &m->material[m->triangle_material[0]], *b = &m->material[m->triangle_material[2]];

	assert_int_equal(m->n_triangles, 3);
	assert_int_equal(m->n_images, 1);
	assert_int_equal(a->base_texture.image, 0);
	assert_int_equal(b->base_texture.image, -1);
	assert_true(a->base_color[0] == 1.0f && a->base_color[1] == psr_srgb_to_linear[128] && a->base_color[2] == 0.0f);
	assert_true(b->base_color[0] == 0.0f && b->base_color[2] == 1.0f && b->metallic == 0.0f);
	/* (2 / (30 + 2))^(1/4) */
	assert_true(a->roughness == 0.5f && a->two_sided && !a->unlit);
	assert_true(a->is_phong && a->phong_exponent == 30 && fabsf(a->phong[1] - 0.2140f) < 0.003f);
	/* OBJ's v grows upwards: the corner at the origin is the image's bottom left */
	for (uint32_t i = 0; i < 3; i++) {
		uint32_t v = m->triangle[0][i];

		assert_true(m->uv[0][v][0] == (float)m->position[v][0] && m->uv[0][v][1] == 1.0f - (float)m->position[v][1]);
	}
	assert_int_equal(m->image[0].rgba[2], 255);
	psr_mesh_destroy(m);
}

static void a_missing_texture_is_left_out_with_a_warning(void **state)
{
	(void)state;
	write_text("gone.mtl", "newmtl a\nKd 1 1 1\nmap_Kd C:\\\\art\\\\wood.png\n");
	write_text("gone.obj", "mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n");
	struct psr_mesh *m = import("gone.obj");

	assert_int_equal(m->n_images, 0);
	assert_int_equal(m->material[0].base_texture.image, -1);
	assert_non_null(strstr(m->warning, "wood.png"));
	psr_mesh_destroy(m);
}

static void a_material_file_outside_of_the_folder_is_not_read(void **state)
{
	(void)state;
	char path[1024];

	snprintf(path, sizeof path, "%s/secret.mtl", test_root);
	write_bytes(path, "newmtl a\nKd 1 0 0\n", 18);
	write_text("escape.obj", "mtllib ../secret.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n");
	struct psr_mesh *m = import("escape.obj");

	assert_true(m->material[0].base_color[0] == m->material[0].base_color[1]);
	assert_non_null(strstr(m->warning, "outside"));
	psr_mesh_destroy(m);
}

static void a_broken_texture_is_an_error(void **state)
{
	(void)state;
	write_text("bad.mtl", "newmtl a\nKd 1 1 1\nmap_Kd broken.png\n");
	write_bytes(path_of("broken.png"), "\x89PNG\r\n\x1a\n and no more", 20);
	write_text("bad.obj", "mtllib bad.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n");
	refuse("bad.obj", PSR_ERR_FORMAT, "broken.png");
}

static void faces_at_right_angles_keep_their_edge(void **state)
{
	(void)state;
	write_text("cube.off", cube_off);
	struct psr_mesh *m = import("cube.off");

	assert_int_equal(m->n_triangles, 12);
	assert_int_equal(m->n_vertices, 24);
	for (uint32_t t = 0; t < 12; t++)
		for (int c = 0; c < 3; c++) {
			const float *n = m->normal[m->triangle[t][c]];
			const double *p = m->position[m->triangle[t][c]];
			int axis = n[0] != 0.0f ? 0 : n[1] != 0.0f ? 1 : 2;

			assert_true(fabsf(n[axis]) == 1.0f && fabsf(n[0]) + fabsf(n[1]) + fabsf(n[2]) == 1.0f);
			assert_true((n[axis] > 0.0f) == (p[axis] > 0.5));
		}
	psr_mesh_destroy(m);
}

/* A sphere of triangles around (3, 0, 0), as a triangle soup (STL), with facet normals that are wrong. */
static char *sphere_stl(int n)
{
	size_t size = (size_t)n * (size_t)n * 2400, at;
	char *text = malloc(size);

	assert_non_null(text);
	at = (size_t)snprintf(text, size, "solid s\n");
	for (int j = 0; j < n; j++)
		for (int i = 0; i < 4 * n; i++) {
			static const int corner[6][2] = { { 0, 0 }, { 1, 1 }, { 1, 0 }, { 0, 0 }, { 0, 1 }, { 1, 1 } };

			for (int c = 0; c < 6; c++) {
				double t = M_PI * (j + corner[c][1]) / n, p = 2 * M_PI * ((i + corner[c][0]) % (4 * n)) / (4 * n);
				int pole = j + corner[c][1] == 0 || j + corner[c][1] == n;

				if (c % 3 == 0)
					at += (size_t)snprintf(text + at, size - at, "facet normal 1 0 0\nouter loop\n");
				at += (size_t)snprintf(text + at, size - at, "vertex %.9g %.9g %.9g\n",
				                       3 + (pole ? 0.0 : sin(t) * cos(p)), j + corner[c][1] == 0 ? 1.0 : cos(t),
				                       pole ? 0.0 : -sin(t) * sin(p));
				if (c % 3 == 2)
					at += (size_t)snprintf(text + at, size - at, "endloop\nendfacet\n");
			}
		}
	snprintf(text + at, size - at, "endsolid s\n");
	return text;
}

static void smooth_normals_of_a_sphere_are_radial(void **state)
{
	(void)state;
	char *text = sphere_stl(12);

	write_text("sphere.stl", text);
	free(text);
	struct psr_mesh *m = import("sphere.stl");

	/* 11 rings of 48 and two poles, each once: the soup is joined */
	assert_int_equal(m->n_vertices, 11 * 48 + 2);
	for (uint32_t v = 0; v < m->n_vertices; v++) {
		const double *p = m->position[v];

		/* Max's weights are exact on a sphere. Positions are floats of up to 4 (2^-23 off), the least edge beside a
		 * pole is 2 sin(pi/12) sin(pi/48) = 0.034 long, so edges turn by up to 2 * 2^-23 / 0.034 = 7e-6. */
		assert_close(m->normal[v], p[0] - 3, p[1], p[2], 1e-5);
	}
	psr_mesh_destroy(m);
}

static void normals_of_the_file_are_kept(void **state)
{
	(void)state;
	write_text("n.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 2\nvn 0 3 4\nf 1//1 2//2 3//1\n");
	struct psr_mesh *m = import("n.obj");

	for (uint32_t i = 0; i < 3; i++) {
		uint32_t v = m->triangle[0][i];

		/* a float below 1 is half of 2^-24 off */
		if (m->position[v][0] == 1.0)
			assert_close(m->normal[v], 0, 0.6, 0.8, 6e-8);
		else
			assert_close(m->normal[v], 0, 0, 1, 0);
	}
	psr_mesh_destroy(m);
}

static void bytes_of_a_ply_are_srgb_colors(void **state)
{
	(void)state;
	write_text("c.ply",
	           "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
	                    "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n"
	                    "property list uchar int vertex_indices\nend_header\n"
	                    "0 0 0 255 128 0\n1 0 0 255 128 0\n0 1 0 255 128 0\n3 0 1 2\n");
	struct psr_mesh *m = import("c.ply");

	assert_non_null(m->color);
	assert_true(m->color[0][0] == 1.0f && m->color[0][1] == psr_srgb_to_linear[128] && m->color[0][2] == 0.0f);
	/* the made-up gray must not darken them */
	assert_true(m->material[0].base_color[0] == 1.0f && m->material[0].base_color[1] == 1.0f);
	psr_mesh_destroy(m);
}

static void headers_that_lie_are_refused_before_allocating(void **state)
{
	(void)state;
	write_text("lie.off", "OFF\n353535235 6 0\n0 0 0\n");
	refuse("lie.off", PSR_ERR_FORMAT, "353535235 vertices");
	write_text("lie.off", "OFF # comment\n3 4000000000 0\n0 0 0\n");
	refuse("lie.off", PSR_ERR_FORMAT, "4000000000 faces");
	write_text("lie.ply", "ply\nformat ascii 1.0\nelement vertex 4294967295\nproperty float x\nend_header\n0\n");
	refuse("lie.ply", PSR_ERR_FORMAT, "4294967295 elements");
	write_text("lie.ply", "ply\nformat ascii 1.0\nelement vertex 3\n");
	refuse("lie.ply", PSR_ERR_FORMAT, "end_header");
}

static void faces_with_wrong_indices_are_refused(void **state)
{
	(void)state;
	write_text("wrong.ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
	                        "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
	                        "0 0 0\n1 0 0\n0 1 0\n4 0 1 2 99\n");
	refuse("wrong.ply", PSR_ERR_FORMAT, "vertex 99");
	write_text("wrong.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 77\n");
	refuse("wrong.obj", PSR_ERR_FORMAT, "");
}

static void what_is_no_mesh_is_refused(void **state)
{
	(void)state;
	refuse("nothing.obj", PSR_ERR_NOT_FOUND, "No such file");
	refuse("", PSR_ERR_IO, "not a regular file");
	write_text("empty.obj", "");
	refuse("empty.obj", PSR_ERR_FORMAT, "empty");
	write_text("letter.txt", "Dear reader,\nthis is not a mesh.\n");
	refuse("letter.txt", PSR_ERR_UNSUPPORTED, "not a mesh file");
	write_text("points.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\np 1 2 3\n");
	refuse("points.obj", PSR_ERR_FORMAT, "");
	assert_int_equal(mkfifo(path_of("pipe.obj"), 0600), 0);
	refuse("pipe.obj", PSR_ERR_IO, "not a regular file");
	assert_int_equal(psr_mesh_import(NULL, "x", NULL, NULL), PSR_ERR_ARG);
}

/* Cut anywhere they may still be meshes, but never more than that. */
static void cut_files_never_break_the_importer(void **state)
{
	(void)state;
	char obj[512];
	const struct {
		const char *name, *text;
	} files[] = { { "cut.off", cube_off }, { "cut.obj", obj } };

	snprintf(obj, sizeof obj, "%sf 1/1 2/2 3/3 4/4\n", square_obj);
	for (size_t i = 0; i < sizeof files / sizeof files[0]; i++)
		for (size_t cut = 1; cut < strlen(files[i].text); cut++) {
			struct psr_mesh *mesh = NULL;
			struct psr_error err = { 0, "" };
			int rc;

			write_bytes(path_of(files[i].name), files[i].text, cut);
			rc = psr_mesh_import(&mesh, path_of(files[i].name), NULL, &err);
			assert_true((rc == PSR_OK) == (mesh != NULL) && rc == err.code);
			psr_mesh_destroy(mesh);
		}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(an_obj_brings_its_colors_and_texture),
		cmocka_unit_test(a_missing_texture_is_left_out_with_a_warning),
		cmocka_unit_test(a_material_file_outside_of_the_folder_is_not_read),
		cmocka_unit_test(a_broken_texture_is_an_error),
		cmocka_unit_test(faces_at_right_angles_keep_their_edge),
		cmocka_unit_test(smooth_normals_of_a_sphere_are_radial),
		cmocka_unit_test(normals_of_the_file_are_kept),
		cmocka_unit_test(bytes_of_a_ply_are_srgb_colors),
		cmocka_unit_test(headers_that_lie_are_refused_before_allocating),
		cmocka_unit_test(faces_with_wrong_indices_are_refused),
		cmocka_unit_test(what_is_no_mesh_is_refused),
		cmocka_unit_test(cut_files_never_break_the_importer),
	};

	return cmocka_run_group_tests_name("import_assimp", tests, make_folder, remove_folder);
}
