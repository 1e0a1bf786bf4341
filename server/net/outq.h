/* The output queue of a connection: messages that wait until the peer takes them. It has no socket and no clock: its
 * user writes the bytes that outq_peek() shows, and tells outq_consume() how many went out.
 *
 * There are two lanes, each in order: control messages, and answers in chunks, such as pictures. A control message goes
 * out as soon as the message under way has ended; no message interrupts another. */
#ifndef PSRD_OUTQ_H
#define PSRD_OUTQ_H

#include <stddef.h>
#include <stdint.h>
#include <sys/uio.h>

/* Within each timeout a reader takes at least one part in OUTQ_PROGRESS_PARTS of the bytes that wait at its beginning,
 * and at least OUTQ_PROGRESS_BYTES. So a queue halves within 11 timeouts (log 2 / log 16/15), down to 1 MiB; the rest
 * takes 16. At the defaults, 32 MiB and 30 s, this begins with 0.56 Mbit/s; the slowest link that psrd has to serve has
 * 1. */
#define OUTQ_PROGRESS_BYTES 65536
#define OUTQ_PROGRESS_PARTS 16

struct outq_chunk { /* whole messages, each of which begins with its length: u32, little-endian */
	struct outq_chunk *next;
	size_t size, capacity;
	uint32_t id;            /* the request that its messages answer; outq_push() sets it */
	uint16_t part;          /* for the user: which part of the answer they belong to */
	uint8_t ends_part, ends_answer; /* for the user */
	uint64_t asked_ns;      /* for the user: when what it answers was asked; 0: on_sent() does not see it */
	uint8_t data[];
};

struct outq_lane {
	struct outq_chunk *first, *last;
	size_t offset;          /* bytes of `first` already sent */
	size_t boundary;        /* end of the message that contains `offset`; `offset` itself between two messages */
	uint64_t size;          /* bytes left to send */
};

struct outq {
	struct outq_lane control, answers;
	uint64_t size;          /* bytes left to send, in both lanes */
	uint64_t sent;          /* bytes sent so far */
	uint64_t mark_us, mark_sent, mark_size; /* when outq_is_stalled() last saw progress, and `sent` and `size` at that
	                                         * time */
	uint64_t *held;         /* the user's counter of the memory of all its queues */
	void (*on_sent)(const struct outq_chunk *chunk, void *userdata); /* sees chunks of answers, sent wholly, before they
	                                                                  * are freed; NULL: nobody does */
	void *userdata;
};

struct outq_chunk *outq_chunk_create(size_t capacity); /* empty; NULL without memory */
void outq_chunks_destroy(struct outq_chunk *first);    /* a whole list; NULL is fine */

void outq_init(struct outq *q, uint64_t *held); /* adds to *held the memory that the queue takes, and subtracts what it
                                                 * frees */
void outq_fini(struct outq *q);

/* Appends chunks of answers to `id`, and takes them. Empty chunks are fine. */
void outq_push(struct outq *q, uint32_t id, struct outq_chunk *first, uint64_t now_us);

/* Appends a copy of a control message; small ones share chunks. Returns 0, or -1 without memory: then it appends
 * nothing. */
int outq_append(struct outq *q, const void *bytes, size_t n, uint64_t now_us);

/* Frees the answers to `id` from a part on, or all answers if the id is 0. A message that is partly sent stays.
 * on_drop, if not NULL, sees each wholly unsent chunk before it is freed. */
void outq_drop(struct outq *q, uint32_t id, unsigned from,
               void (*on_drop)(const struct outq_chunk *chunk, void *userdata), void *userdata);
int outq_holds(const struct outq *q, uint32_t id); /* whether answers to `id` wait behind the message under way */

/* Fills in up to max vectors of the next bytes; returns their number. Valid until the queue changes. */
int outq_peek(const struct outq *q, struct iovec *iov, int max);
void outq_consume(struct outq *q, size_t n); /* n <= the bytes of the last peek */

/* Returns whether bytes have waited for timeout_us, the queue never ran empty, and fewer bytes went out than the rule
 * above asks. Call it from time to time: it also records progress. */
int outq_is_stalled(struct outq *q, uint64_t now_us, uint64_t timeout_us);

#endif
