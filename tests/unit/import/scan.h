/* Bytes of scans, put together and read back by the tests of PLY and LAS. */
#ifndef TESTS_IMPORT_SCAN_H
#define TESTS_IMPORT_SCAN_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "import/import.h"

typedef int reader(struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, struct psr_error *err);

/* Reads from an allocation of exactly n bytes; the mesh, or NULL with *err filled. */
static inline struct psr_mesh *read_scan(reader *read, const char *path, const void *bytes, size_t n,
                                         struct psr_error *err)
{
	struct psr_mesh *mesh = NULL;
	struct import_mesh im;
	uint8_t *copy = malloc(n > 0 ? n : 1);
	int rc;

	assert_non_null(copy);
	memcpy(copy, bytes, n);
	*err = (struct psr_error){ 0, "" };
	assert_int_equal(import_mesh_init(&im, path, err), PSR_OK);
	rc = read(&im, copy, n, err);
	if (rc == PSR_OK)
		rc = import_mesh_finish(&mesh, &im, err);
	import_mesh_fini(&im);
	free(copy);
	assert_int_equal(rc, err->code);
	assert_int_equal(rc == PSR_OK, mesh != NULL);
	return mesh;
}

static inline struct psr_mesh *accept(reader *read, const char *path, const void *bytes, size_t n)
{
	struct psr_error err;
	struct psr_mesh *mesh = read_scan(read, path, bytes, n, &err);

	if (mesh == NULL)
		fail_msg("%s", err.text);
	return mesh;
}

static inline void refuse_scan(reader *read, const char *path, const void *bytes, size_t n, int code, const char *part)
{
	struct psr_error err;
	struct psr_mesh *mesh = read_scan(read, path, bytes, n, &err);

	if (mesh != NULL || err.code != code || strstr(err.text, part) == NULL)
		fail_msg("expected %d \"%s\", got %d \"%s\"", code, part, err.code, err.text);
}

#endif
