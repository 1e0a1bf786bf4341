/* Late warping of hard and hostile pictures: near planes, odd depths, extreme sizes. */
#include "reproject_world.h"

static void what_is_behind_the_eye_is_not_drawn(void **state)
{
	struct psr_frame received = picture(SCENE(near_square_and_wall), &straight, SIDE, SIDE);
	struct psr_camera other = straight;
	struct psr_reproject_stats stats;

	(void)state;
	take(&received, &straight);
	other.target[2] = 8; /* turned round */
	struct psr_frame drawn = draw(&other, SIDE, SIDE);
	assert_int_equal(n_background(&drawn), SIDE * SIDE);
	psr_frame_free(&drawn);
	/* Nearer than near_z nothing is drawn: the square covers a fifth of the picture. */
	other = straight;
	other.near_z = 4;
	drawn = draw_with(&other, SIDE + 1, SIDE, NULL, &stats);
	assert_true(stats.covered < 0.85);
	psr_frame_free(&drawn);
	psr_frame_free(&received);
	/* Through the square alone, in steps: nothing is left beyond it. */
	received = picture((struct scene){ near_square_and_wall, 1 }, &straight, SIDE, SIDE);
	take(&received, &straight);
	for (other = straight; other.eye[2] > -0.9; other.eye[2] -= 0.07) {
		other.target[2] = other.eye[2] - 1;
		drawn = draw(&other, SIDE, SIDE);
		if (other.eye[2] < 0.5)
			assert_int_equal(n_background(&drawn), SIDE * SIDE);
		psr_frame_free(&drawn);
	}
	psr_frame_free(&received);
}

/* Whatever the depths: an answer, in time. */
static void hostile_depths_do_no_harm(void **state)
{
	static const float odd[] = { INFINITY, NAN, 0, -1, -INFINITY, FLT_MAX, FLT_MIN, 1e-45f, 1e30f, 1e-30f, 1 };
	const size_t n_odd = sizeof odd / sizeof odd[0];
	struct psr_frame frame;
	uint64_t seed = 7;

	(void)state;
	assert_int_equal(psr_frame_alloc(&frame, 301, 77, BOTH, NULL), PSR_OK);
	for (int kind = 0; kind < 14; kind++) {
		struct psr_camera other = orbit(straight, kind);

		for (size_t i = 0; i < 301 * 77; i++)
			frame.depth[i] = kind < (int)n_odd ? odd[kind]
			               : kind == 11 ? odd[random_below(&seed, (uint32_t)n_odd)]
			               : kind == 12 ? psr_float_from_bits((uint32_t)random_next(&seed))
			                            : (float)random_in(&seed, 0.01, 5);
		memset(frame.rgb, 50, 3 * 301 * 77);
		take(&frame, &straight);
		for (int k = 0; k < 3; k++) {
			other.eye[2] = k == 1 ? 3.99 : k == 2 ? 1e30 : other.eye[2];
			struct psr_frame drawn = draw(&other, 200, 150);

			for (size_t i = 0; i < 200 * 150; i++)
				assert_true(drawn.rgb[3 * i] == 50 || is_background(&drawn, i % 200, i / 200));
			if (kind < 5)
				assert_int_equal(n_background(&drawn), 200 * 150);
			psr_frame_free(&drawn);
		}
	}
	psr_frame_free(&frame);
}

static void any_size_from_one_pixel_on(void **state)
{
	static const uint32_t size[][2] = { { 1, 1 }, { 1, 9 }, { 8, 8 }, { 17, 1 }, { 16384, 3 }, { 3, 16384 } };
	struct psr_camera other = orbit(straight, 2);

	(void)state;
	for (size_t i = 0; i < sizeof size / sizeof size[0]; i++) {
		struct psr_frame received = picture(SCENE(wall), &straight, size[i][0], size[i][1]);

		take(&received, &straight);
		for (size_t k = 0; k < sizeof size / sizeof size[0]; k++) {
			struct psr_frame drawn = draw(&other, size[k][0], size[k][1]);

			/* The middle of the wall is in the middle of either picture, half a pixel from a pixel's middle at most. */
			if (size[i][0] * size[k][1] > size[i][1])
				assert_false(is_background(&drawn, size[k][0] / 2, size[k][1] / 2));
			psr_frame_free(&drawn);
		}
		psr_frame_free(&received);
	}
}

/* The finest steps of places in wide pictures are quarters of a pixel. */
static void wide_pictures_keep_their_places(void **state)
{
	struct psr_camera flat = straight, other;
	const uint32_t width = 16384;
	struct psr_frame received;

	(void)state;
	flat.kind = PSR_CAMERA_ORTHOGRAPHIC;
	assert_int_equal(psr_frame_alloc(&received, width, 2, BOTH, NULL), PSR_OK);
	for (size_t i = 0; i < 2 * width; i++) {
		received.depth[i] = 1;
		memset(received.rgb + 3 * i, (int)(i % width / 64 % 251), 3);
	}
	take(&received, &flat);
	other = flat;
	other.eye[0] = other.target[0] = 640 * flat.ortho_height / 2; /* so many pixels to the right */
	struct psr_frame drawn = draw(&other, width, 2);

	for (uint32_t x = 0; x < width - 640; x++)
		assert_int_equal(drawn.rgb[3 * x], (x + 640) / 64 % 251);
	psr_frame_free(&received);
	psr_frame_free(&drawn);
}

static void threads_change_nothing(void **state)
{
	const struct psr_camera other = orbit(straight, 9);
	struct psr_frame received = picture(SCENE(near_square_and_wall), &straight, SIDE, SIDE);

	(void)state;
	take(&received, &straight);
	struct psr_frame one = draw(&other, 3 * SIDE, 2 * SIDE);

	for (int n = 2; n <= 4; n++) {
		struct psr_pool *pool;

		assert_int_equal(psr_pool_create(&pool, n, NULL), PSR_OK);
		assert_int_equal(psr_reproject_take(reproject, &received, &straight, background, pool, NULL), PSR_OK);
		struct psr_frame many = draw_with(&other, 3 * SIDE, 2 * SIDE, pool, NULL);

		assert_memory_equal(one.rgb, many.rgb, 3 * 3 * SIDE * 2 * SIDE);
		psr_frame_free(&many);
		psr_pool_destroy(pool);
	}
	psr_frame_free(&one);
	psr_frame_free(&received);
}

static void bad_arguments_are_refused(void **state)
{
	struct psr_frame frame, small;
	struct psr_camera bad = straight;
	struct psr_error err;

	(void)state;
	assert_int_equal(psr_frame_alloc(&small, 4, 4, COLOR, NULL), PSR_OK);
	assert_int_equal(psr_reproject_draw(reproject, &straight, &small, NULL, NULL, &err), PSR_ERR_ARG);
	assert_int_equal(psr_reproject_take(reproject, &small, &straight, background, NULL, &err), PSR_ERR_ARG);
	frame = picture(SCENE(wall), &straight, 4, 4);
	memcpy(bad.target, bad.eye, sizeof bad.eye);
	assert_int_equal(psr_reproject_take(reproject, &frame, &bad, background, NULL, &err), PSR_ERR_ARG);
	take(&frame, &straight);
	assert_int_equal(psr_reproject_draw(reproject, &bad, &small, NULL, NULL, &err), PSR_ERR_ARG);
	small.width = 0;
	assert_int_equal(psr_reproject_draw(reproject, &straight, &small, NULL, NULL, &err), PSR_ERR_ARG);
	small.width = PSR_MAX_SIDE + 1;
	assert_int_equal(psr_reproject_draw(reproject, &straight, &small, NULL, NULL, &err), PSR_ERR_LIMIT);
	psr_frame_free(&small);
	psr_frame_free(&frame);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(what_is_behind_the_eye_is_not_drawn, set_up, tear_down),
		cmocka_unit_test_setup_teardown(hostile_depths_do_no_harm, set_up, tear_down),
		cmocka_unit_test_setup_teardown(any_size_from_one_pixel_on, set_up, tear_down),
		cmocka_unit_test_setup_teardown(wide_pictures_keep_their_places, set_up, tear_down),
		cmocka_unit_test_setup_teardown(threads_change_nothing, set_up, tear_down),
		cmocka_unit_test_setup_teardown(bad_arguments_are_refused, set_up, tear_down),
	};

	return cmocka_run_group_tests_name("unit/client/reproject_hard", tests, NULL, NULL);
}
