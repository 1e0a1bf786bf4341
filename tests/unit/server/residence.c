/* Handles are names, memory is a cache: models leave memory and come back with the same pictures. Many small models in a
 * psrd with room for some of them. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "fixture.h"

#define N 80            /* models, some more than --max-memory holds */
#define MEMORY (3 << 20) /* of which a frame takes up to two thirds */

static char store[PATH_MAX], folder[PATH_MAX], bin[PATH_MAX];
static struct daemon psrd;
static struct peer p, q;
static struct psr_msg_scene scene;
static uint32_t handle_p[N], handle_q[N];

static const char script[] =
	"#!/bin/sh\n"
	"here=${0%/*}\n"
	"echo $$ >> $here/log\n"
	"[ -e $here/slow ] && exec sleep 60\n"
	"cp $here/ready.psr \"$4\"\n";

static void model_name(char name[32], int i)
{
	snprintf(name, 32, "m%d", i);
}

static int make_models(void **state)
{
	char name[32];

	(void)state;
	folder_make(store);
	for (int i = 0; i < N; i++) {
		snprintf(name, sizeof name, "m%d.psr", i);
		plate_write(store, name, 0x202020u + 0x020100u * (uint32_t)i);
	}
	return 0;
}

static int remove_models(void **state)
{
	(void)state;
	folder_remove(store);
	return 0;
}

static int set_up(void **state)
{
	char command[3 * PATH_MAX];

	(void)state;
	folder_make(folder);
	builder_make(bin, script);
	snprintf(command, sizeof command, "cp '%s'/*.psr '%s'", store, folder);
	assert_int_equal(system(command), 0);
	return 0;
}

static int tear_down(void **state)
{
	(void)state;
	folder_remove(folder);
	folder_remove(bin);
	return 0;
}

static void start_with(long bytes)
{
	char program[PATH_MAX + 16], cache[PATH_MAX + 16], memory[32];
	const char *argv[] = { program, "--listen", "127.0.0.1:0", "--models", folder, "--cache", cache, "--threads", "2",
		                   "--max-memory", memory, "--max-handles", "128", NULL };

	snprintf(program, sizeof program, "%s/psrd", bin);
	snprintf(cache, sizeof cache, "%s/cache", bin);
	snprintf(memory, sizeof memory, "%ld", bytes);
	daemon_spawn(&psrd, argv);
	daemon_wait_ready(&psrd);
}

static void start(void)
{
	start_with(MEMORY);
}

static uint32_t open_model(struct peer *peer, const char *name)
{
	struct psr_msg_opened opened;

	peer_expect_opened(peer, peer_ask_open(peer, name), &opened);
	assert_int_equal(opened.n_samples, PLATE_SAMPLES);
	return opened.handle;
}

static void open_all(struct peer *peer, uint32_t handle[N])
{
	char name[32];

	peer_hello(peer, &psrd, NULL);
	for (int i = 0; i < N; i++) {
		model_name(name, i);
		handle[i] = open_model(peer, name);
	}
}

/* A scene of the models first .. first + n - 1, side by side; it leaves with the next request. */
static void put_scene(struct peer *peer, const uint32_t *handle, int first, int n)
{
	scene_default(&scene, 0);
	scene.n_instances = (uint32_t)n;
	for (int i = 0; i < n; i++) {
		scene.instance[i] = scene.instance[0];
		scene.instance[i].handle = handle[first + i];
		scene.instance[i].translation[0] = 0.02 * i;
	}
	assert_int_equal(psr_msg_scene_encode(&peer->buf, ++peer->id, &scene, NULL), PSR_OK);
}

static uint32_t ask_frame(struct peer *peer)
{
	const struct psr_msg_frame frame = frame_default(64, 64);

	return peer_ask_frame(peer, &frame);
}

static uint64_t expect_frame(struct peer *peer, uint32_t id)
{
	struct psr_msg_frame_end end;

	assert_true(peer_expect_frame(peer, id, &end) > 0);
	return end.hash[PSR_PLANE_COLOR];
}

static uint64_t draw(struct peer *peer, const uint32_t *handle, int first, int n)
{
	put_scene(peer, handle, first, n);
	return expect_frame(peer, ask_frame(peer));
}

/* Draws all models once: whichever was not used meanwhile has left memory. */
static void crowd_out(struct peer *peer, const uint32_t *handle)
{
	for (int i = 0; i < N; i++)
		draw(peer, handle, i, 1);
}

static void models_leave_memory_and_come_back_the_same(void **state)
{
	uint64_t hash[N];

	(void)state;
	start();
	open_all(&p, handle_p);
	open_all(&q, handle_q);
	for (int i = 0; i < N; i++) {
		hash[i] = draw(&p, handle_p, i, 1);
		for (int k = 0; k < i; k++)
			assert_true(hash[k] != hash[i]);
	}
	for (int round = 0; round < 2; round++) {
		for (int i = 0; i < N; i++) {
			put_scene(&p, handle_p, i, 1);
			put_scene(&q, handle_q, N - 1 - i, 1);
			ask_frame(&p);
			ask_frame(&q);
			assert_true(expect_frame(&p, p.id) == hash[i]);
			assert_true(expect_frame(&q, q.id) == hash[N - 1 - i]);
			assert_true(peer_stat(&p, PSR_STAT_MODEL_BYTES) <= MEMORY);
		}
	}
	assert_in_range(peer_stat(&p, PSR_STAT_MODELS), 1, N - 1);
	assert_true(peer_stat(&p, PSR_STAT_MODELS_RETURNED) >= N); /* each round brings all, and memory holds two thirds */
	assert_int_equal(peer_stat(&p, PSR_STAT_MODELS_LEFT),
	                 N - peer_stat(&p, PSR_STAT_MODELS) + peer_stat(&p, PSR_STAT_MODELS_RETURNED));
	peer_close(&p);
	peer_close(&q);
	daemon_stop(&psrd);
}

/* Sets of models of which two do not fit at once, asked for at the same time. */
static void crowds_that_exclude_each_other_are_all_drawn(void **state)
{
	const int n = 16;
	uint64_t hash[3];
	uint32_t id[2][30];

	(void)state;
	start();
	open_all(&p, handle_p);
	open_all(&q, handle_q);
	for (int i = 0; i < 3; i++)
		hash[i] = draw(&p, handle_p, 10 * i, n);
	for (int i = 0; i < 30; i++) {
		put_scene(&p, handle_p, i % 3 * 10, n);
		id[0][i] = ask_frame(&p);
		put_scene(&q, handle_q, (i + 1) % 3 * 10, n);
		id[1][i] = ask_frame(&q);
		assert_true(expect_frame(&p, id[0][i]) == hash[i % 3]);
		assert_true(expect_frame(&q, id[1][i]) == hash[(i + 1) % 3]);
	}
	peer_close(&p);
	peer_close(&q);
	daemon_stop(&psrd);
}

static void models_that_never_fit_together_are_refused_with_the_figures(void **state)
{
	char text[PSR_ERROR_TEXT];

	(void)state;
	start();
	open_all(&p, handle_p);
	put_scene(&p, handle_p, 0, N);
	ask_frame(&p);
	peer_expect_error(&p, p.id, PSR_WIRE_LIMIT, text);
	assert_non_null(strstr(text, "together"));
	assert_non_null(strstr(text, "--max-memory"));
	draw(&p, handle_p, 0, 1);
	peer_close(&p);
	daemon_stop(&psrd);
}

/* Of many that are opened at once, and do not fit together, some leave while they come: others wait for their room. */
static void a_model_may_leave_as_it_comes(void **state)
{
	(void)state;
	start_with(1 << 20);
	peer_hello(&p, &psrd, NULL);
	peer_hello(&q, &psrd, NULL);
	for (int i = 0; i < N; i++) {
		char name[32];

		model_name(name, i);
		peer_ask_open(i % 2 ? &q : &p, name);
	}
	for (int i = 0; i < N; i++) { /* in any order */
		struct psr_message message;

		do
			assert_true(peer_next(i % 2 ? &q : &p, &message));
		while (message.type == PSR_MSG_PROGRESS);
		assert_int_equal(message.type, PSR_MSG_OPENED);
	}
	peer_close(&p);
	peer_close(&q);
	daemon_stop(&psrd);
}

static void a_name_keeps_its_numbers_and_presets_without_its_model(void **state)
{
	struct psr_msg_opened before, after;
	struct psr_message message;

	(void)state;
	start();
	open_all(&p, handle_p);
	peer_expect_opened(&p, peer_ask_open(&p, "m0"), &before);
	crowd_out(&p, handle_p);
	peer_expect_opened(&p, peer_ask_open(&p, "m0"), &after);
	after.handle = before.handle;
	assert_memory_equal(&before, &after, sizeof before);
	psr_msg_presets_encode(&p.buf, ++p.id, &(struct psr_msg_presets){ .handle = handle_p[0] }, NULL);
	peer_send(&p);
	for (int i = 0; i < 4; i++) /* front, home, lamp, sun */
		peer_expect(&p, &message, PSR_MSG_PRESET, p.id);
	peer_expect(&p, &message, PSR_MSG_PRESETS_END, p.id);
	peer_close(&p);
	daemon_stop(&psrd);
}

static void a_file_that_has_gone_or_changed_is_not_found(void **state)
{
	char text[PSR_ERROR_TEXT], path[2 * PATH_MAX];
	uint64_t hash;

	(void)state;
	start();
	open_all(&p, handle_p);
	hash = draw(&p, handle_p, 2, 1);
	crowd_out(&p, handle_p);
	snprintf(path, sizeof path, "%s/m0.psr", folder);
	assert_int_equal(unlink(path), 0);
	plate_write(folder, "m1.psr", 0xffffff);
	for (int i = 0; i < 2; i++) {
		put_scene(&p, handle_p, i, 1);
		ask_frame(&p);
		peer_expect_error(&p, p.id, PSR_WIRE_NOT_FOUND, text);
		assert_non_null(strstr(text, i == 0 ? "m0" : "m1"));
		assert_non_null(strstr(text, "open it again"));
		assert_null(strstr(text, folder));
	}
	put_scene(&p, handle_p, 0, 3); /* one that is missing ends the frame; the others are free to go */
	ask_frame(&p);
	peer_expect_error(&p, p.id, PSR_WIRE_NOT_FOUND, NULL);
	assert_true(draw(&p, handle_p, 2, 1) == hash);
	handle_p[1] = open_model(&p, "m1");
	draw(&p, handle_p, 1, 1);
	peer_expect_open_error(&p, peer_ask_open(&p, "m0"), PSR_WIRE_NOT_FOUND, NULL);
	peer_close(&p);
	daemon_stop(&psrd);
}

static int count_builds(int *last_pid)
{
	char path[PATH_MAX + 16];
	FILE *file;
	int n = 0;

	snprintf(path, sizeof path, "%s/log", bin);
	file = fopen(path, "r");
	while (file != NULL && fscanf(file, "%d", last_pid) == 1)
		n++;
	if (file != NULL)
		fclose(file);
	return n;
}

static void empty_cache(void)
{
	char command[2 * PATH_MAX];

	snprintf(command, sizeof command, "rm '%s'/cache/*.psr", bin);
	assert_int_equal(system(command), 0);
}

static void a_built_model_comes_back_from_the_cache_or_is_built_again(void **state)
{
	uint32_t built[1];
	char text[PSR_ERROR_TEXT];
	uint64_t hash;
	int pid;

	(void)state;
	file_write(folder, "built.obj", "1", 1);
	start();
	open_all(&p, handle_p);
	open_all(&q, handle_q);
	built[0] = open_model(&p, "built");
	hash = draw(&p, built, 0, 1);
	crowd_out(&q, handle_q);
	assert_true(draw(&p, built, 0, 1) == hash);
	assert_int_equal(count_builds(&pid), 1);
	crowd_out(&q, handle_q);
	empty_cache();
	assert_true(draw(&p, built, 0, 1) == hash);
	assert_int_equal(count_builds(&pid), 2);
	crowd_out(&q, handle_q);
	empty_cache();
	file_write(folder, "built.obj", "22", 2);
	put_scene(&p, built, 0, 1);
	ask_frame(&p);
	peer_expect_error(&p, p.id, PSR_WIRE_NOT_FOUND, text);
	assert_non_null(strstr(text, "open it again"));
	assert_int_equal(count_builds(&pid), 2); /* nobody wants the other one */
	built[0] = open_model(&p, "built");
	assert_true(draw(&p, built, 0, 1) == hash);
	peer_close(&p);
	peer_close(&q);
	daemon_stop(&psrd);
}

/* Frames that wait for a model can be given up, and the connection too; the build ends then. */
static void who_gives_up_a_frame_waits_for_no_model(void **state)
{
	struct psr_message message;
	uint32_t built[1];
	int pid = 0;

	(void)state;
	file_write(folder, "built.obj", "1", 1);
	start();
	open_all(&p, handle_p);
	open_all(&q, handle_q);
	built[0] = open_model(&p, "built");
	crowd_out(&q, handle_q);
	empty_cache();
	file_write(bin, "slow", "", 0);
	for (int round = 0; round < 2; round++) {
		int64_t end = clock_ms() + PATIENCE_MS;

		put_scene(&p, built, 0, 1);
		ask_frame(&p);
		ask_frame(&p);
		while (count_builds(&pid) < 2 + round && clock_ms() < end)
			usleep(2000);
		assert_int_equal(kill(pid, 0), 0);
		crowd_out(&q, handle_q); /* others draw meanwhile */
		for (uint32_t id = p.id - 1; round == 0 && id <= p.id; id++) {
			psr_msg_cancel_encode(&p.buf, id, 0, NULL);
			peer_send(&p);
			peer_expect(&p, &message, PSR_MSG_CANCELLED, id);
		}
		if (round == 1)
			peer_close(&p);
		while (kill(pid, 0) == 0 && clock_ms() < end)
			usleep(2000);
		assert_int_equal(kill(pid, 0), -1);
	}
	crowd_out(&q, handle_q);
	peer_close(&q);
	daemon_stop(&psrd);
}

static void the_end_does_not_wait_for_models(void **state)
{
	uint32_t built[1];
	int pid = 0;

	(void)state;
	file_write(folder, "built.obj", "1", 1);
	start();
	open_all(&p, handle_p);
	built[0] = open_model(&p, "built");
	crowd_out(&p, handle_p);
	empty_cache();
	file_write(bin, "slow", "", 0);
	put_scene(&p, built, 0, 1);
	ask_frame(&p);
	while (count_builds(&pid) < 2)
		usleep(2000);
	kill(psrd.pid, SIGTERM);
	peer_expect_error(&p, p.id, PSR_WIRE_CANCELLED, NULL);
	peer_close(&p);
	assert_int_equal(daemon_wait(&psrd), 0);
	assert_int_equal(kill(pid, 0), -1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(models_leave_memory_and_come_back_the_same, set_up, tear_down),
		cmocka_unit_test_setup_teardown(crowds_that_exclude_each_other_are_all_drawn, set_up, tear_down),
		cmocka_unit_test_setup_teardown(models_that_never_fit_together_are_refused_with_the_figures, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_model_may_leave_as_it_comes, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_name_keeps_its_numbers_and_presets_without_its_model, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_file_that_has_gone_or_changed_is_not_found, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_built_model_comes_back_from_the_cache_or_is_built_again, set_up, tear_down),
		cmocka_unit_test_setup_teardown(who_gives_up_a_frame_waits_for_no_model, set_up, tear_down),
		cmocka_unit_test_setup_teardown(the_end_does_not_wait_for_models, set_up, tear_down),
	};

	return cmocka_run_group_tests(tests, make_models, remove_models);
}
