#include <stdio.h>
#include <string.h>
#include "base/outfile.h"
#include "client/cli/cli.h"
#include "commands.h"

static const struct {
	const char *name;
	int (*run)(int argc, char **argv);
	const char *help;
} commands[] = {
	{ "list", psr_list_main, "the models that a server has" },
	{ "shot", psr_shot_main, "a picture of a model, or of several, into a file" },
	{ "turntable", psr_turntable_main, "a model from all sides: numbered pictures, an animation or a contact sheet" },
	{ "view", psr_view_main, "models in a window, to be turned, moved and lit; --term: in a terminal" },
	{ "test", psr_test_main, "pictures of test suites, compared with what is expected" },
	{ "bench", psr_bench_main, "load a server with many clients, and measure" },
	{ "stats", psr_stats_main, "what a server counts: connections, frames, bytes, memory" },
	{ "fetch", psr_fetch_main, "the file of a model, coarse first; goes on where it broke off" },
};

#define N_COMMANDS (sizeof commands / sizeof commands[0])

static void print_help(void)
{
	printf("usage: psr COMMAND [options]\n       psr --help | --version\n\n"
	       "The client of psrd, which draws point-sample models and streams the pictures.\n\ncommands:\n");
	for (size_t i = 0; i < N_COMMANDS; i++)
		printf("  %-9s %s\n", commands[i].name, commands[i].help);
	printf("\n`psr COMMAND --help` shows the options of a command.\n\n" PSR_EXIT_CODES "\n");
}

int main(int argc, char **argv)
{
	struct psr_error err;
	const char *name = argc > 1 ? argv[1] : NULL;

	if (name != NULL && strcmp(name, "--help") == 0) {
		print_help();
		return outfile_flush_stdout(&err) == PSR_OK ? 0 : psr_cli_fail("psr", &err);
	}
	if (name != NULL && strcmp(name, "--completions") == 0) {
		for (size_t i = 0; i < N_COMMANDS; i++)
			printf("%s\t\t\t\t%s\n", commands[i].name, commands[i].help);
		return outfile_flush_stdout(&err) == PSR_OK ? 0 : psr_cli_fail("psr", &err);
	}
	if (name != NULL && strcmp(name, "--version") == 0) {
		printf("%s\n", PSR_PROGRAM);
		return outfile_flush_stdout(&err) == PSR_OK ? 0 : psr_cli_fail("psr", &err);
	}
	for (size_t i = 0; name != NULL && i < N_COMMANDS; i++)
		if (strcmp(name, commands[i].name) == 0)
			return commands[i].run(argc - 1, argv + 1);
	if (name == NULL)
		psr_fail(&err, PSR_ERR_ARG, "a command is missing; psr --help lists them");
	else
		psr_fail(&err, PSR_ERR_ARG, "'%.80s' is no command; psr --help lists them", name);
	return psr_cli_fail("psr", &err);
}
