#define _GNU_SOURCE
#include <stdarg.h>
#include <stdio.h>
#include <time.h>
#include <unistd.h>
#include "log.h"

static int is_verbose;

void log_set_verbose(int verbose)
{
	is_verbose = verbose;
}

/* One write a line, so that lines of several threads do not mix. Control characters may come from outside. */
static void write_line(const char *format, va_list args)
{
	char line[1024];
	struct timespec now;
	struct tm tm;
	size_t n;
	int written;

	clock_gettime(CLOCK_REALTIME, &now);
	gmtime_r(&now.tv_sec, &tm);
	n = strftime(line, sizeof line, "%Y-%m-%dT%H:%M:%S", &tm);
	n += (size_t)snprintf(line + n, sizeof line - n, ".%03ldZ psrd: ", now.tv_nsec / 1000000);
	written = vsnprintf(line + n, sizeof line - n - 1, format, args);
	if (written > 0)
		n += (size_t)written < sizeof line - n - 1 ? (size_t)written : sizeof line - n - 2;
	for (size_t i = 0; i < n; i++)
		if ((unsigned char)line[i] < ' ' || line[i] == 127)
			line[i] = '?';
	line[n++] = '\n';
	if (write(STDERR_FILENO, line, n) < 0)
		return; /* nobody is left to be told, and no client is to notice */
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
