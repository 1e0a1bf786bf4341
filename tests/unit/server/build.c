/* Models built on first use: a psrd beside a psr-model of the test's own, a script whose source says what it does. */
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
	"echo \"$1 $3 $5 $6 $7 $8 $9 ${10} ${11} $(nice) $(ulimit -v) $(ulimit -t)\" >> $here/log\n"
	"echo 'import 1 1' >&3\n"
	"echo 'rays 1 4' >&3\n"
	"echo 'nonsense' >&3\n"
	"echo 'import 0 9' >&3\n"
	"echo 'rays 4 4' >&3\n"
	"case $(cat \"$2\") in\n"
	"good*) sleep 0.3; echo 'select 5 9' >&3; cp $here/ready.psr \"$4\";;\n"
	"bad*) echo 'psr-model: warming up' >&2; echo 'psr-model: vertex 7 is not finite' >&2; exit 4;;\n"
	"crash*) kill -SEGV $$;;\n"
	"spin*) while :; do :; done;;\n"
	"slow*) echo $$ > $here/pid; sleep 60;;\n"
	"nothing*) exit 0;;\n"
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
	snprintf(cache, sizeof cache, "%s/cache/deep", bin);
	daemon_spawn(&psrd, argv);
	daemon_wait_ready(&psrd);
}

/* Lines that the script has left: one a build. */
static int count_builds(char text[4096])
{
	char path[PATH_MAX + 16];
	FILE *file;
	size_t n = 0;
	int lines = 0;

	snprintf(path, sizeof path, "%s/log", bin);
	file = fopen(path, "r");
	if (file != NULL) {
		n = fread(text, 1, 4095, file);
		fclose(file);
	}
	text[n] = '\0';
	for (size_t i = 0; i < n; i++)
		lines += text[i] == '\n';
	return lines;
}

static void a_source_is_built_once_for_all_and_cached(void **state)
{
	struct psr_msg_opened opened;
	char text[4096];
	uint32_t id;

	(void)state;
	file_write(folder, "plate.obj", "good", 4);
	start(NULL, NULL);
	peer_hello(&p, &psrd, NULL);
	peer_hello(&q, &psrd, NULL);
	id = peer_ask_open(&p, "plate");
	peer_expect_opened(&q, peer_ask_open(&q, "plate"), &opened);
	peer_expect_opened(&p, id, &opened);
	assert_int_equal(opened.n_samples, PLATE_SAMPLES);
	peer_close(&p);
	peer_close(&q);
	expect_serves(&psrd, "plate");
	assert_int_equal(count_builds(text), 1);
	daemon_stop(&psrd);
	start(NULL, NULL); /* another daemon finds it in the cache */
	expect_serves(&psrd, "plate");
	assert_int_equal(count_builds(text), 1);
	daemon_stop(&psrd);
	file_write(folder, "plate.obj", "good again", 10); /* another source, another model */
	start(NULL, NULL);
	expect_serves(&psrd, "plate");
	assert_int_equal(count_builds(text), 2);
	daemon_stop(&psrd);
}

/* How often the daemon has built so far, and the models in its cache. */
static void expect_builds(int n, int n_cached)
{
	char text[4096], command[2 * PATH_MAX];
	FILE *pipe;
	int n_files = 0;

	assert_int_equal(count_builds(text), n);
	snprintf(command, sizeof command, "ls '%s'/cache/deep | wc -l", bin);
	pipe = popen(command, "r");
	assert_non_null(pipe);
	assert_int_equal(fscanf(pipe, "%d", &n_files), 1);
	pclose(pipe);
	assert_int_equal(n_files, n_cached);
}

static void pictures_choose_the_resolution_of_a_build(void **state)
{
	static const struct {
		uint32_t asked;
		const char *built;
	} cases[] = { { 0, " -r 300 " }, { 1, NULL }, { 300, NULL }, { 333, NULL }, { 334, " -r 600 " }, { 666, NULL },
		          { 1000, " -r 1200 " }, { 1333, NULL }, { 1334, " -r 1536 " }, { 16384, NULL }, { 1536, NULL },
		          { 1200, NULL }, { 600, NULL } };
	struct psr_msg_opened opened;
	char text[4096];
	int n = 0;

	(void)state;
	file_write(folder, "plate.obj", "good", 4);
	start("--resolution", "300");
	peer_hello(&p, &psrd, NULL);
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
		peer_expect_opened(&p, peer_ask_open_for(&p, "plate", cases[i].asked), &opened);
		n += cases[i].built != NULL;
		assert_int_equal(count_builds(text), n);
		if (cases[i].built != NULL && strstr(text, cases[i].built) == NULL)
			fail_msg("%u: no '%s' in %s", cases[i].asked, cases[i].built, text);
	}
	for (uint32_t asked = 1; asked < 16384; asked += 401) /* whatever is asked, the cache does not grow */
		psr_msg_open_encode(&p.buf, ++p.id, &(struct psr_msg_open){ .resolution = asked, .name = "plate" }, NULL);
	peer_send(&p);
	for (uint32_t asked = 1, id = p.id - 16383 / 401; asked < 16384; asked += 401, id++)
		peer_expect_opened(&p, id, &opened);
	expect_builds(4, 4);
	peer_close(&p);
	daemon_stop(&psrd);
	start("--max-resolution", "700"); /* which is --resolution, too */
	peer_hello(&p, &psrd, NULL);
	peer_expect_opened(&p, peer_ask_open_for(&p, "plate", 16384), &opened);
	expect_builds(5, 5);
	count_builds(text);
	assert_non_null(strstr(text, " -r 700 "));
	peer_close(&p);
	daemon_stop(&psrd);
}

static void pictures_beyond_the_protocol_cost_the_request(void **state)
{
	uint8_t bytes[] = { 0x17, 0, 0, 0, 0x13, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 0xff, 0, 1, 0, 'x' };
	struct psr_msg_opened opened;

	(void)state;
	file_write(folder, "plate.obj", "good", 4);
	start(NULL, NULL);
	peer_hello(&p, &psrd, NULL);
	peer_write(&p, bytes, sizeof bytes);
	peer_expect_error(&p, 1, PSR_WIRE_ARG, NULL);
	p.id = 1;
	peer_expect_opened(&p, peer_ask_open(&p, "plate"), &opened);
	peer_close(&p);
	daemon_stop(&psrd);
}

static void a_bad_source_fails_once_for_all_resolutions(void **state)
{
	char log[4096], text[PSR_ERROR_TEXT];

	(void)state;
	file_write(folder, "plate.ply", "bad", 3);
	start(NULL, NULL);
	peer_hello(&p, &psrd, NULL);
	for (uint32_t asked = 0; asked <= 2048; asked += 512) {
		peer_expect_open_error(&p, peer_ask_open_for(&p, "plate", asked), PSR_WIRE_FORMAT, text);
		assert_non_null(strstr(text, "vertex 7 is not finite"));
	}
	assert_int_equal(count_builds(log), 1);
	peer_close(&p);
	daemon_stop(&psrd);
}

static void expect_state(const char *name, unsigned state)
{
	struct psr_message message;
	struct psr_msg_list_entry entry;
	int n = 0;

	assert_int_equal(psr_msg_list_encode(&p.buf, ++p.id, NULL), PSR_OK);
	peer_send(&p);
	for (;;) {
		assert_true(peer_next(&p, &message));
		if (message.type == PSR_MSG_LIST_END)
			break;
		assert_int_equal(psr_msg_list_entry_decode(&entry, message.payload, message.n, NULL), PSR_OK);
		if (strcmp(entry.name, name) == 0) {
			assert_int_equal(entry.state, state);
			n++;
		}
	}
	assert_int_equal(n, 1);
}

static void a_build_over_a_limit_fails_at_its_resolution_alone(void **state)
{
	char text[PSR_ERROR_TEXT], log[4096];

	(void)state;
	file_write(folder, "spin.stl", "spin", 4);
	start("--build-time", "1");
	peer_hello(&p, &psrd, NULL);
	expect_state("spin", PSR_ENTRY_SOURCE);
	for (int i = 0; i < 2; i++)
		peer_expect_open_error(&p, peer_ask_open(&p, "spin"), PSR_WIRE_LIMIT, text);
	assert_int_equal(count_builds(log), 1); /* not tried again */
	expect_state("spin", PSR_ENTRY_FAILED);
	peer_expect_open_error(&p, peer_ask_open_for(&p, "spin", 1700), PSR_WIRE_LIMIT, NULL);
	assert_int_equal(count_builds(log), 2);
	peer_close(&p);
	daemon_stop(&psrd);
}

static void files_that_cannot_be_served_are_listed_and_refused_with_a_reason(void **state)
{
	char text[PSR_ERROR_TEXT], log[4096];

	(void)state;
	file_write(folder, "tower.laz", "LASF", 4);
	file_write(folder, "old.psr", "junk", 4);
	file_write(folder, "twin.obj", "good", 4);
	file_write(folder, "twin.ply", "good", 4);
	start(NULL, NULL);
	peer_hello(&p, &psrd, NULL);
	expect_state("tower", PSR_ENTRY_FAILED);
	expect_state("old", PSR_ENTRY_FAILED);
	expect_state("twin", PSR_ENTRY_SOURCE);
	expect_state("twin.ply", PSR_ENTRY_FAILED);
	peer_expect_error(&p, peer_ask_open(&p, "tower"), PSR_WIRE_UNSUPPORTED, text); /* at once, without progress */
	assert_non_null(strstr(text, "laszip -i IN.laz -o OUT.las"));
	assert_null(strstr(text, folder));
	peer_expect_error(&p, peer_ask_open(&p, "twin.ply"), PSR_WIRE_UNSUPPORTED, text);
	assert_non_null(strstr(text, "twin.obj"));
	peer_expect_open_error(&p, peer_ask_open(&p, "old"), PSR_WIRE_FORMAT, text);
	assert_non_null(strstr(text, "not a .psr file"));
	assert_int_equal(count_builds(log), 0);
	peer_close(&p);
	daemon_stop(&psrd);
}

/* psrd with this cache ends by itself, with status 3 and without READY; its words are in psrd.log. */
static void expect_no_start(const char *cache)
{
	char program[PATH_MAX + 16], byte;
	const char *argv[] = { program, "--listen", "127.0.0.1:0", "--models", folder, "--cache", cache, NULL };

	snprintf(program, sizeof program, "%s/psrd", bin);
	daemon_spawn(&psrd, argv);
	assert_int_equal(read(psrd.output, &byte, 1), 0);
	assert_int_equal(daemon_wait(&psrd), 3);
	if (cache[0] != '\0')
		assert_non_null(strstr(psrd.log, cache));
	assert_non_null(strstr(psrd.log, "--cache DIR"));
}

static void a_cache_that_cannot_be_written_is_refused_before_ready(void **state)
{
	char file[PATH_MAX + 16], below[PATH_MAX + 32];

	(void)state;
	file_write(folder, "plate.obj", "good", 4);
	snprintf(file, sizeof file, "%s/psr-model", bin);
	snprintf(below, sizeof below, "%s/cache", file);
	expect_no_start(file);       /* a file */
	assert_non_null(strstr(psrd.log, "Not a directory"));
	expect_no_start(below);      /* below a file */
	expect_no_start("/proc/psr"); /* where nobody may write, root included */
	expect_no_start("");
}

static void a_damaged_cache_is_built_again(void **state)
{
	char text[4096], command[2 * PATH_MAX];

	(void)state;
	file_write(folder, "plate.obj", "good", 4);
	start(NULL, NULL);
	expect_serves(&psrd, "plate");
	daemon_stop(&psrd);
	snprintf(command, sizeof command, "for f in '%s'/cache/deep/*.psr; do truncate -s 1000 \"$f\"; done", bin);
	assert_int_equal(system(command), 0);
	start(NULL, NULL);
	expect_serves(&psrd, "plate");
	assert_int_equal(count_builds(text), 2);
	daemon_stop(&psrd);
}

static void progress_is_passed_on_and_never_goes_back(void **state)
{
	static const uint16_t stages[] = { PSR_PROGRESS_WAITING, PSR_PROGRESS_IMPORT, PSR_PROGRESS_IMPORT,
		                               PSR_PROGRESS_SAMPLE, PSR_PROGRESS_SAMPLE, PSR_PROGRESS_SELECT,
		                               PSR_PROGRESS_LOAD };
	static const uint64_t done[] = { 0, 0, 1, 1, 4, 5, 0 };
	struct psr_message message;
	struct psr_msg_progress progress;

	(void)state;
	file_write(folder, "plate.glb", "good", 4);
	start(NULL, NULL);
	peer_hello(&p, &psrd, NULL);
	peer_ask_open(&p, "plate");
	for (size_t i = 0; i < sizeof stages / sizeof stages[0]; i++) {
		peer_expect(&p, &message, PSR_MSG_PROGRESS, p.id);
		assert_int_equal(psr_msg_progress_decode(&progress, message.payload, message.n, NULL), PSR_OK);
		assert_int_equal(progress.stage, stages[i]);
		assert_int_equal(progress.done, done[i]);
	}
	peer_expect(&p, &message, PSR_MSG_OPENED, p.id);
	peer_close(&p);
	daemon_stop(&psrd);
}

static void a_failed_build_says_why_and_is_remembered(void **state)
{
	struct psr_msg_opened opened;
	char text[PSR_ERROR_TEXT], log[4096];

	(void)state;
	file_write(folder, "plate.ply", "bad", 3);
	start(NULL, NULL);
	peer_hello(&p, &psrd, NULL);
	for (int i = 0; i < 3; i++) {
		peer_expect_open_error(&p, peer_ask_open(&p, "plate"), PSR_WIRE_FORMAT, text);
		assert_non_null(strstr(text, "vertex 7 is not finite"));
		assert_null(strstr(text, folder));
	}
	assert_int_equal(count_builds(log), 1);
	file_write(folder, "plate.ply", "good", 4);
	peer_expect_opened(&p, peer_ask_open(&p, "plate"), &opened);
	assert_int_equal(count_builds(log), 2);
	peer_close(&p);
	daemon_stop(&psrd);
}

static void a_crash_costs_only_the_build(void **state)
{
	char text[PSR_ERROR_TEXT];

	(void)state;
	file_write(folder, "crash.off", "crash", 5);
	file_write(folder, "nothing.off", "nothing", 7);
	plate_write(folder, "plate.psr", 0x2040c0);
	start(NULL, NULL);
	peer_hello(&p, &psrd, NULL);
	peer_expect_open_error(&p, peer_ask_open(&p, "crash"), PSR_WIRE_FORMAT, text);
	assert_non_null(strstr(text, "signal 11"));
	peer_expect_open_error(&p, peer_ask_open(&p, "nothing"), PSR_WIRE_INTERNAL, NULL);
	peer_close(&p);
	expect_serves(&psrd, "plate");
	daemon_stop(&psrd);
}

static void builds_are_niced_and_limited(void **state)
{
	char text[PSR_ERROR_TEXT], log[4096];

	(void)state;
	file_write(folder, "bad.stl", "bad", 3);
	start("--build-memory", "1g");
	peer_hello(&p, &psrd, NULL);
	peer_expect_open_error(&p, peer_ask_open(&p, "bad"), PSR_WIRE_FORMAT, NULL);
	peer_close(&p);
	daemon_stop(&psrd);
	assert_int_equal(count_builds(log), 1);
	assert_string_equal(log, "build -o -r 768 --progress-fd 3 --quiet --threads 2 10 1048576 3600\n");
	file_write(folder, "spin.stl", "spin", 4);
	start("--build-time", "1");
	peer_hello(&p, &psrd, NULL);
	peer_expect_open_error(&p, peer_ask_open(&p, "spin"), PSR_WIRE_LIMIT, text);
	assert_non_null(strstr(text, "--build-time"));
	peer_close(&p);
	daemon_stop(&psrd);
}

static void frames_go_on_while_a_model_is_built(void **state)
{
	struct psr_message message;
	uint32_t id;

	(void)state;
	file_write(folder, "slow.obj", "slow", 4);
	plate_write(folder, "plate.psr", 0x2040c0);
	start(NULL, NULL);
	peer_hello(&p, &psrd, NULL);
	id = peer_ask_open(&p, "slow");
	for (int i = 0; i < 5; i++) /* it runs: waiting, import, import, rays, rays */
		peer_expect(&p, &message, PSR_MSG_PROGRESS, id);
	expect_serves(&psrd, "plate");
	psr_msg_cancel_encode(&p.buf, id, 0, NULL);
	peer_send(&p);
	peer_expect(&p, &message, PSR_MSG_CANCELLED, id);
	peer_close(&p);
	daemon_stop(&psrd);
}

static void builds_beyond_max_builds_wait(void **state)
{
	struct psr_message message;
	struct pollfd waits = { .events = POLLIN };
	char text[4096];

	(void)state;
	file_write(folder, "one.obj", "slow", 4);
	file_write(folder, "two.obj", "slow", 4);
	for (int max = 1; max <= 2; max++) {
		start("--max-builds", max == 1 ? "1" : "2");
		peer_hello(&p, &psrd, NULL);
		peer_hello(&q, &psrd, NULL);
		peer_ask_open(&p, "one");
		for (int i = 0; i < 5; i++)
			peer_expect(&p, &message, PSR_MSG_PROGRESS, p.id);
		peer_ask_open(&q, "two");
		peer_expect(&q, &message, PSR_MSG_PROGRESS, q.id);
		waits.fd = q.fd;
		if (max == 1)
			assert_int_equal(poll(&waits, 1, 300), 0);
		/* Its start, and the first word of the script, which has logged by then. */
		for (int i = 0; max == 2 && i < 2; i++)
			peer_expect(&q, &message, PSR_MSG_PROGRESS, q.id);
		peer_close(&p);
		peer_close(&q);
		daemon_stop(&psrd);
	}
	assert_int_equal(count_builds(text), 3);
}

static void the_end_takes_builds_with_it(void **state)
{
	char path[PATH_MAX + 16];
	struct psr_message message;
	int pid = 0;
	FILE *file;

	(void)state;
	file_write(folder, "slow.obj", "slow", 4);
	start(NULL, NULL);
	peer_hello(&p, &psrd, NULL);
	peer_ask_open(&p, "slow");
	snprintf(path, sizeof path, "%s/pid", bin);
	for (int64_t end = clock_ms() + PATIENCE_MS; pid == 0 && clock_ms() < end; usleep(5000)) {
		file = fopen(path, "r");
		if (file != NULL && fscanf(file, "%d", &pid) != 1)
			pid = 0;
		if (file != NULL)
			fclose(file);
	}
	assert_true(pid > 0);
	kill(psrd.pid, SIGTERM);
	do
		assert_true(peer_next(&p, &message));
	while (message.type == PSR_MSG_PROGRESS);
	assert_int_equal(message.type, PSR_MSG_ERROR); /* the OPEN ends before the goodbye */
	peer_expect(&p, &message, PSR_MSG_GOODBYE, 0);
	peer_close(&p);
	assert_int_equal(daemon_wait(&psrd), 0);
	assert_int_equal(kill(pid, 0), -1);
}

static void without_psr_model_the_error_says_what_to_do(void **state)
{
	char text[PSR_ERROR_TEXT], path[PATH_MAX + 16];

	(void)state;
	snprintf(path, sizeof path, "%s/psr-model", bin);
	assert_int_equal(unlink(path), 0);
	assert_int_equal(setenv("PATH", "/nonexistent", 1), 0);
	file_write(folder, "plate.obj", "good", 4);
	start(NULL, NULL);
	assert_int_equal(setenv("PATH", "/usr/bin:/bin", 1), 0);
	peer_hello(&p, &psrd, NULL);
	peer_expect_open_error(&p, peer_ask_open(&p, "plate"), PSR_WIRE_NOT_FOUND, text);
	assert_non_null(strstr(text, "psr-model"));
	peer_close(&p);
	daemon_stop(&psrd);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(a_source_is_built_once_for_all_and_cached, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_damaged_cache_is_built_again, set_up, tear_down),
		cmocka_unit_test_setup_teardown(pictures_choose_the_resolution_of_a_build, set_up, tear_down),
		cmocka_unit_test_setup_teardown(pictures_beyond_the_protocol_cost_the_request, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_bad_source_fails_once_for_all_resolutions, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_build_over_a_limit_fails_at_its_resolution_alone, set_up, tear_down),
		cmocka_unit_test_setup_teardown(files_that_cannot_be_served_are_listed_and_refused_with_a_reason, set_up,
		                                tear_down),
		cmocka_unit_test_setup_teardown(a_cache_that_cannot_be_written_is_refused_before_ready, set_up, tear_down),
		cmocka_unit_test_setup_teardown(progress_is_passed_on_and_never_goes_back, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_failed_build_says_why_and_is_remembered, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_crash_costs_only_the_build, set_up, tear_down),
		cmocka_unit_test_setup_teardown(builds_are_niced_and_limited, set_up, tear_down),
		cmocka_unit_test_setup_teardown(frames_go_on_while_a_model_is_built, set_up, tear_down),
		cmocka_unit_test_setup_teardown(builds_beyond_max_builds_wait, set_up, tear_down),
		cmocka_unit_test_setup_teardown(the_end_takes_builds_with_it, set_up, tear_down),
		cmocka_unit_test_setup_teardown(without_psr_model_the_error_says_what_to_do, set_up, tear_down),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
