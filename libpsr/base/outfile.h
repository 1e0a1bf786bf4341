/* Writes all files of the programs. The content goes into a temporary file beside the path, which gets the path's name
 * at the end: the path holds either its old content or the whole new one. */
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
	char target[PATH_MAX];    /* the file itself: links are followed */
	char temporary[PATH_MAX]; /* "": written in place */
	const char *path;         /* belongs to the caller */
	int reason;               /* errno of the first write that failed, or 0 */
};

/* Opens the file; the path must outlive it. NOT_FOUND: no such folder; IO, MEMORY. */
int outfile_open(struct outfile *file, const char *path, enum outfile_kind kind, struct psr_error *err);

/* outfile_close() reports failures. */
void outfile_write(struct outfile *file, const void *data, size_t n);

/* Returns a path with the target's ending, where another writer may put the content instead. */
const char *outfile_name(const struct outfile *file);

/* Ends the file: renames it if code is PSR_OK and every write succeeded, else removes it. Returns code, or IO. */
int outfile_close(struct outfile *file, int code, struct psr_error *err);

/* Opens a file, writes n bytes, closes it. */
int outfile_save(const char *path, enum outfile_kind kind, const void *data, size_t n, struct psr_error *err);

/* Flushes standard output. IO: the system could not write all that was printed. */
int outfile_flush_stdout(struct psr_error *err);

/* Removes temporary files of `path` that killed processes left behind. */
void outfile_remove_remains(const char *path, pid_t pid);

/* Returns the ending of a path without its dot; "" without one. */
const char *outfile_ending(const char *path);

#endif
