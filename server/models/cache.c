#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "cache.h"

#define ADVICE "models are built into it from meshes and scans; give psrd a folder that it may write: --cache DIR"

int cache_make(const char *folder, struct psr_error *err)
{
	char *copy = strdup(folder);

	if (folder[0] == '\0') {
		free(copy);
		return psr_fail(err, PSR_ERR_IO, "the cache folder has an empty name; " ADVICE);
	}
	if (copy == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory");
	for (char *at = copy + 1;; at++) {
		if (*at == '/' || *at == '\0') {
			char was = *at;

			*at = '\0';
			if (mkdir(copy, 0700) != 0 && errno != EEXIST) {
				int code = psr_fail(err, PSR_ERR_IO, "the cache folder %.200s cannot be made: %s: %s; " ADVICE, folder,
				                    copy, strerror(errno));

				free(copy);
				return code;
			}
			*at = was;
			if (was == '\0')
				break;
		}
	}
	free(copy);
	return PSR_OK;
}

int cache_check(const char *folder, struct psr_error *err)
{
	char *path;
	int code = cache_make(folder, err), fd;

	if (code != PSR_OK)
		return code;
	if (asprintf(&path, "%s/.writable-XXXXXX", folder) < 0)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory");
	fd = mkostemp(path, O_CLOEXEC);
	if (fd < 0)
		code = psr_fail(err, PSR_ERR_IO, "the cache folder %.200s cannot be written: %s; " ADVICE, folder, strerror(errno));
	else if (write(fd, "", 1) != 1)
		code = psr_fail(err, PSR_ERR_IO, "the cache folder %.200s takes no file: %s; " ADVICE, folder, strerror(errno));
	if (fd >= 0) {
		close(fd);
		unlink(path);
	}
	free(path);
	return code;
}
