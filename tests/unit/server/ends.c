/* How builds end: by limits, by others, because nobody waits; and what is said and remembered then. A psrd beside a
 * psr-model of the test's own, a script whose source says what it does. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "fixture.h"

static char folder[PATH_MAX], bin[PATH_MAX];
static struct daemon psrd;
static struct peer p, q;

static const char script[] =
	"#!/bin/sh\n"
	"# psr-model build SOURCE -o TARGET -r RESOLUTION --progress-fd 3 --quiet --threads N --scan\n"
	"here=${0%/*}\n"
	"echo $$ >> $here/log\n"
	"case $(cat \"$2\") in\n"
	"good*) cp $here/ready.psr \"$4\";;\n"
	"bad*) echo \"psr-model: $2: vertex 7 is not finite\" >&2; exit 4;;\n"
	"texture*) echo \"psr-model: cannot read ${2%/*}/textures/wood.png: No such file\" >&2; exit 3;;\n"
	"full*) echo half > \"$4\"; echo \"psr-model: cannot write '$4': No space left on device\" >&2; exit 3;;\n"
	"memory*) echo 'psr-model: no memory for 3 triangles' >&2; exit 3;;\n"
	"large*) exec head -c 3000000 /dev/zero > \"$4\";;\n"
	"slow*) exec sleep 60;;\n"
	"group*) sleep 60 & echo $! >> $here/log; wait;;\n"
	"orphan*) sleep 60 & echo $! >> $here/log; cp $here/ready.psr \"$4\";;\n"
	"killed*) [ -e $here/once ] || { : > $here/once; kill -KILL $$; }; cp $here/ready.psr \"$4\";;\n"
	"crash*) kill -SEGV $$;;\n"
	"rays*) exec seq -f 'rays %.0f 4000000000' 1 4000000000 >&3;;\n"
	"words*) exec tr '\\0' x < /dev/zero >&2;;\n"
	"esac\n";

static int set_up(void **state)
{
	(void)state;
	folder_make(folder);
	builder_make(bin, script);
	return 0;
}

static int tear_down(void **state)
{
	(void)state;
	folder_remove(folder);
	folder_remove(bin);
	return 0;
}

static void start(const char *option, const char *value)
{
	char program[PATH_MAX + 16], cache[PATH_MAX + 16];
	const char *argv[] = { program, "--listen", "127.0.0.1:0", "--models", folder, "--cache", cache, "--threads", "2",
		                   option, value, NULL };

	snprintf(program, sizeof program, "%s/psrd", bin);
	snprintf(cache, sizeof cache, "%s/cache", bin);
	daemon_spawn(&psrd, argv);
	daemon_wait_ready(&psrd);
}

static void add_source(const char *name, const char *what)
{
	file_write(folder, name, what, strlen(what));
}

/* Numbers in the script's log: a process a build, and what it started. */
static int read_pids(int pid[16])
{
	char path[PATH_MAX + 16];
	FILE *file;
	int n = 0;

	snprintf(path, sizeof path, "%s/log", bin);
	file = fopen(path, "r");
	while (file != NULL && n < 16 && fscanf(file, "%d", &pid[n]) == 1)
		n++;
	if (file != NULL)
		fclose(file);
	return n;
}

static int wait_pids(int pid[16], int n)
{
	for (int64_t end = clock_ms() + PATIENCE_MS; read_pids(pid) < n && clock_ms() < end;)
		usleep(2000);
	assert_int_equal(read_pids(pid), n);
	return pid[n - 1];
}

static void expect_builds(int n)
{
	int pid[16];

	assert_int_equal(read_pids(pid), n);
}

/* A zombie that its new parent has not waited for yet runs no more. */
static int is_running(int pid)
{
	char path[64], state = 0;
	FILE *file;

	snprintf(path, sizeof path, "/proc/%d/stat", pid);
	file = fopen(path, "r");
	if (file == NULL)
		return 0;
	if (fscanf(file, "%*d %*s %c", &state) != 1)
		state = 'X';
	fclose(file);
	return state != 'Z' && state != 'X';
}

static void expect_gone(int pid)
{
	int64_t end = clock_ms() + PATIENCE_MS;

	while (is_running(pid) && clock_ms() < end)
		usleep(2000);
	assert_false(is_running(pid));
}

static void expect_cache(int n)
{
	char command[2 * PATH_MAX];
	FILE *pipe;
	int n_files = -1;

	snprintf(command, sizeof command, "ls -A '%s/cache' | wc -l", bin);
	pipe = popen(command, "r");
	assert_non_null(pipe);
	assert_int_equal(fscanf(pipe, "%d", &n_files), 1);
	pclose(pipe);
	assert_int_equal(n_files, n);
}

static void cancel_open(struct peer *peer, uint32_t id)
{
	struct psr_message message;

	psr_msg_cancel_encode(&peer->buf, id, 0, NULL);
	peer_send(peer);
	do
		assert_true(peer_next(peer, &message));
	while (message.type == PSR_MSG_PROGRESS);
	assert_int_equal(message.type, PSR_MSG_CANCELLED);
}

static void a_build_that_nobody_waits_for_ends(void **state)
{
	struct psr_msg_opened opened;
	uint32_t id;
	int pid[16];

	(void)state;
	add_source("slow.obj", "slow");
	add_source("group.obj", "group");
	plate_write(folder, "plate.psr", 0x2040c0);
	start("--max-builds", "2");
	peer_hello(&p, &psrd, NULL);
	peer_hello(&q, &psrd, NULL);
	id = peer_ask_open(&p, "slow");
	peer_ask_open(&q, "group");
	wait_pids(pid, 3);
	cancel_open(&p, id);
	peer_close(&q);
	for (int i = 0; i < 3; i++)
		expect_gone(pid[i]);
	expect_cache(0);
	peer_expect_opened(&p, peer_ask_open(&p, "plate"), &opened); /* and all is well */
	peer_close(&p);
	daemon_stop(&psrd);
}

static void who_comes_back_soon_finds_the_build_going_on(void **state)
{
	uint32_t id;
	int pid[16];

	(void)state;
	add_source("slow.obj", "slow");
	start(NULL, NULL);
	peer_hello(&p, &psrd, NULL);
	id = peer_ask_open(&p, "slow");
	wait_pids(pid, 1);
	cancel_open(&p, id);
	peer_ask_open(&p, "slow");
	usleep(1600000); /* longer than the grace */
	assert_true(is_running(pid[0]));
	expect_builds(1);
	peer_close(&p);
	daemon_stop(&psrd);
}

static void a_queued_build_that_nobody_waits_for_never_starts(void **state)
{
	uint32_t id;
	int pid[16];

	(void)state;
	add_source("slow.obj", "slow");
	add_source("other.obj", "slow");
	start(NULL, NULL);
	peer_hello(&p, &psrd, NULL);
	peer_hello(&q, &psrd, NULL);
	peer_ask_open(&p, "slow");
	wait_pids(pid, 1);
	id = peer_ask_open(&q, "other");
	cancel_open(&q, id);
	usleep(1600000);
	peer_close(&p); /* the first one ends; the other one was ended before */
	expect_gone(pid[0]);
	usleep(200000);
	expect_builds(1);
	peer_close(&q);
	daemon_stop(&psrd);
}

static void a_killed_psrd_takes_the_build_with_it(void **state)
{
	int pid[16];

	(void)state;
	add_source("slow.obj", "slow");
	start(NULL, NULL);
	peer_hello(&p, &psrd, NULL);
	peer_ask_open(&p, "slow");
	wait_pids(pid, 1);
	kill(psrd.pid, SIGKILL);
	assert_int_equal(daemon_wait(&psrd), -SIGKILL);
	expect_gone(pid[0]);
	peer_close(&p);
}

static void what_a_build_started_ends_with_it(void **state)
{
	struct psr_msg_opened opened;
	int pid[16];

	(void)state;
	add_source("orphan.obj", "orphan");
	start(NULL, NULL);
	peer_hello(&p, &psrd, NULL);
	peer_expect_opened(&p, peer_ask_open(&p, "orphan"), &opened);
	expect_gone(wait_pids(pid, 2));
	peer_close(&p);
	daemon_stop(&psrd);
}

static void a_killed_build_can_be_tried_again(void **state)
{
	struct psr_msg_opened opened;
	char text[PSR_ERROR_TEXT];
	int pid[16];

	(void)state;
	add_source("killed.obj", "killed");
	add_source("slow.obj", "slow");
	start(NULL, NULL);
	peer_hello(&p, &psrd, NULL);
	peer_expect_open_error(&p, peer_ask_open(&p, "killed"), PSR_WIRE_BUSY, text);
	assert_non_null(strstr(text, "signal 9"));
	peer_expect_opened(&p, peer_ask_open(&p, "killed"), &opened);
	for (int i = 0; i < 2; i++) { /* by an operator */
		uint32_t id = peer_ask_open(&p, "slow");

		kill(wait_pids(pid, 3 + i), SIGTERM);
		peer_expect_open_error(&p, id, PSR_WIRE_BUSY, text);
		assert_non_null(strstr(text, "signal 15"));
	}
	peer_close(&p);
	daemon_stop(&psrd);
}

static void the_clock_limits_a_build(void **state)
{
	char text[PSR_ERROR_TEXT];
	int pid[16];

	(void)state;
	add_source("slow.obj", "slow");
	start("--build-wall-time", "1");
	peer_hello(&p, &psrd, NULL);
	for (int i = 0; i < 2; i++) { /* the second time it is remembered */
		peer_expect_open_error(&p, peer_ask_open(&p, "slow"), PSR_WIRE_LIMIT, text);
		assert_non_null(strstr(text, "slow.obj: "));
		assert_non_null(strstr(text, "1 s (--build-wall-time)"));
		assert_non_null(strstr(text, "in 10 minutes"));
	}
	expect_gone(wait_pids(pid, 1));
	peer_close(&p);
	daemon_stop(&psrd);
}

static void a_build_writes_no_file_beyond_the_limit(void **state)
{
	char text[PSR_ERROR_TEXT];

	(void)state;
	add_source("large.obj", "large");
	start("--build-file-size", "1m");
	peer_hello(&p, &psrd, NULL);
	peer_expect_open_error(&p, peer_ask_open(&p, "large"), PSR_WIRE_LIMIT, text);
	assert_non_null(strstr(text, "--build-file-size"));
	expect_cache(0);
	peer_close(&p);
	daemon_stop(&psrd);
}

/* Errors of all kinds, as a client sees them. */
static void messages_have_no_folders_of_the_server(void **state)
{
	static const struct {
		const char *name, *what, *text;
		int code;
	} cases[] = {
		{ "bad", "bad", "bad.obj: vertex 7 is not finite", PSR_WIRE_FORMAT },
		{ "texture", "texture", "texture.obj: cannot read textures/wood.png: No such file", PSR_WIRE_IO },
		{ "full", "full", "No space left on device", PSR_WIRE_IO },
		{ "memory", "memory", "memory.obj: no memory for 3 triangles; a build may take", PSR_WIRE_LIMIT },
		{ "crash", "crash", "crash.obj: psr-model crashed on it (signal 11)", PSR_WIRE_FORMAT },
		{ "gone", "good", "gone", PSR_WIRE_NOT_FOUND },
	};
	char text[PSR_ERROR_TEXT], name[64], path[2 * PATH_MAX];

	(void)state;
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
		snprintf(name, sizeof name, "%s.obj", cases[i].name);
		add_source(name, cases[i].what);
	}
	file_write(folder, "broken.psr", "junk", 4);
	start(NULL, NULL);
	snprintf(path, sizeof path, "%s/gone.obj", folder);
	assert_int_equal(unlink(path), 0);
	peer_hello(&p, &psrd, NULL);
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
		peer_expect_open_error(&p, peer_ask_open(&p, cases[i].name), (unsigned)cases[i].code, text);
		if (strstr(text, cases[i].text) == NULL || strstr(text, folder) != NULL || strstr(text, bin) != NULL
		    || strstr(text, " /") != NULL)
			fail_msg("%s: %s", cases[i].name, text);
	}
	peer_expect_open_error(&p, peer_ask_open(&p, "broken"), PSR_WIRE_FORMAT, text);
	assert_null(strstr(text, "/"));
	expect_cache(0); /* the half-written file of the full disk included */
	peer_close(&p);
	daemon_stop(&psrd);
}

/* A child that writes as fast as it can: clients get a message a tick, and the loop has time for others. */
static void a_flood_of_progress_is_thinned_out(void **state)
{
	struct psr_message message;
	int64_t began;
	int n = 0;

	(void)state;
	add_source("rays.obj", "rays");
	plate_write(folder, "plate.psr", 0x2040c0);
	start(NULL, NULL);
	peer_hello(&p, &psrd, NULL);
	peer_ask_open(&p, "rays");
	peer_expect(&p, &message, PSR_MSG_PROGRESS, p.id);
	began = clock_ms();
	for (; clock_ms() - began < 1000 || n < 17; n++)
		peer_expect(&p, &message, PSR_MSG_PROGRESS, p.id);
	/* 16 and the first at once, then one in 100 ms; one more for the tick that was under way. */
	assert_in_range(n, 17, 16 + 2 + (clock_ms() - began) / 100);
	expect_serves(&psrd, "plate");
	peer_close(&p);
	daemon_stop(&psrd);
}

static void a_line_without_end_does_no_harm(void **state)
{
	int pid[16];

	(void)state;
	add_source("words.obj", "words");
	plate_write(folder, "plate.psr", 0x2040c0);
	start(NULL, NULL);
	peer_hello(&p, &psrd, NULL);
	peer_ask_open(&p, "words");
	wait_pids(pid, 1);
	expect_serves(&psrd, "plate");
	peer_close(&p);
	expect_gone(pid[0]);
	daemon_stop(&psrd);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(a_build_that_nobody_waits_for_ends, set_up, tear_down),
		cmocka_unit_test_setup_teardown(who_comes_back_soon_finds_the_build_going_on, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_queued_build_that_nobody_waits_for_never_starts, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_killed_psrd_takes_the_build_with_it, set_up, tear_down),
		cmocka_unit_test_setup_teardown(what_a_build_started_ends_with_it, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_killed_build_can_be_tried_again, set_up, tear_down),
		cmocka_unit_test_setup_teardown(the_clock_limits_a_build, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_build_writes_no_file_beyond_the_limit, set_up, tear_down),
		cmocka_unit_test_setup_teardown(messages_have_no_folders_of_the_server, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_flood_of_progress_is_thinned_out, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_line_without_end_does_no_harm, set_up, tear_down),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
