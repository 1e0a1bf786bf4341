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
	if (chunk != NULL)
		*chunk = (struct outq_chunk){ .capacity = capacity };
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

static uint64_t bytes_of(const struct outq_chunk *chunk)
{
	return sizeof *chunk + chunk->capacity;
}

static void free_chunk(struct outq *q, struct outq_chunk *chunk)
{
	*q->held -= bytes_of(chunk);
	free(chunk);
}

void outq_init(struct outq *q, uint64_t *held)
{
	*q = (struct outq){ .held = held };
}

static void free_lane(struct outq *q, struct outq_lane *lane)
{
	while (lane->first != NULL) {
		struct outq_chunk *chunk = lane->first;

		lane->first = chunk->next;
		free_chunk(q, chunk);
	}
}

void outq_fini(struct outq *q)
{
	free_lane(q, &q->control);
	free_lane(q, &q->answers);
	outq_init(q, q->held);
}

static void set_mark(struct outq *q, uint64_t now_us)
{
	q->mark_us = now_us;
	q->mark_sent = q->sent;
	q->mark_size = q->size;
}

static void add(struct outq *q, struct outq_lane *lane, struct outq_chunk *chunk)
{
	chunk->next = NULL;
	if (lane->last != NULL)
		lane->last->next = chunk;
	else
		lane->first = chunk;
	lane->last = chunk;
	lane->size += chunk->size;
	q->size += chunk->size;
	*q->held += bytes_of(chunk);
}

void outq_push(struct outq *q, uint32_t id, struct outq_chunk *first, uint64_t now_us)
{
	int was_empty = q->size == 0;

	while (first != NULL) {
		struct outq_chunk *next = first->next;

		first->id = id;
		if (first->size == 0)
			free(first);
		else
			add(q, &q->answers, first);
		first = next;
	}
	if (was_empty)
		set_mark(q, now_us);
}

int outq_append(struct outq *q, const void *bytes, size_t n, uint64_t now_us)
{
	struct outq_chunk *chunk = q->control.last;
	int was_empty = q->size == 0;

	if (chunk != NULL && chunk->capacity - chunk->size >= n) {
		memcpy(chunk->data + chunk->size, bytes, n);
		chunk->size += n;
		q->control.size += n;
		q->size += n;
	} else {
		chunk = outq_chunk_create(n > SMALL_CHUNK ? n : SMALL_CHUNK);
		if (chunk == NULL)
			return -1;
		memcpy(chunk->data, bytes, n);
		chunk->size = n;
		add(q, &q->control, chunk);
	}
	if (was_empty)
		set_mark(q, now_us);
	return 0;
}

/* Walks from the beginning of one message to the first beginning at or behind `at`, and returns it. */
static size_t find_boundary(const struct outq_chunk *chunk, size_t from, size_t at)
{
	while (from < at) {
		const uint8_t *p = chunk->data + from;
		size_t left = chunk->size - from, n = 0;

		if (left >= 4)
			n = (size_t)p[0] | (size_t)p[1] << 8 | (size_t)p[2] << 16 | (size_t)p[3] << 24;
		from += n > 0 && n < left ? n : left;
	}
	return from;
}

/* Cuts the first chunk at the end of the message under way. Returns whether the chunk is then empty. */
static int cut_first(struct outq *q, struct outq_lane *lane)
{
	struct outq_chunk *chunk = lane->first;
	uint64_t cut = chunk->size - lane->boundary;

	lane->size -= cut;
	q->size -= cut;
	chunk->size = lane->boundary;
	return lane->offset == lane->boundary;
}

void outq_drop(struct outq *q, uint32_t id, unsigned from,
               void (*on_drop)(const struct outq_chunk *chunk, void *userdata), void *userdata)
{
	struct outq_lane *lane = &q->answers;
	struct outq_chunk **at = &lane->first, *last = NULL;
	uint64_t taken = q->sent - q->mark_sent;

	while (*at != NULL) {
		struct outq_chunk *chunk = *at;
		int is_first = chunk == lane->first;

		if ((id != 0 && (chunk->id != id || chunk->part < from)) || (is_first && !cut_first(q, lane))) {
			last = chunk;
			at = &chunk->next;
			continue;
		}
		if (on_drop != NULL && (!is_first || lane->offset == 0))
			on_drop(chunk, userdata);
		*at = chunk->next;
		if (is_first) {
			lane->offset = lane->boundary = 0;
		} else {
			lane->size -= chunk->size;
			q->size -= chunk->size;
		}
		free_chunk(q, chunk);
	}
	lane->last = last;
	if (q->mark_size > q->size + taken) /* the peer cannot take bytes that are no longer queued */
		q->mark_size = q->size + taken;
}

int outq_holds(const struct outq *q, uint32_t id)
{
	const struct outq_lane *lane = &q->answers;

	for (const struct outq_chunk *chunk = lane->first; chunk != NULL; chunk = chunk->next)
		if (chunk->id == id && (chunk != lane->first || lane->boundary < chunk->size))
			return 1;
	return 0;
}

static int show(struct iovec *iov, int max, const struct outq_lane *lane, size_t offset)
{
	int n = 0;

	for (struct outq_chunk *chunk = lane->first; chunk != NULL && n < max; chunk = chunk->next) {
		if (offset < chunk->size)
			iov[n++] = (struct iovec){ chunk->data + offset, chunk->size - offset };
		offset = 0;
	}
	return n;
}

/* Order: the message under way, control messages, other answers. outq_consume() keeps to it. */
int outq_peek(const struct outq *q, struct iovec *iov, int max)
{
	const struct outq_lane *lane = &q->answers;
	int n = 0;

	if (q->control.first == NULL)
		return show(iov, max, lane, lane->offset);
	if (lane->boundary > lane->offset && max > 0)
		iov[n++] = (struct iovec){ lane->first->data + lane->offset, lane->boundary - lane->offset };
	n += show(iov + n, max - n, &q->control, q->control.offset);
	return n + show(iov + n, max - n, lane, lane->boundary);
}

static uint64_t take(struct outq *q, struct outq_lane *lane, uint64_t n)
{
	uint64_t left = n = n < lane->size ? n : lane->size;

	lane->size -= n;
	left += lane->offset;
	while (lane->first != NULL && left >= lane->first->size) {
		struct outq_chunk *chunk = lane->first;

		left -= chunk->size;
		lane->first = chunk->next;
		lane->boundary = 0;
		if (chunk->asked_ns != 0 && q->on_sent != NULL)
			q->on_sent(chunk, q->userdata);
		free_chunk(q, chunk);
	}
	if (lane->first == NULL)
		lane->last = NULL;
	lane->offset = left;
	if (lane->first != NULL)
		lane->boundary = find_boundary(lane->first, lane->boundary, left);
	return n;
}

void outq_consume(struct outq *q, size_t n)
{
	uint64_t left = n;

	assert(n <= q->size);
	q->size -= n;
	q->sent += n;
	if (q->control.first != NULL) {
		uint64_t rest = q->answers.boundary - q->answers.offset;

		left -= take(q, &q->answers, left < rest ? left : rest);
		left -= take(q, &q->control, left);
	}
	take(q, &q->answers, left);
}

int outq_is_stalled(struct outq *q, uint64_t now_us, uint64_t timeout_us)
{
	uint64_t part = q->mark_size / OUTQ_PROGRESS_PARTS;
	uint64_t enough = part > OUTQ_PROGRESS_BYTES ? part : OUTQ_PROGRESS_BYTES;

	if (q->size == 0 || q->sent - q->mark_sent >= enough) {
		set_mark(q, now_us);
		return 0;
	}
	return now_us >= q->mark_us && now_us - q->mark_us >= timeout_us;
}
