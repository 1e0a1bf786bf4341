/* How far psr-model is: a bar on a terminal, and lines for a program that waits. */
#ifndef MODELS_PROGRESS_H
#define MODELS_PROGRESS_H

#include <stdint.h>

struct progress {
	int fd;     /* -1: none */
	int has_bar;
	int failed; /* the reader of fd is gone */
};

void progress_show(const char *stage, uint64_t done, uint64_t total, void *progress);
void progress_clear(void); /* the bar */

#endif
