#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "cli.h"

#define BAR 30

const char *psr_default_server(void)
{
	const char *set = getenv("PSR_SERVER");

	return set != NULL && set[0] != '\0' ? set : PSR_CLIENT_DEFAULT_ADDRESS;
}

void psr_find_program(char path[PATH_MAX], const char *name)
{
	const ssize_t n = readlink("/proc/self/exe", path, PATH_MAX - 1);
	char *slash;

	if (n > 0) {
		path[n] = '\0';
		slash = strrchr(path, '/');
		if (slash != NULL && (size_t)(slash - path) + strlen(name) + 2 < PATH_MAX) {
			strcpy(slash + 1, name);
			if (access(path, X_OK) == 0)
				return;
		}
	}
	snprintf(path, PATH_MAX, "%s", name);
}

void psr_progress_draw(const struct psr_msg_progress *progress, void *userdata)
{
	static const char *const stages[] = { "waiting", "import", "sample", "select", "write", "load" };
	struct psr_progress_line *line = userdata;
	const char *stage = progress->stage < sizeof stages / sizeof stages[0] ? stages[progress->stage] : "working";

	if (!isatty(STDERR_FILENO))
		return;
	line->is_drawn = 1;
	if (progress->total > 0) {
		double part = (double)progress->done / (double)progress->total;
		int full = (int)(part * BAR);

		fprintf(stderr, "\rbuilding: %-8s [%.*s%*s] %3.0f %%\x1b[K", stage, full, "##############################",
		        BAR - full, "", 100 * part);
	} else {
		fprintf(stderr, "\rbuilding: %-8s\x1b[K", stage);
	}
	fflush(stderr);
}

void psr_progress_end(struct psr_progress_line *line)
{
	if (line->is_drawn)
		fprintf(stderr, "\r\x1b[K");
	line->is_drawn = 0;
}
