/* The pacer by itself: an event, and what it asks for then. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "client/lib/pace.h"

#define MS UINT64_C(1000000)
#define SECOND UINT64_C(1000000000)

static const struct pace_wish wish = { .fps = 30, .width = 1920, .height = 1080, .least_quality = 30,
	                                   .most_quality = 85, .most_scale = 4, .pass_limit = 4 };

static struct pace pace;
static struct pace_request asked;
static uint64_t again_ns;

static void start_moving(void)
{
	pace_init(&pace, &wish, SECOND);
	assert_int_equal(pace_next(&pace, SECOND, &asked, &again_ns), 1);
	pace_sent(&pace, 1, &asked, SECOND);
}

static void answer(uint32_t id, uint64_t bytes, uint64_t first_ns, uint64_t last_ns)
{
	const struct pace_cost cost = { .bytes = bytes, .server_ns = 5 * MS };

	pace_first_bytes(&pace, id, bytes / 10, first_ns);
	pace_complete(&pace, id, &cost, last_ns);
	pace_acknowledged(&pace, id, MS, last_ns + MS);
}

static void the_first_picture_is_coarse_and_a_sharp_one_follows(void **state)
{
	(void)state;
	start_moving();
	assert_int_equal(asked.settings.scale, wish.most_scale);
	assert_int_equal(asked.color_codec, PSR_CODEC_JPEG);
	assert_int_equal(asked.color_quality, wish.least_quality);
	assert_int_equal(asked.is_sharp, 1);
	assert_int_equal(asked.pass_limit, wish.pass_limit);
}

static void nothing_is_asked_for_while_nothing_moves(void **state)
{
	(void)state;
	start_moving();
	answer(1, 10000, SECOND + 10 * MS, SECOND + 12 * MS);
	assert_int_equal(pace_next(&pace, 100 * SECOND, &asked, &again_ns), 0);
	assert_true(again_ns == PACE_NEVER);
}

static void letting_go_asks_at_once(void **state)
{
	(void)state;
	start_moving();
	pace_moved(&pace, SECOND + MS);
	assert_int_equal(pace_next(&pace, SECOND + MS, &asked, &again_ns), 0);
	assert_true(again_ns <= SECOND + MS + PACE_REST_NS);
	pace_rested(&pace);
	assert_int_equal(pace_next(&pace, SECOND + MS, &asked, &again_ns), 1);
	assert_int_equal(asked.is_sharp, 1);
}

static void a_movement_asks_for_no_sharp_frame(void **state)
{
	(void)state;
	start_moving();
	pace_moved(&pace, 2 * SECOND);
	assert_int_equal(pace_next(&pace, 2 * SECOND, &asked, &again_ns), 1);
	assert_int_equal(asked.is_sharp, 0);
	assert_int_equal(asked.pass_limit, 0);
}

static void a_camera_that_was_asked_for_is_not_asked_for_again_while_moving(void **state)
{
	(void)state;
	start_moving();
	pace_moved(&pace, 2 * SECOND);
	assert_int_equal(pace_next(&pace, 2 * SECOND, &asked, &again_ns), 1);
	pace_sent(&pace, 2, &asked, 2 * SECOND);
	answer(1, 10000, 2 * SECOND + MS, 2 * SECOND + 2 * MS);
	assert_int_equal(pace_next(&pace, 2 * SECOND + PACE_REST_NS - 1, &asked, &again_ns), 0);
	assert_true(again_ns == 2 * SECOND + PACE_REST_NS);
	assert_int_equal(pace_next(&pace, again_ns, &asked, &again_ns), 1);
	assert_int_equal(asked.is_sharp, 1);
}

static void later_frames_of_an_id_and_foreign_ids_teach_nothing(void **state)
{
	struct pace before;

	(void)state;
	start_moving();
	answer(1, 10000, SECOND + 10 * MS, SECOND + 12 * MS);
	before = pace;
	answer(1, 900000, SECOND + 20 * MS, SECOND + 900 * MS);
	answer(77, 1, SECOND + 20 * MS, SECOND + 900 * MS);
	answer(0, 1, SECOND + 20 * MS, SECOND + 900 * MS);
	pace_ended(&pace, 0);
	assert_memory_equal(&pace, &before, sizeof pace);
	assert_true(pace_rate(&pace) > 4.4e6 && pace_rate(&pace) < 4.6e6); /* 9,000 bytes in 2 ms */
}

static void a_request_that_failed_makes_room(void **state)
{
	(void)state;
	start_moving();
	for (uint32_t id = 2; id <= 3; id++) {
		pace_moved(&pace, id * SECOND);
		assert_int_equal(pace_next(&pace, id * SECOND, &asked, &again_ns), id == 2);
		if (id == 2)
			pace_sent(&pace, id, &asked, id * SECOND);
	}
	pace_ended(&pace, 1);
	assert_int_equal(pace_next(&pace, 3 * SECOND, &asked, &again_ns), 1);
}

static void a_frame_that_one_read_brought_lets_the_next_grow_four_times(void **state)
{
	const struct pace_cost cost = { .bytes = 7000 };

	(void)state;
	start_moving();
	pace_first_bytes(&pace, 1, cost.bytes, SECOND + 10 * MS);
	pace_complete(&pace, 1, &cost, SECOND + 10 * MS);
	pace_acknowledged(&pace, 1, MS, SECOND + 11 * MS);
	assert_true(pace_rate(&pace) == 0);
	pace_moved(&pace, 2 * SECOND);
	assert_int_equal(pace_next(&pace, 2 * SECOND, &asked, &again_ns), 1);
	assert_int_equal(asked.settings.scale, 2); /* 18,000 bytes; 48,000 in full size */
}

static void a_smaller_window_gets_a_sharper_picture(void **state)
{
	struct pace_wish small = wish;

	(void)state;
	start_moving();
	answer(1, 8000, SECOND + 10 * MS, SECOND + 20 * MS); /* 0.72 MB/s: 19 KB a frame */
	pace_moved(&pace, 2 * SECOND);
	assert_int_equal(pace_next(&pace, 2 * SECOND, &asked, &again_ns), 1);
	assert_int_equal(asked.settings.scale, 4);
	small.width = 480;
	small.height = 270;
	pace_set_wish(&pace, &small, 2 * SECOND);
	assert_int_equal(pace_next(&pace, 2 * SECOND, &asked, &again_ns), 1);
	assert_int_equal(asked.settings.scale, 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_first_picture_is_coarse_and_a_sharp_one_follows),
		cmocka_unit_test(nothing_is_asked_for_while_nothing_moves),
		cmocka_unit_test(letting_go_asks_at_once),
		cmocka_unit_test(a_movement_asks_for_no_sharp_frame),
		cmocka_unit_test(a_camera_that_was_asked_for_is_not_asked_for_again_while_moving),
		cmocka_unit_test(later_frames_of_an_id_and_foreign_ids_teach_nothing),
		cmocka_unit_test(a_request_that_failed_makes_room),
		cmocka_unit_test(a_frame_that_one_read_brought_lets_the_next_grow_four_times),
		cmocka_unit_test(a_smaller_window_gets_a_sharper_picture),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
