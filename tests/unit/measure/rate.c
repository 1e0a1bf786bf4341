#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "measure/rate.h"
#include "tests/unit/sample/meshes.h"

static const double zero[3];

/* No core traces a ray in a nanosecond, 1000 Mray/s; and at a thousandth of a Mray/s this would have taken an hour. */
static void both_rates_are_measured(void **state)
{
	struct psr_mesh *mesh = meshes_sphere(32, zero, 1);
	double ours = -1, embree = -1;

	(void)state;
	assert_int_equal(psr_ray_rate(mesh, &ours, &embree, NULL), PSR_OK);
	assert_true(ours > 1e-3 && ours < 1e3);
	assert_true(embree > 1e-3 && embree < 1e3);
	meshes_free(mesh);
}

static void what_no_ray_meets_has_no_rate(void **state)
{
	struct psr_mesh *mesh = meshes_new(3, 1);
	double ours = -1, embree = -1;
	struct psr_error err;

	(void)state;
	for (uint32_t i = 0; i < 3; i++) { /* a splinter, much thinner than rays are apart */
		mesh->position[i][0] = i == 1 ? 1 : -1;
		mesh->position[i][1] = i == 2 ? 1e-9 : 0;
		mesh->triangle[0][i] = i;
	}
	assert_int_equal(psr_ray_rate(mesh, &ours, &embree, &err), PSR_ERR_ARG);
	assert_string_equal(err.text, "no ray meets the mesh");
	assert_true(ours == -1 && embree == -1);
	meshes_free(mesh);
}

static void a_mesh_that_the_sampler_refuses_is_refused(void **state)
{
	struct psr_mesh *mesh = meshes_sphere(4, zero, 1);
	double ours = -1, embree = -1;

	(void)state;
	mesh->n_triangles = 0;
	assert_int_equal(psr_ray_rate(mesh, &ours, &embree, NULL), PSR_ERR_ARG);
	assert_true(ours == -1 && embree == -1);
	meshes_free(mesh);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(both_rates_are_measured),
		cmocka_unit_test(what_no_ray_meets_has_no_rate),
		cmocka_unit_test(a_mesh_that_the_sampler_refuses_is_refused),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
