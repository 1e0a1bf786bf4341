/* The output queue: bytes come out in order whatever the writes, and stalls are told by the clock that it is given. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <string.h>
#include "server/net/outq.h"

#define TOTAL 200000

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

static void bytes_come_out_in_order_whatever_the_writes(void **state)
{
	static uint8_t in[TOTAL], out[TOTAL];
	uint64_t random = 0x123456789abcdef;
	size_t n_in = 0, n_out = 0;
	struct outq q;
	struct iovec iov[5];

	(void)state;
	for (size_t i = 0; i < TOTAL; i++)
		in[i] = (uint8_t)(next_random(&random) >> 32);
	outq_init(&q);
	while (n_out < TOTAL) {
		size_t n = next_random(&random) % 9000, taken = 0;
		int n_iov;

		n = n < TOTAL - n_in ? n : TOTAL - n_in;
		if (n > 0 && next_random(&random) % 3 == 0) {
			struct outq_chunk *chunk = outq_chunk_create(n + 1);

			assert_non_null(chunk);
			memcpy(chunk->data, in + n_in, n);
			chunk->size = n;
			outq_push(&q, chunk, 0);
		} else {
			assert_int_equal(outq_append(&q, in + n_in, n, 0), 0);
		}
		n_in += n;
		assert_true(q.size == n_in - n_out);
		n_iov = outq_peek(&q, iov, (int)(1 + next_random(&random) % 5));
		for (int i = 0; i < n_iov; i++) { /* a short write somewhere in the middle */
			size_t part = next_random(&random) % (iov[i].iov_len + 1);

			if (next_random(&random) % 2)
				part = iov[i].iov_len;
			memcpy(out + n_out + taken, iov[i].iov_base, part);
			taken += part;
			if (part < iov[i].iov_len)
				break;
		}
		outq_consume(&q, taken);
		n_out += taken;
	}
	assert_memory_equal(in, out, TOTAL);
	assert_true(q.size == 0 && q.first == NULL && q.last == NULL && q.sent == TOTAL);
	outq_fini(&q);
}

static void small_messages_share_chunks(void **state)
{
	struct outq q;
	struct iovec iov[64];

	(void)state;
	outq_init(&q);
	for (int i = 0; i < 100; i++)
		assert_int_equal(outq_append(&q, "0123456789", 10, 0), 0);
	assert_int_equal(outq_peek(&q, iov, 64), 1);
	assert_int_equal(iov[0].iov_len, 1000);
	outq_fini(&q);
}

static void empty_chunks_leave_no_trace(void **state)
{
	struct outq q;
	struct iovec iov[4];
	struct outq_chunk *first = chunk_of(8, 0, 0);

	(void)state;
	first->next = chunk_of(8, 3, 7);
	first->next->next = chunk_of(8, 0, 0);
	outq_init(&q);
	outq_push(&q, first, 0);
	assert_int_equal(outq_peek(&q, iov, 4), 1);
	assert_int_equal(iov[0].iov_len, 3);
	outq_consume(&q, 3);
	assert_int_equal(outq_peek(&q, iov, 4), 0);
	outq_fini(&q);
}

static void what_is_not_written_belongs_to_the_queue(void **state)
{
	struct outq q;

	(void)state;
	outq_init(&q);
	outq_push(&q, chunk_of(100, 100, 1), 0);
	outq_push(&q, chunk_of(100, 100, 2), 0);
	outq_consume(&q, 30);
	outq_fini(&q); /* the leak checker is the judge */
	assert_true(q.size == 0 && q.first == NULL);
}

static void a_stall_is_bytes_that_wait_without_progress(void **state)
{
	struct outq q;

	(void)state;
	outq_init(&q);
	assert_false(outq_is_stalled(&q, 1000, 100)); /* nothing waits */
	outq_push(&q, chunk_of(300000, 300000, 1), 5000);
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

static void the_clock_of_a_stall_starts_with_the_first_byte(void **state)
{
	struct outq q;

	(void)state;
	outq_init(&q);
	assert_int_equal(outq_append(&q, "x", 1, 1000), 0);
	outq_consume(&q, 1);
	assert_int_equal(outq_append(&q, "x", 1, 900000), 0); /* nobody looked meanwhile */
	assert_false(outq_is_stalled(&q, 900050, 100));
	assert_true(outq_is_stalled(&q, 900100, 100));
	outq_fini(&q);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(bytes_come_out_in_order_whatever_the_writes),
		cmocka_unit_test(small_messages_share_chunks),
		cmocka_unit_test(empty_chunks_leave_no_trace),
		cmocka_unit_test(what_is_not_written_belongs_to_the_queue),
		cmocka_unit_test(a_stall_is_bytes_that_wait_without_progress),
		cmocka_unit_test(the_clock_of_a_stall_starts_with_the_first_byte),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
