#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "models/studies/lib/study.h"
#include "base/direction.h"
#include "tests/unit/sample/meshes.h"

static const struct study_column two[] = { { "size", "size", 1 }, { "ratio", "ratio", 3 } };
static const struct study_form form = { "row", two, 2 };

static void a_mean_leaves_out_what_is_not_known(void **state)
{
	struct study_table table;

	(void)state;
	assert_int_equal(study_table_init(&table, form, 2, 3, NULL), PSR_OK);
	assert_true(isnan(study_mean(&table, 0, 0)));
	*study_at(&table, 0, 0, 0) = 1;
	*study_at(&table, 0, 2, 0) = 5;
	assert_true(study_mean(&table, 0, 0) == 3);
	assert_true(isnan(study_mean(&table, 1, 0)));
	study_table_fini(&table);
}

static void scans_are_asked_for_by_name(void **state)
{
	struct psr_error err;
	struct study_model model;

	(void)state;
	assert_int_equal(study_model_load(&model, "gavel", &err), PSR_OK);
	assert_false(model.is_scanned);
	study_model_fini(&model);
	assert_int_equal(study_model_load(&model, "scan:gavel", &err), PSR_OK);
	assert_true(model.is_scanned);
	assert_string_equal(model.name, "scan:gavel");
	study_model_fini(&model);
	assert_int_not_equal(study_model_load(&model, "scan:gravel", &err), PSR_OK);
}

/* A large model does not outweigh a small one: the mean of 2/1 and 10/20 is 1.25, the ratio of the sums 12/21. */
static void ratios_are_made_model_by_model(void **state)
{
	struct study_table table;

	(void)state;
	assert_int_equal(study_table_init(&table, form, 2, 2, NULL), PSR_OK);
	*study_at(&table, 0, 0, 0) = 1;
	*study_at(&table, 0, 1, 0) = 20;
	*study_at(&table, 1, 0, 0) = 2;
	*study_at(&table, 1, 1, 0) = 10;
	study_relate(&table, 0, 1, 0);
	assert_true(study_mean(&table, 0, 1) == 1);
	assert_true(study_mean(&table, 1, 1) == 1.25);
	study_table_fini(&table);
}

static void a_table_is_printed_in_columns(void **state)
{
	struct study_table table;
	char *text = NULL;
	size_t n = 0;
	FILE *to = open_memstream(&text, &n);

	(void)state;
	assert_int_equal(study_table_init(&table, form, 2, 1, NULL), PSR_OK);
	strcpy(table.label[0], "first");
	strcpy(table.label[1], "2nd");
	*study_at(&table, 0, 0, 0) = 123456.78;
	*study_at(&table, 1, 0, 1) = 0.5;
	study_table_print(&table, to);
	fclose(to);
	assert_string_equal(text, "row        size  ratio\n"
	                          "first  123456.8      -\n"
	                          "2nd           -  0.500\n");
	free(text);
	study_table_fini(&table);
}

/* ---- trials ---- */

struct ball {
	struct psr_mesh *mesh;
	struct ray_scene *scene;
	struct trials *trials;
};

static struct ball make_ball(double radius)
{
	const double center[3] = { 0 }, origin[3] = { 0 };
	struct ball ball = { .mesh = meshes_sphere(32, center, radius) };

	assert_int_equal(ray_scene_create(&ball.scene, ball.mesh, origin, 1, NULL), PSR_OK);
	assert_int_equal(trials_create(&ball.trials, ball.mesh, ball.scene, 20, 300, NULL), PSR_OK);
	return ball;
}

static void ball_fini(struct ball *ball)
{
	trials_destroy(ball->trials);
	ray_scene_destroy(ball->scene);
	meshes_free(ball->mesh);
}

/* Points on a sphere, on a spiral of equal areas. */
static struct trials_sample *spiral(size_t n, double radius, int is_inside_out)
{
	struct trials_sample *point = calloc(n + 1, sizeof *point);

	for (size_t i = 0; i < n; i++) {
		double z = 1 - (2 * (double)i + 1) / (double)n, a = 2.399963229728653 * (double)i, r = sqrt(1 - z * z);
		float out[3] = { (float)(r * cos(a)), (float)(r * sin(a)), (float)z };

		for (int k = 0; k < 3; k++) {
			point[i].position[k] = (float)radius * out[k];
			out[k] = is_inside_out ? -out[k] : out[k];
		}
		point[i].normal = psr_direction_encode(out);
	}
	return point;
}

static uint64_t missing(const struct ball *ball, const struct trials_sample *point, size_t n, double ds)
{
	struct trials_count count;

	assert_int_equal(trials_run(&count, ball->trials, point, n, ds, NULL), PSR_OK);
	assert_int_equal(count.n_trials, 20 * 300);
	return count.n_missing;
}

/* Points of a spiral have a neighbour within sqrt(4 pi / n) * 1.2 in every direction: with sides of triangles of two
 * thirds of a pixel no pixel in the middle of a face can be empty ([G] 4.3); with one and a half pixels between them
 * many are. */
static void trials_find_holes_and_only_holes(void **state)
{
	struct ball ball = make_ball(0.9);
	double ds = 1.0 / 32, spacing = 0.9 * sqrt(4 * 3.14159265358979323846 / 60000);
	struct trials_sample *dense = spiral(60000, 0.9, 0), *sparse = spiral(6000, 0.9, 0);

	(void)state;
	assert_true(1.5 * spacing < 0.667 * ds);
	assert_int_equal(missing(&ball, dense, 60000, ds), 0);
	assert_true(missing(&ball, sparse, 6000, ds) > 600);
	assert_int_equal(missing(&ball, dense, 0, ds), 20 * 300);
	free(dense);
	free(sparse);
	ball_fini(&ball);
}

static void samples_that_face_away_or_lie_deeper_fill_no_pixel(void **state)
{
	struct ball ball = make_ball(0.9);
	double ds = 1.0 / 64;
	struct trials_sample *inside_out = spiral(120000, 0.9, 1), *deep = spiral(120000, 0.5, 0);

	(void)state;
	/* The far side, now turned to the viewer, is 1.8 c behind a place seen at cosine c, where ds (1 + 1.5 / c) is
	 * allowed: near enough for c < 0.12, which are c^2 = 1.5 % of the places; a pixel reaches half as far again. */
	assert_true(missing(&ball, inside_out, 120000, ds) > 20 * 300 * 0.97);
	/* The deeper sphere lies 0.4 and more behind places that are seen at 34 degrees or less. */
	assert_int_equal(missing(&ball, deep, 120000, ds), 20 * 300);
	for (size_t i = 0; i < 120000; i++)
		inside_out[i].two_sided = 1;
	assert_int_equal(missing(&ball, inside_out, 120000, ds), 0);
	free(inside_out);
	free(deep);
	ball_fini(&ball);
}

/* ---- plots ---- */

static const struct study_kind plotted = { .name = "tested", .plot = "plot $table using 1:3:xtic(2) with lines" };
static const struct study_kind unplotted = { .name = "tested" };

static void plots_say_what_is_wrong(void **state)
{
	struct study study = { .kind = &plotted };
	char *path = getenv("PATH") != NULL ? strdup(getenv("PATH")) : NULL;
	struct psr_error err;

	(void)state;
	assert_int_equal(study_table_init(&study.table, form, 1, 1, NULL), PSR_OK);
	assert_int_equal(study_plot(&study, "picture.gif", &err), PSR_ERR_ARG);
	assert_non_null(strstr(err.text, ".svg"));
	assert_int_equal(study_plot(&study, "pic\nture.svg", &err), PSR_ERR_ARG);
	assert_non_null(strstr(err.text, "control"));
	setenv("PATH", "/nonexistent", 1);
	assert_int_equal(study_plot(&study, "picture.svg", &err), PSR_ERR_NOT_FOUND);
	assert_non_null(strstr(err.text, "gnuplot-nox"));
	if (path != NULL)
		setenv("PATH", path, 1);
	study.kind = &unplotted;
	assert_int_equal(study_plot(&study, "picture.svg", &err), PSR_ERR_ARG);
	assert_non_null(strstr(err.text, "'tested'"));
	free(path);
	study_table_fini(&study.table);
}

/* A gnuplot of our own, which keeps what it is told. */
static void the_program_for_gnuplot_has_the_whole_table(void **state)
{
	char folder[] = "/tmp/psr-study-XXXXXX", tool[64], said[64], search[1024], picture[64], text[2048] = "";
	struct study study = { .kind = &plotted };
	char *before = getenv("PATH") != NULL ? strdup(getenv("PATH")) : strdup("/usr/bin:/bin");
	struct psr_error err;
	FILE *file;

	(void)state;
	assert_non_null(mkdtemp(folder));
	snprintf(tool, sizeof tool, "%s/gnuplot", folder);
	snprintf(said, sizeof said, "%s/said", folder);
	snprintf(picture, sizeof picture, "%s/it's.svg", folder);
	snprintf(search, sizeof search, "%s:%s", folder, before);
	file = fopen(tool, "w");
	fprintf(file, "#!/bin/sh\ncat >%s\n", said);
	fclose(file);
	assert_int_equal(chmod(tool, 0700), 0);
	assert_int_equal(study_table_init(&study.table, form, 2, 1, NULL), PSR_OK);
	strcpy(study.table.label[0], "25");
	strcpy(study.table.label[1], "two words");
	*study_at(&study.table, 0, 0, 0) = 1.5;
	setenv("PATH", search, 1);
	assert_int_equal(study_plot(&study, picture, &err), PSR_OK);
	setenv("PATH", before, 1);
	file = fopen(said, "r");
	assert_non_null(file);
	assert_true(fread(text, 1, sizeof text - 1, file) > 0);
	fclose(file);
	assert_non_null(strstr(text, "it''s.svg'\n"));
	assert_non_null(strstr(text, "\n0 \"25\" 1.5 nan\n1 \"two words\" nan nan\nEOD\n"));
	assert_non_null(strstr(text, plotted.plot));
	unlink(tool);
	unlink(said);
	rmdir(folder);
	free(before);
	study_table_fini(&study.table);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_mean_leaves_out_what_is_not_known),
		cmocka_unit_test(scans_are_asked_for_by_name),
		cmocka_unit_test(ratios_are_made_model_by_model),
		cmocka_unit_test(a_table_is_printed_in_columns),
		cmocka_unit_test(trials_find_holes_and_only_holes),
		cmocka_unit_test(samples_that_face_away_or_lie_deeper_fill_no_pixel),
		cmocka_unit_test(plots_say_what_is_wrong),
		cmocka_unit_test(the_program_for_gnuplot_has_the_whole_table),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
