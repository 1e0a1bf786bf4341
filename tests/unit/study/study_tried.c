#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include "models/studies/study.h"
#include "surface/validate.h"
#include "tests/unit/sample/meshes.h"

/* The study of a ball at a resolution that has one level. */
struct tried {
	struct study study;
	struct study_model model;
};

static int set_up(void **state)
{
	static struct tried tried;
	static const double center[3];
	struct study_model *model = &tried.model;

	tried.study = (struct study){ .resolution = 64, .n_threads = 1, .n_models = 1, .model = model };
	model->mesh = meshes_sphere(24, center, 1);
	assert_int_equal(validate_bound_mesh(model->mesh, model->origin, &model->scale, NULL), PSR_OK);
	assert_int_equal(ray_scene_create(&model->scene, model->mesh, model->origin, model->scale, NULL), PSR_OK);
	assert_int_equal(study_trials_create(&model->trials, model->mesh, model->scene, 50, 200, NULL), PSR_OK);
	assert_int_equal(study_run_selection(&tried.study), PSR_OK);
	*state = &tried;
	return 0;
}

static int tear_down(void **state)
{
	struct tried *tried = *state;

	study_table_fini(&tried->study.table);
	study_trials_destroy(tried->model.trials);
	ray_scene_destroy(tried->model.scene);
	meshes_free(tried->model.mesh);
	return 0;
}

/* The first row with this in its label, `after` rows further on. */
static double value(const struct tried *tried, const char *label, int after, const char *key)
{
	const struct study_table *table = &tried->study.table;

	for (int row = 0; row + after < table->n_rows; row++)
		for (int c = 0; strstr(table->label[row], label) != NULL && c < table->n_columns; c++)
			if (strcmp(table->column[c].key, key) == 0)
				return *study_at(table, row + after, 0, c);
	fail_msg("there is no row '%s' with %s", label, key);
	return NAN;
}

static void all_rows_have_names_and_values(void **state)
{
	struct tried *tried = *state;
	const struct study_table *table = &tried->study.table;

	assert_int_equal(tried->study.done, tried->study.total);
	for (int row = 0; row < table->n_rows; row++) {
		assert_true(table->label[row][0] != '\0');
		assert_true(*study_at(table, row, 0, 0) > 0);
		for (int c = 0; c < table->n_columns; c++)
			assert_true(strcmp(table->column[c].key, "blocks_before") == 0 || !isnan(*study_at(table, row, 0, c)));
	}
	assert_true(value(tried, "[G] 32, first pass", 1, "size_ratio") == 1);
}

static void each_way_to_save_saves(void **state)
{
	struct tried *tried = *state;

	assert_true(value(tried, "[G] 32, first pass", 1, "blocks") < value(tried, "[G] 32, first pass", 0, "blocks"));
	assert_true(value(tried, "[G] 32, first pass", 2, "samples") < value(tried, "[G] 32, first pass", 1, "samples"));
	assert_true(value(tried, "by score", 0, "blocks") < value(tried, "by score", 0, "blocks_before"));
	assert_true(value(tried, "that own little", 0, "blocks") < value(tried, "owned by", 0, "blocks"));
}

static void dicing_adds_what_ownership_leaves_out(void **state)
{
	struct tried *tried = *state;

	assert_true(value(tried, "that own little", 0, "missing_of_10000") > 10);
	assert_true(value(tried, "diced", 0, "samples") > value(tried, "that own little", 0, "samples"));
	assert_true(value(tried, "diced", 0, "missing_of_10000") < 10);
}

/* Step by step it is the same sampling. */
static void the_steps_end_at_what_is_built(void **state)
{
	struct tried *tried = *state;

	assert_true(value(tried, "until it is adequate", 0, "blocks") == value(tried, "all levels built", 0, "blocks"));
	assert_true(value(tried, "until it is adequate", 0, "samples") == value(tried, "all levels built", 0, "samples"));
	assert_true(value(tried, "until it is adequate", 0, "seconds") >= value(tried, "diced", 0, "seconds"));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(all_rows_have_names_and_values),
		cmocka_unit_test(each_way_to_save_saves),
		cmocka_unit_test(dicing_adds_what_ownership_leaves_out),
		cmocka_unit_test(the_steps_end_at_what_is_built),
	};

	return cmocka_run_group_tests(tests, set_up, tear_down);
}
