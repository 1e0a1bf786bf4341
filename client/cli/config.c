#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "cli.h"
#include "optlist.h"

const char *const psr_commands[] = { "list", "shot", "turntable", "view", "test", "bench", "stats", "fetch", NULL };

static char *text; /* options point into it until the program ends */

/* Returns 0 if there is no such file, or nowhere to look for it. */
static int find(char path[PATH_MAX])
{
	const char *base = getenv("XDG_CONFIG_HOME"), *home = getenv("HOME");
	int n = -1;

	if (base != NULL && base[0] == '/')
		n = snprintf(path, PATH_MAX, "%s/psr/psr.conf", base);
	else if (home != NULL && home[0] == '/')
		n = snprintf(path, PATH_MAX, "%s/.config/psr/psr.conf", home);
	return n > 0 && n < PATH_MAX && access(path, F_OK) == 0;
}

static int configure(const char *command, const struct psr_cli *cli, struct psr_error *err)
{
	char path[PATH_MAX];
	const struct psr_config config = { path, psr_cli_is_given(cli, "replay") ? NULL : command, psr_commands };
	const char *server = getenv("PSR_SERVER");
	int taken[OPTLIST_MAX + 1];
	struct psr_cli own = *cli;

	if (!find(path))
		return PSR_OK;
	own.given = taken;
	for (int i = 0; cli->opts[i].name != NULL; i++)
		taken[i] = cli->given[i]
		           + (server != NULL && server[0] != '\0' && strcmp(cli->opts[i].name, "server") == 0);
	free(text);
	text = NULL;
	return psr_config_read(&text, &config, &own, err);
}

static int asks_for_help(int argc, char **argv)
{
	for (int i = 1; i < argc && strcmp(argv[i], "--") != 0; i++)
		if (strcmp(argv[i], "--help") == 0)
			return 1;
	return 0;
}

int psr_command_parse(const char *command, const struct psr_cli *cli, int argc, char **argv, int *n_operands,
                      struct psr_error *err)
{
	int given[OPTLIST_MAX + 1] = { 0 }, code = PSR_OK;
	struct psr_cli own = *cli;
	const int is_help = asks_for_help(argc, argv);

	for (int n = 0; cli->opts[n].name != NULL; n++)
		assert(n < OPTLIST_MAX);
	if (own.given == NULL)
		own.given = given;
	if (is_help)
		code = configure(command, &own, err);
	if (code == PSR_OK)
		code = psr_cli_parse(&own, argc, argv, n_operands, err);
	if (code == PSR_OK)
		code = configure(command, &own, err);
	return code;
}
