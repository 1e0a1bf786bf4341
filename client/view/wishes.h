/* The options that both viewers have, and their checks. */
#ifndef PSR_CLIENT_VIEW_WISHES_H
#define PSR_CLIENT_VIEW_WISHES_H

#include "client/cli/cli.h"
#include "client/scene/quality.h"
#include "client/scene/scene.h"
#include "client/scene/view.h"
#include "subject.h"

struct wishes {
	const char *server;      /* its form is checked */
	const char *file;        /* to be viewed, in the place of models of the server; NULL: none */
	double fps;
	struct scene_wish scene;
	struct view_wish camera;
	struct quality_wish quality;
	struct subject subject;  /* by wishes_parse() */
};

void wishes_init(struct wishes *wishes, uint32_t width, uint32_t height, double fps);
void wishes_fini(struct wishes *wishes);

/* Lists models and server, under `heading` --fps and the program's own options, and camera,
 * light and quality. */
struct wishes_own { const char *heading, *quality_hint; const struct psr_opt *option; int n_options; };
void wishes_add_options(struct optlist *list, struct wishes *wishes, const struct wishes_own *own);

/* Parses the command line and checks all but the program's own options. needs_model: a file or a model must be there.
 * The errors of psr_command_parse(); ARG, LIMIT, and those of the scene's file. */
int wishes_parse(struct wishes *wishes, const struct psr_cli *cli, int argc, char **argv, int needs_model,
                 struct psr_error *err);

#endif
