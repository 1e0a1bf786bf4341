/* Which cubes of an octree a frame tests and draws: levels by the density of leaves, runs that face away at once. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include "model/cubes.h"
#include "render/stages.h"
#include "tests/unit/lib/trees.h"

#define SIDE 160

static const struct tree_options SOLID = { .levels = 8, .radius = 0.9, .is_one_sided = 1, .keep = 1 };

static struct {
	uint8_t rgb[3 * SIDE * SIDE], block[3 * SIDE * SIDE];
	uint32_t id[SIDE * SIDE];
	uint64_t words[SIDE * SIDE];
	struct psr_report report;
} drawn;

static struct psr_instance place(const struct psr_model *model)
{
	return (struct psr_instance){ .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
}

/* Looks along -z: `height` world units are as high as the picture. */
static struct psr_camera orthographic(double height)
{
	return (struct psr_camera){ .eye = { 0, 0, 4 }, .up = { 0, 1, 0 }, .kind = PSR_CAMERA_ORTHOGRAPHIC,
		                        .ortho_height = height };
}

static struct psr_camera perspective(double distance, double degrees)
{
	return (struct psr_camera){ .eye = { 0, 0, distance }, .up = { 0, 1, 0 },
		                        .fov_y = degrees * 3.14159265358979 / 180 };
}

/* Returns the report of a picture in `drawn`. */
static const struct psr_report *draw(const struct psr_scene *scene, unsigned cull_tests)
{
	struct psr_frame frame = { .width = SIDE, .height = SIDE, .rgb = drawn.rgb, .block = drawn.block, .id = drawn.id,
		                       .words = drawn.words };
	struct psr_renderer *renderer;
	struct render_settings settings;
	struct psr_error err = { 0 };

	render_settings_default(&settings, SIDE, SIDE);
	settings.cull_tests = cull_tests;
	assert_int_equal(psr_renderer_create(&renderer, NULL), PSR_OK);
	if (renderer_draw(renderer, scene, &settings, NULL, &frame, &err))
		fail_msg("%s", err.text);
	psr_renderer_destroy(renderer);
	drawn.report = frame.report;
	return &drawn.report;
}

static void fewer_samples_are_drawn_of_what_is_small(void **state)
{
	struct psr_model *model = tree_build(&SOLID);
	struct psr_instance instance = place(model);
	struct psr_scene scene = { .instance = &instance, .n_instances = 1, .ambient = { 1, 1, 1 } };
	uint64_t last = UINT64_MAX;

	(void)state;
	assert_int_equal(psr_model_make_cubes(model, NULL), PSR_OK);
	assert_int_equal(psr_model_cubes(model)->groups.n_levels, CUBES_MOST_LEVELS);
	for (double height = 4; height <= 32; height *= 2) {
		scene.camera = orthographic(height);
		const struct psr_report *report = draw(&scene, PSR_CULL_ALL);

		assert_true(report->n_samples_drawn < last / 3); /* a fourth of a surface */
		last = report->n_samples_drawn;
	}
	psr_model_unref(model);
}

/* Leaves as dense as a block's samples are: up to 1 / CUBES_LEVEL_SPACING pixels wide. */
static void the_coarsest_level_that_is_dense_enough_is_drawn(void **state)
{
	static const struct {
		double pixels; /* a leaf of level 0 is wide */
		uint8_t level;
	} cases[] = { { 1.2, 0 }, { 0.92, 0 }, { 0.48, 0 }, { 0.46, 1 }, { 0.24, 1 }, { 0.23, 2 } };
	struct psr_model *model = tree_build(&SOLID);
	struct psr_instance instance = place(model);
	struct psr_scene scene = { .instance = &instance, .n_instances = 1, .ambient = { 1, 1, 1 } };

	(void)state;
	for (unsigned i = 0; i < sizeof cases / sizeof *cases; i++) {
		scene.camera = orthographic(SIDE * ldexp(2, -SOLID.levels) / cases[i].pixels);
		draw(&scene, PSR_CULL_ALL);
		const size_t middle = (size_t)SIDE / 2 * SIDE + SIDE / 2;

		assert_int_not_equal(drawn.id[middle], UINT32_MAX);
		assert_int_equal(drawn.block[3 * middle], cases[i].level);
	}
	psr_model_unref(model);
}

/* Half of a closed surface faces away. Of a sphere of 50 leaves' radius, runs of 64 cubes, some eight by eight, see
 * normals within 40 degrees, so that a third of them is left out before their cubes are tested. */
static void runs_that_face_away_are_left_out_at_once(void **state)
{
	struct psr_model *model = tree_build(&SOLID);
	const int rc = psr_model_make_cubes(model, NULL);
	const uint32_t n_cubes = rc == PSR_OK ? psr_model_cubes(model)->level[0].n : 0;
	struct psr_instance instance = place(model);
	struct psr_scene scene = { .instance = &instance, .n_instances = 1, .ambient = { 1, 1, 1 } };
	static uint64_t words[SIDE * SIDE];

	(void)state;
	for (int is_perspective = 0; is_perspective < 2; is_perspective++) {
		scene.camera = is_perspective ? perspective(3.2, 40) : orthographic(2);
		assert_int_equal(draw(&scene, PSR_CULL_ALL & ~(unsigned)PSR_CULL_CONES)->count[PSR_STAGE_CULL], n_cubes);
		memcpy(words, drawn.words, sizeof words);
		assert_true(draw(&scene, PSR_CULL_ALL)->count[PSR_STAGE_CULL] < 0.7 * n_cubes);
		assert_memory_equal(words, drawn.words, sizeof words);
	}
	psr_model_unref(model);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(fewer_samples_are_drawn_of_what_is_small),
		cmocka_unit_test(the_coarsest_level_that_is_dense_enough_is_drawn),
		cmocka_unit_test(runs_that_face_away_are_left_out_at_once),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
