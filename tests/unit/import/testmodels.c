/* The files of Debian's assimp-testmodels (PSR_TESTMODELS names another folder of them): what real exporters write, and
 * what is broken on purpose. Skipped where the package is not installed. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "gltf_build.h"

static const char *models_folder(void)
{
	const char *named = getenv("PSR_TESTMODELS");

	return named != NULL ? named : "/usr/share/assimp/models";
}

static struct psr_mesh *import_model(const char *name)
{
	struct psr_mesh *mesh = NULL;
	struct psr_error err = { 0, "" };
	char path[1024];

	snprintf(path, sizeof path, "%s/%s", models_folder(), name);
	if (access(models_folder(), R_OK) != 0)
		skip();
	if (psr_mesh_import(&mesh, path, NULL, &err) != PSR_OK)
		fail_msg("%s", err.text);
	return mesh;
}

static void bounds_of(const struct psr_mesh *m, double low[3], double high[3])
{
	for (int c = 0; c < 3; c++) {
		low[c] = INFINITY;
		high[c] = -INFINITY;
		for (uint32_t v = 0; v < m->n_vertices; v++) {
			low[c] = fmin(low[c], m->position[v][c]);
			high[c] = fmax(high[c], m->position[v][c]);
		}
	}
}

static int n_read, n_refused;

static int read_one(const char *path, const struct stat *st, int type, struct FTW *ftw)
{
	const char *end = strrchr(path, '.');
	struct psr_mesh *mesh = NULL;
	struct psr_error err = { 0, "" };
	int rc;

	(void)st, (void)ftw;
	if (type != FTW_F || end == NULL || (strcmp(end, ".gltf") != 0 && strcmp(end, ".glb") != 0))
		return 0;
	rc = psr_mesh_import(&mesh, path, NULL, &err);
	if (rc != PSR_OK) {
		n_refused++;
		assert_null(mesh);
		if (rc != err.code || strncmp(err.text, path, strlen(path)) != 0 || strlen(err.text) < strlen(path) + 12)
			fail_msg("%s is refused with %d: %s", path, rc, err.text);
		return 0;
	}
	n_read++;
	assert_true(mesh->n_triangles + mesh->n_points > 0 && mesh->n_materials > 0);
	for (uint32_t v = 0; v < mesh->n_vertices; v++)
		assert_true(isfinite(mesh->position[v][0]) && isfinite(mesh->position[v][1]) && isfinite(mesh->position[v][2]));
	for (uint32_t p = 0; p < mesh->n_points; p++)
		assert_true(isfinite(mesh->point[p][0]) && mesh->point_radius[p] > 0.0f);
	psr_mesh_destroy(mesh);
	return 0;
}

static void every_gltf_is_read_or_refused_with_a_sentence(void **state)
{
	(void)state;
	if (access(models_folder(), R_OK) != 0)
		skip();
	assert_int_equal(nftw(models_folder(), read_one, 16, FTW_PHYS), 0);
	print_message("%d files are read, %d are refused\n", n_read, n_refused);
	assert_true(n_read > 20 && n_refused > 10);
}

static void cameras_of_a_file_are_presets(void **state)
{
	(void)state;
	struct psr_mesh *m = import_model("glTF2/cameras/Cameras.gltf");

	assert_int_equal(m->n_cameras, 2);
	assert_int_equal(m->camera[0].camera.kind, PSR_CAMERA_PERSPECTIVE);
	assert_true(m->camera[0].camera.fov_y == 0.7 && m->camera[0].camera.near_z == 0.01);
	assert_int_equal(m->camera[1].camera.kind, PSR_CAMERA_ORTHOGRAPHIC);
	assert_true(m->camera[1].camera.ortho_height == 2.0);
	for (int i = 0; i < 2; i++)
		NEAR(m->camera[i].camera.eye, 1e-15, 0.5, 0.5, 3);
	psr_mesh_destroy(m);
}

/* Its inverse bind matrices move by (-0.5, -1, 0), its joints stand at (0, 1, 0); written from (0,0,0) to (1,2,0). */
static void a_skinned_file_stands_in_its_bind_pose(void **state)
{
	(void)state;
	struct psr_mesh *m = import_model("glTF2/simple_skin/simple_skin.gltf");
	double low[3], high[3];

	bounds_of(m, low, high);
	NEAR(low, 0, -0.5, 0, 0);
	NEAR(high, 0, 0.5, 2, 0);
	assert_int_equal(m->n_triangles, 8);
	psr_mesh_destroy(m);
}

static void a_morphed_file_stands_as_its_default_weights_say(void **state)
{
	(void)state;
	struct psr_mesh *m = import_model("glTF2/glTF-Sample-Models/AnimatedMorphCube-glTF/AnimatedMorphCube.gltf");
	double low[3], high[3];

	/* both weights 0; a cube of 0.02 scaled by 100, turned with 7 digits */
	bounds_of(m, low, high);
	NEAR(low, 2e-6, -1, -1, -1);
	NEAR(high, 2e-6, 1, 1, 1);
	psr_mesh_destroy(m);
}

static void texture_transforms_of_a_file_are_kept(void **state)
{
	(void)state;
	struct psr_mesh *m = import_model("glTF2/textureTransform/TextureTransformTest.gltf");
	const double c = cos(0.3), s = sin(0.3);

	assert_int_equal(m->n_materials, 9);
	NEAR_F(m->material[0].base_texture.transform, 0, 1, 0, 0.5, 0, 1, 0);
	NEAR_F(m->material[1].base_texture.transform, 0, 1, 0, 0, 0, 1, 0.5);
	NEAR_F(m->material[4].base_texture.transform, 0, 1.5, 0, 0, 0, 1.5, 0);
	/* floats below 2 are 2^-24 off */
	NEAR_F(m->material[5].base_texture.transform, 0x1p-24, 1.5 * c, 1.5 * s, -0.2, -1.5 * s, 1.5 * c, -0.1);
	psr_mesh_destroy(m);
}

static void a_file_with_two_sets_of_coordinates_keeps_both(void **state)
{
	(void)state;
	struct psr_mesh *m = import_model("glTF2/BoxTexcoords-glTF/boxTexcoords.gltf");

	assert_int_equal(m->material[0].base_texture.uv_set, 0);
	assert_int_equal(m->material[0].metallic_roughness_texture.uv_set, 1);
	assert_true(m->uv[0] != NULL && m->uv[1] != NULL);
	psr_mesh_destroy(m);
}

/* Modes 4, 5 and 6 without indices, 11 to 13 with them, 14 and 15 with other index types: the same square. */
static void every_mode_of_triangles_gives_the_same_square(void **state)
{
	(void)state;
	static const int numbers[] = { 4, 5, 6, 11, 12, 13, 14, 15 };
	double low[3], high[3];

	for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {
		char name[128];
		double area = 0.0;

		snprintf(name, sizeof name, "glTF2/glTF-Asset-Generator/Mesh_PrimitiveMode/Mesh_PrimitiveMode_%02d.gltf",
		         numbers[i]);
		struct psr_mesh *m = import_model(name);

		bounds_of(m, low, high);
		assert_int_equal(m->n_triangles, 2);
		for (uint32_t t = 0; t < 2; t++) {
			const double *a = m->position[m->triangle[t][0]], *b = m->position[m->triangle[t][1]];
			const double *d = m->position[m->triangle[t][2]];
			double twice = (b[0] - a[0]) * (d[1] - a[1]) - (b[1] - a[1]) * (d[0] - a[0]);

			assert_true(twice > 0.0); /* all look the same way */
			area += twice / 2;
		}
		assert_true(fabs(area - (high[0] - low[0]) * (high[1] - low[1])) < 1e-12);
		psr_mesh_destroy(m);
	}
}

/* The same engine twice: the compressed one is off by the steps of its quantized positions (14 bits or fewer of the
 * largest part, 11 in the least case that Draco's exporters use). */
static void draco_gives_the_engine_that_plain_data_give(void **state)
{
	(void)state;
	struct psr_mesh *plain = import_model("glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb");
	struct psr_mesh *packed = import_model("glTF2/draco/2CylinderEngine.gltf");
	double low[2][3], high[2][3], size = 0.0;

	bounds_of(plain, low[0], high[0]);
	bounds_of(packed, low[1], high[1]);
	for (int c = 0; c < 3; c++)
		size = fmax(size, high[0][c] - low[0][c]);
	for (int c = 0; c < 3; c++)
		assert_true(fabs(low[0][c] - low[1][c]) < size / 2048 && fabs(high[0][c] - high[1][c]) < size / 2048);
	/* what is flat in one may be a sliver in the other */
	assert_int_equal(plain->n_triangles + plain->n_dropped_triangles, 121496);
	assert_true(packed->n_triangles <= 121496 && packed->n_materials == plain->n_materials);
	psr_mesh_destroy(plain);
	psr_mesh_destroy(packed);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_gltf_is_read_or_refused_with_a_sentence),
		cmocka_unit_test(cameras_of_a_file_are_presets),
		cmocka_unit_test(a_skinned_file_stands_in_its_bind_pose),
		cmocka_unit_test(a_morphed_file_stands_as_its_default_weights_say),
		cmocka_unit_test(texture_transforms_of_a_file_are_kept),
		cmocka_unit_test(a_file_with_two_sets_of_coordinates_keeps_both),
		cmocka_unit_test(every_mode_of_triangles_gives_the_same_square),
		cmocka_unit_test(draco_gives_the_engine_that_plain_data_give),
	};

	return cmocka_run_group_tests_name("import_testmodels", tests, NULL, NULL);
}
