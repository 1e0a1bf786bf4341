#include <stdio.h>
#include <string.h>
#include "commands.h"
#include "psr/cli.h"
#include "psr/error.h"
#include "psr/isa.h"

static const struct command {
	const char *name, *summary;
	int (*run)(int argc, char **argv);
} commands[] = {
	{ "build", "make a .psr model of a mesh or scan (glTF, OBJ, PLY, STL, LAS, ...)", cmd_build },
	{ "info", "say what is in a .psr file", cmd_info },
	{ "make", "generate a model of the standard set as glTF", cmd_make },
	{ "accuracy", "compare a model's pictures with ray-traced ones", cmd_accuracy },
	{ "study", "repeat a study of the thesis: tables and plots", cmd_study },
	{ "figures", "draw the thesis's figures, beside the truth", cmd_figures },
};

#define N_COMMANDS (sizeof commands / sizeof commands[0])

static void print_usage(FILE *to)
{
	fputs("usage: psr-model COMMAND [arguments]\n\nMakes, inspects and measures point-sample models.\n\n", to);
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
