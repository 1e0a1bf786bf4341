/* The command-line manners that all subcommands share. */
#ifndef PSR_CLIENT_CLI_CLI_H
#define PSR_CLIENT_CLI_CLI_H

#include <limits.h>
#include "base/cli.h"
#include "psr/client.h"

#define PSR_PROGRAM "psr " PSR_VERSION

#define PSR_EXIT_CODES \
	"exit codes: 0 done, 1 a frame of bench or a test failed, 2 usage, 3 file or system, 4 bad data,\n" \
	"5 over a limit, 6 server or connection, 7 a defect of psr"

#define PSR_OPT_SERVER(variable) \
	{ .name = "server", .letter = 's', .type = PSR_OPT_STRING, .value = &(variable), .arg = "ADDR", \
	  .help = "Where psrd listens: HOST:PORT, [V6]:PORT, tcp://HOST:PORT or unix:PATH. Set $PSR_SERVER, or write " \
	          "`server = ADDR` into ~/.config/psr/psr.conf, to say it once." }
#define PSR_OPT_TIMEOUT(variable) \
	{ .name = "timeout", .type = PSR_OPT_INT, .value = &(variable), .arg = "SECONDS", .min = 1, .max = 86400, \
	  .help = "How long to wait for a server that says nothing." }

#define PSR_DEFAULT_TIMEOUT 60

const char *psr_default_server(void); /* $PSR_SERVER, or psrd's default address */

extern const char *const psr_commands[]; /* names, NULL at the end */

/* psr_cli_parse(), then the user's defaults for what the command line leaves open: $XDG_CONFIG_HOME/psr/psr.conf, or
 * ~/.config/psr/psr.conf, if it exists. Lines above the first section hold for all commands, those below [COMMAND] for
 * one. cli->given, if not NULL, is of the command line alone. --help shows them. With --replay the section is left
 * out, as the report says everything. ARG, IO, LIMIT, MEMORY; 1 as of psr_cli_parse(). */
int psr_command_parse(const char *command, const struct psr_cli *cli, int argc, char **argv, int *n_operands,
                      struct psr_error *err);

/* The path of a program that stands beside this one, or else its bare name, for PATH. */
void psr_find_program(char path[PATH_MAX], const char *name);

/* Shows a build or load on one line of standard error, if that is a terminal. A callback for psr_client_open();
 * userdata is a zeroed struct psr_progress_line. */
struct psr_progress_line {
	int is_drawn;
};
void psr_progress_draw(const struct psr_msg_progress *progress, void *userdata);
void psr_progress_end(struct psr_progress_line *line);

#endif
