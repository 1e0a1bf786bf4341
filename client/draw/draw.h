/* The common part of shot and turntable: a scene, any number of cameras, and the files of the pictures. */
#ifndef PSR_CLIENT_DRAW_DRAW_H
#define PSR_CLIENT_DRAW_DRAW_H

#include "client/output/sink.h"
#include "client/scene/quality.h"
#include "client/scene/view.h"

struct draw_wish {
	const char *server;
	int64_t timeout; /* seconds */
	struct scene_wish scene;
	struct view_wish view;
	struct quality_wish quality;
	struct sink_wish sink;
	const char *cameras, *replay;
	const char *file; /* served by a psrd of the program's own; NULL: none */
};

/* Lists the options of both commands, group by group; `files` are the command's own in the group Files. */
void draw_add_options(struct optlist *list, struct draw_wish *wish, const struct psr_opt *files, int n_files);

/* Parses the command line: options, and the one file that may stand among them. As psr_cli_parse(). */
int draw_parse_command(struct draw_wish *wish, const char *command, const struct psr_cli *cli, int argc, char **argv,
                       struct psr_error *err);

/* Fills the wish, which must hold its defaults. Returns 1 if it printed --help. */
typedef int draw_parse(struct draw_wish *wish, int argc, char **argv, struct psr_error *err);

/* Parses, checks, connects, draws and writes. Returns the exit status. */
int draw_main(const char *program, draw_parse *parse, int argc, char **argv);

#endif
