/* The first levels of a packed octree: psrd opens the beginning of its file, and draws it. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "cloud.h"
#include "fixture.h"

static char folder[PATH_MAX];
static struct daemon psrd;
static struct peer p;

/* Points that take tenths of a second to unpack, at least. */
#ifdef __SANITIZE_THREAD__
#define LARGE 30000
#else
#define LARGE 150000
#endif

static int set_up(void **state)
{
	(void)state;
	folder_make(folder);
	cloud_write(folder, "cloud.psr", 9, 6000);
	cloud_write(folder, "large.psr", 10, LARGE);
	plate_write(folder, "plate.psr", 0x2040c0);
	return 0;
}

static int tear_down(void **state)
{
	(void)state;
	folder_remove(folder);
	return 0;
}

static struct psr_msg_opened open_levels(const char *name, unsigned levels)
{
	struct psr_msg_opened opened;

	peer_expect_opened(&p, peer_ask_open_as(&p, name, (struct psr_msg_open){ .levels = (uint8_t)levels }), &opened);
	return opened;
}

static void start(void)
{
	daemon_start(&psrd, folder, (const char *const[]){ "--threads", "2", "--verbose", NULL });
	peer_hello(&p, &psrd, NULL);
}

static void end(void)
{
	peer_close(&p);
	daemon_stop(&psrd);
}

/* Steps end at depths 5, 7 and 9. */
static void the_first_levels_are_a_model_of_their_own(void **state)
{
	struct psr_msg_opened whole, first, again;

	(void)state;
	start();
	first = open_levels("cloud", 7);
	whole = open_levels("cloud", 0);
	assert_int_equal(first.octree_levels, 7);
	assert_int_equal(first.of_levels, 9);
	assert_int_equal(whole.octree_levels, 0);
	assert_int_equal(whole.of_levels, 0);
	assert_int_equal(first.resolution, whole.resolution / 4);
	assert_true(first.spacing == 4 * whole.spacing);
	assert_true(first.bytes < whole.bytes);
	assert_memory_not_equal(first.content_id, whole.content_id, sizeof first.content_id);
	again = open_levels("cloud", 6);
	assert_memory_equal(again.content_id, first.content_id, sizeof first.content_id);
	for (unsigned levels = 8; levels <= 31; levels++) {
		again = open_levels("cloud", levels);
		assert_memory_equal(again.content_id, whole.content_id, sizeof whole.content_id);
	}
	first = open_levels("plate", 7);
	whole = open_levels("plate", 0);
	assert_int_equal(first.octree_levels, 0);
	assert_memory_equal(first.content_id, whole.content_id, sizeof whole.content_id);
	end();
}

/* Returns the frame's end; *levels: of its entry, 0 without. */
static struct psr_msg_frame_end draw(uint32_t handle, uint64_t *levels)
{
	struct psr_msg_scene *scene = malloc(sizeof *scene);
	struct psr_msg_frame frame = frame_default(32, 32);
	struct psr_msg_frame_end ended;
	struct psr_message message;

	assert_non_null(scene);
	scene_default(scene, handle);
	peer_send_scene(&p, scene);
	free(scene);
	peer_ask_frame(&p, &frame);
	do /* an OPEN may tell its progress, or end, in between */
		assert_int_equal(peer_next(&p, &message), 1);
	while (message.type != PSR_MSG_FRAME_END && message.type != PSR_MSG_ERROR);
	assert_int_equal(message.type, PSR_MSG_FRAME_END);
	assert_int_equal(psr_msg_frame_end_decode(&ended, message.payload, message.n, NULL), PSR_OK);
	*levels = 0;
	for (unsigned i = 0; i < ended.n_entries; i++)
		if (ended.entry[i].id == PSR_WIRE_REPORT_LEVELS)
			*levels = ended.entry[i].count;
	return ended;
}

static void a_frame_names_the_levels_and_is_the_same_again(void **state)
{
	struct psr_msg_frame_end first, again, whole;
	uint64_t levels;

	(void)state;
	start();
	first = draw(open_levels("cloud", 7).handle, &levels);
	assert_int_equal(levels, 7 | 9 << 8);
	whole = draw(open_levels("cloud", 0).handle, &levels);
	assert_int_equal(levels, 0);
	assert_true(first.hash[PSR_PLANE_COLOR] != whole.hash[PSR_PLANE_COLOR]);
	end();
	start();
	again = draw(open_levels("cloud", 7).handle, &levels);
	assert_int_equal(again.hash[PSR_PLANE_COLOR], first.hash[PSR_PLANE_COLOR]);
	end();
}

static void the_beginning_is_drawn_while_the_rest_is_opened(void **state)
{
	struct psr_msg_opened first;
	uint64_t levels;

	(void)state;
	start();
	first = open_levels("large", 6);
	assert_int_equal(first.octree_levels, 6);
	peer_ask_open(&p, "large");
	draw(first.handle, &levels);
	assert_int_equal(levels, 6 | 10 << 8);
	draw(open_levels("large", 0).handle, &levels);
	assert_int_equal(levels, 0);
	end();
}

static void wait_for_log(const char *text)
{
	const int64_t until = clock_ms() + PATIENCE_MS;

	while (strstr(psrd.log, text) == NULL && clock_ms() < until) {
		daemon_read_log(&psrd);
		usleep(5000);
	}
	if (strstr(psrd.log, text) == NULL)
		fail_msg("no '%s' in %s", text, psrd.log);
}

#define STOPPED "the unpacking of an octree was stopped"

static void an_open_that_is_cancelled_ends_the_work(void **state)
{
	struct psr_message message;
	uint32_t id;

	(void)state;
	start();
	id = peer_ask_open(&p, "large");
	psr_msg_cancel_encode(&p.buf, id, 0, NULL);
	peer_send(&p);
	do
		assert_int_equal(peer_next(&p, &message), 1);
	while (message.type == PSR_MSG_PROGRESS);
	assert_int_equal(message.type, PSR_MSG_CANCELLED);
	wait_for_log(STOPPED);
	assert_int_equal(open_levels("large", 0).octree_levels, 0); /* and it can be opened again */
	end();
}

static void a_client_that_hangs_up_ends_the_work_unless_another_one_waits(void **state)
{
	struct peer other;
	struct psr_message message;
	struct psr_msg_opened opened;
	uint32_t id;

	(void)state;
	start();
	peer_ask_open(&p, "large");
	peer_close(&p);
	wait_for_log(STOPPED);
	peer_hello(&p, &psrd, NULL);
	peer_hello(&other, &psrd, NULL);
	peer_expect(&p, &message, PSR_MSG_PROGRESS, peer_ask_open(&p, "large"));
	id = peer_ask_open(&other, "large");
	peer_expect(&other, &message, PSR_MSG_PROGRESS, id);
	peer_close(&p);
	peer_expect_opened(&other, id, &opened);
	peer_close(&other);
	daemon_stop(&psrd);
}

static void psrd_ends_though_it_unpacks(void **state)
{
	(void)state;
	start();
	peer_ask_open(&p, "large");
	end();
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_first_levels_are_a_model_of_their_own),
		cmocka_unit_test(a_frame_names_the_levels_and_is_the_same_again),
		cmocka_unit_test(the_beginning_is_drawn_while_the_rest_is_opened),
		cmocka_unit_test(an_open_that_is_cancelled_ends_the_work),
		cmocka_unit_test(a_client_that_hangs_up_ends_the_work_unless_another_one_waits),
		cmocka_unit_test(psrd_ends_though_it_unpacks),
	};

	return cmocka_run_group_tests(tests, set_up, tear_down);
}
