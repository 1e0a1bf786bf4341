#include <stdlib.h>
#include <string.h>
#include "workers.h"

void workers_init(struct workers *workers, struct psr_pool *io, uint64_t most_bytes)
{
	workers->io = io;
	workers->n = 0;
	workers->bytes = 0;
	workers->most_bytes = most_bytes;
}

static void destroy_one(void *userdata)
{
	draw_worker_destroy(userdata);
}

/* Unmapping takes milliseconds: not on the loop's thread. */
static void discard(struct workers *workers, struct draw_worker *worker)
{
	const struct pool_job job = { .fn = destroy_one, .userdata = worker };

	if (psr_pool_submit(workers->io, &job) != PSR_OK)
		draw_worker_destroy(worker);
}

static struct draw_worker *take(struct workers *workers, unsigned i)
{
	struct draw_worker *worker = workers->idle[i].worker;

	workers->bytes -= workers->idle[i].bytes;
	workers->n--;
	memmove(&workers->idle[i], &workers->idle[i + 1], (workers->n - i) * sizeof workers->idle[0]);
	return worker;
}

void workers_fini(struct workers *workers)
{
	while (workers->n > 0)
		draw_worker_destroy(take(workers, workers->n - 1));
}

/* The last one of the flow, and of the size if it is not NULL; or -1. */
static int find(const struct workers *workers, uint64_t flow, const struct workers_use *size)
{
	for (int i = (int)workers->n - 1; i >= 0; i--) {
		const struct workers_use *use = &workers->idle[i].use;

		if (use->flow == flow && (size == NULL || (use->width == size->width && use->height == size->height)))
			return i;
	}
	return -1;
}

struct draw_worker *workers_take(struct workers *workers, const struct workers_use *use, uint64_t bytes)
{
	struct draw_worker *worker = NULL;
	int i = find(workers, use->flow, use);

	if (i < 0)
		i = find(workers, use->flow, NULL);
	if (i < 0)
		i = find(workers, 0, use);
	if (i < 0)
		i = find(workers, 0, NULL);
	if (i >= 0)
		return take(workers, (unsigned)i);
	if (workers->n == 0 || workers->bytes + bytes <= workers->most_bytes)
		worker = draw_worker_create();
	return worker != NULL || workers->n == 0 ? worker : take(workers, 0);
}

void workers_forget(struct workers *workers, uint64_t flow)
{
	for (unsigned i = 0; i < workers->n; i++)
		if (workers->idle[i].use.flow == flow)
			workers->idle[i].use.flow = 0;
}

void workers_put(struct workers *workers, const struct workers_use *use, struct draw_worker *worker)
{
	const uint64_t bytes = draw_worker_bytes(worker);

	if (workers->n == WORKERS_MOST)
		discard(workers, take(workers, 0));
	if (bytes > workers->most_bytes) {
		discard(workers, worker);
		return;
	}
	if (workers->bytes + bytes > workers->most_bytes)
		workers_free(workers, workers->bytes + bytes - workers->most_bytes);
	workers->idle[workers->n].worker = worker;
	workers->idle[workers->n].use = *use;
	workers->idle[workers->n++].bytes = bytes;
	workers->bytes += bytes;
}

void workers_free(struct workers *workers, uint64_t bytes)
{
	uint64_t freed = 0;

	while (freed < bytes && workers->n > 0) {
		freed += workers->idle[0].bytes;
		discard(workers, take(workers, 0));
	}
}
