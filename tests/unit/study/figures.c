#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/srgb.h"
#include "models/studies/figures/figures.h"
#include "models/shapes/surfaces.h"

#define SIDE 64

/* A plate, and a smaller one over its middle. Both look up. */
static void make_plates(struct shape *shape)
{
	static const struct shape_material grey = { "grey", 0x808080, 0, 1, 0 };
	static const double floor[3] = { 1, 0.05, 1 }, roof[3] = { 0.4, 0.05, 0.4 };
	static const double turn[3][3] = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } }, up[3] = { 0, 1, 0 };
	uint32_t first;

	shape_material(shape, &grey);
	surface_box(shape, floor);
	first = shape->n_vertices;
	surface_box(shape, roof);
	shape_move(shape, first, turn, up);
}

struct fixture {
	struct psr_error err;
	struct study study;
	struct figure_model model;
	struct figure_shot shot;
	struct figure_truth truth;
};

static int set_up(void **state)
{
	static const double toward[3] = { 0, 0.3, 1 };
	struct fixture *f = calloc(1, sizeof *f);

	assert_non_null(f);
	f->study = (struct study){ .err = &f->err, .n_threads = 1 };
	assert_int_equal(psr_renderer_create(&f->study.renderer, NULL), PSR_OK);
	assert_int_equal(figure_model_load(&f->model, &f->study, "plates", make_plates, 64), PSR_OK);
	figure_shot_init(&f->shot, &f->model, toward, 1, SIDE);
	*state = f;
	return 0;
}

static int tear_down(void **state)
{
	struct fixture *f = *state;

	figure_truth_fini(&f->truth);
	figure_model_fini(&f->model);
	psr_renderer_destroy(f->study.renderer);
	free(f);
	return 0;
}

static void draw(struct fixture *f)
{
	assert_int_equal(figure_truth_draw(&f->truth, &f->study, &f->model, &f->shot, 2), PSR_OK);
}

/* Seen from straight above every ray meets the same normal at N.V = 1, so that a mean of rays has one code, too:
 * surface/lobe.h with roughness 1 and reflectance 0.04, where S is 1 / 3.15. */
static void the_truth_in_ambient_light_is_the_light_of_the_material(void **state)
{
	static const double above[3] = { 0, 1, 0 };
	struct fixture *f = *state;
	struct psr_camera *camera = &f->shot.scene.camera;
	const uint8_t code = psr_linear_to_srgb(psr_srgb_to_linear[0x80] * 0.96f + 0.04f / 3.15f);
	uint32_t n_whole = 0;

	figure_shot_init(&f->shot, &f->model, above, 1, SIDE);
	camera->up[1] = 0;
	camera->up[2] = 1;
	camera->ortho_height = SIDE * f->model.spacing;
	camera->kind = PSR_CAMERA_ORTHOGRAPHIC;

	f->shot.scene.n_lights = 0;
	for (int c = 0; c < 3; c++)
		f->shot.scene.ambient[c] = 1;
	draw(f);
	for (size_t i = 0; i < SIDE * SIDE; i++)
		if (f->truth.n_met[i] == 4) {
			assert_int_equal(f->truth.rgb[3 * i], code);
			assert_int_equal(f->truth.rgb[3 * i + 2], code);
			n_whole++;
		}
	assert_true(n_whole > 100);
}

static uint64_t light_of(const struct fixture *f)
{
	uint64_t sum = 0;

	for (size_t i = 0; i < SIDE * SIDE; i++)
		sum += f->truth.n_met[i] == 4 ? f->truth.rgb[3 * i] : 0;
	return sum;
}

static void the_truth_has_the_shadows_that_lights_cast(void **state)
{
	struct fixture *f = *state;
	struct psr_light *light = &f->shot.light[0];
	uint64_t ambient, lit, shadowed;

	*light = (struct psr_light){ .kind = PSR_LIGHT_DIRECTIONAL, .direction = { 0, -1, 0 }, .color = { 0, 0, 0 } };
	draw(f);
	ambient = light_of(f);
	for (int c = 0; c < 3; c++)
		light->color[c] = 0.7;
	draw(f);
	lit = light_of(f);
	light->casts_shadow = 1;
	draw(f);
	shadowed = light_of(f);
	assert_true(ambient < shadowed);
	assert_true(shadowed < lit);
}

static size_t first_whole(const struct fixture *f)
{
	size_t i = 0;

	while (f->truth.n_met[i] < 4)
		i++;
	return i;
}

static void the_truth_scores_no_error(void **state)
{
	struct fixture *f = *state;
	struct figure_score score = { .n_met = 0 };
	struct psr_frame frame;

	assert_int_equal(psr_frame_alloc(&frame, SIDE, SIDE, FIGURE_PLANES, &f->err), PSR_OK);
	draw(f);
	assert_int_equal(figure_draw(&frame, &f->study, &f->shot), PSR_OK);
	memcpy(frame.rgb, f->truth.rgb, 3 * SIDE * SIDE);
	figure_score_colors(&score, &frame, &f->truth);
	assert_true(score.n_met > score.n_inside && score.n_inside > 100);
	assert_int_equal(score.square, 0);
	assert_true(isinf(figure_psnr(score.square, score.n_met)));
	frame.rgb[3 * first_whole(f) + 1] ^= 4;
	figure_score_colors(&score, &frame, &f->truth);
	assert_int_equal(score.square, 16);
	psr_frame_free(&frame);
}

static void a_part_is_found_where_the_first_way_is_worse(void **state)
{
	struct fixture *f = *state;
	struct figure_part part = { 0, 0, 8, 8, 1 };
	uint8_t *wrong = malloc(3 * SIDE * SIDE);
	size_t inside;

	assert_non_null(wrong);
	draw(f);
	inside = first_whole(f);
	memcpy(wrong, f->truth.rgb, 3 * SIDE * SIDE);
	assert_int_equal(figure_part_find(&part, wrong, f->truth.rgb, &f->truth), 0);
	wrong[3 * inside] ^= 0x80;
	assert_true(figure_part_find(&part, wrong, f->truth.rgb, &f->truth) == 0x80 * 0x80);
	assert_in_range(inside % SIDE, part.x, part.x + 7);
	assert_in_range(inside / SIDE, part.y, part.y + 7);
	free(wrong);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(the_truth_in_ambient_light_is_the_light_of_the_material, set_up, tear_down),
		cmocka_unit_test_setup_teardown(the_truth_has_the_shadows_that_lights_cast, set_up, tear_down),
		cmocka_unit_test_setup_teardown(the_truth_scores_no_error, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_part_is_found_where_the_first_way_is_worse, set_up, tear_down),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
