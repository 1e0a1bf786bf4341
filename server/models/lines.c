#include <errno.h>
#include <unistd.h>
#include "lines.h"

void lines_close(struct lines *lines)
{
	const int fd = lines->source.fd;

	if (fd < 0)
		return;
	loop_remove(lines->loop, &lines->source);
	close(fd);
}

static void end_line(struct lines *lines)
{
	lines->line[lines->n] = '\0';
	lines->n = 0;
	lines->on_line(lines->line, lines->userdata);
}

/* Returns the bytes read, 0 at the end. */
static size_t read_some(struct lines *lines, size_t most)
{
	char bytes[LINES_BYTES];
	const ssize_t n = read(lines->source.fd, bytes, most < sizeof bytes ? most : sizeof bytes);

	if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR))
		lines_close(lines);
	for (ssize_t i = 0; i < n; i++) {
		if (bytes[i] == '\n')
			end_line(lines);
		else if (lines->n < LINES_LENGTH - 1 && bytes[i] != '\0')
			lines->line[lines->n++] = bytes[i];
	}
	return n > 0 ? (size_t)n : 0;
}

/* Reads a pipe that all writers have closed to its end, whatever n_left says: epoll would report it again and again. */
static void on_ready(uint32_t events, void *userdata)
{
	struct lines *lines = userdata;

	if (events & EPOLLHUP)
		read_some(lines, LINES_BYTES);
	else
		lines->n_left -= read_some(lines, lines->n_left);
	if (lines->n_left == 0)
		loop_set(lines->loop, &lines->source, 0);
}

void lines_open(struct lines *lines, struct loop *loop, int fd, void (*on_line)(const char *, void *), void *userdata)
{
	*lines = (struct lines){ .loop = loop, .on_line = on_line, .userdata = userdata, .n_left = LINES_BYTES };
	lines->source = (struct loop_source){ .fd = fd, .on_ready = on_ready, .userdata = lines };
	if (loop_add(loop, &lines->source, EPOLLIN, NULL) != PSR_OK) {
		close(fd);
		lines->source.fd = -1;
	}
}

void lines_tick(struct lines *lines)
{
	lines->n_left = LINES_BYTES;
	loop_set(lines->loop, &lines->source, EPOLLIN);
}

void lines_finish(struct lines *lines)
{
	size_t left = LINES_BYTES, n;

	while (lines->source.fd >= 0 && left > 0 && (n = read_some(lines, left)) > 0)
		left -= n;
	if (lines->n > 0)
		end_line(lines);
	lines_close(lines);
}
