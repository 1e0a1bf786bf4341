/* The ladder measured on a model. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "base/vec.h"
#include "measure/calibrate.h"
#include "psr/build.h"
#include "tests/unit/sample/meshes.h"

#define N 4 /* a view of each kind */

struct fixture {
	struct psr_mesh *mesh;
	struct psr_model *model;
};

static int open_fixture(void **state)
{
	struct fixture *f = calloc(1, sizeof *f);
	struct psr_build_options options;

	f->mesh = meshes_sphere(24, (const double[3]){ 5, 1, -2 }, 3);
	v3d_set(f->mesh->up, 0, 1, 0);
	psr_build_options_default(&options);
	options.resolution = 64;
	*state = f;
	return psr_model_build(&f->model, f->mesh, &options, NULL, NULL);
}

static int close_fixture(void **state)
{
	struct fixture *f = *state;

	psr_model_unref(f->model);
	meshes_free(f->mesh);
	free(f);
	return 0;
}

static uint64_t n_steps;

static void on_progress(const char *stage, uint64_t done, uint64_t total, void *userdata)
{
	(void)userdata;
	assert_string_equal(stage, "calibrate");
	assert_true(done == ++n_steps && total == N);
}

/* Errors are a function of model, source and seed; the passes of a sphere are better than a picture of a quarter of the
 * size, whose edges are four pixels wide. */
static void errors_are_those_of_views_alone(void **state)
{
	const struct fixture *f = *state;
	struct calibrate_options options = { .n_views = N, .seed = 5, .n_threads = 1, .on_progress = on_progress };
	struct psr_calibrated one[N], two[N];
	struct psr_calibrated_fine fine[2][N];
	struct psr_model *calibrated;

	assert_int_equal(calibrate(one, fine[0], f->model, f->mesh, &options, NULL), PSR_OK);
	assert_true(n_steps == N);
	options.n_threads = 2;
	options.on_progress = NULL;
	assert_int_equal(calibrate(two, fine[1], f->model, f->mesh, &options, NULL), PSR_OK);
	for (int i = 0; i < N; i++) {
		assert_memory_equal(one[i].rmse, two[i].rmse, sizeof one[i].rmse);
		assert_true(one[i].apart == two[i].apart && one[i].layers == two[i].layers);
		assert_true(one[i].apart > 0 && one[i].n_shadow_lights == 0);
		assert_true(one[i].rmse[9] < one[i].rmse[0]);
		/* A fine picture has an error of its own where it is fine, and is nearer than the smooth one. */
		assert_true(fine[0][i].rmse == fine[1][i].rmse && (fine[0][i].ms > 0) == (fine[1][i].ms > 0));
		assert_true((fine[0][i].ms > 0) == (one[i].apart <= 1.5f));
		assert_true(fine[0][i].ms == 0 || fine[0][i].rmse < one[i].rmse[5]);
	}
	assert_true(one[1].apart > 4 * one[3].apart); /* close, and far */
	assert_int_equal(psr_model_calibrate(&calibrated, f->model, &(struct psr_calibration){ N, one, fine[0] }, NULL), PSR_OK);
	psr_model_unref(calibrated);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(errors_are_those_of_views_alone),
	};

	return cmocka_run_group_tests(tests, open_fixture, close_fixture);
}
