/* Late warping: what is where, and what fills gaps, against pictures of an analytic world. */
#include "reproject_world.h"

/* Compares the pixels of `camera` that are well within a surface that faces both cameras, and whose place the received
 * picture showed well within it, too: cells make surfaces up to a pixel larger. Pixels of the received picture are
 * `step` codes apart at most. A place may be off by a pixel of it: by the margin of a cell, by half a pixel of
 * interpolation, by what the angle shows of the distance from the cell's plane. Rounding, twice, costs a code. Returns
 * how many were compared. */
static uint64_t compare(struct scene scene, const struct psr_camera *from, const struct psr_frame *received,
                        const struct psr_camera *camera, const struct psr_frame *drawn)
{
	const struct axes a = axes_of(camera, drawn->height), b = axes_of(from, received->height);
	const int is_perspective = from->kind == PSR_CAMERA_PERSPECTIVE;
	uint64_t n = 0;

	for (uint32_t y = 0; y < drawn->height; y++)
		for (uint32_t x = 0; x < drawn->width; x++) {
			const struct seen seen =
				look(scene.things, scene.n, camera, &a, x + 0.5 - 0.5 * drawn->width, y + 0.5 - 0.5 * drawn->height);
			double away[3];

			if (!(seen.depth < INFINITY) || seen.cosine < 0.4)
				continue;
			v3d_sub(away, seen.place, from->eye);
			const double z = v3d_dot(away, b.forward), unit = b.unit * (is_perspective ? z : 1);
			const double u = v3d_dot(away, b.right) / unit, v = v3d_dot(away, b.down) / unit;
			int is_within = z > 0 && fabs(u) < 0.5 * received->width - 2 && fabs(v) < 0.5 * received->height - 2;

			for (int k = 0; k < 9 && is_within; k++) {
				const double right = 2 * (k % 3 - 1), down = 2 * (k / 3 - 1);
				const struct seen there = look(scene.things, scene.n, from, &b, u + right, v + down);
				const struct seen beside = look(scene.things, scene.n, camera, &a, x + 0.5 - 0.5 * drawn->width + right,
				                                y + 0.5 - 0.5 * drawn->height + down);

				is_within = there.cosine > 0.4 && fabs(there.depth - z) < 10 * unit && beside.cosine > 0.4
				            && fabs(beside.depth - seen.depth) < 10 * unit;
			}
			if (!is_within)
				continue;
			const double step = 100 * unit / 0.4;
			const size_t pixel = (size_t)y * drawn->width + x;

			const int off = differ_by(drawn, seen.color, pixel);

			if (off > 2 + step)
				fail_msg("pixel %u, %u is off by %d codes; a pixel is %.1f", x, y, off, step);
			n++;
		}
	return n;
}

static void check_warp(struct scene scene, const struct psr_camera *from, const struct psr_camera *to, uint32_t reduce)
{
	struct psr_frame received = picture(scene, from, SIDE / reduce, SIDE / reduce);

	take(&received, from);
	struct psr_frame drawn = draw(to, SIDE, SIDE);

	if (compare(scene, from, &received, to, &drawn) < SIDE * SIDE / 8)
		fail_msg("hardly anything was compared");
	psr_frame_free(&received);
	psr_frame_free(&drawn);
}

static void the_same_camera_gives_the_picture_bit_for_bit(void **state)
{
	uint64_t seed = 1;
	struct psr_frame frame;
	struct psr_reproject_stats stats;

	(void)state;
	assert_int_equal(psr_frame_alloc(&frame, 37, 21, BOTH, NULL), PSR_OK);
	for (size_t i = 0; i < 37 * 21; i++) {
		frame.depth[i] = psr_float_from_bits((uint32_t)random_next(&seed));
		for (size_t c = 0; c < 3; c++)
			frame.rgb[3 * i + c] = (uint8_t)random_next(&seed);
	}
	take(&frame, &straight);
	struct psr_frame drawn = draw_with(&straight, 37, 21, NULL, &stats);

	assert_memory_equal(frame.rgb, drawn.rgb, 3 * 37 * 21);
	assert_int_equal(stats.is_copy, 1);
	psr_frame_free(&frame);
	psr_frame_free(&drawn);
}

static void overscan_gives_its_middle_bit_for_bit(void **state)
{
	struct psr_camera wide = straight;

	(void)state;
	wide.fov_y = 2 * atan(tan(straight.fov_y / 2) * 1.25);
	struct psr_frame received = picture(SCENE(near_square_and_wall), &wide, SIDE * 5 / 4, SIDE * 5 / 4);
	take(&received, &wide);
	struct psr_frame drawn = draw(&straight, SIDE, SIDE);

	for (uint32_t y = 0; y < SIDE; y++)
		assert_memory_equal(drawn.rgb + 3 * y * SIDE,
		                    received.rgb + 3 * ((size_t)(y + SIDE / 8) * received.width + SIDE / 8), 3 * SIDE);
	psr_frame_free(&received);
	psr_frame_free(&drawn);
}

static void surfaces_are_where_the_other_camera_sees_them(void **state)
{
	struct psr_camera other = orbit(straight, 5), rolled = straight, nearer = straight;

	(void)state;
	check_warp(SCENE(ball), &straight, &other, 1);
	check_warp(SCENE(near_square_and_wall), &straight, &other, 1);
	other.eye[1] = 0.5;
	check_warp(SCENE(ball), &straight, &other, 1);
	rolled.up[0] = 0.3;
	check_warp(SCENE(near_square_and_wall), &straight, &rolled, 1);
	nearer.eye[2] = 3.2;
	check_warp(SCENE(ball), &straight, &nearer, 1);
	nearer.fov_y = 0.5;
	check_warp(SCENE(near_square_and_wall), &straight, &nearer, 1);
}

static void orthographic_pictures_are_warped_too(void **state)
{
	struct psr_camera flat = straight, other = orbit(straight, 5);

	(void)state;
	flat.kind = PSR_CAMERA_ORTHOGRAPHIC;
	check_warp(SCENE(ball), &flat, &other, 1);
	check_warp(SCENE(ball), &straight, &flat, 1);
	other.kind = PSR_CAMERA_ORTHOGRAPHIC;
	other.eye[1] = 0.3;
	check_warp(SCENE(ball), &flat, &other, 1);
	check_warp(SCENE(near_square_and_wall), &flat, &other, 1);
}

static void smaller_pictures_are_warped_to_full_size(void **state)
{
	const struct psr_camera other = orbit(straight, 4);

	(void)state;
	check_warp(SCENE(ball), &straight, &other, 2);
	check_warp(SCENE(wall), &straight, &other, 4);
	check_warp(SCENE(wall), &straight, &straight, 2);
}

static void depth_as_u16_serves_as_well(void **state)
{
	const struct psr_camera other = orbit(straight, 5);
	const struct psr_depth_range range = { .min = 2, .max = 8 };
	struct psr_frame received = picture(SCENE(ball), &straight, SIDE, SIDE);
	uint16_t *q = malloc(SIDE * SIDE * sizeof *q);

	(void)state;
	assert_non_null(q);
	psr_depth_quantise(q, received.depth, SIDE * SIDE, &range);
	psr_depth_restore(received.depth, q, SIDE * SIDE, &range);
	take(&received, &straight);
	struct psr_frame drawn = draw(&other, SIDE, SIDE);

	assert_true(compare(SCENE(ball), &straight, &received, &other, &drawn) > SIDE * SIDE / 8);
	free(q);
	psr_frame_free(&received);
	psr_frame_free(&drawn);
}

/* The wall is behind all of it: the received picture has no background, and what it does not show is a part of the
 * wall. Overscan keeps the rim out of the picture. */
static void no_hole_shows_the_background(void **state)
{
	struct psr_camera wide = straight;

	(void)state;
	wide.fov_y = 1.6;
	struct psr_frame received = picture(SCENE(near_square_and_wall), &wide, 2 * SIDE, 2 * SIDE);
	take(&received, &wide);
	for (int i = 1; i <= 40; i++) {
		struct psr_camera other = orbit(straight, i % 2 ? i : -i);
		struct psr_reproject_stats stats;

		other.eye[1] = i % 4 < 2 ? 0 : 0.05 * i;
		struct psr_frame drawn = draw_with(&other, SIDE, SIDE, NULL, &stats);

		if (n_background(&drawn) > 0)
			fail_msg("%d degrees: %" PRIu64 " pixels", i, n_background(&drawn));
		assert_true(stats.filled > 0 || i < 3);
		assert_true(fabs(stats.filled + stats.covered - 1) < 1e-9);
		psr_frame_free(&drawn);
	}
	psr_frame_free(&received);
}

static void the_gap_takes_the_colour_of_the_farther_surface(void **state)
{
	struct psr_camera wide = straight, other = orbit(straight, 12);

	(void)state;
	wide.fov_y = 1.6;
	struct psr_frame received = picture(SCENE(near_square_and_wall), &wide, 4 * SIDE, 4 * SIDE);
	/* the square is black, the wall white */
	for (size_t i = 0; i < (size_t)received.width * received.height; i++)
		memset(received.rgb + 3 * i, received.depth[i] < 4 ? 0 : 255, 3);
	take(&received, &wide);
	struct psr_frame drawn = draw(&other, SIDE, SIDE);
	struct psr_frame truth = picture(SCENE(near_square_and_wall), &other, SIDE, SIDE);
	uint64_t n_black = 0, n_near = 0;

	for (size_t i = 0; i < SIDE * SIDE; i++) {
		n_black += drawn.rgb[3 * i] < 128;
		n_near += truth.depth[i] < 4.5;
	}
	/* A pixel of the received picture too much on each side. */
	if (n_black < n_near * 95 / 100 || n_black > n_near * 105 / 100)
		fail_msg("%" PRIu64 " pixels are black, %" PRIu64 " the square's", n_black, n_near);
	psr_frame_free(&received);
	psr_frame_free(&drawn);
	psr_frame_free(&truth);
}

static void background_that_was_seen_stays(void **state)
{
	const struct psr_camera other = orbit(straight, 3);
	struct psr_frame received = picture(SCENE(two_squares), &straight, SIDE, SIDE);
	struct psr_frame truth = picture(SCENE(two_squares), &other, SIDE, SIDE);

	(void)state;
	take(&received, &straight);
	struct psr_frame drawn = draw(&other, SIDE, SIDE);
	uint64_t n_wrong = 0;

	for (uint32_t y = 0; y < SIDE; y++)
		for (uint32_t x = 0; x < SIDE; x++)
			n_wrong += is_background(&drawn, x, y) != is_background(&truth, x, y);
	/* Half a pixel along the eight edges, of 53 pixels each. */
	assert_in_range(n_wrong, 0, 8 * 53 / 2);
	psr_frame_free(&received);
	psr_frame_free(&drawn);
	psr_frame_free(&truth);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(the_same_camera_gives_the_picture_bit_for_bit, set_up, tear_down),
		cmocka_unit_test_setup_teardown(overscan_gives_its_middle_bit_for_bit, set_up, tear_down),
		cmocka_unit_test_setup_teardown(surfaces_are_where_the_other_camera_sees_them, set_up, tear_down),
		cmocka_unit_test_setup_teardown(orthographic_pictures_are_warped_too, set_up, tear_down),
		cmocka_unit_test_setup_teardown(smaller_pictures_are_warped_to_full_size, set_up, tear_down),
		cmocka_unit_test_setup_teardown(depth_as_u16_serves_as_well, set_up, tear_down),
		cmocka_unit_test_setup_teardown(no_hole_shows_the_background, set_up, tear_down),
		cmocka_unit_test_setup_teardown(the_gap_takes_the_colour_of_the_farther_surface, set_up, tear_down),
		cmocka_unit_test_setup_teardown(background_that_was_seen_stays, set_up, tear_down),
	};

	return cmocka_run_group_tests_name("unit/client/reproject", tests, NULL, NULL);
}
