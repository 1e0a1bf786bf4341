#define _GNU_SOURCE
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>
#include "cachekey.h"
#include "parts.h"

#define MAX_NEIGHBOURS 10000
#define MAX_DEPTH 4
#define READ_BYTES 262144

struct neighbours {
	char **line;
	size_t n, capacity;
	const char *own; /* file name of the source */
};

static int hash_file(XXH3_state_t *state, const char *path, struct psr_error *err)
{
	int fd = open(path, O_RDONLY | O_CLOEXEC);
	char *bytes = malloc(READ_BYTES);
	ssize_t n = -1;
	int code = PSR_OK;

	if (fd >= 0 && bytes != NULL)
		while ((n = read(fd, bytes, READ_BYTES)) > 0 || (n < 0 && errno == EINTR))
			if (n > 0)
				XXH3_128bits_update(state, bytes, (size_t)n);
	if (n != 0)
		code = psr_fail(err, errno == ENOENT ? PSR_ERR_NOT_FOUND : PSR_ERR_IO, "%s: %s", path, strerror(errno));
	if (fd >= 0)
		close(fd);
	free(bytes);
	return code;
}

/* Files of the first formats never name other files, and the others seldom do. */
static int is_alone(const char *source)
{
	static const char *const endings[] = { ".stl", ".off", ".las", ".pcd", ".pts", ".ptx", ".xyz",
		                                      ".step", ".stp", ".iges", ".igs", ".glb", ".ply" };
	const char *dot = strrchr(source, '.');
	enum { NEVER = 11 };
	struct parts parts;
	size_t i = 0;

	while (dot != NULL && i < sizeof endings / sizeof endings[0] && strcasecmp(dot, endings[i]) != 0)
		i++;
	if (dot == NULL || i == sizeof endings / sizeof endings[0])
		return 0;
	if (i < NEVER)
		return 1;
	parts_find(&parts, source);
	return parts.n_named == 0;
}

static int is_model(const char *name)
{
	const char *dot = strrchr(name, '.');

	return catalogue_is_source(name) || (dot != NULL && strcasecmp(dot, ".psr") == 0);
}

static int add(struct neighbours *list, const char *relative, const struct stat *status)
{
	char *line;

	if (list->n == MAX_NEIGHBOURS)
		return PSR_ERR_LIMIT;
	if (list->n == list->capacity) {
		size_t capacity = list->capacity > 0 ? 2 * list->capacity : 64;
		char **grown = realloc(list->line, capacity * sizeof *grown);

		if (grown == NULL)
			return PSR_ERR_MEMORY;
		list->line = grown;
		list->capacity = capacity;
	}
	if (asprintf(&line, "%s\t%jd\t%jd.%09ld", relative, (intmax_t)status->st_size, (intmax_t)status->st_mtim.tv_sec,
	             status->st_mtim.tv_nsec) < 0)
		return PSR_ERR_MEMORY;
	list->line[list->n++] = line;
	return PSR_OK;
}

static int collect(struct neighbours *list, const char *folder, const char *prefix, int depth)
{
	DIR *dir = opendir(folder);
	struct dirent *item;
	int code = PSR_OK;

	if (dir == NULL)
		return depth == 0 ? PSR_ERR_IO : PSR_OK;
	while (code == PSR_OK && (item = readdir(dir)) != NULL) {
		char *path = NULL, *relative = NULL;
		struct stat status;

		if (item->d_name[0] == '.' || (depth == 0 && strcmp(item->d_name, list->own) == 0))
			continue;
		if (asprintf(&path, "%s/%s", folder, item->d_name) < 0)
			path = NULL;
		if (asprintf(&relative, "%s%s", prefix, item->d_name) < 0)
			relative = NULL;
		if (path == NULL || relative == NULL)
			code = PSR_ERR_MEMORY;
		else if (stat(path, &status) == 0 && S_ISREG(status.st_mode) && !is_model(item->d_name))
			code = add(list, relative, &status);
		else if (stat(path, &status) == 0 && S_ISDIR(status.st_mode) && depth < MAX_DEPTH) {
			char *deeper = NULL;

			code = asprintf(&deeper, "%s/", relative) < 0 ? PSR_ERR_MEMORY : collect(list, path, deeper, depth + 1);
			free(deeper);
		}
		free(path);
		free(relative);
	}
	closedir(dir);
	return code;
}

static int compare(const void *a, const void *b)
{
	return strcmp(*(char *const *)a, *(char *const *)b);
}

static int hash_neighbours(XXH3_state_t *state, const char *source, struct psr_error *err)
{
	const char *slash = strrchr(source, '/');
	char *folder = slash != NULL ? strndup(source, (size_t)(slash - source)) : strdup(".");
	struct neighbours list = { .own = slash != NULL ? slash + 1 : source };
	int code = folder != NULL ? collect(&list, folder[0] != '\0' ? folder : "/", "", 0) : PSR_ERR_MEMORY;

	if (code == PSR_OK && list.n > 0)
		qsort(list.line, list.n, sizeof *list.line, compare);
	for (size_t i = 0; i < list.n; i++) {
		XXH3_128bits_update(state, list.line[i], strlen(list.line[i]) + 1);
		free(list.line[i]);
	}
	free(list.line);
	free(folder);
	if (code == PSR_ERR_LIMIT)
		return psr_fail(err, code, "%s: more than %d files lie beside it; give it a folder of its own", source,
		                MAX_NEIGHBOURS);
	return code == PSR_OK ? PSR_OK : psr_fail(err, code, "%s: its folder cannot be read", source);
}

int cachekey_find(char key[CATALOGUE_KEY], const char *source, const char *builder, struct psr_error *err)
{
	static const char version[] = "psr built model 2, psrd " PSR_VERSION;
	const char *dot = strrchr(source, '.');
	XXH3_state_t *state = XXH3_createState();
	XXH128_hash_t hash;
	int code;

	if (state == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory");
	XXH3_128bits_reset(state);
	XXH3_128bits_update(state, version, sizeof version);
	if (dot != NULL)
		XXH3_128bits_update(state, dot, strlen(dot) + 1);
	code = hash_file(state, builder, err);
	if (code == PSR_OK)
		code = hash_file(state, source, err);
	if (code == PSR_OK && !is_alone(source))
		code = hash_neighbours(state, source, err);
	hash = XXH3_128bits_digest(state);
	XXH3_freeState(state);
	if (code == PSR_OK)
		snprintf(key, CATALOGUE_KEY, "%016" PRIx64 "%016" PRIx64, (uint64_t)hash.high64, (uint64_t)hash.low64);
	return code;
}
