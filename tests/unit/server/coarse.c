/* A first look at a packed octree: psrd opens the beginning of its file. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "fixture.h"
#include "../octree/leaves.h"
#include "model/tree.h"

static char folder[PATH_MAX];
static struct daemon psrd;
static struct peer p;

/* Of 9 levels in steps of two: those of 7 are the first with 128 leaves a side. */
static void write_cloud(void)
{
	struct leaves leaves = leaves_at_random(9, 6000);
	struct octree *tree = leaves_to_tree(&leaves, 9), inner;
	struct psr_model_info info;
	struct psr_model *model;
	char path[2 * PATH_MAX];

	free(leaves.path);
	assert_true(tree != NULL && leaves_dress(tree, 5));
	psr_octree_info(&info, tree);
	psr_octree_to_inner(&inner, tree, &info);
	assert_int_equal(psr_model_create_octree(&model, &info, &inner, NULL, NULL), PSR_OK);
	snprintf(path, sizeof path, "%s/cloud.psr", folder);
	assert_int_equal(psr_model_write_packed(model, path, NULL), PSR_OK);
	psr_model_unref(model);
	octree_destroy(tree);
}

static int set_up(void **state)
{
	(void)state;
	folder_make(folder);
	write_cloud();
	plate_write(folder, "plate.psr", 0x2040c0);
	return 0;
}

static int tear_down(void **state)
{
	(void)state;
	folder_remove(folder);
	return 0;
}

static struct psr_msg_opened open_for(const char *name, uint32_t resolution)
{
	struct psr_msg_opened opened;

	peer_expect_opened(&p, peer_ask_open_for(&p, name, resolution), &opened);
	return opened;
}

static void a_first_look_is_of_the_beginning(void **state)
{
	static const char *const more[] = { "--threads", "2", "--resolution", "64", "--max-resolution", "512", NULL };
	struct psr_msg_opened first, whole, again, plate;

	(void)state;
	daemon_start(&psrd, folder, more);
	peer_hello(&p, &psrd, NULL);
	first = open_for("cloud", 64);
	whole = open_for("cloud", 512);
	again = open_for("cloud", 0);
	assert_int_equal(first.resolution, whole.resolution / 4);
	assert_true(first.spacing == 4 * whole.spacing);
	assert_memory_not_equal(first.content_id, whole.content_id, sizeof first.content_id);
	assert_memory_equal(again.content_id, whole.content_id, sizeof whole.content_id);
	again = open_for("cloud", 40);
	assert_memory_equal(again.content_id, first.content_id, sizeof first.content_id);
	plate = open_for("plate", 64);
	again = open_for("plate", 0);
	assert_memory_equal(again.content_id, plate.content_id, sizeof plate.content_id);
	peer_close(&p);
	daemon_stop(&psrd);
}

static void a_server_of_finer_models_opens_all_of_it(void **state)
{
	struct psr_msg_opened first, whole;

	(void)state;
	daemon_start(&psrd, folder, (const char *const[]){ "--threads", "2", NULL });
	peer_hello(&p, &psrd, NULL);
	first = open_for("cloud", 64);
	whole = open_for("cloud", 0);
	assert_memory_equal(first.content_id, whole.content_id, sizeof whole.content_id);
	peer_close(&p);
	daemon_stop(&psrd);
}

static void the_beginning_is_drawn_while_the_rest_is_opened(void **state)
{
	static const char *const more[] = { "--threads", "2", "--resolution", "64", NULL };
	struct psr_msg_scene *scene = malloc(sizeof *scene);
	struct psr_msg_opened first;
	struct psr_msg_frame frame;

	(void)state;
	assert_non_null(scene);
	daemon_start(&psrd, folder, more);
	peer_hello(&p, &psrd, NULL);
	first = open_for("cloud", 64);
	scene_default(scene, first.handle);
	peer_send_scene(&p, scene);
	frame = frame_default(32, 32);
	peer_ask_open(&p, "cloud");
	peer_ask_frame(&p, &frame);
	for (struct psr_message message = { .type = 0 }; message.type != PSR_MSG_FRAME_END;) {
		assert_int_equal(peer_next(&p, &message), 1);
		assert_int_not_equal(message.type, PSR_MSG_ERROR);
	}
	peer_close(&p);
	daemon_stop(&psrd);
	free(scene);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_first_look_is_of_the_beginning),
		cmocka_unit_test(a_server_of_finer_models_opens_all_of_it),
		cmocka_unit_test(the_beginning_is_drawn_while_the_rest_is_opened),
	};

	return cmocka_run_group_tests(tests, set_up, tear_down);
}
