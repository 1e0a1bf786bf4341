#define _GNU_SOURCE
#include <errno.h>
#include <inttypes.h>
#include <poll.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>
#include "log.h"

#define LINE 1024 /* below PIPE_BUF, so that a line goes into a pipe whole or not at all */

static int is_verbose;
static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
static uint64_t n_lost, n_told; /* under the mutex */

void log_set_verbose(int verbose)
{
	is_verbose = verbose;
}

/* Other processes may share standard error, so psrd does not set O_NONBLOCK, which would hold for them, too. On a
 * kernel without a write that does not wait, poll() tells whether there is room; a file always takes its line. */
static ssize_t write_now(const char *line, size_t n)
{
	const struct iovec part = { (void *)line, n };
	struct pollfd room = { .fd = STDERR_FILENO, .events = POLLOUT };
	struct stat status;
	ssize_t written;

	if (fstat(STDERR_FILENO, &status) != 0)
		return -1;
	if (S_ISREG(status.st_mode))
		return write(STDERR_FILENO, line, n);
	if (S_ISSOCK(status.st_mode))
		return send(STDERR_FILENO, line, n, MSG_DONTWAIT | MSG_NOSIGNAL);
	written = pwritev2(STDERR_FILENO, &part, 1, -1, RWF_NOWAIT);
	if (written >= 0 || (errno != EOPNOTSUPP && errno != ENOSYS && errno != EINVAL && errno != ESPIPE))
		return written;
	return poll(&room, 1, 0) == 1 && room.revents == POLLOUT ? write(STDERR_FILENO, line, n) : -1;
}

static size_t begin_line(char line[LINE])
{
	struct timespec now;
	struct tm tm;
	size_t n;

	clock_gettime(CLOCK_REALTIME, &now);
	gmtime_r(&now.tv_sec, &tm);
	n = strftime(line, LINE, "%Y-%m-%dT%H:%M:%S", &tm);
	return n + (size_t)snprintf(line + n, LINE - n, ".%03ldZ psrd: ", now.tv_nsec / 1000000);
}

/* Under the mutex. */
static int tell_lost(void)
{
	char line[LINE];
	size_t n = begin_line(line);

	n += (size_t)snprintf(line + n, sizeof line - n, "%" PRIu64 " lines were lost: their reader was too slow\n",
	                      n_lost - n_told);
	if (write_now(line, n) < 0)
		return -1;
	n_told = n_lost;
	return 0;
}

/* One write a line, so that lines of several threads do not mix. Control characters may come from outside. */
static void write_line(const char *format, va_list args)
{
	char line[LINE];
	size_t n = begin_line(line);
	int written = vsnprintf(line + n, sizeof line - n - 1, format, args);

	if (written > 0)
		n += (size_t)written < sizeof line - n - 1 ? (size_t)written : sizeof line - n - 2;
	for (size_t i = 0; i < n; i++)
		if ((unsigned char)line[i] < ' ' || line[i] == 127)
			line[i] = '?';
	line[n++] = '\n';
	pthread_mutex_lock(&mutex);
	if ((n_told < n_lost && tell_lost() != 0) || write_now(line, n) < 0)
		n_lost++;
	pthread_mutex_unlock(&mutex);
}

uint64_t log_lost(void)
{
	uint64_t n;

	pthread_mutex_lock(&mutex);
	n = n_lost;
	pthread_mutex_unlock(&mutex);
	return n;
}

void log_info(const char *format, ...)
{
	va_list args;

	if (!is_verbose)
		return;
	va_start(args, format);
	write_line(format, args);
	va_end(args);
}

void log_warn(const char *format, ...)
{
	va_list args;

	va_start(args, format);
	write_line(format, args);
	va_end(args);
}
