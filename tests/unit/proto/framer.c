/* The framer: arbitrary splits, limits, the rules of headers. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "base/random.h"
#include "table.h"

static uint8_t storage[PSR_WIRE_MAX_MESSAGE], big[3 * PSR_WIRE_MAX_MESSAGE];

static uint64_t seed;

static void put(struct psr_framer *framer, const uint8_t *bytes, size_t n)
{
	size_t room;
	uint8_t *space = psr_framer_space(framer, &room);

	assert_true(n <= room);
	memcpy(space, bytes, n);
	psr_framer_filled(framer, n);
}

static size_t hello_bytes(uint8_t *bytes, size_t capacity)
{
	static const struct psr_msg_hello hello = { .major = PSR_PROTO_MAJOR, .minor = PSR_PROTO_MINOR, .client = "test" };
	struct psr_buf out = { bytes, 0, capacity };

	assert_int_equal(psr_msg_hello_encode(&out, &hello, NULL), PSR_OK);
	return out.size;
}

static void header_bytes(uint8_t *p, uint32_t length, unsigned type, unsigned flags, uint32_t id, unsigned view)
{
	const uint32_t v[4] = { length, type | flags << 16, id, view };

	for (int i = 0; i < 16; i++)
		p[i] = (uint8_t)(v[i / 4] >> 8 * (i % 4));
}

/* A framer behind an accepted HELLO. */
static void init_accepted(struct psr_framer *framer)
{
	uint8_t bytes[1024];
	struct psr_message m;
	size_t n = hello_bytes(bytes, sizeof bytes);

	psr_framer_init(framer, PSR_CLIENT, storage, sizeof storage);
	put(framer, bytes, n);
	assert_int_equal(psr_framer_next(framer, &m, NULL), 1);
	psr_framer_accept(framer, storage, sizeof storage);
}

static void framer_waits_for_split_header(void **state)
{
	uint8_t bytes[1024];
	size_t n = hello_bytes(bytes, sizeof bytes);
	struct psr_framer framer;
	struct psr_message m;

	(void)state;
	psr_framer_init(&framer, PSR_CLIENT, storage, sizeof storage);
	assert_int_equal(psr_framer_next(&framer, &m, NULL), 0);
	for (size_t i = 0; i < n - 1; i++) {
		put(&framer, bytes + i, 1);
		assert_int_equal(psr_framer_next(&framer, &m, NULL), 0);
	}
	put(&framer, bytes + n - 1, 1);
	assert_int_equal(psr_framer_next(&framer, &m, NULL), 1);
	assert_int_equal(m.type, PSR_MSG_HELLO);
	assert_memory_equal(m.payload, bytes + 16, n - 16);
	assert_int_equal(psr_framer_next(&framer, &m, NULL), 0);
}

/* One stream of messages of many sizes, cut at random: always the same messages. */
static void any_split_gives_the_same_messages(void **state)
{
	static uint8_t stream[2 << 20], data[PSR_WIRE_MAX_RECT_DATA];
	static uint32_t sizes[200];
	struct psr_buf out = { stream, 0, sizeof stream };

	(void)state;
	seed = 7;
	for (size_t i = 0; i < sizeof data; i++)
		data[i] = (uint8_t)random_below(&seed, 256);
	for (uint32_t i = 0; i < 200; i++) {
		struct psr_msg_rect rect = { .plane = PSR_PLANE_COLOR, .codec = PSR_CODEC_ZSTD, .scale = 1, .w = 640,
			.h = 128, .total = 100000, .data = data };

		sizes[i] = rect.bytes = i % 10 == 9 ? PSR_WIRE_MAX_RECT_DATA : 1 + random_below(&seed, 3000);
		assert_int_equal(psr_msg_rect_encode(&out, i + 1, 0, &rect, NULL), PSR_OK);
	}
	for (int round = 0; round < 40; round++) {
		struct psr_framer framer;
		struct psr_message m;
		struct psr_msg_rect rect;
		size_t at = 0, got = 0, chunk_max = (size_t)1 << random_below(&seed, 18);

		psr_framer_init(&framer, PSR_SERVER, storage, sizeof storage);
		while (at < out.size) {
			size_t room, n = 1 + random_below(&seed, (uint32_t)chunk_max);
			uint8_t *space = psr_framer_space(&framer, &room);

			assert_true(room > 0);
			n = n < room ? n : room;
			n = n < out.size - at ? n : out.size - at;
			memcpy(space, stream + at, n);
			psr_framer_filled(&framer, n);
			at += n;
			while (psr_framer_next(&framer, &m, NULL) > 0) {
				assert_int_equal(m.type, PSR_MSG_RECT);
				assert_int_equal(m.id, got + 1);
				assert_int_equal(psr_msg_rect_decode(&rect, m.payload, m.n, NULL), PSR_OK);
				assert_int_equal(rect.bytes, sizes[got]);
				assert_memory_equal(rect.data, data, rect.bytes);
				got++;
			}
			assert_false(framer.failed);
		}
		assert_int_equal(got, 200);
	}
}

static void strangers_are_known_by_their_first_wrong_byte(void **state)
{
	static const char *const streams[] = { "GET / HTTP/1.1\r\n", "\x16\x03\x01\x02", "SSH-2.0-OpenSSH\r\n" };
	uint8_t bytes[1024];

	(void)state;
	for (int i = 0; i < 3; i++) {
		struct psr_framer framer;
		struct psr_message m;

		psr_framer_init(&framer, PSR_CLIENT, storage, sizeof storage);
		put(&framer, (const uint8_t *)streams[i], 4);
		assert_int_equal(psr_framer_next(&framer, &m, NULL), PSR_ERR_FORMAT);
	}
	hello_bytes(bytes, sizeof bytes);
	for (size_t wrong = 2; wrong < 24; wrong++) {
		struct psr_framer framer;
		struct psr_message m;

		psr_framer_init(&framer, PSR_CLIENT, storage, sizeof storage);
		bytes[wrong] ^= 0x40;
		put(&framer, bytes, wrong);
		assert_int_equal(psr_framer_next(&framer, &m, NULL), 0);
		put(&framer, bytes + wrong, 1);
		assert_int_equal(psr_framer_next(&framer, &m, NULL), PSR_ERR_FORMAT);
		bytes[wrong] ^= 0x40;
	}
}

static void failure_is_for_ever(void **state)
{
	struct psr_framer framer;
	struct psr_message m;
	struct psr_error err;
	uint8_t bytes[16];

	(void)state;
	init_accepted(&framer);
	header_bytes(bytes, 15, PSR_MSG_LIST, 0, 1, 0);
	put(&framer, bytes, 16);
	assert_int_equal(psr_framer_next(&framer, &m, &err), PSR_ERR_PROTOCOL);
	header_bytes(bytes, 16, PSR_MSG_LIST, 0, 1, 0);
	put(&framer, bytes, 16);
	assert_int_equal(psr_framer_next(&framer, &m, &err), PSR_ERR_PROTOCOL);

	/* Also if what was wrong would be right by now. */
	psr_framer_init(&framer, PSR_CLIENT, storage, sizeof storage);
	put(&framer, big, hello_bytes(big, sizeof big));
	assert_int_equal(psr_framer_next(&framer, &m, &err), 1);
	header_bytes(big, 2000, PSR_MSG_SCENE, 0, 1, 0);
	put(&framer, big, 2000);
	assert_int_equal(psr_framer_next(&framer, &m, &err), PSR_ERR_PROTOCOL);
	psr_framer_accept(&framer, storage, sizeof storage);
	assert_int_equal(psr_framer_next(&framer, &m, &err), PSR_ERR_PROTOCOL);
}

static void a_kilobyte_is_the_limit_until_accepted(void **state)
{
	struct psr_framer framer;
	struct psr_message m;
	uint8_t small[PSR_WIRE_MAX_MESSAGE_HELLO], bytes[1024];
	size_t n = hello_bytes(bytes, sizeof bytes);
	int accept;

	(void)state;
	for (accept = 0; accept < 2; accept++) {
		psr_framer_init(&framer, PSR_CLIENT, small, sizeof small);
		put(&framer, bytes, n);
		header_bytes(big, 2000, PSR_MSG_SCENE, 0, 1, 0);
		put(&framer, big, 100);
		assert_int_equal(psr_framer_next(&framer, &m, NULL), 1);
		if (accept) {
			psr_framer_accept(&framer, storage, sizeof storage);
			assert_int_equal(psr_framer_next(&framer, &m, NULL), 0);
			put(&framer, big + 100, 1900);
			assert_int_equal(psr_framer_next(&framer, &m, NULL), 1);
			assert_int_equal(m.n, 1984);
			assert_memory_equal(m.payload, big + 16, 1984);
		} else {
			assert_int_equal(psr_framer_next(&framer, &m, NULL), PSR_ERR_PROTOCOL);
		}
	}
}

static void nothing_comes_before_hello(void **state)
{
	struct psr_framer framer;
	struct psr_message m;
	uint8_t bytes[1024];

	(void)state;
	psr_framer_init(&framer, PSR_CLIENT, storage, sizeof storage);
	header_bytes(bytes, 16, PSR_MSG_LIST, 0, 1, 0);
	put(&framer, bytes, 16);
	assert_int_equal(psr_framer_next(&framer, &m, NULL), PSR_ERR_FORMAT);
}

static void unknown_types_pass_only_with_skip(void **state)
{
	struct psr_framer framer;
	struct psr_message m;
	uint8_t bytes[16];

	(void)state;
	init_accepted(&framer);
	header_bytes(big, 60000, 77, PSR_FLAG_SKIP, 5, 9);
	put(&framer, big, 60000);
	header_bytes(bytes, 16, PSR_MSG_LIST, 0, 1, 0);
	put(&framer, bytes, 16);
	assert_int_equal(psr_framer_next(&framer, &m, NULL), 1);
	assert_int_equal(m.type, PSR_MSG_LIST);
	assert_int_equal(framer.skipped, 1);
	header_bytes(bytes, 16, 77, 0, 5, 9);
	put(&framer, bytes, 16);
	assert_int_equal(psr_framer_next(&framer, &m, NULL), PSR_ERR_PROTOCOL);
}

/* Every type, from either side, with every combination of id, view and length: refused exactly as PROTOCOL.md's table
 * says. */
static void headers_follow_the_table(void **state)
{
	enum { C = 1, S = 2, B = 3, Z = 0, P = 1, A = 2 };
	static const struct { unsigned type, from, id, view, min, max; } table[] = {
		{ 2, S, Z, Z, 58, 313 }, { 3, B, Z, Z, 6, 261 }, { 4, B, Z, Z, 8, 8 }, { 5, B, Z, Z, 8, 8 },
		{ 6, S, A, A, 6, 517 }, { 16, C, P, Z, 0, 0 }, { 17, S, P, Z, 34, 289 }, { 18, S, P, Z, 4, 4 },
		{ 19, C, P, Z, 6, 261 }, { 20, S, P, Z, 24, 24 }, { 21, S, P, Z, 168, 168 }, { 22, C, P, Z, 4, 4 },
		{ 23, C, P, Z, 4, 4 }, { 24, S, P, Z, 107, 361 }, { 25, S, P, Z, 8, 8 },
		{ 32, C, P, Z, 24, 65520 }, { 33, C, P, A, 176, 176 }, { 34, S, P, A, 160, 160 }, { 35, S, P, A, 25, 65520 },
		{ 36, S, P, A, 40, 1256 }, { 37, S, P, P, 4, 4 }, { 38, S, P, A, 0, 0 }, { 39, C, P, P, 4, 4 },
		{ 40, C, P, A, 0, 0 }, { 41, C, P, A, 0, 0 }, { 42, C, P, A, 0, 0 }, { 48, C, P, Z, 0, 0 },
		{ 49, S, P, Z, 8, 648 },
	};

	(void)state;
	for (size_t i = 0; i < sizeof table / sizeof table[0]; i++) {
		const unsigned most = table[i].max + PSR_WIRE_GROWTH;
		const unsigned lengths[4] = { table[i].min - 1, table[i].min, most, most + 1 };

		assert_non_null(psr_msg_name(table[i].type));
		for (unsigned c = 0; c < 32; c++) {
			unsigned side = c & 1 ? S : C, id = c >> 1 & 1, view = c >> 2 & 1, n = lengths[c >> 3];
			int fits = (table[i].from & side) && (table[i].id == A || table[i].id == id) &&
			           (table[i].view == A || table[i].view == view) && n + 1 > table[i].min && n <= most;
			struct psr_framer framer;
			struct psr_message m;

			if (n == (unsigned)-1 || n > PSR_WIRE_MAX_PAYLOAD)
				continue;
			if (side == C)
				init_accepted(&framer);
			else
				psr_framer_init(&framer, PSR_SERVER, storage, sizeof storage);
			header_bytes(big, 16 + n, table[i].type, 0, id, view);
			put(&framer, big, 16 + n);
			if (psr_framer_next(&framer, &m, NULL) != (fits ? 1 : PSR_ERR_PROTOCOL))
				fail_msg("type %u, side %u, id %u, view %u, %u bytes", table[i].type, side, id, view, n);
		}
	}
}

static void accept_keeps_what_is_already_read(void **state)
{
	struct psr_framer framer;
	struct psr_message m;
	uint8_t small[PSR_WIRE_MAX_MESSAGE_HELLO], bytes[1024];
	struct psr_buf out = { bytes, 0, sizeof bytes };

	(void)state;
	psr_framer_init(&framer, PSR_CLIENT, small, sizeof small);
	out.size = hello_bytes(bytes, sizeof bytes);
	assert_int_equal(psr_msg_list_encode(&out, 1, NULL), PSR_OK);
	assert_int_equal(psr_msg_stats_encode(&out, 2, NULL), PSR_OK);
	put(&framer, bytes, out.size - 3);
	assert_int_equal(psr_framer_next(&framer, &m, NULL), 1);
	psr_framer_accept(&framer, storage, sizeof storage);
	assert_int_equal(psr_framer_next(&framer, &m, NULL), 1);
	assert_int_equal(m.type, PSR_MSG_LIST);
	assert_int_equal(psr_framer_next(&framer, &m, NULL), 0);
	put(&framer, bytes + out.size - 3, 3);
	assert_int_equal(psr_framer_next(&framer, &m, NULL), 1);
	assert_int_equal(m.type, PSR_MSG_STATS);
	assert_int_equal(m.id, 2);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(framer_waits_for_split_header),
		cmocka_unit_test(any_split_gives_the_same_messages),
		cmocka_unit_test(strangers_are_known_by_their_first_wrong_byte),
		cmocka_unit_test(failure_is_for_ever),
		cmocka_unit_test(a_kilobyte_is_the_limit_until_accepted),
		cmocka_unit_test(nothing_comes_before_hello),
		cmocka_unit_test(unknown_types_pass_only_with_skip),
		cmocka_unit_test(headers_follow_the_table),
		cmocka_unit_test(accept_keeps_what_is_already_read),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
