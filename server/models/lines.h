/* Lines of text from a child's pipe, for any speed and length: reads up to LINES_BYTES between two ticks; then the pipe
 * fills up and the child waits. Belongs to the loop's thread. */
#ifndef PSRD_LINES_H
#define PSRD_LINES_H

#include <stddef.h>
#include "server/net/loop.h"

#define LINES_BYTES 16384u
#define LINES_LENGTH 512u /* a line with its NUL; longer lines lose their ends */

struct lines {
	struct loop *loop;
	struct loop_source source; /* fd -1: closed */
	void (*on_line)(const char *line, void *userdata); /* must not close it */
	void *userdata;
	char line[LINES_LENGTH];
	size_t n, n_left; /* length of the line so far; bytes that may still be read before the next tick */
};

/* Takes fd, which must be non-blocking. If the loop cannot watch it, closes it: then no line comes. */
void lines_open(struct lines *lines, struct loop *loop, int fd, void (*on_line)(const char *, void *), void *userdata);
void lines_tick(struct lines *lines);

void lines_finish(struct lines *lines); /* reads the rest, LINES_BYTES at most, passes on an unfinished line, closes */
void lines_close(struct lines *lines);  /* at once */

#endif
