#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "feed.h"

int feed_open(struct feed *feed, const char *path, struct psr_error *err)
{
	struct stat st;

	*feed = (struct feed){ .path = path, .room = FEED_WINDOW };
	feed->fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
	if (feed->fd < 0)
		return psr_fail(err, errno == ENOENT ? PSR_ERR_NOT_FOUND : PSR_ERR_IO, "%s: %s", path, strerror(errno));
	if (fstat(feed->fd, &st) != 0 || !S_ISREG(st.st_mode))
		return psr_fail(err, PSR_ERR_IO, "%s: not a file", path);
	feed->n_bytes = (uint64_t)st.st_size;
	if (feed->n_bytes == 0)
		return psr_fail(err, PSR_ERR_FORMAT, "%s: the file is empty", path);
	feed->bytes = malloc(feed->room);
	return feed->bytes != NULL ? PSR_OK : psr_fail(err, PSR_ERR_MEMORY, "%s: no memory to read it", path);
}

void feed_close(struct feed *feed)
{
	if (feed->fd >= 0)
		close(feed->fd);
	feed->fd = -1;
	free(feed->bytes);
	feed->bytes = NULL;
}

void feed_seek(struct feed *feed, uint64_t at)
{
	feed->at = at;
	feed->n = feed->next = 0;
}

static int fill(struct feed *feed, struct psr_error *err)
{
	const uint64_t left = feed->n_bytes - feed->at;
	const size_t want = left < feed->room ? (size_t)left : feed->room;

	while (feed->n < want) {
		const ssize_t more = pread(feed->fd, feed->bytes + feed->n, want - feed->n, (off_t)(feed->at + feed->n));

		if (more < 0 && errno == EINTR)
			continue;
		if (more < 0)
			return psr_fail(err, PSR_ERR_IO, "%s: %s", feed->path, strerror(errno));
		if (more == 0)
			return psr_fail(err, PSR_ERR_IO, "%s: became shorter while it was read", feed->path);
		feed->n += (size_t)more;
	}
	return PSR_OK;
}

int feed_need(struct feed *feed, size_t n, struct psr_error *err)
{
	if (feed->n - feed->next >= n || feed->at + feed->n == feed->n_bytes)
		return PSR_OK;
	if (n > feed->room) {
		uint8_t *bytes = realloc(feed->bytes, n);

		if (bytes == NULL)
			return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for %zu bytes of it", feed->path, n);
		feed->bytes = bytes;
		feed->room = n;
	}
	memmove(feed->bytes, feed->bytes + feed->next, feed->n - feed->next);
	feed->n -= feed->next;
	feed->at += feed->next;
	feed->next = 0;
	return fill(feed, err);
}

int feed_line(struct feed *feed, const uint8_t **line, size_t *n, struct psr_error *err)
{
	const uint8_t *end = NULL;
	size_t there = feed->n - feed->next;
	int rc;

	*line = NULL;
	if (there > 0)
		end = memchr(feed->bytes + feed->next, '\n', there);
	if (end == NULL) {
		rc = feed_need(feed, FEED_LINE, err);
		if (rc != PSR_OK)
			return rc;
		there = feed->n - feed->next;
		if (there == 0)
			return PSR_OK;
		end = memchr(feed->bytes + feed->next, '\n', there);
	}
	*line = feed->bytes + feed->next;
	*n = end != NULL ? (size_t)(end - *line) : there;
	if (*n >= FEED_LINE)
		return psr_fail(err, PSR_ERR_FORMAT, "%s: byte %llu: a line of more than %zu bytes; is this a text?", feed->path,
		                (unsigned long long)(feed->at + feed->next), FEED_LINE);
	feed->next += *n + (end != NULL);
	return PSR_OK;
}
