#define _GNU_SOURCE
#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>
#include "cache.h"
#include "server/log.h"

#define ADVICE "models are built into it from meshes and scans; give psrd a folder that it may write: --cache DIR"

/* Whoever can write to the folder can put any model there under any key. */
static int check_owner(const char *folder, struct psr_error *err)
{
	struct stat status;

	if (stat(folder, &status) != 0)
		return psr_fail(err, PSR_ERR_IO, "the cache folder %.200s cannot be read: %s; " ADVICE, folder, strerror(errno));
	if (status.st_uid != geteuid())
		return psr_fail(err, PSR_ERR_IO, "the cache folder %.200s belongs to user %ju, and psrd runs as %ju: models there "
		                "could be anybody's; " ADVICE, folder, (uintmax_t)status.st_uid, (uintmax_t)geteuid());
	if ((status.st_mode & (S_IWGRP | S_IWOTH)) != 0)
		return psr_fail(err, PSR_ERR_IO, "the cache folder %.200s has mode %04o: others may write to it, and models there "
		                "could be anybody's; run chmod go-w on it, or give psrd another folder: --cache DIR", folder,
		                (unsigned)status.st_mode & 07777);
	return PSR_OK;
}

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
	return check_owner(folder, err);
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

char *cache_path(const char *folder, const char *key, uint32_t resolution)
{
	char *path;

	return asprintf(&path, "%s/%s-%" PRIu32 ".psr", folder, key, resolution) < 0 ? NULL : path;
}

char *cache_model_path(const char *folder, const struct catalogue_model *model)
{
	if (model->key[0] != '\0')
		return cache_path(folder, model->key, model->resolution);
	return model->entry != NULL ? strdup(model->entry->file.path) : NULL;
}

int cache_find(uint64_t *bytes, const char *path)
{
	struct stat status;

	if (lstat(path, &status) != 0 || !S_ISREG(status.st_mode) || status.st_uid != geteuid())
		return 0;
	*bytes = (uint64_t)status.st_size;
	psr_model_need(bytes, path, 0, NULL); /* if that fails the size stays */
	return 1;
}

void cache_touch(const char *path)
{
	utimensat(AT_FDCWD, path, NULL, AT_SYMLINK_NOFOLLOW);
}

/* ---- the size ---- */

#define KEY_LENGTH (CATALOGUE_KEY - 1)
#define LEFT_OVER_S 86400 /* seconds since the last byte was written; a younger file may belong to a running build */

struct cached {
	char name[64];
	struct timespec used;
	uint64_t bytes;
};

struct cached_list {
	struct cached *file;
	size_t n, capacity;
	uint64_t bytes;
};

/* 32 hexadecimal digits, a dash, a number, .psr */
static int is_built(const char *name)
{
	const char *at = name + KEY_LENGTH;

	if (strspn(name, "0123456789abcdef") != KEY_LENGTH || *at++ != '-' || !isdigit((unsigned char)*at))
		return 0;
	return strcmp(at + strspn(at, "0123456789"), ".psr") == 0;
}

/* Whether it is a temporary file of psr-model or of an opening. */
static int is_left_over(const char *name)
{
	const size_t n = strlen(name);

	return (strncmp(name, ".psr-", 5) == 0 || strncmp(name, ".built-", 7) == 0) && n > 4
	       && strcmp(name + n - 4, ".tmp") == 0;
}

static int is_kept(const char *name, const char (*key)[CATALOGUE_KEY], size_t n)
{
	for (size_t i = 0; i < n; i++)
		if (strncmp(name, key[i], KEY_LENGTH) == 0)
			return 1;
	return 0;
}

static int list_file(struct cached_list *list, const char *name, const struct stat *status)
{
	if (list->n == list->capacity) {
		const size_t capacity = list->capacity > 0 ? 2 * list->capacity : 64;
		struct cached *grown = realloc(list->file, capacity * sizeof *grown);

		if (grown == NULL)
			return PSR_ERR_MEMORY;
		list->file = grown;
		list->capacity = capacity;
	}
	list->file[list->n] = (struct cached){ .used = status->st_mtim, .bytes = (uint64_t)status->st_size };
	snprintf(list->file[list->n++].name, sizeof list->file->name, "%.*s", (int)sizeof list->file->name - 1, name);
	list->bytes += (uint64_t)status->st_size;
	return PSR_OK;
}

/* Lists the built models, and removes left-overs. */
static void read_cache(struct cached_list *list, DIR *dir)
{
	const time_t now = time(NULL);
	struct dirent *item;
	struct stat status;

	while ((item = readdir(dir)) != NULL) {
		const char *name = item->d_name;

		if ((!is_built(name) && !is_left_over(name)) || strlen(name) >= sizeof list->file->name
		    || fstatat(dirfd(dir), name, &status, AT_SYMLINK_NOFOLLOW) != 0 || !S_ISREG(status.st_mode))
			continue;
		if (!is_built(name)) {
			if (now - status.st_mtim.tv_sec > LEFT_OVER_S)
				unlinkat(dirfd(dir), name, 0);
		} else if (list_file(list, name, &status) != PSR_OK) {
			return;
		}
	}
}

static int compare_use(const void *a, const void *b)
{
	const struct cached *x = a, *y = b;

	if (x->used.tv_sec != y->used.tv_sec)
		return x->used.tv_sec < y->used.tv_sec ? -1 : 1;
	return (x->used.tv_nsec > y->used.tv_nsec) - (x->used.tv_nsec < y->used.tv_nsec);
}

void cache_trim(const char *folder, uint64_t max_bytes, const char (*key)[CATALOGUE_KEY], size_t n)
{
	struct cached_list list = { .n = 0 };
	DIR *dir = opendir(folder);

	if (dir == NULL)
		return;
	read_cache(&list, dir);
	if (list.n > 0)
		qsort(list.file, list.n, sizeof *list.file, compare_use);
	for (size_t i = 0; max_bytes > 0 && i < list.n && list.bytes > max_bytes; i++) {
		if (is_kept(list.file[i].name, key, n) || unlinkat(dirfd(dir), list.file[i].name, 0) != 0)
			continue;
		log_info("cache: %s removed, to keep within --cache-size", list.file[i].name);
		list.bytes -= list.file[i].bytes;
	}
	if (max_bytes > 0 && list.bytes > max_bytes)
		log_warn("the cache holds %.1f MB, more than --cache-size: all of its models are in use",
		         (double)list.bytes * 1e-6);
	free(list.file);
	closedir(dir);
}
