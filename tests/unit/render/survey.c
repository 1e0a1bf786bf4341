/* What a survey foresees, beside what frames then meet. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include "base/random.h"
#include "base/vec.h"
#include "psr/model.h"
#include "render/render.h"
#include "render/survey.h"
#include "tests/unit/lib/trees.h"

#define WIDTH 320
#define HEIGHT 240
#define N_VIEWS 24

static const double densities[] = { 0.25, 0.5, 1, 2, 4 };
#define N (int)(sizeof densities / sizeof *densities)

static struct psr_model *teapot, *closed, *cloud; /* the latter two octrees alone */
static struct psr_renderer *renderer;
static struct surveyor *surveyor;

static int set_up(void **state)
{
	static const struct tree_options solid = { .levels = 7, .radius = 0.9, .is_one_sided = 1, .with_offsets = 1, .keep = 1 };
	static const struct tree_options sparse = { .levels = 7, .radius = 0.7, .keep = 0.7 };

	(void)state;
	closed = tree_build(&solid);
	cloud = tree_build(&sparse);
	surveyor = surveyor_create();
	return surveyor == NULL || psr_renderer_create(&renderer, NULL)
	       || psr_model_read(&teapot, "tests/golden/teapot.psr", NULL);
}

static int tear_down(void **state)
{
	(void)state;
	surveyor_destroy(surveyor);
	psr_renderer_destroy(renderer);
	psr_model_unref(teapot);
	psr_model_unref(closed);
	psr_model_unref(cloud);
	return 0;
}

/* From outside, some of them so near that the picture cuts much of the model off. */
static void look(struct psr_scene *scene, const struct psr_instance *instance, uint64_t *random)
{
	const struct psr_model_info *info = psr_model_info(instance->model);
	const double away = info->scale * random_in(random, 1.2, 6);
	double toward[3];

	*scene = (struct psr_scene){ .instance = instance, .n_instances = 1, .ambient = { 1, 1, 1 } };
	scene->camera = (struct psr_camera){ .kind = PSR_CAMERA_PERSPECTIVE, .fov_y = 0.7, .up = { 0.1, 1, 0.2 } };
	for (int k = 0; k < 3; k++)
		toward[k] = random_in(random, -1, 1);
	v3d_normalize(toward, toward);
	for (int k = 0; k < 3; k++) {
		scene->camera.target[k] = info->box_min[k] / 2 + info->box_max[k] / 2;
		scene->camera.eye[k] = scene->camera.target[k] + away * toward[k];
	}
	assert_int_equal(psr_scene_validate(scene, NULL), PSR_OK);
}

static void draw(struct psr_report *report, const struct psr_scene *scene, double spacing)
{
	static uint8_t rgb[3 * WIDTH * HEIGHT];
	struct psr_frame frame = { .width = WIDTH, .height = HEIGHT, .rgb = rgb };
	struct render_settings settings;

	render_settings_default(&settings, WIDTH, HEIGHT);
	settings.cull_tests &= ~(unsigned)PSR_CULL_MASKS;
	settings.spacing_px = spacing;
	assert_int_equal(renderer_draw(renderer, scene, &settings, NULL, &frame, NULL), PSR_OK);
	*report = frame.report;
}

/* All blocks of a small model are tested. Without masks, which a survey does not ask, it counts at density 1 what the
 * frame does, and the share in view of other levels is nearly that of this one: their blocks are as large as two or
 * four, and reach as far out of the picture, where the model has some ten blocks across. */
static void check_samples(const struct psr_model *model)
{
	const struct psr_instance instance = { .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	uint64_t random = 3;

	for (int v = 0; v < N_VIEWS; v++) {
		struct survey survey;
		struct psr_scene scene;

		look(&scene, &instance, &random);
		assert_int_equal(survey_scene(&survey, surveyor, &scene, WIDTH, HEIGHT, densities, N), 1);
		for (int i = 0; i < N; i++) {
			const double slack = densities[i] == 1 ? 1e-5 : 0.5;
			struct psr_report report;

			draw(&report, &scene, 1 / densities[i]);
			const double drawn = (double)report.n_samples_drawn;
			if (fabs(survey.at[i].n_samples - drawn) > slack * drawn + 512)
				fail_msg("view %d, density %g: %g samples, and the frame has %g", v, densities[i],
				         survey.at[i].n_samples, drawn);
			assert_true(survey.at[i].n_blocks >= (double)report.count[PSR_STAGE_CULL]);
		}
	}
}

static void samples_are_those_of_the_frame(void **state)
{
	(void)state;
	check_samples(teapot);
}

static void samples_of_octrees_are_those_of_the_frame(void **state)
{
	(void)state;
	check_samples(closed);
	check_samples(cloud);
}

/* Squares stand for what blocks cover, slanted alike, and cells of a grid for these: half as much, or twice. */
static void check_area(const struct psr_model *model)
{
	const struct psr_instance instance = { .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	uint64_t random = 4;

	for (int v = 0; v < N_VIEWS; v++) {
		struct survey survey;
		struct psr_scene scene;
		struct psr_report report;

		look(&scene, &instance, &random);
		assert_int_equal(survey_scene(&survey, surveyor, &scene, WIDTH, HEIGHT, densities, N), 1);
		draw(&report, &scene, 1);
		const double covered = (double)(report.n_covered + report.n_filled);
		if (!(survey.area > covered / 2 && survey.area < 2 * covered))
			fail_msg("view %d: %g pixels, and the frame covers %g", v, survey.area, covered);
	}
}

static void the_area_is_about_that_of_the_frame(void **state)
{
	(void)state;
	check_area(teapot);
}

static void the_area_of_octrees_is_about_that_of_the_frame(void **state)
{
	(void)state;
	check_area(closed);
	check_area(cloud);
}

static void nothing_in_view_is_nothing(void **state)
{
	struct psr_instance instance = { .model = teapot, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	struct psr_scene scene = { .instance = &instance, .n_instances = 1 };
	struct survey survey;

	(void)state;
	scene.camera = (struct psr_camera){ .kind = PSR_CAMERA_PERSPECTIVE, .fov_y = 0.5, .target = { 0, 0, 1 },
		                                .up = { 0, 1, 0 } };
	instance.translation[2] = -1000;
	assert_int_equal(survey_scene(&survey, surveyor, &scene, WIDTH, HEIGHT, densities, N), 1);
	assert_true(survey.area == 0);
	for (int i = 0; i < N; i++)
		assert_true(survey.at[i].n_samples == 0 && survey.at[i].spread == 0);
	scene.n_instances = 0;
	assert_int_equal(survey_scene(&survey, surveyor, &scene, WIDTH, HEIGHT, densities, N), 1);
	assert_true(survey.area == 0 && survey.at[0].n_blocks == 0);
}

/* A survey has some tenths of a millisecond. */
static void large_scenes_are_left_alone(void **state)
{
	const uint32_t n = 300;
	struct psr_instance *instance = calloc(n, sizeof *instance);
	struct psr_scene scene = { .instance = instance, .n_instances = n };
	struct survey survey;

	(void)state;
	for (uint32_t i = 0; i < n; i++)
		instance[i] = (struct psr_instance){ .model = teapot, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	scene.camera = (struct psr_camera){ .kind = PSR_CAMERA_PERSPECTIVE, .fov_y = 0.5, .target = { 0, 0, 1 },
		                                .up = { 0, 1, 0 } };
	assert_int_equal(survey_scene(&survey, surveyor, &scene, WIDTH, HEIGHT, densities, N), 0);
	free(instance);
}

/* Samples of a block that holds the eye may be a million pixels apart, and most of them are out of view. */
static void blocks_at_the_eye_tell_little(void **state)
{
	const struct psr_instance instance = { .model = teapot, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	uint64_t random = 5;

	(void)state;
	for (int i = 0; i < 2000; i++) {
		struct psr_scene scene;
		struct survey survey;

		look(&scene, &instance, &random);
		for (int k = 0; k < 3; k++) /* into the model */
			scene.camera.eye[k] += (scene.camera.target[k] - scene.camera.eye[k]) * random_in(&random, 0.6, 1);
		assert_int_equal(survey_scene(&survey, surveyor, &scene, WIDTH, HEIGHT, densities, N), 1);
		assert_true(survey.apart >= 0 && survey.apart <= WIDTH + HEIGHT);
		assert_true(survey.layers >= 0 && survey.layers < 1000);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(samples_are_those_of_the_frame),
		cmocka_unit_test(samples_of_octrees_are_those_of_the_frame),
		cmocka_unit_test(the_area_is_about_that_of_the_frame),
		cmocka_unit_test(the_area_of_octrees_is_about_that_of_the_frame),
		cmocka_unit_test(nothing_in_view_is_nothing),
		cmocka_unit_test(large_scenes_are_left_alone),
		cmocka_unit_test(blocks_at_the_eye_tell_little),
	};

	return cmocka_run_group_tests(tests, set_up, tear_down);
}
