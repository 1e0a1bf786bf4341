/* A folder of a test's own. Include after cmocka.h. */
#ifndef TESTS_UNIT_LIB_FOLDER_H
#define TESTS_UNIT_LIB_FOLDER_H

#include <dirent.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char folder[32];

static inline int make_folder(void **state)
{
	(void)state;
	strcpy(folder, "/tmp/psr-unit-XXXXXX");
	return mkdtemp(folder) == NULL;
}

/* The path of a file in it; valid until the next call but three. */
static inline const char *in_folder(const char *name)
{
	static char path[4][PATH_MAX];
	static int at;

	at = (at + 1) % 4;
	snprintf(path[at], sizeof path[at], "%s/%s", folder, name);
	return path[at];
}

static inline int count_files(void)
{
	DIR *dir = opendir(folder);
	int n = -2; /* . and .. */

	assert_non_null(dir);
	while (readdir(dir) != NULL)
		n++;
	closedir(dir);
	return n;
}

static inline int remove_folder(void **state)
{
	DIR *dir = opendir(folder);

	(void)state;
	for (struct dirent *entry; (entry = readdir(dir)) != NULL;)
		remove(in_folder(entry->d_name));
	closedir(dir);
	return rmdir(folder);
}

static inline void write_file(const char *name, const void *bytes, size_t n)
{
	FILE *file = fopen(in_folder(name), "wb");

	assert_non_null(file);
	assert_int_equal(fwrite(bytes, 1, n, file), n);
	assert_int_equal(fclose(file), 0);
}

/* At most `size` bytes; returns how many there are. */
static inline size_t read_file(const char *name, void *to, size_t size)
{
	FILE *file = fopen(in_folder(name), "rb");
	size_t n;

	assert_non_null(file);
	n = fread(to, 1, size, file);
	fclose(file);
	return n;
}

#endif
