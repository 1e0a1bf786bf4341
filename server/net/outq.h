/* The output queue of a connection: chunks of bytes, written as the peer takes them. It has no socket and no clock: the
 * user writes what outq_peek() shows, and reports to outq_consume() how much went out. */
#ifndef PSRD_OUTQ_H
#define PSRD_OUTQ_H

#include <stddef.h>
#include <stdint.h>
#include <sys/uio.h>

#define OUTQ_PROGRESS_BYTES 65536

struct outq_chunk {
	struct outq_chunk *next;
	size_t size, capacity;
	uint8_t data[];
};

struct outq {
	struct outq_chunk *first, *last;
	size_t offset;          /* bytes of `first` that are sent */
	uint64_t size;          /* bytes that wait to be sent */
	uint64_t sent;          /* bytes sent, ever */
	uint64_t mark_us, mark_sent; /* when outq_is_stalled() last saw progress, and `sent` then */
};

struct outq_chunk *outq_chunk_create(size_t capacity); /* empty; NULL without memory */
void outq_chunks_destroy(struct outq_chunk *first);    /* a whole list; NULL is fine */

void outq_init(struct outq *q);
void outq_fini(struct outq *q);

/* Appends a list of chunks, and takes them. Empty chunks are fine. */
void outq_push(struct outq *q, struct outq_chunk *first, uint64_t now_us);

/* Appends a copy; small ones share chunks. 0, or -1: no memory, nothing appended. */
int outq_append(struct outq *q, const void *bytes, size_t n, uint64_t now_us);

/* Fills in up to max vectors of the next bytes; returns their number. Valid until the queue changes. */
int outq_peek(const struct outq *q, struct iovec *iov, int max);
void outq_consume(struct outq *q, size_t n); /* n <= the bytes of the last peek */

/* Whether bytes have waited for timeout_us while less than OUTQ_PROGRESS_BYTES went out, nor the queue ran empty. To be
 * called from time to time: it also moves the mark when there was progress. */
int outq_is_stalled(struct outq *q, uint64_t now_us, uint64_t timeout_us);

#endif
