/* psr view: another program, so that psr links neither a window system nor a terminal's pictures. */
#include <string.h>
#include <unistd.h>
#include "client/cli/cli.h"
#include "commands.h"

static const struct viewer {
	const char *program, *needs;
} window = { "psr-view", "SDL2 and Dear ImGui (libsdl2-dev, libimgui-dev)" },
  term = { "psr-view-term", "chafa (libchafa-dev)" };

int psr_view_main(int argc, char **argv)
{
	const struct viewer *viewer = &window;
	char path[PATH_MAX];
	struct psr_error err;
	int n = 1;

	for (int i = 1; i < argc; i++)
		if (strcmp(argv[i], "--term") == 0)
			viewer = &term;
		else
			argv[n++] = argv[i];
	argv[n] = NULL;
	argv[0] = (char *)viewer->program;
	psr_find_program(path, viewer->program);
	execvp(path, argv);
	psr_fail(&err, PSR_ERR_NOT_FOUND, "%s is neither beside psr nor on the PATH; it is built where %s is installed: "
	         "install that and run make again", viewer->program, viewer->needs);
	return psr_cli_fail("psr view", &err);
}
