#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "measure/measure.h"
#include "tests/unit/sample/meshes.h"

#define SIDE 64
#define SPACING 0.05

/* A square seen from straight ahead, which fills the middle 52x52 pixels of the picture. */
struct fixture {
	struct psr_mesh *mesh;
	struct psr_truth *truth;
	struct psr_camera camera;
	float depth[SIDE * SIDE]; /* a perfect frame */
};
#define SHOT(f, n_threads) ((struct psr_truth_shot){ (f)->truth, &(f)->camera, SIDE, SIDE, n_threads })

static int open_fixture(void **state)
{
	struct fixture *f = calloc(1, sizeof *f);

	f->mesh = meshes_square(3);
	f->camera = (struct psr_camera){ .eye = { 0, 0, 3 }, .up = { 0, 1, 0 }, .kind = PSR_CAMERA_ORTHOGRAPHIC,
		                             .ortho_height = 2.5 };
	*state = f;
	return psr_truth_create(&f->truth, f->mesh, NULL)
	       || psr_truth_draw(&SHOT(f, 1), 1, f->depth, NULL, NULL, NULL);
}

static int close_fixture(void **state)
{
	struct fixture *f = *state;

	psr_truth_destroy(f->truth);
	meshes_free(f->mesh);
	free(f);
	return 0;
}

static struct psr_accuracy measure(const struct fixture *f)
{
	struct psr_accuracy a;

	assert_int_equal(psr_accuracy_measure(&a, &SHOT(f, 2), f->depth, SPACING, NULL), PSR_OK);
	return a;
}

static void the_truth_itself_is_perfect(void **state)
{
	struct psr_accuracy a = measure(*state);
	uint64_t side = 52; /* |x + 0.5 - 32| * 2.5 / 64 < 1 */

	assert_int_equal(a.n_truth, side * side);
	assert_int_equal(a.n_inside, (side - 2) * (side - 2));
	assert_int_equal(a.n_compared, a.n_truth);
	assert_int_equal(a.n_holes + a.n_inside_empty + a.n_outside_drawn, 0);
	assert_true(a.distance_max < 1e-5);
}

static void distances_count_in_spacings_along_the_normal(void **state)
{
	struct fixture *f = *state;
	struct psr_accuracy a;

	for (int i = 0; i < SIDE * SIDE; i++)
		f->depth[i] += (float)(i % 1000 == 0 ? 2 * SPACING : SPACING / 2);
	a = measure(f);
	assert_float_equal(a.distance_p50, 0.5, 1e-4);
	assert_float_equal(a.distance_p99, 0.5, 1e-4);
	assert_float_equal(a.distance_max, 2, 1e-4);
	assert_int_equal(a.n_holes, 0);
}

static void empty_and_far_pixels_inside_are_holes(void **state)
{
	struct fixture *f = *state;
	struct psr_accuracy a;

	f->depth[20 * SIDE + 30] = INFINITY;
	f->depth[22 * SIDE + 30] = NAN;
	f->depth[24 * SIDE + 30] += (float)(3.1 * SPACING);
	f->depth[26 * SIDE + 30] += (float)(2.9 * SPACING);
	f->depth[28 * SIDE + 30] -= 1;     /* in front: wrong, but no hole */
	f->depth[30 * SIDE + 6] = INFINITY; /* on the outline: not inside */
	a = measure(f);
	assert_int_equal(a.n_inside_empty, 2);
	assert_int_equal(a.n_holes, 3);
	assert_int_equal(a.n_compared, a.n_truth - 3);
	assert_float_equal(a.distance_max, 1 / SPACING, 1e-3);
}

/* All nine centre rays of pixel 7 meet the square, whose outline is at column 6.4, in the first of its neighbours. */
static void an_outline_between_centres_is_no_hole(void **state)
{
	struct fixture *f = *state;
	struct psr_accuracy a;

	f->depth[30 * SIDE + 7] = INFINITY; /* as beyond the outline */
	a = measure(f);
	assert_int_equal(a.n_inside_empty, 1);
	assert_int_equal(a.n_holes, 0);
	f->depth[32 * SIDE + 8] = INFINITY; /* its neighbourhood is whole */
	f->depth[34 * SIDE + 7] = 6;        /* nothing is there */
	a = measure(f);
	assert_int_equal(a.n_inside_empty, 2);
	assert_int_equal(a.n_holes, 2);
}

static void only_what_is_over_a_pixel_away_is_outside(void **state)
{
	struct fixture *f = *state;
	struct psr_accuracy a;

	f->depth[30 * SIDE + 5] = 3;  /* the outline is at column 6.4 */
	f->depth[30 * SIDE + 4] = 3;
	f->depth[0] = 3;
	f->depth[SIDE * SIDE - 1] = 3;
	a = measure(f);
	assert_int_equal(a.n_outside_drawn, 3);
	assert_int_equal(a.n_compared, a.n_truth + 1);
}

static void a_slope_is_no_hole(void **state)
{
	struct fixture *f = *state;
	double a = 1.3; /* 74 degrees from facing the eye */
	struct psr_accuracy accuracy;

	f->camera.eye[0] = 3 * sin(a);
	f->camera.eye[2] = 3 * cos(a);
	assert_int_equal(psr_truth_draw(&SHOT(f, 1), 1, f->depth, NULL, NULL, NULL), PSR_OK);
	/* As if each pixel's sample lay half a pixel to its side: the depth changes by half a pixel times the tangent. */
	for (int i = 0; i < SIDE * SIDE; i++)
		f->depth[i] += (float)(2.5 / SIDE / 2 * tan(a));
	accuracy = measure(f);
	assert_true(accuracy.n_inside > 300);
	assert_int_equal(accuracy.n_holes, 0);
	/* Along the normal that is half a pixel times the sine. */
	assert_true(accuracy.distance_max <= 2.5 / SIDE / 2 / SPACING);
}

static void bad_spacings_and_cameras_are_refused(void **state)
{
	struct fixture *f = *state;
	struct psr_accuracy a;

	assert_int_equal(psr_accuracy_measure(&a, &SHOT(f, 1), f->depth, 0, NULL), PSR_ERR_ARG);
	assert_int_equal(psr_accuracy_measure(&a, &SHOT(f, 1), f->depth, NAN, NULL), PSR_ERR_ARG);
	assert_int_equal(psr_accuracy_measure(&a, &SHOT(f, -1), f->depth, 1, NULL), PSR_ERR_ARG);
	f->camera.ortho_height = 0;
	assert_int_equal(psr_accuracy_measure(&a, &SHOT(f, 1), f->depth, 1, NULL), PSR_ERR_ARG);
}

#define TEST(f) cmocka_unit_test_setup_teardown(f, open_fixture, close_fixture)

static void colors_are_compared_within_a_pixel(void **state)
{
	struct fixture *f = *state;
	struct psr_color_accuracy color;
	uint8_t *rgb = malloc(3 * SIDE * SIDE), (*drawn)[4] = malloc(4 * SIDE * SIDE);

	assert_int_equal(psr_truth_draw(&SHOT(f, 1), 1, f->depth, NULL, drawn, NULL), PSR_OK);
	for (size_t i = 0; i < SIDE * SIDE; i++)
		memcpy(rgb + 3 * i, drawn[i], 3);
	assert_int_equal(psr_accuracy_measure_color(&color, &SHOT(f, 1), rgb, NULL), PSR_OK);
	assert_true(color.n_compared > 0 && color.n_wrong == 0 && color.mean == 0);
	/* What is as far off as is allowed, what is further, and what is outside and does not count. */
	rgb[3 * (SIDE / 2 * SIDE + SIDE / 2) + 1] -= PSR_COLOR_WRONG;
	rgb[3 * (SIDE / 2 * SIDE + SIDE / 2 + 5) + 2] -= PSR_COLOR_WRONG + 1;
	rgb[0] = 77;
	assert_int_equal(psr_accuracy_measure_color(&color, &SHOT(f, 1), rgb, NULL), PSR_OK);
	assert_int_equal(color.n_wrong, 1);
	assert_true(fabs(color.mean * (double)color.n_compared - (2 * PSR_COLOR_WRONG + 1)) < 1e-9);
	free(rgb);
	free(drawn);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(the_truth_itself_is_perfect),
		TEST(distances_count_in_spacings_along_the_normal),
		TEST(empty_and_far_pixels_inside_are_holes),
		TEST(an_outline_between_centres_is_no_hole),
		TEST(only_what_is_over_a_pixel_away_is_outside),
		TEST(a_slope_is_no_hole),
		TEST(colors_are_compared_within_a_pixel),
		TEST(bad_spacings_and_cameras_are_refused),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
