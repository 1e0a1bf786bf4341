/* Files that are either what they were or the whole new content. */
#ifndef PSR_CLIENT_OUTFILE_H
#define PSR_CLIENT_OUTFILE_H

#include <limits.h>
#include <stdio.h>
#include "psr/error.h"

#define OUTFILE_STDOUT "-" /* as a path: standard output */

struct outfile {
	FILE *stream;
	char target[PATH_MAX];    /* the file itself, links followed */
	char temporary[PATH_MAX]; /* "" when a device or pipe is written in place */
	const char *path;         /* as the person said it */
	int reason;               /* errno of the first write that failed, or 0 */
};

/* Opens a temporary file beside path, with the same ending; or standard output, which stays open afterwards. */
int outfile_open(struct outfile *file, const char *path, struct psr_error *err);

/* Writes n bytes; a failure is remembered, and reported by outfile_close. */
void outfile_write(struct outfile *file, const void *data, size_t n);

/* Where another writer may put the content instead of outfile_write. */
const char *outfile_name(const struct outfile *file);

/* Closes and, if code is PSR_OK and all was written, renames; otherwise removes the temporary file. Returns code, or
 * IO. */
int outfile_close(struct outfile *file, int code, struct psr_error *err);

/* The ending of a path without its dot, "" if it has none. */
const char *outfile_ending(const char *path);

#endif
