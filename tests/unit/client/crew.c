/* Threads that decode: the picture is the one that a single thread makes, in whatever order they work. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <string.h>
#include "base/random.h"
#include "client/lib/internal.h"

#define SIDE 96
#define RECTS 400 /* more than wait at a time */

static struct client_assembly alone, together;
static struct client_decoder *decoder;
static struct client_crew *crew;

static void begin(struct client_assembly *assembly, struct client_crew *its_crew)
{
	const struct psr_msg_frame asked = { .width = SIDE, .height = SIDE, .planes = 1u << PSR_PLANE_COLOR,
		                                 .color_codec = PSR_CODEC_JPEG, .color_quality = 50,
		                                 .flags = PSR_WIRE_FRAME_NO_HASHES };
	const struct psr_msg_frame_begin first = { .width = SIDE, .height = SIDE, .planes = 1u << PSR_PLANE_COLOR,
		                                       .color_codec = PSR_CODEC_JPEG, .color_quality = 50,
		                                       .settings.scale = 1 };
	struct psr_error err;

	client_assembly_init(assembly, &asked, 0);
	assembly->crew = its_crew;
	assert_int_equal(client_assembly_begin(assembly, &first, NULL, &err), PSR_OK);
}

static int set_up(void **state)
{
	(void)state;
	return client_decoder_create(&decoder) == PSR_OK ? client_crew_create(&crew, 3) : -1;
}

static int tear_down(void **state)
{
	(void)state;
	client_decoder_destroy(decoder);
	client_crew_destroy(crew);
	return 0;
}

static void put(struct client_assembly *assembly, struct psr_msg_rect *rect)
{
	struct psr_error err;

	assert_int_equal(client_assembly_rect(assembly, decoder, rect, &err), PSR_OK);
}

static void rectangles_on_top_of_each_other_lie_as_they_came(void **state)
{
	static uint8_t data[SIDE * SIDE * 3];
	uint64_t random = 5;

	(void)state;
	begin(&alone, NULL);
	begin(&together, crew);
	for (int i = 0; i < RECTS; i++) {
		struct psr_msg_rect rect = { .plane = PSR_PLANE_COLOR, .codec = PSR_CODEC_RAW, .scale = 1, .data = data };

		rect.x = (uint16_t)(random_next(&random) % SIDE);
		rect.y = (uint16_t)(random_next(&random) % SIDE);
		rect.w = (uint16_t)(1 + random_next(&random) % (SIDE - rect.x));
		rect.h = (uint16_t)(1 + random_next(&random) % (SIDE - rect.y));
		rect.total = rect.bytes = 3u * rect.w * rect.h;
		memset(data, (int)(random_next(&random) & 255), rect.total); /* what the thread before may still read */
		put(&alone, &rect);
		put(&together, &rect);
	}
	assert_int_equal(client_crew_wait(crew, NULL), PSR_OK);
	assert_memory_equal(together.picture.rgb, alone.picture.rgb, SIDE * SIDE * 3);
	client_assembly_fini(&alone);
	client_assembly_fini(&together);
}

static void a_frame_that_is_left_waits_for_its_rectangles(void **state)
{
	static uint8_t data[SIDE * SIDE * 3];
	struct psr_msg_rect rect = { .plane = PSR_PLANE_COLOR, .codec = PSR_CODEC_RAW, .scale = 1, .w = SIDE, .h = 1,
		                         .total = 3 * SIDE, .bytes = 3 * SIDE, .data = data };

	(void)state;
	for (int i = 0; i < 50; i++) { /* under the sanitizers a job that goes on would be seen */
		begin(&together, crew);
		for (rect.y = 0; rect.y < SIDE; rect.y++)
			put(&together, &rect);
		client_assembly_fini(&together);
	}
}

static void the_end_of_a_frame_tells_of_a_damaged_rectangle(void **state)
{
	const struct psr_msg_frame_end end = { .planes = 1u << PSR_PLANE_COLOR, .is_final = 1 };
	uint8_t data[64] = { 0xff, 0xd8, 0xff, 0xd9 };
	struct psr_msg_rect rect = { .plane = PSR_PLANE_COLOR, .codec = PSR_CODEC_JPEG, .scale = 1, .w = 8, .h = 8,
		                         .total = sizeof data, .bytes = sizeof data, .data = data };
	struct psr_error err = { .code = PSR_OK };
	unsigned checked;

	(void)state;
	begin(&together, crew);
	put(&together, &rect);
	assert_int_equal(client_assembly_end(&together, &end, &checked, &err), PSR_ERR_PROTOCOL);
	assert_non_null(strstr(err.text, "JPEG"));
	client_assembly_fini(&together);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(rectangles_on_top_of_each_other_lie_as_they_came, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_frame_that_is_left_waits_for_its_rectangles, set_up, tear_down),
		cmocka_unit_test_setup_teardown(the_end_of_a_frame_tells_of_a_damaged_rectangle, set_up, tear_down),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
