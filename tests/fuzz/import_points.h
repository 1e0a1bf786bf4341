/* What fuzzers require of sources of points. */
#ifndef TESTS_FUZZ_IMPORT_POINTS_H
#define TESTS_FUZZ_IMPORT_POINTS_H

#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>
#include "import/points/points.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);

static inline void require(int truth)
{
	if (!truth)
		abort();
}

/* Reads all points; returns a sum of all their bytes that matter. */
static inline int read_once(uint64_t *sum, uint64_t *n_points, const struct octree_source *source, int are_finite,
                            struct psr_error *err)
{
	static struct octree_point point[256];
	int rc = source->rewind(source->userdata, err);

	*sum = *n_points = 0;
	for (size_t n = 1; rc == PSR_OK && n > 0;) {
		rc = source->read(&n, point, 256, source->userdata, err);
		n = rc == PSR_OK ? n : 0;
		*n_points += n;
		for (size_t i = 0; i < n; i++)
			for (int c = 0; c < 3; c++) {
				uint64_t bits;

				require(!are_finite || isfinite(point[i].at[c]));
				memcpy(&bits, &point[i].at[c], sizeof bits);
				*sum = *sum * 31 + bits + (source->has_color ? point[i].color[c] : 0);
			}
	}
	return rc;
}

/* Gives the bytes to `open` as a file. What it accepts can be read twice, to the same points or the same error. */
static inline void points_check(int (*open)(struct octree_source *, const char *, struct psr_error *),
                                void (*close_source)(struct octree_source *), int are_finite, const uint8_t *data,
                                size_t n)
{
	struct octree_source source;
	struct psr_error err = { 0, "" }, again = { 0, "" };
	const int fd = memfd_create("points", 0);
	uint64_t sum[2], n_points[2];
	char path[64];
	int rc;

	require(fd >= 0 && write(fd, data, n) == (ssize_t)n);
	snprintf(path, sizeof path, "/proc/self/fd/%d", fd);
	rc = open(&source, path, &err);
	require(rc == err.code);
	if (rc == PSR_OK) {
		rc = read_once(&sum[0], &n_points[0], &source, are_finite, &err);
		require(rc == err.code && rc == read_once(&sum[1], &n_points[1], &source, are_finite, &again));
		require(strcmp(err.text, again.text) == 0 && (rc != PSR_OK || n_points[0] > 0));
		require(rc != PSR_OK || (sum[0] == sum[1] && n_points[0] == n_points[1]));
		close_source(&source);
	}
	require(rc == PSR_OK || (rc == PSR_ERR_FORMAT || rc == PSR_ERR_UNSUPPORTED || rc == PSR_ERR_LIMIT));
	close(fd);
}

#endif
