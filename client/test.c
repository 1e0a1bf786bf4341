#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>
#include "client/cli/cli.h"
#include "client/cli/optlist.h"
#include "client/home/daemon.h"
#include "client/test/accept.h"
#include "client/test/report.h"
#include "client/test/run.h"
#include "commands.h"

enum { ALL_PASSED = 0, SOME_FAILED = 1, SUITE_WRONG = 2, NO_DAEMON = 3 };

struct wish {
	const char *server, *models, *pattern, *accept;
	int is_server_said; /* on the command line: else a suite's own models come first */
	int64_t timeout; /* seconds */
	struct report report;
};

static const char footer[] =
	"A suite is a text file; each of its tests asks for a picture, or several, by the options of psr shot, and says\n"
	"what is expected: psr-suite(5).\n"
	"\n"
	"  models=models.d size=320x240\n"
	"  test=front model=engine view=front reference=front.png psnr=45 ssim=0.99\n"
	"  test=turn  model=engine turntable=12 hash=?\n"
	"  test=none  model=nothing error=not-found\n"
	"\n"
	"A psrd of its own serves the suite's folder `models`, unless --server or --models says otherwise; suites that\n"
	"name no folder go to the default server.\n"
	"\n"
	"examples:\n"
	"  psr test engine.suite --html failures.html\n"
	"  psr test --server unix:/run/psrd.sock --junit results.xml suites/*.suite\n"
	"  psr test engine.suite --accept 'turn*'\n"
	"\n"
	"exit codes: 0 all tests passed, 1 some failed, 2 usage, or a suite is wrong, 3 no daemon, or a file cannot be\n"
	"written";

static int parse(struct wish *wish, int argc, char **argv, int *n_suites, struct psr_error *err)
{
	struct optlist list = { .n = 0 };
	const struct psr_opt opts[] = {
		PSR_OPT_SERVER(wish->server),
		{ .name = "models", .letter = 'm', .type = PSR_OPT_STRING, .value = &wish->models, .arg = "DIR",
		  .help = "Start a psrd that serves this folder to the tests alone, and end it with them." },
		{ .name = "only", .letter = 'k', .type = PSR_OPT_STRING, .value = &wish->pattern, .arg = "PATTERN",
		  .help = "Only tests whose names match, such as 'front-*'." },
		{ .name = "accept", .type = PSR_OPT_STRING, .value = &wish->accept, .arg = "PATTERN",
		  .help = "Take what the tests of these names draw: write their hashes into the suite, and their reference "
		          "pictures anew. Other tests are left out, unless --only says them." },
		{ .name = "tap", .type = PSR_OPT_FLAG, .value = &wish->report.is_tap,
		  .help = "Print the Test Anything Protocol instead of the lines for people." },
		{ .name = "junit", .type = PSR_OPT_STRING, .value = &wish->report.junit, .arg = "FILE",
		  .help = "Write the results as JUnit's XML, too." },
		{ .name = "html", .type = PSR_OPT_STRING, .value = &wish->report.html, .arg = "FILE",
		  .help = "Write a page with each picture that failed beside its reference and their difference." },
		PSR_OPT_TIMEOUT(wish->timeout),
	};
	int given[OPTLIST_MAX + 1] = { 0 }, code;
	const struct psr_cli cli = {
		.usage = "psr test [--server ADDR | --models DIR] [--only PATTERN] [--html FILE] SUITE...",
		.summary = "Draws the pictures of test suites and compares them with what is expected. Prints a line for "
		           "each that failed.",
		.opts = list.opt,
		.footer = footer,
		.given = given,
	};

	OPTLIST_ADD(&list, opts);
	code = psr_command_parse("test", &cli, argc, argv, n_suites, err);
	wish->is_server_said = code == PSR_OK && psr_cli_is_given(&cli, "server");
	return code;
}

/* ---- a suite ---- */

struct progress {
	const char *suite;
	uint32_t n_done, n;
};

static void draw_progress(void *userdata)
{
	struct progress *progress = userdata;

	progress->n_done++;
	if (isatty(STDERR_FILENO))
		fprintf(stderr, "\r%s: %u of %u\x1b[K%s", progress->suite, progress->n_done, progress->n,
		        progress->n_done == progress->n ? "\r\x1b[K" : "");
}

static int draw(struct results *results, const struct wish *wish, const char *address, struct psr_error *err)
{
	struct progress progress = { .suite = results->suite->name };
	struct run run = { .results = results, .timeout_ms = (int)wish->timeout * 1000,
		               .wants_figures = wish->report.html != NULL, .on_result = draw_progress, .userdata = &progress };
	int code = psr_client_connect(&run.client, address, PSR_PROGRAM, NULL, run.timeout_ms, err);

	for (uint32_t i = 0; i < results->suite->n_tests; i++)
		progress.n += results->is_chosen[i] ? results->suite->test[i].n_pictures : 0;
	if (code == PSR_OK)
		code = run_tests(&run, err);
	psr_client_close(run.client);
	return code;
}

/* At a server, or at a psrd of its own. */
static int run_suite(struct wish *wish, struct results *results, struct psr_error *err)
{
	static const char *const no_options[] = { NULL };
	const char *models = wish->models != NULL ? wish->models : results->suite->models;
	struct daemon *daemon = NULL;
	int code = PSR_OK;

	if (!wish->is_server_said && models != NULL) {
		code = daemon_create(&daemon, err);
		if (code == PSR_OK)
			code = daemon_start(daemon, models, no_options, err);
	}
	if (code == PSR_OK)
		code = draw(results, wish, daemon != NULL ? daemon_address(daemon) : wish->server, err);
	daemon_destroy(daemon);
	if (code == PSR_OK)
		code = accept_write(results, err);
	report_suite(&wish->report, results, code != PSR_OK ? err : NULL);
	return code;
}

/* ---- all suites ---- */

static int fail(const struct psr_error *err, int status)
{
	psr_cli_fail("psr test", err);
	return status;
}

static int check_chosen(const struct results *results, uint32_t n, const struct wish *wish, struct psr_error *err)
{
	uint32_t n_accepted = 0, n_chosen = 0;

	for (uint32_t s = 0; s < n; s++)
		for (uint32_t i = 0; i < results[s].suite->n_tests; i++) {
			n_accepted += results[s].is_accepted[i];
			n_chosen += results[s].is_chosen[i];
		}
	if (wish->accept != NULL && n_accepted == 0)
		return psr_fail(err, PSR_ERR_ARG, "--accept: no test matches '%.80s'", wish->accept);
	return n_chosen > 0 ? PSR_OK : psr_fail(err, PSR_ERR_ARG, "--only: no test matches '%.80s'", wish->pattern);
}

/* Reads all suites before anything is drawn. */
static int read_suites(struct suite **suite, struct results *results, char **path, uint32_t n, const struct wish *wish,
                       struct psr_error *err)
{
	int code = PSR_OK;

	for (uint32_t i = 0; i < n && code == PSR_OK; i++) {
		code = suite_read(&suite[i], path[i], err);
		if (code == PSR_OK)
			code = results_init(&results[i], suite[i], wish->pattern, wish->accept, err);
	}
	return code == PSR_OK ? check_chosen(results, n, wish, err) : code;
}

static int run_suites(struct wish *wish, struct results *results, uint32_t n, struct psr_error *err)
{
	int code = report_open(&wish->report, err), closed;

	if (code != PSR_OK)
		return code;
	for (uint32_t i = 0; i < n && code == PSR_OK; i++)
		code = run_suite(wish, &results[i], err);
	/* What was drawn before the daemon was lost is told, too. */
	closed = report_close(&wish->report, PSR_OK, code == PSR_OK ? err : NULL);
	return code == PSR_OK ? closed : code;
}

int psr_test_main(int argc, char **argv)
{
	struct wish wish = { .server = psr_default_server(), .timeout = PSR_DEFAULT_TIMEOUT };
	struct suite **suite = NULL;
	struct results *results = NULL;
	struct psr_error err;
	int n = 0, code = parse(&wish, argc, argv, &n, &err), status = ALL_PASSED;

	if (code > 0)
		return 0;
	if (code == PSR_OK && n == 0)
		code = psr_fail(&err, PSR_ERR_ARG, "a suite is missing: psr test FILE; --help shows one");
	if (code == PSR_OK && wish.is_server_said && wish.models != NULL)
		code = psr_fail(&err, PSR_ERR_ARG, "--server and --models exclude each other: both say who draws");
	if (code == PSR_OK)
		code = psr_address_check(wish.server, &err);
	if (code == PSR_OK) {
		suite = calloc((size_t)n, sizeof *suite);
		results = calloc((size_t)n, sizeof *results);
		code = suite != NULL && results != NULL ? PSR_OK : psr_fail(&err, PSR_ERR_MEMORY, "no memory for %d suites", n);
	}
	if (code == PSR_OK)
		code = read_suites(suite, results, argv + 1, (uint32_t)n, &wish, &err);
	if (code != PSR_OK)
		status = fail(&err, code == PSR_ERR_MEMORY ? NO_DAEMON : SUITE_WRONG);
	if (code == PSR_OK && run_suites(&wish, results, (uint32_t)n, &err) != PSR_OK)
		status = fail(&err, NO_DAEMON);
	else if (code == PSR_OK)
		status = wish.report.n_failed > 0 ? SOME_FAILED : ALL_PASSED;
	for (int i = 0; i < n && suite != NULL && results != NULL; i++) {
		if (results[i].suite != NULL)
			results_fini(&results[i]);
		suite_free(suite[i]);
	}
	free(suite);
	free(results);
	return status;
}
