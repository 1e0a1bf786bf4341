#include <stdio.h>
#include <string.h>
#include "commands.h"
#include "base/cli.h"
#include "psr/error.h"
#include "simd/isa.h"

static const struct command {
	const char *name, *summary;
	int (*run)(int argc, char **argv);
} commands[] = {
	{ "build", "turn a mesh or scan (glTF, OBJ, PLY, STL, LAS, PCD, ...) into a .psr model", cmd_build },
	{ "info", "check a .psr file and describe its content", cmd_info },
	{ "make", "generate one of fourteen models to try things with, as glTF", cmd_make },
	{ "accuracy", "say whether a picture is right, beside the ray-traced mesh", cmd_accuracy },
};

#define N_COMMANDS (sizeof commands / sizeof commands[0])

static void print_usage(FILE *to)
{
	fputs("usage: psr-model COMMAND [arguments]\n\nMakes, checks and measures the models that psrd draws.\n\n", to);
	for (size_t i = 0; i < N_COMMANDS; i++)
		fprintf(to, "  %-10s %s\n", commands[i].name, commands[i].summary);
	fputs("\npsr-model COMMAND --help says more; psr-model --version prints the version.\n"
	      "Exit codes: 0 ok, 1 a check failed, 2 usage, 3 file or system, 4 bad data, 5 over a limit, 7 internal.\n",
	      to);
}

int main(int argc, char **argv)
{
	if (argc < 2) {
		print_usage(stderr);
		return psr_exit_status(PSR_ERR_ARG);
	}
	if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0 || strcmp(argv[1], "help") == 0) {
		print_usage(stdout);
		return 0;
	}
	if (strcmp(argv[1], "--completions") == 0) {
		for (size_t i = 0; i < N_COMMANDS; i++)
			printf("%s\t\t\t\t%s\n", commands[i].name, commands[i].summary);
		return 0;
	}
	if (strcmp(argv[1], "--version") == 0) {
		puts("psr-model " PSR_VERSION);
		return 0;
	}
	struct psr_error error;
	if (psr_isa_check_environment(&error) != PSR_OK)
		return psr_cli_fail("psr-model", &error);
	for (size_t i = 0; i < N_COMMANDS; i++) {
		if (strcmp(argv[1], commands[i].name) == 0)
			return commands[i].run(argc - 1, argv + 1);
	}
	fprintf(stderr, "psr-model: there is no command '%s'; psr-model --help lists them\n", argv[1]);
	return psr_exit_status(PSR_ERR_ARG);
}
