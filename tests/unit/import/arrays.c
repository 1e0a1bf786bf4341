/* Meshes of the caller's arrays. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include "psr/mesh.h"

static const double point[4][3] = { { 0, 0, 0 }, { 1, 0, 0 }, { 0, 1, 0 }, { 5, 5, NAN } };

static void a_mesh_is_a_copy_with_normals_and_a_material(void **state)
{
	uint32_t face[1][3] = { { 0, 1, 2 } };
	struct psr_mesh *mesh;

	(void)state;
	assert_int_equal(psr_mesh_create(&mesh, point, 4, face, 1, NULL), PSR_OK);
	face[0][0] = 77;
	assert_int_equal(mesh->n_triangles, 1);
	assert_int_equal(mesh->n_vertices, 3); /* the unused one is left out */
	assert_int_equal(mesh->triangle[0][0], 0);
	assert_memory_equal(mesh->position, point, 3 * sizeof point[0]);
	for (int v = 0; v < 3; v++)
		assert_true(mesh->normal[v][0] == 0 && mesh->normal[v][1] == 0 && mesh->normal[v][2] == 1);
	assert_int_equal(mesh->n_materials, 1);
	assert_true(mesh->material[0].base_color[0] == 1);
	assert_true(mesh->up[0] == 0 && mesh->up[1] == 1 && mesh->up[2] == 0);
	psr_mesh_destroy(mesh);
}

static void broken_triangles_are_left_out_and_counted(void **state)
{
	static const uint32_t face[4][3] = { { 0, 1, 2 }, { 0, 0, 1 }, { 0, 1, 3 }, { 0, 1, 2 } };
	struct psr_mesh *mesh;

	(void)state;
	assert_int_equal(psr_mesh_create(&mesh, point, 4, face, 4, NULL), PSR_OK);
	assert_int_equal(mesh->n_triangles, 1);
	assert_int_equal(mesh->n_dropped_triangles, 3);
	psr_mesh_destroy(mesh);
}

static void arrays_that_are_no_mesh_are_refused(void **state)
{
	static const uint32_t beyond[1][3] = { { 0, 1, 4 } }, flat[1][3] = { { 0, 1, 1 } };
	struct psr_mesh *mesh = NULL;
	struct psr_error err;

	(void)state;
	assert_int_equal(psr_mesh_create(&mesh, point, 4, beyond, 1, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "vertex 4"));
	assert_int_equal(psr_mesh_create(&mesh, point, 4, flat, 1, &err), PSR_ERR_FORMAT);
	assert_int_equal(psr_mesh_create(&mesh, NULL, 0, NULL, 0, &err), PSR_ERR_FORMAT);
	assert_null(mesh);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_mesh_is_a_copy_with_normals_and_a_material),
		cmocka_unit_test(broken_triangles_are_left_out_and_counted),
		cmocka_unit_test(arrays_that_are_no_mesh_are_refused),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
