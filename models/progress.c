#include "progress.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#define BAR_WIDTH 32

static void draw_bar(const char *stage, uint64_t done, uint64_t total)
{
	char bar[BAR_WIDTH + 1];
	int n = (int)((double)done / (double)total * BAR_WIDTH);

	memset(bar, ' ', BAR_WIDTH);
	memset(bar, '#', (size_t)n);
	bar[BAR_WIDTH] = '\0';
	fprintf(stderr, "\r%-8s [%s] %3d %%", stage, bar, (int)((double)done / (double)total * 100));
}

void progress_clear(void)
{
	fprintf(stderr, "\r%*s\r", BAR_WIDTH + 18, "");
}

void progress_show(const char *stage, uint64_t done, uint64_t total, void *userdata)
{
	struct progress *progress = userdata;

	if (progress->has_bar)
		draw_bar(stage, done, total);
	if (progress->fd >= 0 && !progress->failed)
		progress->failed = dprintf(progress->fd, "%s %" PRIu64 " %" PRIu64 "\n", stage, done, total) < 0;
}
