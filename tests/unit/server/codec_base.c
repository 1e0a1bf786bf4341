/* Frames as changes to a base: the client's picture is that of a whole frame, and little but the changes is sent. */
#include "trip.h"
#include "tests/unit/lib/threads.h"

static struct trip trip;

static int set_up(void **state)
{
	(void)state;
	trip_init(&trip);
	return 0;
}

static int tear_down(void **state)
{
	(void)state;
	trip_fini(&trip);
	return 0;
}

static uint32_t below(uint32_t n)
{
	return random_below(&trip_random, n);
}

static void change_somewhere(void)
{
	const uint32_t width = trip.drawn.width, height = trip.drawn.height, x = below(width), y = below(height);
	unsigned plane = below(PSR_N_PLANES);

	while (!(trip.request.planes >> plane & 1))
		plane = (plane + 1) % PSR_N_PLANES;
	trip_paint(&trip.drawn, plane, x, y, 1 + below(width - x), 1 + below(height - y));
}

static void changes_to_a_base_make_the_whole_picture(void **state)
{
	(void)state;
	for (int round = 0; round < 40; round++) {
		uint32_t planes = 1 + below(TRIP_ALL);

		trip.scale = 1u << below(3);
		trip_ask(&trip, trip.scale * (1 + below(400 / trip.scale)), trip.scale * (1 + below(300 / trip.scale)), planes);
		trip_draw(&trip);
		trip_go(&trip, 0);
		for (int frame = 0; frame < 4; frame++) {
			for (uint32_t k = below(4); k > 0; k--)
				change_somewhere();
			assert_true(trip_go(&trip, 1));
			trip_expect_exact(&trip);
			assert_int_equal(trip.checked, planes);
		}
	}
}

static void threads_change_nothing(void **state)
{
	(void)state;
	assert_int_equal(psr_pool_create(&trip.pool, 4, NULL), PSR_OK);
	trip_ask(&trip, 700, 500, TRIP_ALL);
	trip_draw(&trip);
	trip_go(&trip, 0);
	for (int frame = 0; frame < 20; frame++) {
		change_somewhere();
		assert_true(trip_go(&trip, 1));
		trip_expect_exact(&trip);
	}
	psr_pool_destroy(trip.pool);
	trip.pool = NULL;
}

static void an_unchanged_frame_sends_nothing(void **state)
{
	(void)state;
	trip_ask(&trip, 333, 300, TRIP_ALL);
	trip_draw(&trip);
	trip_go(&trip, 0);
	assert_true(trip_go(&trip, 1));
	assert_int_equal(trip.n_rects, 0);
	assert_true(trip.result.rect_bytes == 0);
	assert_int_equal(trip.checked, TRIP_ALL);
}

static void a_changed_pixel_sends_its_part(void **state)
{
	static const struct {
		uint32_t x, y;
		uint16_t rect[4];
	} rows[] = {
		{ 0, 0, { 0, 0, 128, 32 } }, { 127, 31, { 0, 0, 128, 32 } }, { 128, 32, { 128, 32, 128, 32 } },
		{ 332, 150, { 256, 128, 77, 32 } }, { 332, 299, { 256, 288, 77, 12 } },
	};

	(void)state;
	trip_ask(&trip, 333, 300, 1);
	trip_draw(&trip);
	trip_go(&trip, 0);
	for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
		trip.drawn.rgb[3 * (333 * rows[i].y + rows[i].x) + 1] ^= 1;
		assert_true(trip_go(&trip, 1));
		assert_int_equal(trip.n_rects, 1);
		assert_true(trip.rect[0].x == rows[i].rect[0] && trip.rect[0].y == rows[i].rect[1]
		            && trip.rect[0].w == rows[i].rect[2] && trip.rect[0].h == rows[i].rect[3]);
		trip_expect_exact(&trip);
	}
}

static void toggle_part(uint32_t column, uint32_t row)
{
	trip.drawn.rgb[3 * (trip.drawn.width * (row * PSR_WIRE_PART_HEIGHT + 3) + column * PSR_WIRE_PART_WIDTH + 5)] ^= 1;
}

/* A strip of parts, # is changed:   # # . #
 *                                   # # # .
 *                                   # # . .
 *                                   . . . #   */
static void changed_neighbours_are_one_rectangle(void **state)
{
	static const struct psr_msg_rect expected[] = {
		{ .x = 0, .y = 128, .w = 256, .h = 32 }, { .x = 384, .y = 128, .w = 100, .h = 32 },
		{ .x = 0, .y = 160, .w = 384, .h = 32 }, { .x = 0, .y = 192, .w = 256, .h = 32 },
		{ .x = 384, .y = 224, .w = 100, .h = 32 },
	};
	static const char *const rows[] = { "##.#", "###.", "##..", "...#" };

	(void)state;
	trip_ask(&trip, 484, 256, 1);
	trip_draw(&trip);
	trip_go(&trip, 0);
	for (uint32_t y = 0; y < 4; y++)
		for (uint32_t x = 0; x < 4; x++)
			if (rows[y][x] == '#')
				toggle_part(x, 4 + y);
	trip_go(&trip, 1);
	assert_int_equal(trip.n_rects, 5);
	for (size_t i = 0; i < 5; i++)
		assert_true(trip.rect[i].x == expected[i].x && trip.rect[i].y == expected[i].y
		            && trip.rect[i].w == expected[i].w && trip.rect[i].h == expected[i].h);
	for (uint32_t y = 1; y < 3; y++)
		for (uint32_t x = 0; x < 2; x++)
			toggle_part(x, y);
	trip_go(&trip, 1);
	assert_int_equal(trip.n_rects, 1);
	assert_true(trip.rect[0].x == 0 && trip.rect[0].y == 32 && trip.rect[0].w == 256 && trip.rect[0].h == 64);
	trip_expect_exact(&trip);
}

static void a_picture_that_changes_all_over_costs_no_more_than_without(void **state)
{
	uint64_t bytes;

	(void)state;
	trip_ask(&trip, 484, 300, 1);
	trip.request.color_codec = PSR_CODEC_JPEG;
	trip.request.color_quality = 80;
	trip_draw(&trip);
	trip_go(&trip, 0);
	for (uint32_t i = 0; i < 3 * 484 * 300; i++)
		trip.drawn.rgb[i] = (uint8_t)(i / 5000);
	trip_go(&trip, 1);
	assert_int_equal(trip.n_rects, 3);
	bytes = trip.result.rect_bytes;
	trip_go(&trip, 0);
	assert_true(trip.result.rect_bytes == bytes);
}

static void what_becomes_background_is_sent(void **state)
{
	(void)state;
	trip_ask(&trip, 200, 100, TRIP_ALL);
	trip_draw(&trip);
	trip_go(&trip, 0);
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++)
		for (uint32_t i = 0; i < 200 * 100; i++)
			memcpy((uint8_t *)psr_frame_plane(&trip.drawn, plane) + i * psr_plane_bytes(plane), trip_empty(plane),
			       psr_plane_bytes(plane));
	trip_go(&trip, 1);
	trip_expect_exact(&trip);
	assert_int_equal(trip.checked, TRIP_ALL);
}

static void ask_jpeg(uint8_t quality)
{
	trip.request.color_codec = quality > 0 ? PSR_CODEC_JPEG : PSR_CODEC_ZSTD;
	trip.request.color_quality = quality;
}

static size_t count_pixels(void)
{
	size_t n = 0;

	for (size_t i = 0; i < trip.n_rects; i++)
		n += (size_t)trip.rect[i].w * trip.rect[i].h;
	return n;
}

static void better_quality_sends_all_parts_again(void **state)
{
	(void)state;
	trip_ask(&trip, 333, 300, 1);
	trip_draw(&trip);
	trip_paint(&trip.drawn, 0, 0, 0, 333, 300);
	trip.drawn.rgb[0] ^= 1; /* no background anywhere in the first strip, at least */
	ask_jpeg(50);
	trip_go(&trip, 0);
	assert_int_equal(trip.checked, 0);
	ask_jpeg(80);
	assert_true(trip_go(&trip, 1));
	assert_true(count_pixels() >= 333 * 128);
	ask_jpeg(0);
	trip_go(&trip, 1);
	assert_true(count_pixels() >= 333 * 128);
	trip_expect_exact(&trip);
	assert_int_equal(trip.checked, 1);
}

static void quality_that_the_client_has_is_not_sent_again(void **state)
{
	(void)state;
	trip_ask(&trip, 333, 300, 1);
	trip_draw(&trip);
	trip_go(&trip, 0);
	ask_jpeg(90);
	trip_go(&trip, 1);
	assert_int_equal(trip.n_rects, 0);
	toggle_part(1, 1);
	trip_go(&trip, 1);
	assert_int_equal(trip.n_rects, 1);
	ask_jpeg(0); /* of which that part alone is not lossless */
	trip_go(&trip, 1);
	assert_int_equal(trip.n_rects, 1);
	trip_expect_exact(&trip);
	assert_int_equal(trip.checked, 1);
}

static void a_jpeg_that_travels_raw_has_lost_nothing(void **state)
{
	(void)state;
	trip_ask(&trip, 5, 4, 1); /* 60 bytes: a JPEG has more */
	trip_draw(&trip);
	trip.drawn.rgb[0] ^= 1;
	ask_jpeg(50);
	trip_go(&trip, 0);
	trip_expect_exact(&trip);
	ask_jpeg(0);
	trip_go(&trip, 1);
	assert_int_equal(trip.n_rects, 0);
}

static void whole_depth_replaces_half(void **state)
{
	(void)state;
	trip_ask(&trip, 333, 300, 2);
	trip_draw(&trip);
	trip.request.depth_format = PSR_WIRE_DEPTH_U16_HALF;
	trip.request.depth_min = 1;
	trip.request.depth_max = 2;
	trip_go(&trip, 0);
	assert_true(trip_go(&trip, 1));
	assert_int_equal(trip.n_rects, 0);
	trip.request.depth_format = PSR_WIRE_DEPTH_U16;
	assert_true(trip_go(&trip, 1));
	assert_true(trip.n_rects > 0);
	trip.request.depth_format = PSR_WIRE_DEPTH_F32;
	trip.request.depth_min = trip.request.depth_max = 0;
	assert_true(trip_go(&trip, 1));
	trip_expect_exact(&trip);
	assert_int_equal(trip.checked, 2);
}

static void another_frame_is_no_base(void **state)
{
	struct psr_msg_frame other;

	(void)state;
	trip_ask(&trip, 336, 300, 3);
	trip.request.depth_format = PSR_WIRE_DEPTH_U16;
	trip.request.depth_min = 1;
	trip.request.depth_max = 2;
	trip_draw(&trip);
	trip_go(&trip, 0);
	assert_true(codec_parts_fit(trip.parts, &trip.request, 1));
	assert_false(codec_parts_fit(trip.parts, &trip.request, 2));
	other = trip.request;
	other.width = 337;
	assert_false(codec_parts_fit(trip.parts, &other, 1));
	other = trip.request;
	other.height = 299;
	assert_false(codec_parts_fit(trip.parts, &other, 1));
	other = trip.request;
	other.planes = 1;
	assert_false(codec_parts_fit(trip.parts, &other, 1));
	other = trip.request;
	other.depth_max = 2.5;
	assert_false(codec_parts_fit(trip.parts, &other, 1));
	other = trip.request;
	other.camera.kind = PSR_CAMERA_ORTHOGRAPHIC;
	assert_false(codec_parts_fit(trip.parts, &other, 1));
}

static void parts_take_the_bytes_that_were_said(void **state)
{
	(void)state;
	assert_true(codec_parts_bytes(128, 32, 1) == sizeof(struct codec_parts) + 9);
	assert_true(codec_parts_bytes(129, 33, 3) == sizeof(struct codec_parts) + 2 * 4 * 9);
	assert_true(codec_parts_bytes(16384, 4096, TRIP_ALL) == sizeof(struct codec_parts) + UINT64_C(8) * 128 * 128 * 9);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(changes_to_a_base_make_the_whole_picture, set_up, tear_down),
		cmocka_unit_test_setup_teardown(threads_change_nothing, set_up, tear_down),
		cmocka_unit_test_setup_teardown(an_unchanged_frame_sends_nothing, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_changed_pixel_sends_its_part, set_up, tear_down),
		cmocka_unit_test_setup_teardown(changed_neighbours_are_one_rectangle, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_picture_that_changes_all_over_costs_no_more_than_without, set_up, tear_down),
		cmocka_unit_test_setup_teardown(what_becomes_background_is_sent, set_up, tear_down),
		cmocka_unit_test_setup_teardown(better_quality_sends_all_parts_again, set_up, tear_down),
		cmocka_unit_test_setup_teardown(quality_that_the_client_has_is_not_sent_again, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_jpeg_that_travels_raw_has_lost_nothing, set_up, tear_down),
		cmocka_unit_test_setup_teardown(whole_depth_replaces_half, set_up, tear_down),
		cmocka_unit_test_setup_teardown(another_frame_is_no_base, set_up, tear_down),
		cmocka_unit_test(parts_take_the_bytes_that_were_said),
	};

	only_threads_under_tsan();
	return cmocka_run_group_tests(tests, NULL, NULL);
}
