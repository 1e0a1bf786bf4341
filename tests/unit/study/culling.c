#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include "models/studies/tables/tables.h"
#include "tests/unit/sample/meshes.h"

/* A study of a ball at a low resolution. Its rays are in the coordinates of its model: it is about the origin,
 * and 1. */
static struct study run(const char *name, struct study_model *model, int (*study_run)(struct study *))
{
	static const double zero[3];
	struct study study = { .resolution = 32, .n_threads = 1, .n_models = 1, .model = model };

	snprintf(model->name, sizeof model->name, "%s", name);
	model->mesh = meshes_sphere(24, zero, 1);
	model->scale = 1;
	assert_int_equal(ray_scene_create(&model->scene, model->mesh, zero, 1, NULL), PSR_OK);
	assert_int_equal(study_run(&study), PSR_OK);
	assert_int_equal(study.done, study.total);
	return study;
}

static void drop(struct study *study)
{
	study_table_fini(&study->table);
	ray_scene_destroy(study->model->scene);
	meshes_free(study->model->mesh);
}

static double value(const struct study *study, int row, const char *key)
{
	for (int c = 0; c < study->table.n_columns; c++)
		if (strcmp(study->table.column[c].key, key) == 0)
			return *study_at(&study->table, row, 0, c);
	fail_msg("there is no column %s", key);
	return NAN;
}

static void culling_stands_beside_the_thesis(void **state)
{
	struct study_model model = { 0 };
	struct study study = run("teapot", &model, table_culling);

	(void)state;
	assert_true(value(&study, 0, "thesis_percent_cone") == 32.1);
	assert_true(value(&study, 0, "thesis_percent_mask") == 25.5);
	assert_true(value(&study, 0, "thesis_percent_both") == 35.3);
	assert_true(value(&study, 0, "percent_cone") > 0);
	assert_true(value(&study, 0, "percent_mask") > 0);
	assert_true(value(&study, 0, "percent_both") >= value(&study, 0, "percent_cone"));
	assert_true(value(&study, 0, "percent_both") >= value(&study, 0, "percent_mask"));
	assert_true(value(&study, 0, "percent_both") <= value(&study, 0, "percent_hidden"));
	assert_true(value(&study, 0, "percent_wrong") == 0);
	/* Zoomed in, the frustum culls some, with cones and masks more, and the more of it is hidden. */
	assert_true(value(&study, 0, "zoomed_percent_frustum") > 0);
	assert_true(value(&study, 0, "zoomed_percent_all") >= value(&study, 0, "zoomed_percent_frustum"));
	assert_true(value(&study, 0, "zoomed_percent_hidden") >= value(&study, 0, "zoomed_percent_all"));
	assert_true(value(&study, 0, "zoomed_percent_hidden") > value(&study, 0, "percent_hidden"));
	drop(&study);
}

static void a_model_that_the_thesis_has_not_stands_alone(void **state)
{
	struct study_model model = { 0 };
	struct study study = run("ball", &model, table_culling);

	(void)state;
	assert_true(isnan(value(&study, 0, "thesis_percent_cone")));
	assert_true(value(&study, 0, "percent_cone") > 0);
	drop(&study);
}

static void more_bits_cull_no_less(void **state)
{
	static const char *const labels[] = { "neither", "8 bits", "32 bits", "128 bits", "512 bits",
		                                  "cones", "cones, 8 bits", "cones, 32 bits", "cones, 128 bits",
	                                      "cones, 512 bits" };
	struct study_model model = { 0 };
	struct study study = run("ball", &model, table_masks);

	(void)state;
	assert_int_equal(study.table.n_rows, 10);
	for (int row = 0; row < 10; row++) {
		assert_string_equal(study.table.label[row], labels[row]);
		assert_true(value(&study, row, "percent_hidden") == value(&study, 0, "percent_hidden"));
		assert_true(value(&study, row, "frame_us") > 0);
		if (row % 5 != 0)
			assert_true(value(&study, row, "percent_culled") >= value(&study, row - 1, "percent_culled"));
		if (row >= 5)
			assert_true(value(&study, row, "percent_culled") >= value(&study, row - 5, "percent_culled"));
	}
	assert_true(value(&study, 0, "percent_culled") == 0);
	assert_true(value(&study, 0, "percent_speedup") == 0);
	assert_true(value(&study, 4, "percent_culled") > value(&study, 1, "percent_culled"));
	drop(&study);
}

static void more_regions_cull_no_less(void **state)
{
	struct study_model model = { 0 };
	struct study study = run("ball", &model, table_subdivision);

	(void)state;
	assert_int_equal(study.table.n_rows, 7);
	assert_string_equal(study.table.label[0], "1x1");
	assert_string_equal(study.table.label[6], "64x64");
	for (int row = 0; row < 7; row++) {
		double culled = value(&study, row, "percent_culled"), first = value(&study, 0, "percent_culled");

		assert_true(fabs(value(&study, row, "percent_more_culled") - 100 * (culled / first - 1)) < 1e-9);
		if (row > 0)
			assert_true(culled >= value(&study, row - 1, "percent_culled"));
	}
	drop(&study);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(culling_stands_beside_the_thesis),
		cmocka_unit_test(a_model_that_the_thesis_has_not_stands_alone),
		cmocka_unit_test(more_bits_cull_no_less),
		cmocka_unit_test(more_regions_cull_no_less),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
