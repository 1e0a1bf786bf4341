/* Sizes, scales and formats of depth, from the codec to the client's picture; strips that leave early, and frames that
 * are given up. */
#include "trip.h"
#include "tests/unit/lib/threads.h"
#include <stdatomic.h>
#include <unistd.h>

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

static void frames_of_any_size_come_back(void **state)
{
	(void)state;
	for (int round = 0; round < 60; round++) {
		trip_ask(&trip, 1 + below(300), 1 + below(round & 1 ? 20 : 300), 1 + below(TRIP_ALL));
		trip_draw(&trip);
		trip_go(&trip, 0);
		trip_expect_exact(&trip);
		assert_int_equal(trip.checked, trip.request.planes);
	}
}

static void frames_drawn_at_a_scale_come_enlarged_with_their_hashes(void **state)
{
	(void)state;
	for (int round = 0; round < 40; round++) {
		trip.scale = round & 1 ? 2 : 4;
		trip_ask(&trip, trip.scale * (1 + below(100)), trip.scale * (1 + below(100)), 1 + below(TRIP_ALL));
		trip_draw(&trip);
		trip_go(&trip, 0);
		trip_expect_exact(&trip);
		assert_int_equal(trip.checked, trip.request.planes);
	}
}

static float z_at(const uint8_t *pixel)
{
	float z;

	memcpy(&z, pixel, 4);
	return z;
}

/* The nearest drawn depth of the pixel's group of `side` x `side`. */
static float nearest(uint32_t x, uint32_t y, uint32_t side)
{
	float z = INFINITY;

	for (uint32_t v = y / side * side; v < y / side * side + side && v < trip.request.height; v++)
		for (uint32_t u = x / side * side; u < x / side * side + side && u < trip.request.width; u++)
			z = fminf(z, z_at(trip_drawn(&trip, PSR_PLANE_DEPTH, u, v)));
	return z;
}

/* Depth lies between 1 and 2, the range is 1 to 3: a step of 1/z is 2/3 / 65534, of z at 2 four times as much; float
 * rounds by 2^-24. */
static void expect_depth(uint32_t side)
{
	const double half_step = 4 * (2.0 / 3) / 65534 / 2;

	for (uint32_t y = 0; y < trip.request.height; y++) {
		for (uint32_t x = 0; x < trip.request.width; x++) {
			const float z = nearest(x, y, side), got = z_at(trip_got(&trip, PSR_PLANE_DEPTH, x, y));

			if (isinf(z) ? !isinf(got) : fabs((double)got - (double)z) > half_step + ldexp(1, -22))
				fail_msg("depth %g came as %g", (double)z, (double)got);
		}
	}
}

static void ask_depth(unsigned format, unsigned codec)
{
	trip_ask(&trip, trip.scale * (1 + below(200)), trip.scale * (1 + below(150)), 1u << PSR_PLANE_DEPTH);
	trip.request.depth_format = (uint8_t)format;
	trip.request.depth_codec = (uint8_t)codec;
	trip.request.depth_min = 1;
	trip.request.depth_max = 3;
	trip_draw(&trip);
	trip_go(&trip, 0);
}

static void depth_as_u16_is_off_by_half_a_step_at_most(void **state)
{
	(void)state;
	for (int round = 0; round < 20; round++) {
		ask_depth(PSR_WIRE_DEPTH_U16, round & 1 ? PSR_CODEC_ZSTD : PSR_CODEC_RAW);
		expect_depth(1);
		if (trip.n_rects > 0)
			assert_int_equal(trip.checked, 0);
	}
}

static void depth_at_half_size_is_the_nearest_of_four(void **state)
{
	(void)state;
	for (int round = 0; round < 20; round++) {
		ask_depth(PSR_WIRE_DEPTH_U16_HALF, round & 1 ? PSR_CODEC_ZSTD : PSR_CODEC_RAW);
		expect_depth(2);
		for (size_t i = 0; i < trip.n_rects; i++)
			assert_int_equal(trip.rect[i].scale, 2);
	}
}

/* Of a frame drawn at scale 2 or 4 its pixels are the nearest of each 2x2 of the picture. */
static void depth_at_half_size_of_a_scaled_frame_is_not_reduced_again(void **state)
{
	(void)state;
	for (int round = 0; round < 20; round++) {
		trip.scale = round & 1 ? 2 : 4;
		ask_depth(PSR_WIRE_DEPTH_U16_HALF, PSR_CODEC_ZSTD);
		expect_depth(1);
		for (size_t i = 0; i < trip.n_rects; i++)
			assert_int_equal(trip.rect[i].scale, trip.scale);
	}
}

static void a_frame_without_hashes_has_none(void **state)
{
	(void)state;
	trip_ask(&trip, 100, 200, TRIP_ALL);
	trip.request.flags = PSR_WIRE_FRAME_NO_HASHES;
	trip_draw(&trip);
	trip_go(&trip, 0);
	trip_expect_exact(&trip);
	assert_int_equal(trip.checked, 0);
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++)
		assert_true(trip.result.hash[plane] == 0);
}

/* ---- strips on their way ---- */

struct watch {
	int n_asked, stop_at;  /* strips that began; the one that is told to stop, or -1 */
	int first_emitted_at;  /* n_asked then */
	uint32_t last_y;
	unsigned last_plane;
	atomic_int n_emitting;
	int is_slow, is_in_order, n_emitted;
};

static int asked(void *userdata)
{
	struct watch *watch = userdata;

	return watch->stop_at >= 0 && watch->n_asked++ >= watch->stop_at;
}

static int count_asked(void *userdata)
{
	struct watch *watch = userdata;

	watch->n_asked++;
	return 0;
}

static void watch_emit(struct outq_chunk *first, void *userdata)
{
	struct watch *watch = userdata;
	struct psr_msg_rect rect;

	if (atomic_fetch_add(&watch->n_emitting, 1) != 0)
		watch->is_in_order = 0;
	if (watch->is_slow)
		usleep(500); /* others are done with their strips meanwhile */
	if (watch->n_emitted++ == 0)
		watch->first_emitted_at = watch->n_asked;
	for (struct outq_chunk *chunk = first; chunk != NULL; chunk = chunk->next) {
		const uint8_t *message = chunk->data;
		const size_t length = (size_t)(message[0] | message[1] << 8 | message[2] << 16);

		assert_int_equal(psr_msg_rect_decode(&rect, message + PSR_HEADER_SIZE, length - PSR_HEADER_SIZE, NULL), PSR_OK);
		if (rect.plane < watch->last_plane || (rect.plane == watch->last_plane && rect.y < watch->last_y))
			watch->is_in_order = 0;
		watch->last_plane = rect.plane;
		watch->last_y = rect.y;
	}
	outq_chunks_destroy(first);
	atomic_fetch_sub(&watch->n_emitting, 1);
}

static int encode(struct watch *watch, struct psr_pool *pool, int (*is_cancelled)(void *))
{
	const struct psr_cancel cancel = { is_cancelled, watch };
	const struct codec_answer answer = {
		.id = 9, .request = &trip.request, .scale = 1, .background = trip_background, .emit = watch_emit,
		.userdata = watch, .cancel = &cancel,
	};
	struct psr_error err;

	watch->is_in_order = 1;
	return codec_encode(&trip.result, trip.codec, pool, &answer, &trip.drawn, &err);
}

/* 8 strips of each of 2 planes. */
static void draw_strips(void)
{
	trip_ask(&trip, 256, 1024, 3);
	trip_draw(&trip);
	for (uint32_t y = 0; y < 1024; y += 128) {
		trip.drawn.rgb[3 * 256 * y] = 77; /* none is background */
		trip.drawn.depth[256 * y] = 5;
	}
}

static void strips_leave_while_later_ones_are_coded(void **state)
{
	struct watch watch = { .stop_at = -1 };

	(void)state;
	draw_strips();
	assert_int_equal(encode(&watch, NULL, count_asked), PSR_OK);
	assert_int_equal(watch.first_emitted_at, 1);
	assert_int_equal(watch.n_emitted, 16);
	assert_true(watch.is_in_order);
}

static void strips_leave_in_order_and_one_at_a_time_from_any_thread(void **state)
{
	struct psr_pool *pool;

	(void)state;
	draw_strips();
	assert_int_equal(psr_pool_create(&pool, 4, NULL), PSR_OK);
	for (int round = 0; round < 20; round++) {
		struct watch watch = { .stop_at = -1, .is_slow = 1 };

		assert_int_equal(encode(&watch, pool, asked), PSR_OK);
		assert_int_equal(watch.n_emitted, 16);
		assert_true(watch.is_in_order);
	}
	psr_pool_destroy(pool);
}

static void a_frame_that_is_given_up_ends_before_the_next_strip(void **state)
{
	(void)state;
	draw_strips();
	for (int strip = 0; strip < 16; strip++) {
		struct watch watch = { .stop_at = strip };

		assert_int_equal(encode(&watch, NULL, asked), PSR_ERR_CANCELLED);
		assert_int_equal(watch.n_emitted, strip);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(frames_of_any_size_come_back, set_up, tear_down),
		cmocka_unit_test_setup_teardown(frames_drawn_at_a_scale_come_enlarged_with_their_hashes, set_up, tear_down),
		cmocka_unit_test_setup_teardown(depth_as_u16_is_off_by_half_a_step_at_most, set_up, tear_down),
		cmocka_unit_test_setup_teardown(depth_at_half_size_is_the_nearest_of_four, set_up, tear_down),
		cmocka_unit_test_setup_teardown(depth_at_half_size_of_a_scaled_frame_is_not_reduced_again, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_frame_without_hashes_has_none, set_up, tear_down),
		cmocka_unit_test_setup_teardown(strips_leave_while_later_ones_are_coded, set_up, tear_down),
		cmocka_unit_test_setup_teardown(strips_leave_in_order_and_one_at_a_time_from_any_thread, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_frame_that_is_given_up_ends_before_the_next_strip, set_up, tear_down),
	};

	only_threads_under_tsan();
	return cmocka_run_group_tests(tests, NULL, NULL);
}
