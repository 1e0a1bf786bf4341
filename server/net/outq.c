#include <assert.h>
#include <stdlib.h>
#include <string.h>
#include "outq.h"

#define SMALL_CHUNK (4096 - sizeof(struct outq_chunk))

struct outq_chunk *outq_chunk_create(size_t capacity)
{
	struct outq_chunk *chunk;

	if (capacity > SIZE_MAX - sizeof *chunk)
		return NULL;
	chunk = malloc(sizeof *chunk + capacity);
	if (chunk != NULL) {
		chunk->next = NULL;
		chunk->size = 0;
		chunk->capacity = capacity;
	}
	return chunk;
}

void outq_chunks_destroy(struct outq_chunk *first)
{
	while (first != NULL) {
		struct outq_chunk *next = first->next;

		free(first);
		first = next;
	}
}

void outq_init(struct outq *q)
{
	memset(q, 0, sizeof *q);
}

void outq_fini(struct outq *q)
{
	outq_chunks_destroy(q->first);
	outq_init(q);
}

static void start_mark(struct outq *q, uint64_t now_us)
{
	if (q->size == 0) {
		q->mark_us = now_us;
		q->mark_sent = q->sent;
	}
}

void outq_push(struct outq *q, struct outq_chunk *first, uint64_t now_us)
{
	start_mark(q, now_us);
	while (first != NULL) {
		struct outq_chunk *next = first->next;

		if (first->size == 0) {
			free(first);
		} else {
			first->next = NULL;
			if (q->last != NULL)
				q->last->next = first;
			else
				q->first = first;
			q->last = first;
			q->size += first->size;
		}
		first = next;
	}
}

int outq_append(struct outq *q, const void *bytes, size_t n, uint64_t now_us)
{
	struct outq_chunk *chunk = q->last;

	if (n == 0)
		return 0;
	if (chunk == NULL || chunk->capacity - chunk->size < n) {
		chunk = outq_chunk_create(n > SMALL_CHUNK ? n : SMALL_CHUNK);
		if (chunk == NULL)
			return -1;
		memcpy(chunk->data, bytes, n);
		chunk->size = n;
		outq_push(q, chunk, now_us);
		return 0;
	}
	start_mark(q, now_us);
	memcpy(chunk->data + chunk->size, bytes, n);
	chunk->size += n;
	q->size += n;
	return 0;
}

int outq_peek(const struct outq *q, struct iovec *iov, int max)
{
	size_t offset = q->offset;
	int n = 0;

	for (struct outq_chunk *chunk = q->first; chunk != NULL && n < max; chunk = chunk->next) {
		iov[n].iov_base = chunk->data + offset;
		iov[n++].iov_len = chunk->size - offset;
		offset = 0;
	}
	return n;
}

void outq_consume(struct outq *q, size_t n)
{
	assert(n <= q->size);
	q->size -= n;
	q->sent += n;
	n += q->offset;
	while (q->first != NULL && n >= q->first->size) {
		struct outq_chunk *chunk = q->first;

		n -= chunk->size;
		q->first = chunk->next;
		free(chunk);
	}
	if (q->first == NULL)
		q->last = NULL;
	q->offset = n;
}

int outq_is_stalled(struct outq *q, uint64_t now_us, uint64_t timeout_us)
{
	if (q->size == 0 || q->sent - q->mark_sent >= OUTQ_PROGRESS_BYTES) {
		q->mark_us = now_us;
		q->mark_sent = q->sent;
		return 0;
	}
	return now_us >= q->mark_us && now_us - q->mark_us >= timeout_us;
}
