/* The writer of every file. It writes beside the path and renames when all is written: the path holds either what it
 * held before or the whole new content. */
#ifndef PSR_BASE_OUTFILE_H
#define PSR_BASE_OUTFILE_H

#include <limits.h>
#include <stdio.h>
#include <sys/types.h>
#include "psr/error.h"

#define OUTFILE_STDOUT "-"

enum outfile_kind {
	OUTFILE_PLAIN,   /* "-" is standard output; devices and pipes are written in place */
	OUTFILE_DURABLE, /* replaces regular files only; file and name survive a power cut */
};

struct outfile {
	FILE *stream;
	enum outfile_kind kind;
	char target[PATH_MAX];    /* the file itself, links followed */
	char temporary[PATH_MAX]; /* "": written in place */
	const char *path;         /* the caller's */
	int reason;               /* errno of the first write that failed, or 0 */
};

/* The path must outlive the file. NOT_FOUND: no such folder; IO, MEMORY. */
int outfile_open(struct outfile *file, const char *path, enum outfile_kind kind, struct psr_error *err);

/* outfile_close() reports failures. */
void outfile_write(struct outfile *file, const void *data, size_t n);

/* Where another writer may put the content instead: a file with the path's ending. */
const char *outfile_name(const struct outfile *file);

/* Renames if code is PSR_OK and all was written; else removes the temporary file. Returns code, or IO. */
int outfile_close(struct outfile *file, int code, struct psr_error *err);

/* Opens, writes n bytes, closes. */
int outfile_save(const char *path, enum outfile_kind kind, const void *data, size_t n, struct psr_error *err);

/* IO: not all that was printed could be written. */
int outfile_flush_stdout(struct psr_error *err);

/* Removes the temporary files of `path` that a killed process left. */
void outfile_remove_remains(const char *path, pid_t pid);

/* The ending of a path without its dot; "" without one. */
const char *outfile_ending(const char *path);

#endif
