#define _GNU_SOURCE
#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include "catalogue.h"
#include "log.h"
#include "parts.h"

/* In order of preference. */
static const char *const endings[] = {
	"psr", "glb", "gltf", "3ds", "3mf", "ac", "amf", "dae", "fbx", "las", "lwo", "obj", "off", "ply", "stl", "x",
};
#define N_ENDINGS (sizeof endings / sizeof endings[0])

struct list {
	struct catalogue_file *file;
	size_t n, capacity;
};

static size_t find_ending(const char *file_name)
{
	const char *dot = strrchr(file_name, '.');
	size_t i = 0;

	if (dot == NULL || dot == file_name)
		return N_ENDINGS;
	while (i < N_ENDINGS && strcasecmp(dot + 1, endings[i]) != 0)
		i++;
	return i;
}

int catalogue_is_source(const char *file_name)
{
	size_t i = find_ending(file_name);

	return i > 0 && i < N_ENDINGS;
}

/* Names travel in LIST_ENTRY, so whatever it takes is a name. */
static int is_clean(const char *name)
{
	struct psr_msg_open msg;
	uint8_t bytes[512];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };

	if (name[0] == '\0' || strlen(name) > PSR_WIRE_MAX_NAME)
		return 0;
	strcpy(msg.name, name);
	return psr_msg_open_encode(&buf, 1, &msg, NULL) == PSR_OK;
}

static void clear(struct list *list)
{
	for (size_t i = 0; i < list->n; i++)
		free(list->file[i].path);
	free(list->file);
	*list = (struct list){ 0 };
}

static int add(struct list *list, const struct catalogue_file *file)
{
	if (list->n == list->capacity) {
		size_t capacity = list->capacity > 0 ? 2 * list->capacity : 16;
		struct catalogue_file *grown = realloc(list->file, capacity * sizeof *grown);

		if (grown == NULL)
			return PSR_ERR_MEMORY;
		list->file = grown;
		list->capacity = capacity;
	}
	list->file[list->n++] = *file;
	return PSR_OK;
}

/* A regular file with a known ending becomes a candidate; 0 or MEMORY. */
static int consider(struct list *list, const char *file_name, char *path, const struct stat *status, int is_nested)
{
	size_t ending = find_ending(file_name), stem = (size_t)(strrchr(file_name, '.') - file_name);
	struct catalogue_file file = {
		.path = path, .is_source = ending > 0, .is_nested = is_nested, .bytes = (uint64_t)status->st_size,
		.device = status->st_dev, .inode = status->st_ino,
		.modified_ns = (int64_t)status->st_mtim.tv_sec * 1000000000 + status->st_mtim.tv_nsec,
	};

	struct parts parts;

	if (stem <= PSR_WIRE_MAX_NAME)
		memcpy(file.name, file_name, stem);
	if (!is_clean(file.name)) {
		log_warn("%s: passed over: its name is not UTF-8 of 1 to 255 bytes without control characters", path);
		free(path);
		return PSR_OK;
	}
	if (file.is_source) {
		parts_find(&parts, path);
		file.bytes += parts.bytes;
	}
	if (add(list, &file) != PSR_OK) {
		free(path);
		return PSR_ERR_MEMORY;
	}
	return PSR_OK;
}

static int read_folder(struct list *list, const char *folder, int is_nested, struct psr_error *err);

static int read_subfolder(struct list *list, const char *path, struct psr_error *err)
{
	struct list inner = { 0 };
	struct psr_error reason;
	int code = read_folder(&inner, path, 1, &reason), same = 1;

	if (code == PSR_ERR_MEMORY || code == PSR_ERR_LIMIT) {
		clear(&inner);
		return psr_fail(err, code, "%s", reason.text);
	}
	if (code != PSR_OK)
		log_warn("%s", reason.text);
	for (size_t i = 1; i < inner.n; i++)
		same &= strcmp(inner.file[i].name, inner.file[0].name) == 0;
	if (!same)
		log_info("%s: passed over: it holds several models", path);
	for (size_t i = 0; same && i < inner.n; i++) {
		if (add(list, &inner.file[i]) != PSR_OK) {
			clear(&inner);
			return psr_fail(err, PSR_ERR_MEMORY, "no memory for the models folder");
		}
		inner.file[i].path = NULL;
	}
	clear(&inner);
	return PSR_OK;
}

static int read_one(struct list *list, const char *folder, const char *file_name, int is_nested, struct psr_error *err)
{
	struct stat status;
	char *path;
	int code = PSR_OK;

	if (asprintf(&path, "%s/%s", folder, file_name) < 0)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for the models folder");
	if (stat(path, &status) != 0) {
		free(path);
		return PSR_OK; /* gone between the listing and now, or a link that leads nowhere */
	}
	if (S_ISREG(status.st_mode) && find_ending(file_name) < N_ENDINGS) {
		if (list->n >= CATALOGUE_MAX_FILES) {
			free(path);
			return psr_fail(err, PSR_ERR_LIMIT, "%s: more than %d model files", folder, CATALOGUE_MAX_FILES);
		}
		if (consider(list, file_name, path, &status, is_nested) != PSR_OK)
			return psr_fail(err, PSR_ERR_MEMORY, "no memory for the models folder");
		return PSR_OK;
	}
	if (S_ISDIR(status.st_mode) && !is_nested)
		code = read_subfolder(list, path, err);
	free(path);
	return code;
}

static int read_folder(struct list *list, const char *folder, int is_nested, struct psr_error *err)
{
	DIR *dir = opendir(folder);
	struct dirent *item;
	int code = PSR_OK;

	if (dir == NULL)
		return psr_fail(err, errno == ENOENT ? PSR_ERR_NOT_FOUND : PSR_ERR_IO, "models folder %s: %s", folder,
		                strerror(errno));
	while (code == PSR_OK && (errno = 0, item = readdir(dir)) != NULL)
		if (item->d_name[0] != '.')
			code = read_one(list, folder, item->d_name, is_nested, err);
	if (code == PSR_OK && errno != 0)
		code = psr_fail(err, PSR_ERR_IO, "models folder %s: %s", folder, strerror(errno));
	closedir(dir);
	return code;
}

/* By name, and within a name the preferred file first. */
static int compare(const void *a, const void *b)
{
	const struct catalogue_file *x = a, *y = b;
	size_t x_ending = find_ending(x->path), y_ending = find_ending(y->path);
	int order = strcmp(x->name, y->name);

	if (order == 0)
		order = x->is_source - y->is_source;
	if (order == 0)
		order = x->is_nested - y->is_nested;
	if (order == 0)
		order = (x_ending > y_ending) - (x_ending < y_ending);
	return order != 0 ? order : strcmp(x->path, y->path);
}

static void remove_doubles(struct list *list)
{
	size_t n = 0;

	for (size_t i = 0; i < list->n; i++) {
		if (n > 0 && strcmp(list->file[n - 1].name, list->file[i].name) == 0) {
			if (list->file[n - 1].is_source == list->file[i].is_source)
				log_warn("%s: passed over: %s has the same name", list->file[i].path, list->file[n - 1].path);
			free(list->file[i].path);
		} else {
			list->file[n++] = list->file[i];
		}
	}
	list->n = n;
}

int catalogue_scan(struct catalogue_listing **out, const char *folder, struct psr_error *err)
{
	struct catalogue_listing *listing;
	struct list list = { 0 };
	int code = read_folder(&list, folder, 0, err);

	if (code != PSR_OK) {
		clear(&list);
		return code;
	}
	listing = malloc(sizeof *listing);
	if (listing == NULL) {
		clear(&list);
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for the models folder");
	}
	if (list.n > 0)
		qsort(list.file, list.n, sizeof *list.file, compare);
	remove_doubles(&list);
	*listing = (struct catalogue_listing){ .file = list.file, .n = list.n };
	*out = listing;
	return PSR_OK;
}

void catalogue_listing_destroy(struct catalogue_listing *listing)
{
	if (listing == NULL)
		return;
	for (size_t i = 0; i < listing->n; i++)
		free(listing->file[i].path);
	free(listing->file);
	free(listing);
}
