#define _GNU_SOURCE
#include <errno.h>
#include <limits.h>
#include <stdlib.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>
#include "import.h"

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
