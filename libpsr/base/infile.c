#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "infile.h"

#define MAX_READ (1u << 30)
#define FIRST_READ 4096

static int fail_system(const char *path, struct psr_error *err)
{
	return psr_fail(err, errno == ENOENT || errno == ENOTDIR ? PSR_ERR_NOT_FOUND : PSR_ERR_IO, "%.300s: %s", path,
	                strerror(errno));
}

/* Reads n bytes, fewer only at the end; returns how many, or -1 on failure. */
static ssize_t fill(int fd, void *to, size_t n)
{
	size_t done = 0;

	while (done < n) {
		ssize_t got = read(fd, (char *)to + done, n - done < MAX_READ ? n - done : MAX_READ);

		if (got < 0 && errno == EINTR)
			continue;
		if (got < 0)
			return -1;
		if (got == 0)
			break;
		done += (size_t)got;
	}
	return (ssize_t)done;
}

static int read_regular(uint8_t **bytes, size_t *n_bytes, int fd, const char *path, uint64_t max_bytes,
                        struct psr_error *err)
{
	struct stat st;
	uint8_t *buffer;
	ssize_t n;

	if (fstat(fd, &st) != 0 || !S_ISREG(st.st_mode))
		return psr_fail(err, PSR_ERR_IO, "%.300s: not a regular file", path);
	if ((uint64_t)st.st_size > max_bytes)
		return psr_fail(err, PSR_ERR_LIMIT, "%.300s: %lld bytes, the limit is %llu", path, (long long)st.st_size,
		                (unsigned long long)max_bytes);
	buffer = malloc(st.st_size > 0 ? (size_t)st.st_size : 1);
	if (buffer == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "%.300s: no memory for %lld bytes", path, (long long)st.st_size);
	n = fill(fd, buffer, (size_t)st.st_size);
	if (n < 0) {
		int code = fail_system(path, err);

		free(buffer);
		return code;
	}
	*bytes = buffer;
	*n_bytes = (size_t)n;
	return PSR_OK;
}

int infile_read(uint8_t **bytes, size_t *n_bytes, const char *path, uint64_t max_bytes, struct psr_error *err)
{
	/* O_NONBLOCK: opening a pipe without a writer would wait for one. */
	int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK), code;

	if (fd < 0)
		return fail_system(path, err);
	code = read_regular(bytes, n_bytes, fd, path, max_bytes, err);
	close(fd);
	return code;
}

static int read_stream(char **text, int fd, const char *path, uint64_t max_bytes, struct psr_error *err)
{
	size_t n = 0, capacity = FIRST_READ;

	for (;;) {
		char *grown = realloc(*text, capacity + 1);
		ssize_t got;

		if (grown == NULL)
			return psr_fail(err, PSR_ERR_MEMORY, "%.300s: no memory for %zu bytes", path, capacity);
		*text = grown;
		got = fill(fd, grown + n, capacity - n);
		if (got < 0)
			return fail_system(path, err);
		n += (size_t)got;
		if (n > max_bytes)
			return psr_fail(err, PSR_ERR_LIMIT, "%.300s: more than %llu bytes", path, (unsigned long long)max_bytes);
		if (n < capacity)
			break;
		capacity *= 2;
	}
	(*text)[n] = '\0';
	if (strlen(*text) != n)
		return psr_fail(err, PSR_ERR_FORMAT, "%.300s: not text, byte %zu is 0", path, strlen(*text));
	return PSR_OK;
}

int infile_read_text(char **text, const char *path, uint64_t max_bytes, struct psr_error *err)
{
	int fd = open(path, O_RDONLY | O_CLOEXEC), code;

	if (fd < 0)
		return fail_system(path, err);
	*text = NULL;
	code = read_stream(text, fd, path, max_bytes, err);
	close(fd);
	if (code != PSR_OK) {
		free(*text);
		*text = NULL;
	}
	return code;
}
