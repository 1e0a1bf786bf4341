#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "runs.h"
#include "base/array.h"
#include "base/mem.h"
#include "base/radix.h"

#define LEAST_ROOM 64

int runs_init(struct runs *runs, const char *folder, int bits, int is_scan, uint64_t memory, struct psr_error *err)
{
	const size_t bytes = is_scan ? sizeof(struct scan_record) : sizeof(struct record);

	*runs = (struct runs){ .folder = folder, .bits = bits, .bytes = bytes, .fd = -1, .room = memory / (2 * bytes) };
	runs->room = runs->room > LEAST_ROOM ? runs->room : LEAST_ROOM;
	runs->record = psr_alloc_array(runs->room, bytes);
	runs->spare = psr_alloc_array(runs->room, bytes);
	if (runs->record == NULL || runs->spare == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to sort %zu points at a time", runs->room);
	return PSR_OK;
}

void runs_fini(struct runs *runs)
{
	psr_free(runs->record);
	psr_free(runs->spare);
	free(runs->run);
	free(runs->heap);
	if (runs->fd >= 0)
		close(runs->fd);
}

/* A record begins with its path. */
static inline uint64_t path_of(const uint8_t *record)
{
	uint64_t path;

	memcpy(&path, record, sizeof path);
	return path;
}

static void sort(struct runs *runs)
{
	uint8_t *const sorted = radix_sort_records(runs->record, runs->spare, runs->bytes, runs->n, runs->bits);

	if (sorted == runs->spare) {
		runs->spare = runs->record;
		runs->record = sorted;
	}
}

/* Opens a file that has no name, or loses it at once. */
static int open_file(struct runs *runs, struct psr_error *err)
{
	char path[PATH_MAX];

	runs->fd = open(runs->folder, O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
	if (runs->fd >= 0)
		return PSR_OK;
	if (snprintf(path, sizeof path, "%s/psr-runs-XXXXXX", runs->folder) < (int)sizeof path)
		runs->fd = mkostemp(path, O_CLOEXEC);
	if (runs->fd < 0)
		return psr_fail(err, PSR_ERR_IO, "%s: a temporary file cannot be made: %s; set TMPDIR to another folder",
		                runs->folder, strerror(errno));
	unlink(path);
	return PSR_OK;
}

static int write_run(struct runs *runs, struct psr_error *err)
{
	const uint8_t *bytes = runs->record;
	size_t left = runs->n * runs->bytes;
	int rc = runs->fd < 0 ? open_file(runs, err) : PSR_OK;

	if (rc != PSR_OK)
		return rc;
	if (!ARRAY_ROOM(runs->run, runs->n_runs, runs->runs_room))
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for runs of points");
	runs->run[runs->n_runs++] = (struct run){ runs->written, runs->written + left, NULL, 0, 0 };
	while (left > 0) {
		const ssize_t n = pwrite(runs->fd, bytes, left, (off_t)runs->written);

		if (n < 0 && errno == EINTR)
			continue;
		if (n <= 0)
			return psr_fail(err, PSR_ERR_IO,
			                "%s: sorted points cannot be written, after %llu MB: %s; set TMPDIR to a folder with more "
			                "room, or allow more memory",
			                runs->folder, (unsigned long long)(runs->written >> 20), strerror(errno));
		bytes += n;
		left -= (size_t)n;
		runs->written += (uint64_t)n;
	}
	runs->n = 0;
	return PSR_OK;
}

int runs_put(struct runs *runs, const struct record *record, struct psr_error *err)
{
	if (runs->n == runs->room) {
		int rc;

		sort(runs);
		rc = write_run(runs, err);
		if (rc != PSR_OK)
			return rc;
	}
	memcpy(runs->record + runs->n++ * runs->bytes, record, runs->bytes);
	return PSR_OK;
}

static int refill(struct runs *runs, struct run *run, struct psr_error *err)
{
	size_t want = runs->run_room * runs->bytes, got = 0;

	want = want < run->end - run->at ? want : run->end - run->at;
	while (got < want) {
		const ssize_t n = pread(runs->fd, run->record + got, want - got, (off_t)(run->at + got));

		if (n < 0 && errno == EINTR)
			continue;
		if (n <= 0)
			return psr_fail(err, PSR_ERR_IO, "%s: sorted points cannot be read again: %s", runs->folder,
			                n < 0 ? strerror(errno) : "the file is shorter");
		got += (size_t)n;
	}
	run->at += want;
	run->next = 0;
	run->n = want / runs->bytes;
	return PSR_OK;
}

/* Returns whether run a comes before run b: by path, then by the order in which they were written. */
static int is_before(const struct runs *runs, uint32_t a, uint32_t b)
{
	const struct run *first = &runs->run[a], *second = &runs->run[b];
	const uint64_t x = path_of(first->record + first->next * runs->bytes);
	const uint64_t y = path_of(second->record + second->next * runs->bytes);

	return x < y || (x == y && a < b);
}

static void sink(struct runs *runs, size_t i)
{
	const uint32_t run = runs->heap[i];
	size_t child;

	while ((child = 2 * i + 1) < runs->n_heap) {
		child += child + 1 < runs->n_heap && is_before(runs, runs->heap[child + 1], runs->heap[child]);
		if (!is_before(runs, runs->heap[child], run))
			break;
		runs->heap[i] = runs->heap[child];
		i = child;
	}
	runs->heap[i] = run;
}

int runs_end(struct runs *runs, struct psr_error *err)
{
	int rc = PSR_OK;

	sort(runs);
	if (runs->fd < 0) { /* what is in memory is the one run */
		psr_free(runs->spare);
		runs->spare = NULL;
		return PSR_OK;
	}
	rc = write_run(runs, err);
	if (rc != PSR_OK)
		return rc;
	psr_free(runs->spare);
	runs->spare = NULL;
	runs->run_room = runs->room / runs->n_runs;
	runs->heap = calloc(runs->n_runs, sizeof *runs->heap);
	if (runs->heap == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to merge %zu runs of points", runs->n_runs);
	if (runs->run_room == 0)
		return psr_fail(err, PSR_ERR_LIMIT, "%zu runs, of %zu points each, are too many to merge; allow more memory",
		                runs->n_runs, runs->room);
	for (size_t i = 0; i < runs->n_runs && rc == PSR_OK; i++) {
		runs->run[i].record = runs->record + i * runs->run_room * runs->bytes;
		rc = refill(runs, &runs->run[i], err);
		runs->heap[runs->n_heap++] = (uint32_t)i;
	}
	for (size_t i = runs->n_heap / 2; rc == PSR_OK && i-- > 0;)
		sink(runs, i);
	return rc;
}

const struct record *runs_next(struct runs *runs, int *rc, struct psr_error *err)
{
	struct run *run;

	*rc = PSR_OK;
	if (runs->fd < 0) { /* `written` counts what was given out */
		if (runs->written == runs->n)
			return NULL;
		memcpy(&runs->taken, runs->record + runs->written++ * runs->bytes, runs->bytes);
		return &runs->taken.record;
	}
	if (runs->n_heap == 0)
		return NULL;
	run = &runs->run[runs->heap[0]];
	memcpy(&runs->taken, run->record + run->next++ * runs->bytes, runs->bytes);
	if (run->next == run->n && run->at < run->end)
		*rc = refill(runs, run, err);
	if (*rc != PSR_OK)
		return NULL;
	if (run->next == run->n)
		runs->heap[0] = runs->heap[--runs->n_heap];
	if (runs->n_heap > 0)
		sink(runs, 0);
	return &runs->taken.record;
}
