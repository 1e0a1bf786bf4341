/* Files that the importer's tests write into a folder of their own. */
#ifndef TESTS_IMPORT_FILES_H
#define TESTS_IMPORT_FILES_H

#include <ftw.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "psr/mesh.h"

static char test_root[512];   /* holds what must not be read */
static char test_folder[576]; /* below it; where the files stand */

static inline int make_folder(void **state)
{
	const char *tmp = getenv("TMPDIR");

	(void)state;
	snprintf(test_root, sizeof test_root, "%s/psr-import.XXXXXX", tmp != NULL ? tmp : "/tmp");
	if (mkdtemp(test_root) == NULL)
		return -1;
	snprintf(test_folder, sizeof test_folder, "%s/in", test_root);
	return mkdir(test_folder, 0777);
}

static inline int remove_one(const char *path, const struct stat *st, int type, struct FTW *ftw)
{
	(void)st, (void)type, (void)ftw;
	return remove(path);
}

static inline int remove_folder(void **state)
{
	(void)state;
	return nftw(test_root, remove_one, 16, FTW_DEPTH | FTW_PHYS);
}

/* A build without Open CASCADE has none. */
static inline int has_cad_module(void)
{
	const char *build = getenv("BUILD");
	char module[600];

	snprintf(module, sizeof module, "%s/lib/psr-cad-occ.so", build != NULL ? build : ".");
	return access(module, R_OK) == 0;
}

/* The path of a file in the folder; valid until the next call but three. */
static inline const char *path_of(const char *name)
{
	static char path[4][1024];
	static int at;

	at = (at + 1) % 4;
	snprintf(path[at], sizeof path[at], "%s/%s", test_folder, name);
	return path[at];
}

static inline void write_bytes(const char *path, const void *bytes, size_t n)
{
	FILE *file = fopen(path, "wb");

	assert_non_null(file);
	assert_int_equal(fwrite(bytes, 1, n, file), n);
	assert_int_equal(fclose(file), 0);
}

/* Writes text in which ' stands for ". */
static inline void write_text(const char *name, const char *text)
{
	char *copy = strdup(text);

	assert_non_null(copy);
	for (char *c = copy; *c != '\0'; c++)
		if (*c == '\'')
			*c = '"';
	write_bytes(path_of(name), copy, strlen(copy));
	free(copy);
}

static inline struct psr_mesh *import(const char *name)
{
	struct psr_mesh *mesh = NULL;
	struct psr_error err = { 0, "" };
	int rc = psr_mesh_import(&mesh, path_of(name), NULL, &err);

	if (rc != PSR_OK)
		fail_msg("%s", err.text);
	assert_non_null(mesh);
	return mesh;
}

/* The import fails with this code, and its text holds these words and the file's name. */
static inline void refuse(const char *name, int code, const char *words)
{
	struct psr_mesh *mesh = (struct psr_mesh *)&code;
	struct psr_error err = { 0, "" };
	int rc = psr_mesh_import(&mesh, path_of(name), NULL, &err);

	if (rc != code || strstr(err.text, words) == NULL || strstr(err.text, name) == NULL)
		fail_msg("expected %d with \"%s\", got %d: %s", code, words, rc, err.text);
	assert_int_equal(err.code, code);
	assert_null(mesh);
}

static inline void put_u32(uint8_t *p, uint32_t x)
{
	for (int i = 0; i < 4; i++)
		p[i] = (uint8_t)(x >> 8 * i);
}

/* A BMP of 24 bits, rows from the bottom up, of w x h, with n bytes of pixels (w a multiple of 4: rows unpadded). */
static inline size_t make_bmp(uint8_t *out, uint32_t w, uint32_t h, const uint8_t *bgr, size_t n)
{
	memset(out, 0, 54);
	memcpy(out, "BM", 2);
	put_u32(out + 2, (uint32_t)(54 + n));
	out[10] = 54;
	out[14] = 40;
	put_u32(out + 18, w);
	put_u32(out + 22, h);
	out[26] = 1;
	out[28] = 24;
	put_u32(out + 34, (uint32_t)n);
	if (n > 0)
		memcpy(out + 54, bgr, n);
	return 54 + n;
}

#endif
