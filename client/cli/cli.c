#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>
#include "cli.h"

#define BAR 30

const char *psr_default_server(void)
{
	const char *set = getenv("PSR_SERVER");

	return set != NULL && set[0] != '\0' ? set : PSR_CLIENT_DEFAULT_ADDRESS;
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
