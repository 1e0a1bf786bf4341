/* Octrees in psrd: what is drawn of them takes memory, too, and --max-memory knows it. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "fixture.h"
#include "model/cubes.h"
#include "tests/unit/lib/trees.h"

static char folder[PATH_MAX];
static uint64_t opened, drawn; /* bytes of the model before its cubes are made, and after */

static int make_model(void **state)
{
	const struct tree_options options = { .levels = 8, .radius = 0.9, .is_one_sided = 1, .with_offsets = 1, .keep = 1 };
	struct psr_model *model = tree_build(&options);
	char path[PATH_MAX + 16];

	(void)state;
	folder_make(folder);
	snprintf(path, sizeof path, "%s/ball.psr", folder);
	assert_int_equal(psr_model_write(model, path, NULL), PSR_OK);
	opened = psr_model_bytes(model);
	assert_int_equal(psr_model_make_cubes(model, NULL), PSR_OK);
	drawn = psr_model_bytes(model);
	psr_model_unref(model);
	return 0;
}

static int remove_model(void **state)
{
	(void)state;
	folder_remove(folder);
	return 0;
}

static void an_octree_counts_with_what_is_drawn_of_it(void **state)
{
	struct psr_msg_opened answer;
	struct daemon psrd;
	struct peer p;

	(void)state;
	daemon_start(&psrd, folder, NULL);
	peer_hello(&p, &psrd, NULL);
	peer_expect_opened(&p, peer_ask_open(&p, "ball"), &answer);
	assert_int_equal(peer_stat(&p, PSR_STAT_MODEL_BYTES), drawn);
	peer_close(&p);
	daemon_stop(&psrd);
}

/* Half of its cubes would fit. */
static void an_octree_that_fits_without_its_cubes_is_refused(void **state)
{
	char memory[32], text[PSR_ERROR_TEXT];
	const char *const more[] = { "--max-memory", memory, NULL };
	struct daemon psrd;
	struct peer p;

	(void)state;
	assert_true(opened > 1 << 20 && drawn > opened + opened / 4);
	snprintf(memory, sizeof memory, "%llu", (unsigned long long)(opened + (drawn - opened) / 2));
	daemon_start(&psrd, folder, more);
	peer_hello(&p, &psrd, NULL);
	peer_expect_open_error(&p, peer_ask_open(&p, "ball"), PSR_WIRE_LIMIT, text);
	assert_non_null(strstr(text, "--max-memory"));
	peer_close(&p);
	daemon_stop(&psrd);
}

/* As above, of a source whose model a psr-model of the test's own makes; then of the model in the cache. */
static void an_octree_that_psrd_builds_counts_with_its_cubes(void **state)
{
	static const char script[] = "#!/bin/sh\ncp ${0%/*}/ready.psr \"$4\"\n";
	char bin[PATH_MAX], sources[PATH_MAX], program[PATH_MAX + 16], cache[PATH_MAX + 16], command[3 * PATH_MAX];
	char memory[32], text[PSR_ERROR_TEXT];
	const char *const argv[] = { program, "--listen", "127.0.0.1:0", "--models", sources, "--cache", cache,
		                         "--max-memory", memory, NULL };
	struct psr_msg_opened answer;
	struct daemon psrd;
	struct peer p;

	(void)state;
	builder_make(bin, script);
	folder_make(sources);
	file_write(sources, "cloud.xyz", "1 2 3\n", 6);
	snprintf(command, sizeof command, "cp '%s/ball.psr' '%s/ready.psr'", folder, bin);
	assert_int_equal(system(command), 0);
	snprintf(program, sizeof program, "%s/psrd", bin);
	snprintf(cache, sizeof cache, "%s/cache", bin);
	for (int i = 0; i < 3; i++) {
		const int is_enough = i == 1;

		snprintf(memory, sizeof memory, "%llu",
		         (unsigned long long)(is_enough ? 2 * drawn : opened + (drawn - opened) / 2));
		daemon_spawn(&psrd, argv);
		daemon_wait_ready(&psrd);
		peer_hello(&p, &psrd, NULL);
		if (is_enough)
			peer_expect_opened(&p, peer_ask_open(&p, "cloud"), &answer);
		else
			peer_expect_open_error(&p, peer_ask_open(&p, "cloud"), PSR_WIRE_LIMIT, text);
		peer_close(&p);
		daemon_stop(&psrd);
	}
	folder_remove(sources);
	folder_remove(bin);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(an_octree_counts_with_what_is_drawn_of_it),
		cmocka_unit_test(an_octree_that_fits_without_its_cubes_is_refused),
		cmocka_unit_test(an_octree_that_psrd_builds_counts_with_its_cubes),
	};

	return cmocka_run_group_tests(tests, make_model, remove_model);
}
