/* A window on a file that is read from its beginning to its end, or from anywhere on. */
#ifndef PSR_IMPORT_POINTS_FEED_H
#define PSR_IMPORT_POINTS_FEED_H

#include <stddef.h>
#include <stdint.h>
#include "psr/error.h"

#define FEED_WINDOW ((size_t)1 << 20)
#define FEED_LINE ((size_t)1 << 16) /* bytes of a line, at most */

struct feed {
	const char *path;
	int fd;
	uint64_t n_bytes;  /* of the file, when it was opened */
	uint64_t at;       /* of the window's first byte */
	uint8_t *bytes;    /* the window */
	size_t n, next, room; /* its bytes; the next one to use; room for so many */
};

/* Opens a regular file of one byte at least. NOT_FOUND, IO, FORMAT, MEMORY; feed_close() is fine even then. */
int feed_open(struct feed *feed, const char *path, struct psr_error *err);
void feed_close(struct feed *feed);

void feed_seek(struct feed *feed, uint64_t at); /* at most n_bytes */

/* Makes sure that the window has n bytes from `next` on; fewer at the end of the file alone. Bytes before `next` may
 * go. IO: the file became shorter, too; MEMORY. */
int feed_need(struct feed *feed, size_t n, struct psr_error *err);

static inline int feed_is_at_end(const struct feed *feed)
{
	return feed->at + feed->next == feed->n_bytes;
}

/* Takes the next line, without its end, valid until the next call. *line is NULL behind the last one. FORMAT for a line
 * above FEED_LINE; and errors of feed_need(). */
int feed_line(struct feed *feed, const uint8_t **line, size_t *n, struct psr_error *err);

#endif
