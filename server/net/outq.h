/* The output queue of a connection: chunks of bytes, written as the peer takes them. It knows no socket and no clock:
 * its user writes what outq_peek shows and says with outq_consume how much went out. */
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
	size_t offset;          /* bytes of `first` that are out */
	uint64_t size;          /* bytes that wait */
	uint64_t sent;          /* bytes that went out, ever */
	uint64_t mark_us, mark_sent; /* when progress was last seen, and `sent` at that time */
};

struct outq_chunk *outq_chunk_create(size_t capacity); /* empty; NULL without memory */
void outq_chunks_destroy(struct outq_chunk *first);    /* a whole list; NULL is fine */

void outq_init(struct outq *q);
void outq_fini(struct outq *q);

/* Appends a list of chunks, which belong to the queue from now on. Empty chunks are fine. */
void outq_push(struct outq *q, struct outq_chunk *first, uint64_t now_us);

/* Appends a copy; small ones share chunks. 0, or -1 without memory (nothing was appended). */
int outq_append(struct outq *q, const void *bytes, size_t n, uint64_t now_us);

/* Up to max vectors of what goes out next; their number. Valid until the queue is changed. */
int outq_peek(const struct outq *q, struct iovec *iov, int max);
void outq_consume(struct outq *q, size_t n); /* n <= the bytes of the last peek */

/* Whether bytes have waited for timeout_us while less than OUTQ_PROGRESS_BYTES went out, nor the queue ran empty. To be
 * called from time to time: it also moves the mark when there was progress. */
int outq_is_stalled(struct outq *q, uint64_t now_us, uint64_t timeout_us);

#endif
