/* What the subcommands of psr share. */
#ifndef PSR_CLIENT_PSR_H
#define PSR_CLIENT_PSR_H

#include <cjson/cJSON.h>
#include "base/cli.h"
#include "psr/client.h"

#define PSR_PROGRAM "psr " PSR_VERSION

#define PSR_EXIT_CODES \
	"exit codes: 0 done, 1 a frame of bench failed, 2 usage, 3 file or system, 4 bad data, 5 over a limit,\n" \
	"6 server or connection, 7 a defect of psr"

#define PSR_OPT_SERVER(variable) \
	{ "server", 's', PSR_OPT_STRING, &(variable), "ADDR", \
	  "Where psrd listens: HOST:PORT, [V6]:PORT, tcp://HOST:PORT or unix:PATH. Set $PSR_SERVER to say it once.", \
	  0, 0, NULL, NULL }
#define PSR_OPT_TIMEOUT(variable) \
	{ "timeout", 0, PSR_OPT_INT, &(variable), "SECONDS", "How long to wait for a server that says nothing.", \
	  1, 86400, NULL, NULL }

#define PSR_DEFAULT_TIMEOUT 60

/* Each takes argv[0] = its own name and returns the exit status. */
int psr_list_main(int argc, char **argv);
int psr_shot_main(int argc, char **argv);
int psr_turntable_main(int argc, char **argv);
int psr_bench_main(int argc, char **argv);

const char *psr_default_server(void); /* $PSR_SERVER, or the address that psrd listens to by default */

/* A build or load that the server reports, as one line on standard error; nothing unless that is a terminal. For
 * psr_client_open; userdata is a struct psr_progress_line, zero at first. */
struct psr_progress_line {
	int is_drawn;
};
void psr_progress_draw(const struct psr_msg_progress *progress, void *userdata);
void psr_progress_end(struct psr_progress_line *line);

/* Prints `json` (which it frees) on standard output. */
int psr_print_json(cJSON *json, struct psr_error *err);

/* Flushes standard output: IO if not all of it could be written. */
int psr_flush_output(struct psr_error *err);

#endif
