/* --max-memory holds whatever frames take: glass, refinement; and who lacks memory gets it. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "plate.h"
#include "model/blocks.h"
#include "model/cubes.h"
#include "psr/render.h"
#include "render/need.h"

#define N_PEERS 2
#define N_PANES 64

static struct daemon psrd;
static struct peer peer[N_PEERS];

static int add_panes(void **state)
{
	set_up(state);
	pane_write(folder, "pane.psr", 0x2040c0, 8);
	return 0;
}

static int stop(void **state)
{
	daemon_stop(&psrd);
	return tear_down(state);
}

/* Panes behind each other, each wider than the picture. */
static void send_panes(struct peer *p)
{
	static struct psr_msg_scene scene;
	struct psr_msg_opened opened;

	peer_hello(p, &psrd, NULL);
	peer_expect_opened(p, peer_ask_open(p, "pane"), &opened);
	scene_default(&scene, opened.handle);
	scene.n_instances = N_PANES;
	for (int i = 0; i < N_PANES; i++) {
		scene.instance[i] = scene.instance[0];
		scene.instance[i].scale = 4;
		scene.instance[i].translation[2] = -i;
	}
	peer_send_scene(p, &scene);
}

/* What psrd took at most is within --max-memory, beside what it had before any frame. */
static void expect_within(long before_kb, long max_mb)
{
	const long most_kb = daemon_memory_kb(&psrd, "VmHWM") - before_kb;

	if (most_kb > max_mb << 10)
		fail_msg("psrd took %ld MB, and --max-memory is %ld MB", most_kb >> 10, max_mb);
}

/* A frame lists up to 64 words a pixel of a tile, in each thread. Without glass it takes 12 MB. */
static void glass_that_takes_more_than_max_memory_is_refused(void **state)
{
	static const char *const more[] = { "--threads", "2", "--max-memory", "40m", NULL };
	const struct psr_msg_frame frame = frame_default(512, 512);
	struct psr_msg_frame_end end;
	char text[PSR_ERROR_TEXT];
	long before_kb;

	(void)state;
	daemon_start(&psrd, folder, more);
	send_panes(&peer[0]);
	peer_begin(&peer[1], &psrd, "plate");
	before_kb = daemon_resident_kb(&psrd);
	peer_expect_frame(&peer[1], peer_ask_frame(&peer[1], &frame), &end);
	peer_expect_error(&peer[0], peer_ask_frame(&peer[0], &frame), PSR_WIRE_LIMIT, text);
	assert_non_null(strstr(text, "--max-memory"));
	expect_within(before_kb, 40);
	peer_close(&peer[0]);
	peer_close(&peer[1]);
}

static void glass_within_max_memory_is_drawn(void **state)
{
	static const char *const more[] = { "--threads", "2", "--max-memory", "100m", NULL };
	const struct psr_msg_frame frame = frame_default(256, 256);
	struct psr_msg_frame_end end;
	uint64_t n_sheer = 0;
	long before_kb;

	(void)state;
	daemon_start(&psrd, folder, more);
	for (int i = 0; i < 2; i++)
		send_panes(&peer[i]);
	before_kb = daemon_resident_kb(&psrd);
	for (int i = 0; i < 2; i++)
		peer_ask_frame(&peer[i], &frame);
	for (int i = 0; i < 2; i++)
		peer_expect_frame(&peer[i], peer[i].id, &end);
	for (int i = 0; i < end.n_entries; i++)
		if (end.entry[i].id == PSR_WIRE_REPORT_EFFECTS + PSR_EFFECT_SHEER)
			n_sheer = end.entry[i].count;
	assert_int_equal(n_sheer, 256 * 256);
	expect_within(before_kb, 100);
	for (int i = 0; i < 2; i++)
		peer_close(&peer[i]);
}

/* Returns what a renderer takes that has drawn the scene once. */
static uint64_t bytes_of(const struct psr_scene *scene, const struct psr_settings *settings, struct psr_pool *pool)
{
	struct psr_renderer *renderer;
	struct psr_frame frame;

	assert_int_equal(psr_renderer_create(&renderer, NULL), PSR_OK);
	assert_int_equal(psr_frame_alloc(&frame, settings->width, settings->height,
	                                 1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH, NULL), PSR_OK);
	assert_int_equal(psr_render(renderer, scene, settings, pool, &frame, NULL), PSR_OK);
	const uint64_t bytes = psr_renderer_bytes(renderer);
	psr_frame_free(&frame);
	psr_renderer_destroy(renderer);
	return bytes;
}

/* Panes that fill the picture, drawn with three threads. */
static uint64_t renderer_bytes(uint32_t width, uint32_t height, unsigned pass, uint8_t opacity)
{
	static struct psr_instance instance[N_PANES];
	struct psr_model *pane = pane_create(0x2040c0, opacity);
	struct psr_scene scene = { .n_instances = N_PANES, .instance = instance,
		                       .camera = { .eye = { 0, 0, 2 }, .up = { 0, 1, 0 }, .fov_y = 0.6, .near_z = 0.01 } };
	struct psr_settings settings;
	struct psr_pool *pool;

	for (int i = 0; i < N_PANES; i++)
		instance[i] = (struct psr_instance){ .model = pane, .rotation = { 0, 0, 0, 1 }, .translation = { 0, 0, -i },
			                                 .scale = 4 };
	psr_settings_default(&settings, width, height);
	settings.pass = pass;
	settings.smooth = 1;
	assert_int_equal(psr_pool_create(&pool, 3, NULL), PSR_OK);
	const uint64_t bytes = bytes_of(&scene, &settings, pool);
	psr_pool_destroy(pool);
	psr_model_unref(pane);
	return bytes;
}

static void a_renderer_takes_no_more_than_was_foreseen(void **state)
{
	static const uint32_t sides[] = { 16, 100, 256 };

	(void)state;
	for (int i = 0; i < 3; i++)
		for (unsigned pass = 0; pass <= 2; pass += 2)
			for (int has_sheer = 0; has_sheer < 2; has_sheer++) {
				const struct renderer_need need = { .width = sides[i], .height = sides[i] / 2, .pass = pass,
					                                .has_sheer = has_sheer, .n_threads = 3 };
				const uint64_t bytes = renderer_bytes(need.width, need.height, pass, has_sheer ? 8 : PSR_OPAQUE);

				if (bytes > renderer_need(&need))
					fail_msg("%ux%u, pass %u, glass %d: %llu bytes, foreseen %llu", need.width, need.height, pass, has_sheer,
					         (unsigned long long)bytes, (unsigned long long)renderer_need(&need));
			}
}

static uint64_t splats_bytes(const struct psr_model *knot, uint32_t side, enum psr_smooth smooth)
{
	const struct psr_model_info *info = psr_model_info(knot);
	const struct psr_instance instance = { .model = knot, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	struct psr_scene scene = { .n_instances = 1, .instance = &instance };
	struct psr_settings settings;

	psr_camera_frame(&scene.camera, info->box_min, info->box_max, info->up, 0.6, 1);
	psr_settings_default(&settings, side, side);
	settings.smooth = smooth;
	settings.with_splats = 1;
	return bytes_of(&scene, &settings, NULL);
}

static void splats_take_no_more_than_was_foreseen(void **state)
{
	static const uint32_t sides[] = { 16, 200, 1000 };
	struct psr_model *knot;

	(void)state;
	assert_int_equal(psr_model_read(&knot, "tests/golden/knot.psr", NULL), PSR_OK);
	assert_int_equal(psr_model_make_cubes(knot, NULL), PSR_OK);
	for (int i = 0; i < 3; i++)
		for (int is_fine = 0; is_fine < 2; is_fine++) {
			struct renderer_need need = { .width = sides[i], .height = sides[i], .pass = (unsigned)is_fine, .n_threads = 1,
				                          .n_blocks = psr_model_cubes(knot)->groups.n_blocks, .has_octrees = 1, .with_splats = 1 };
			const uint64_t bytes = splats_bytes(knot, sides[i], is_fine ? PSR_SMOOTH_FINE : PSR_SMOOTH_EDGES);

			assert_true(bytes <= renderer_need(&need));
			need.with_splats = 0;
			if (i == 2) /* the reserve is smaller than what splats take */
				assert_true(bytes > renderer_need(&need));
		}
	psr_model_unref(knot);
}

/* Pass 4 of 400x400 takes a second or more, and leaves no room for the other frame. It is drawn again afterwards. */
static void a_refined_frame_gives_way_to_one_that_lacks_memory(void **state)
{
	static const char *const more[] = { "--threads", "1", "--max-memory", "180m", NULL };
	struct psr_msg_frame still = frame_default(400, 400), large = frame_default(1600, 1600);
	struct psr_msg_frame_end end;
	uint32_t id, large_id;

	(void)state;
	daemon_start(&psrd, folder, more);
	still.pass_limit = 4;
	large.color_codec = PSR_CODEC_JPEG;
	large.color_quality = 10;
	peer_begin(&peer[0], &psrd, "plate");
	peer_begin(&peer[1], &psrd, "plate");
	id = peer_ask_frame(&peer[0], &still);
	for (int pass = 0; pass < 4; pass++)
		peer_expect_frame(&peer[0], id, &end);
	large_id = peer_ask_frame(&peer[1], &large);
	while (stat_of(&psrd, PSR_STAT_FRAMES_LACKING) == 0) /* for half a second */
		assert_int_equal(stat_of(&psrd, PSR_STAT_FRAMES), 4);
	peer_expect_frame(&peer[1], large_id, &end);
	assert_int_equal(peer_stat(&peer[1], PSR_STAT_FRAMES_LACKING), 0);
	assert_int_equal(peer_stat(&peer[1], PSR_STAT_FRAMES), 5); /* pass 4 is not among them */
	peer_expect_frame(&peer[0], id, &end);
	assert_int_equal(end.pass, 4);
	assert_true(end.is_final);
	peer_close(&peer[0]);
	peer_close(&peer[1]);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_renderer_takes_no_more_than_was_foreseen),
		cmocka_unit_test(splats_take_no_more_than_was_foreseen),
		cmocka_unit_test_setup_teardown(glass_that_takes_more_than_max_memory_is_refused, add_panes, stop),
		cmocka_unit_test_setup_teardown(glass_within_max_memory_is_drawn, add_panes, stop),
		cmocka_unit_test_setup_teardown(a_refined_frame_gives_way_to_one_that_lacks_memory, add_panes, stop),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
