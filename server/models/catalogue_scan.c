#define _GNU_SOURCE
#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include "catalogue.h"
#include "formats.h"
#include "server/log.h"
#include "parts.h"
#include "psr/model.h"

/* In order of preference. */
static const char *const endings[] = {
	"psr", "glb", "gltf", "3ds", "3mf", "ac", "amf", "dae", "fbx", "iges", "igs", "las", "lwo", "obj", "off", "pcd", "ply",
	"pts", "ptx", "step", "stl", "stp", "x", "xyz",
};
#define N_ENDINGS (sizeof endings / sizeof endings[0])

struct list {
	struct catalogue_file *file;
	size_t n, capacity;
	size_t n_root; /* length of the models folder's part of paths */
};

void catalogue_file_fini(struct catalogue_file *file)
{
	free(file->path);
	free(file->reason);
	file->path = file->reason = NULL;
}

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

int catalogue_is_cloud(const char *file_name)
{
	static const char *const clouds[] = { "las", "pcd", "pts", "ptx", "xyz" };
	const size_t ending = find_ending(file_name);
	int is_cloud = 0;

	for (size_t i = 0; i < sizeof clouds / sizeof clouds[0] && ending < N_ENDINGS; i++)
		is_cloud |= strcmp(endings[ending], clouds[i]) == 0;
	return is_cloud;
}

/* A valid name is one that LIST_ENTRY can carry. */
static int is_clean(const char *name)
{
	struct psr_msg_open msg = { .resolution = 0 };
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
		catalogue_file_fini(&list->file[i]);
	free(list->file);
	*list = (struct list){ .n_root = list->n_root };
}

/* Takes the file, even if it returns MEMORY. */
static int add(struct list *list, struct catalogue_file *file)
{
	if (list->n == list->capacity) {
		size_t capacity = list->capacity > 0 ? 2 * list->capacity : 16;
		struct catalogue_file *grown = realloc(list->file, capacity * sizeof *grown);

		if (grown == NULL) {
			catalogue_file_fini(file);
			return PSR_ERR_MEMORY;
		}
		list->file = grown;
		list->capacity = capacity;
	}
	list->file[list->n++] = *file;
	return PSR_OK;
}

/* Makes a clean name of the first n bytes of a text. */
static void set_name(char name[PSR_WIRE_MAX_NAME + 1], const char *text, size_t n)
{
	n = n < PSR_WIRE_MAX_NAME ? n : PSR_WIRE_MAX_NAME;
	memcpy(name, text, n);
	name[n] = '\0';
	for (size_t i = 0; !is_clean(name) && i < n; i++)
		if (name[i] < ' ' || name[i] > '~')
			name[i] = '?';
}

/* Gives a file the reason "PATH: text", with PATH within the models folder; a file without a name gets PATH as its
 * name. */
static int set_reason(const struct list *list, struct catalogue_file *file, const char *text)
{
	const char *relative = file->path + list->n_root;

	if (file->name[0] == '\0')
		set_name(file->name, relative, strlen(relative));
	if (asprintf(&file->reason, "%.200s: %s", relative, text) < 0)
		file->reason = NULL;
	return file->reason != NULL ? PSR_OK : PSR_ERR_MEMORY;
}

static int is_candidate(const char *file_name)
{
	size_t stem;

	return find_ending(file_name) < N_ENDINGS || formats_advice(file_name, &stem) != NULL;
}

/* Adds a regular file. Returns 0 or MEMORY; takes path. */
static int consider(struct list *list, const char *file_name, char *path, const struct stat *status, int is_nested)
{
	size_t ending = find_ending(file_name), stem = 0;
	const char *advice = ending == N_ENDINGS ? formats_advice(file_name, &stem) : NULL;
	struct catalogue_file file = {
		.path = path, .is_source = ending > 0, .is_nested = is_nested, .bytes = (uint64_t)status->st_size,
		.device = status->st_dev, .inode = status->st_ino,
		.modified_ns = (int64_t)status->st_mtim.tv_sec * 1000000000 + status->st_mtim.tv_nsec,
	};
	struct parts parts;
	uint64_t need;

	if (advice == NULL)
		stem = (size_t)(strrchr(file_name, '.') - file_name);
	if (stem <= PSR_WIRE_MAX_NAME)
		memcpy(file.name, file_name, stem);
	if (!is_clean(file.name)) {
		file.name[0] = '\0';
		advice = "the name of the file is not UTF-8 without control characters, so no client can ask for it; rename it";
	}
	if (advice == NULL && file.is_source) {
		parts_find(&parts, path);
		file.bytes += parts.bytes;
	}
	if (advice != NULL && set_reason(list, &file, advice) != PSR_OK) {
		free(path);
		return PSR_ERR_MEMORY;
	}
	file.beginnings = ending == 0 && advice == NULL ? psr_model_beginnings(path) : 0;
	file.is_broken = ending == 0 && advice == NULL && psr_model_need(&need, path, 0, NULL) != PSR_OK;
	return add(list, &file);
}

static int read_folder(struct list *list, const char *folder, int is_nested, struct psr_error *err);

/* Adds a subfolder that holds several models, `first` and `other` among them, as one entry. Returns 0 or MEMORY. */
static int add_folder(struct list *list, const char *path, const char *first, const char *other)
{
	struct catalogue_file file = { .path = strdup(path), .is_nested = 1 };
	char text[PSR_ERROR_TEXT];

	snprintf(text, sizeof text,
	         "the folder holds several models (%.60s, %.60s); move each into the models folder, or into a folder of "
	         "its own there", first, other);
	if (file.path == NULL || set_reason(list, &file, text) != PSR_OK) {
		free(file.path);
		return PSR_ERR_MEMORY;
	}
	return add(list, &file);
}

/* Counts those files of a subfolder that psr can read, or all files if it can read none. If they are not one model,
 * skips the folder with a reason. */
static int take_subfolder(struct list *list, const char *path, struct list *inner)
{
	size_t n_read = 0, n;

	for (size_t i = 0; i < inner->n; i++) {
		if (inner->file[i].reason == NULL) {
			struct catalogue_file file = inner->file[n_read];

			inner->file[n_read++] = inner->file[i];
			inner->file[i] = file;
		}
	}
	n = n_read > 0 ? n_read : inner->n;
	for (size_t i = 1; i < n; i++)
		if (strcmp(inner->file[i].name, inner->file[0].name) != 0)
			return add_folder(list, path, inner->file[0].name, inner->file[i].name);
	for (size_t i = 0; i < n; i++) {
		struct catalogue_file file = inner->file[i];

		inner->file[i].path = inner->file[i].reason = NULL;
		if (add(list, &file) != PSR_OK)
			return PSR_ERR_MEMORY;
	}
	return PSR_OK;
}

static int read_subfolder(struct list *list, const char *path, struct psr_error *err)
{
	struct list inner = { .n_root = list->n_root };
	struct psr_error reason;
	int code = read_folder(&inner, path, 1, &reason);

	if (code == PSR_ERR_MEMORY || code == PSR_ERR_LIMIT) {
		clear(&inner);
		return psr_fail(err, code, "%s", reason.text);
	}
	if (code != PSR_OK)
		log_warn("%s", reason.text);
	code = take_subfolder(list, path, &inner);
	clear(&inner);
	return code == PSR_OK ? PSR_OK : psr_fail(err, code, "no memory for the models folder");
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
		return PSR_OK; /* it has been removed, or is a dangling link */
	}
	if (S_ISREG(status.st_mode) && is_candidate(file_name)) {
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

/* Sorts by name, and within a name puts the preferred file first. */
static int compare(const void *a, const void *b)
{
	const struct catalogue_file *x = a, *y = b;
	size_t x_ending = find_ending(x->path), y_ending = find_ending(y->path);
	int order = strcmp(x->name, y->name);

	if (order == 0)
		order = (x->reason != NULL) - (y->reason != NULL);
	if (order == 0)
		order = x->is_source - y->is_source;
	if (order == 0)
		order = x->is_nested - y->is_nested;
	if (order == 0)
		order = (x_ending > y_ending) - (x_ending < y_ending);
	return order != 0 ? order : strcmp(x->path, y->path);
}

/* Of two files of one kind with one name the later one stays under its path, with a reason. The source of a .psr, and
 * files that were converted, are left out. */
static int is_clash(const struct catalogue_file *taken, const struct catalogue_file *file)
{
	return file->reason == NULL && taken->is_source == file->is_source;
}

static int rename_clash(const struct list *list, const struct catalogue_file *taken, struct catalogue_file *file)
{
	char text[PSR_ERROR_TEXT];

	snprintf(text, sizeof text, "another file, %.120s, is the model `%.120s`; rename one of them",
	         taken->path + list->n_root, taken->name);
	memset(file->name, 0, sizeof file->name);
	return set_reason(list, file, text);
}

/* Keeps one file for each name, sorted. */
static int settle(struct list *list)
{
	size_t n = 0, taken = 0, n_clashes = 0;

	if (list->n == 0)
		return PSR_OK;
	qsort(list->file, list->n, sizeof *list->file, compare);
	for (size_t i = 0; i < list->n; i++) {
		struct catalogue_file *file = &list->file[i];

		if (i == 0 || strcmp(list->file[taken].name, file->name) != 0) {
			taken = n;
		} else if (is_clash(&list->file[taken], file)) {
			if (rename_clash(list, &list->file[taken], file) != PSR_OK)
				return PSR_ERR_MEMORY;
			n_clashes++;
		} else {
			catalogue_file_fini(file);
			continue;
		}
		if (n != i) {
			list->file[n] = *file;
			file->path = file->reason = NULL;
		}
		n++;
	}
	list->n = n;
	return n_clashes > 0 ? settle(list) : PSR_OK; /* settles at once, as entries with a reason never clash */
}

/* Takes the files. Returns NULL without memory. */
static struct catalogue_listing *create_listing(struct list *list)
{
	struct catalogue_listing *listing = malloc(sizeof *listing);
	struct catalogue_entry *entry = calloc(list->n > 0 ? list->n : 1, sizeof *entry);

	if (listing == NULL || entry == NULL) {
		free(listing);
		free(entry);
		return NULL;
	}
	for (size_t i = 0; i < list->n; i++) {
		entry[i].file = list->file[i];
		entry[i].has_failed = entry[i].file.is_broken || entry[i].file.reason != NULL;
	}
	*listing = (struct catalogue_listing){ .entry = entry, .n = list->n };
	list->n = 0;
	return listing;
}

int catalogue_scan(struct catalogue_listing **out, const char *folder, struct psr_error *err)
{
	struct catalogue_listing *listing;
	struct list list = { .n_root = strlen(folder) + 1 };
	int code = read_folder(&list, folder, 0, err);

	if (code == PSR_OK && settle(&list) != PSR_OK)
		code = psr_fail(err, PSR_ERR_MEMORY, "no memory for the models folder");
	if (code != PSR_OK) {
		clear(&list);
		return code;
	}
	listing = create_listing(&list);
	clear(&list);
	if (listing == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for the models folder");
	*out = listing;
	return PSR_OK;
}

void catalogue_listing_destroy(struct catalogue_listing *listing)
{
	if (listing == NULL)
		return;
	for (size_t i = 0; i < listing->n; i++)
		catalogue_file_fini(&listing->entry[i].file);
	free(listing->entry);
	free(listing);
}
