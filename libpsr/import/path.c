#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdlib.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>
#include "import.h"

static int read_all(uint8_t *bytes, size_t *n_bytes, int fd)
{
	size_t n = 0;
	while (n < *n_bytes) {
		ssize_t got = read(fd, bytes + n, *n_bytes - n < (1u << 30) ? *n_bytes - n : (1u << 30));
		if (got < 0 && errno == EINTR)
			continue;
		if (got < 0)
			return -1;
		if (got == 0)
			break;
		n += (size_t)got;
	}
	*n_bytes = n;
	return 0;
}

int import_file_read(uint8_t **bytes, size_t *n_bytes, const char *path, uint64_t max_bytes, struct psr_error *err)
{
	struct stat st;
	uint8_t *buffer;
	size_t n;
	/* O_NONBLOCK: opening a pipe without a writer would wait for one. */
	int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
	if (fd < 0)
		return psr_fail(err, errno == ENOENT || errno == ENOTDIR ? PSR_ERR_NOT_FOUND : PSR_ERR_IO, "%s: %s", path,
		                strerror(errno));
	if (fstat(fd, &st) != 0 || !S_ISREG(st.st_mode)) {
		close(fd);
		return psr_fail(err, PSR_ERR_IO, "%s: not a regular file", path);
	}
	if ((uint64_t)st.st_size > max_bytes) {
		close(fd);
		return psr_fail(err, PSR_ERR_LIMIT, "%s: has %lld bytes; the limit is %llu", path, (long long)st.st_size,
		                (unsigned long long)max_bytes);
	}
	n = (size_t)st.st_size;
	buffer = malloc(n > 0 ? n : 1);
	if (buffer == NULL) {
		close(fd);
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for %zu bytes", path, n);
	}
	if (read_all(buffer, &n, fd) != 0) {
		int saved = errno;
		free(buffer);
		close(fd);
		return psr_fail(err, PSR_ERR_IO, "%s: cannot read: %s", path, strerror(saved));
	}
	close(fd);
	*bytes = buffer;
	*n_bytes = n;
	return PSR_OK;
}

int import_path_ends_with(const char *path, const char *ending)
{
	const size_t n = strlen(path), m = strlen(ending);
	return n >= m && strcasecmp(path + n - m, ending) == 0;
}

int import_path_folder(char **folder, const char *path, struct psr_error *err)
{
	const char *slash = strrchr(path, '/');
	char *name, *resolved;
	name = slash == NULL ? strdup(".") : slash == path ? strdup("/") : strndup(path, (size_t)(slash - path));
	if (name == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for its path", path);
	resolved = realpath(name, NULL);
	free(name);
	if (resolved == NULL)
		return psr_fail(err, PSR_ERR_IO, "%s: cannot resolve its folder: %s", path, strerror(errno));
	if (strcmp(resolved, "/") == 0)
		resolved[0] = '\0';
	*folder = resolved;
	return PSR_OK;
}

int import_path_inside(char **out, const char *folder, const char *name, struct psr_error *err)
{
	size_t n = strlen(folder);
	char *joined, *resolved;
	if (name[0] == '\0')
		return psr_fail(err, PSR_ERR_FORMAT, "names a file by an empty string");
	if (name[0] == '/')
		joined = strdup(name);
	else if (asprintf(&joined, "%s/%s", folder, name) < 0)
		joined = NULL;
	if (joined == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a path");
	resolved = realpath(joined, NULL);
	free(joined);
	if (resolved == NULL)
		return psr_fail(err, PSR_ERR_NOT_FOUND, "names \"%s\", which is not in its folder: %s", name,
		                strerror(errno));
	if (strncmp(resolved, folder, n) != 0 || resolved[n] != '/') {
		free(resolved);
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "names \"%s\", outside of its own folder; copy it into the folder",
		                name);
	}
	*out = resolved;
	return PSR_OK;
}
