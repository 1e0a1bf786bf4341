/* The output queue: whole messages come out in the order of their lanes, and stalls are told by the clock that it is
 * given. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <string.h>
#include "server/net/outq.h"

#define TOTAL 20000

static uint64_t next_random(uint64_t *state)
{
	*state ^= *state << 13;
	*state ^= *state >> 7;
	*state ^= *state << 17;
	return *state;
}

static struct outq_chunk *chunk_of(size_t capacity, size_t size, uint8_t value)
{
	struct outq_chunk *chunk = outq_chunk_create(capacity);

	assert_non_null(chunk);
	memset(chunk->data, value, size);
	chunk->size = size;
	return chunk;
}

/* A message: its length, the lane and id that it was given, its number within these, and filling. */
static struct outq_chunk *message_of(size_t n, uint32_t id, uint32_t number)
{
	struct outq_chunk *chunk = chunk_of(n, n, 0xee);
	const uint32_t head[3] = { (uint32_t)n, id, number };

	assert_true(n >= sizeof head);
	memcpy(chunk->data, head, sizeof head);
	return chunk;
}

static void append_message(struct outq *q, size_t n, uint32_t id, uint32_t number)
{
	struct outq_chunk *chunk = message_of(n, id, number);

	assert_int_equal(outq_append(q, chunk->data, n, 0), 0);
	outq_chunks_destroy(chunk);
}

/* Takes up to n bytes as a short write would. */
static size_t take(struct outq *q, uint8_t *out, size_t n)
{
	struct iovec iov[3];
	size_t taken = 0;
	int n_iov = outq_peek(q, iov, 3);

	for (int i = 0; i < n_iov && taken < n; i++) {
		size_t part = iov[i].iov_len < n - taken ? iov[i].iov_len : n - taken;

		memcpy(out + taken, iov[i].iov_base, part);
		taken += part;
	}
	outq_consume(q, taken);
	return taken;
}

#define IDS 8
#define CONTROL 0

/* What a reader of the bytes checks: whole messages, each lane in order, and nothing of an id behind its end. */
struct reader {
	uint8_t bytes[TOTAL];
	size_t n;
	uint32_t n_control, n_answers[IDS + 1];
	int is_ended[IDS + 1];
	uint64_t n_read;
};

static void read_messages(struct reader *r)
{
	uint32_t head[3];
	size_t at = 0;

	while (r->n - at >= sizeof head) {
		memcpy(head, r->bytes + at, sizeof head);
		assert_in_range(head[0], sizeof head, 5000);
		if (r->n - at < head[0])
			break;
		for (size_t i = sizeof head; i < head[0]; i++)
			assert_int_equal(r->bytes[at + i], 0xee);
		if (head[1] == CONTROL) {
			assert_int_equal(head[2] >> 8, r->n_control++);
			if (head[2] & 255)
				r->is_ended[head[2] & 255] = 1;
		} else {
			assert_false(r->is_ended[head[1]]);
			assert_true(head[2] >= r->n_answers[head[1]]); /* some may have been dropped */
			r->n_answers[head[1]] = head[2] + 1;
		}
		at += head[0];
		r->n_read++;
	}
	r->n -= at;
	memmove(r->bytes, r->bytes + at, r->n);
}

/* Random messages in both lanes, random writes, ids that end by a drop and a control message. */
static void lanes_keep_messages_whole_and_in_order_whatever_the_writes(void **state)
{
	static struct reader reader;
	uint64_t random = 0x123456789abcdef, held = 0, n_read = 0;
	uint32_t n_control = 0, n_answers[IDS + 1] = { 0 };
	int is_ended[IDS + 1] = { 0 };
	struct outq q;

	(void)state;
	memset(&reader, 0, sizeof reader);
	outq_init(&q, &held);
	for (int step = 0; step < 200000; step++) {
		uint32_t id = 1 + (uint32_t)(next_random(&random) % IDS);
		size_t n = 12 + next_random(&random) % 600;

		switch (next_random(&random) % 8) {
		case 0:
		case 1:
			if (!is_ended[id] && q.size < 20000) { /* some messages in one chunk */
				struct outq_chunk *chunk = outq_chunk_create(8 * n + 7);

				for (int i = 0; i < 8; i++) {
					struct outq_chunk *one = message_of(n, id, n_answers[id]++);

					memcpy(chunk->data + chunk->size, one->data, n);
					chunk->size += n;
					outq_chunks_destroy(one);
				}
				outq_push(&q, id, chunk, 0);
			}
			break;
		case 2:
			if (q.size < 20000)
				append_message(&q, n, CONTROL, n_control++ << 8);
			break;
		case 3:
			if (!is_ended[id] && next_random(&random) % 8 == 0) {
				outq_drop(&q, id, 0, NULL, NULL);
				append_message(&q, n, CONTROL, n_control++ << 8 | id);
				is_ended[id] = 1;
			} else if (is_ended[id] && reader.is_ended[id]) { /* as another id */
				is_ended[id] = reader.is_ended[id] = 0;
			}
			break;
		default:
			reader.n += take(&q, reader.bytes + reader.n, 1 + next_random(&random) % 4000);
			read_messages(&reader);
		}
		assert_true(q.size == q.control.size + q.answers.size && q.size <= held);
	}
	n_read = reader.n_read;
	while (q.size > 0) {
		reader.n += take(&q, reader.bytes + reader.n, 4000);
		read_messages(&reader);
	}
	assert_true(reader.n == 0 && n_read > 10000 && reader.n_control == n_control);
	outq_fini(&q);
	assert_int_equal(held, 0);
}

static uint32_t next_number(struct outq *q)
{
	uint8_t bytes[100];
	uint32_t head[3];

	assert_int_equal(take(q, bytes, 100), 100);
	memcpy(head, bytes, sizeof head);
	return head[2];
}

static void control_messages_pass_answers_but_not_the_message_under_way(void **state)
{
	uint64_t held = 0;
	struct outq q;
	uint8_t bytes[100];

	(void)state;
	outq_init(&q, &held);
	outq_push(&q, 1, message_of(100, 1, 1), 0);
	outq_push(&q, 1, message_of(100, 1, 2), 0);
	assert_int_equal(take(&q, bytes, 40), 40);
	append_message(&q, 100, CONTROL, 10);
	append_message(&q, 100, CONTROL, 11);
	assert_int_equal(take(&q, bytes + 40, 60), 60); /* the rest of the first */
	assert_int_equal(bytes[40], 0xee);
	assert_int_equal(next_number(&q), 10);
	assert_int_equal(next_number(&q), 11);
	assert_int_equal(next_number(&q), 2);
	assert_int_equal(q.size, 0);
	outq_fini(&q);
}

static void what_is_dropped_is_freed_at_once_but_for_the_message_under_way(void **state)
{
	uint64_t held = 0, before;
	struct outq q;
	uint8_t bytes[200];
	struct outq_chunk *two = chunk_of(200, 200, 0xee);
	const uint32_t length = 100;

	(void)state;
	memcpy(two->data, &length, 4);
	memcpy(two->data + 100, &length, 4);
	outq_init(&q, &held);
	outq_push(&q, 1, two, 0);
	outq_push(&q, 2, message_of(100, 2, 5), 0);
	before = held;
	outq_push(&q, 1, message_of(5000, 1, 2), 0);
	assert_int_equal(take(&q, bytes, 40), 40);
	outq_drop(&q, 1, 0, NULL, NULL);
	assert_true(held == before);
	assert_int_equal(q.size, 60 + 100);
	assert_true(!outq_holds(&q, 1) && outq_holds(&q, 2)); /* the rest of the message goes first of all */
	assert_int_equal(take(&q, bytes, 60), 60);
	assert_false(outq_holds(&q, 1));
	assert_int_equal(next_number(&q), 5);
	outq_push(&q, 3, message_of(100, 3, 6), 0); /* nothing of it is sent: nothing is left */
	outq_drop(&q, 0, 0, NULL, NULL);
	assert_true(q.size == 0 && held == 0 && q.answers.first == NULL && q.answers.last == NULL);
	outq_fini(&q);
}

static void small_messages_share_chunks(void **state)
{
	uint64_t held = 0;
	struct outq q;
	struct iovec iov[64];

	(void)state;
	outq_init(&q, &held);
	for (int i = 0; i < 100; i++)
		assert_int_equal(outq_append(&q, "0123456789", 10, 0), 0);
	assert_int_equal(outq_peek(&q, iov, 64), 1);
	assert_int_equal(iov[0].iov_len, 1000);
	outq_fini(&q);
}

static void empty_chunks_leave_no_trace(void **state)
{
	uint64_t held = 0;
	struct outq q;
	struct iovec iov[4];
	struct outq_chunk *first = chunk_of(8, 0, 0);

	(void)state;
	first->next = chunk_of(8, 3, 7);
	first->next->next = chunk_of(8, 0, 0);
	outq_init(&q, &held);
	outq_push(&q, 1, first, 0);
	assert_int_equal(outq_peek(&q, iov, 4), 1);
	assert_int_equal(iov[0].iov_len, 3);
	outq_consume(&q, 3);
	assert_int_equal(outq_peek(&q, iov, 4), 0);
	outq_fini(&q);
}

static void what_is_not_written_belongs_to_the_queue(void **state)
{
	uint64_t held = 0;
	struct outq q;

	(void)state;
	outq_init(&q, &held);
	outq_push(&q, 1, chunk_of(100, 100, 1), 0);
	outq_push(&q, 1, chunk_of(100, 100, 2), 0);
	outq_consume(&q, 30);
	outq_fini(&q); /* the leak checker is the judge */
	assert_true(q.size == 0 && q.control.first == NULL && q.answers.first == NULL);
	assert_int_equal(held, 0);
}

static void a_stall_is_bytes_that_wait_without_progress(void **state)
{
	uint64_t held = 0;
	struct outq q;

	(void)state;
	outq_init(&q, &held);
	assert_false(outq_is_stalled(&q, 1000, 100)); /* nothing waits */
	outq_push(&q, 1, chunk_of(300000, 300000, 1), 5000);
	assert_false(outq_is_stalled(&q, 5099, 100));
	assert_true(outq_is_stalled(&q, 5100, 100));
	outq_consume(&q, OUTQ_PROGRESS_BYTES - 1); /* a trickle is no progress */
	assert_true(outq_is_stalled(&q, 5100, 100));
	outq_consume(&q, 1);
	assert_false(outq_is_stalled(&q, 5100, 100));
	assert_false(outq_is_stalled(&q, 5199, 100));
	assert_true(outq_is_stalled(&q, 5200, 100));
	outq_consume(&q, (size_t)q.size);
	assert_false(outq_is_stalled(&q, 9000, 100));
	outq_fini(&q);
}

/* Of 32 MiB, 2 MiB a timeout; of what is left then, a sixteenth again; and what is dropped need not be read. */
static void who_holds_more_has_to_take_more(void **state)
{
	const size_t total = 32 << 20;
	uint64_t held = 0;
	struct outq q;

	(void)state;
	outq_init(&q, &held);
	outq_push(&q, 1, chunk_of(65536, 65536, 0), 0);
	for (size_t i = 0; i < total; i += 65536)
		outq_push(&q, 1 + (uint32_t)(i / (16 << 20)), chunk_of(65536, 65536, 0), 0);
	outq_consume(&q, 65536);
	assert_false(outq_is_stalled(&q, 0, 100)); /* a timeout begins with 32 MiB */
	outq_consume(&q, total / OUTQ_PROGRESS_PARTS - 1);
	assert_true(outq_is_stalled(&q, 100, 100));
	outq_consume(&q, 1);
	assert_false(outq_is_stalled(&q, 100, 100));
	outq_consume(&q, (total - total / OUTQ_PROGRESS_PARTS) / OUTQ_PROGRESS_PARTS - 1);
	assert_true(outq_is_stalled(&q, 200, 100));
	outq_drop(&q, 2, 0, NULL, NULL);
	assert_false(outq_is_stalled(&q, 200, 100));
	outq_fini(&q);
}

/* 32 MiB are down to 1 MiB after log 32 / log 16/15 = 54 timeouts, and 16 of 64 KiB take the rest. */
static void the_slowest_reader_is_done_in_time(void **state)
{
	uint64_t held = 0, now_us = 0;
	struct outq q;

	(void)state;
	outq_init(&q, &held);
	for (int i = 0; i < 512; i++)
		outq_push(&q, 1, chunk_of(65536, 65536, 0), 0);
	while (q.size > 0) {
		uint64_t part = q.mark_size / OUTQ_PROGRESS_PARTS, n = part > OUTQ_PROGRESS_BYTES ? part : OUTQ_PROGRESS_BYTES;

		assert_false(outq_is_stalled(&q, now_us += 99, 100));
		outq_consume(&q, n < q.size ? n : q.size);
		assert_false(outq_is_stalled(&q, now_us += 1, 100));
	}
	assert_in_range(now_us, 100, 100 * (54 + 1 + 16));
	outq_fini(&q);
}

static void the_clock_of_a_stall_starts_with_the_first_byte(void **state)
{
	uint64_t held = 0;
	struct outq q;

	(void)state;
	outq_init(&q, &held);
	assert_int_equal(outq_append(&q, "x", 1, 1000), 0);
	outq_consume(&q, 1);
	assert_int_equal(outq_append(&q, "x", 1, 900000), 0); /* nobody looked meanwhile */
	assert_false(outq_is_stalled(&q, 900050, 100));
	assert_true(outq_is_stalled(&q, 900100, 100));
	outq_fini(&q);
}

struct seen { uint64_t asked_ns[4]; unsigned n; };

static void see(const struct outq_chunk *chunk, void *userdata)
{
	struct seen *seen = userdata;

	assert_in_range(seen->n, 0, 3);
	seen->asked_ns[seen->n++] = chunk->asked_ns;
}

static void who_times_answers_sees_each_once_when_its_last_byte_is_sent(void **state)
{
	struct outq_chunk *chunk[3];
	struct seen seen = { .n = 0 };
	uint64_t held = 0;
	struct outq q;

	(void)state;
	outq_init(&q, &held);
	q.on_sent = see;
	q.userdata = &seen;
	for (uint32_t i = 0; i < 3; i++) {
		chunk[i] = message_of(20, i + 1, i);
		chunk[i]->asked_ns = i == 1 ? 0 : 7 + i;
		outq_push(&q, i + 1, chunk[i], 0);
	}
	outq_consume(&q, 19);
	assert_int_equal(seen.n, 0);
	outq_consume(&q, 1 + 20 + 5);
	assert_int_equal(seen.n, 1);
	assert_int_equal(seen.asked_ns[0], 7);
	outq_push(&q, 4, message_of(20, 4, 3), 0);
	q.answers.last->asked_ns = 99;
	outq_drop(&q, 4, 0, NULL, NULL); /* never sent */
	outq_consume(&q, 15);
	assert_int_equal(seen.n, 2);
	assert_int_equal(seen.asked_ns[1], 9);
	assert_int_equal(q.size, 0);
	outq_fini(&q);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(lanes_keep_messages_whole_and_in_order_whatever_the_writes),
		cmocka_unit_test(control_messages_pass_answers_but_not_the_message_under_way),
		cmocka_unit_test(what_is_dropped_is_freed_at_once_but_for_the_message_under_way),
		cmocka_unit_test(who_holds_more_has_to_take_more),
		cmocka_unit_test(the_slowest_reader_is_done_in_time),
		cmocka_unit_test(small_messages_share_chunks),
		cmocka_unit_test(empty_chunks_leave_no_trace),
		cmocka_unit_test(what_is_not_written_belongs_to_the_queue),
		cmocka_unit_test(a_stall_is_bytes_that_wait_without_progress),
		cmocka_unit_test(the_clock_of_a_stall_starts_with_the_first_byte),
		cmocka_unit_test(who_times_answers_sees_each_once_when_its_last_byte_is_sent),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
