/* FETCH: parts of model files, from a real daemon to a peer that speaks raw bytes. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "fixture.h"

#define LARGE_BYTES (1 << 20)

static char folder[PATH_MAX];
static struct daemon psrd;
static struct peer p;
static uint8_t *file;      /* teapot.psr */
static uint64_t n_file, hash;

static int set_up(void **state)
{
	static const char *const more[] = { "--threads", "2", "--slow-timeout", "600", NULL };
	char path[2 * PATH_MAX];
	struct stat status;
	FILE *stream;
	uint8_t *large;

	(void)state;
	folder_make(folder);
	teapot_write(folder);
	plate_write(folder, "plate.psr", 0x2040c0);
	file_write(folder, "source.ply", "ply\n", 4);
	large = calloc(1, LARGE_BYTES);
	assert_non_null(large);
	snprintf(path, sizeof path, "%s/teapot.psr", folder);
	stream = fopen(path, "rb");
	assert_true(stream != NULL && fstat(fileno(stream), &status) == 0);
	n_file = (uint64_t)status.st_size;
	file = malloc(n_file);
	assert_true(file != NULL && fread(file, 1, n_file, stream) == n_file);
	fclose(stream);
	memcpy(large, file, 64);
	file_write(folder, "large.psr", large, LARGE_BYTES);
	free(large);
	memcpy(&hash, file + 56, 8);
	daemon_start(&psrd, folder, more);
	return 0;
}

static int tear_down(void **state)
{
	(void)state;
	daemon_stop(&psrd);
	folder_remove(folder);
	free(file);
	return 0;
}

static uint32_t ask(const struct psr_msg_fetch *msg)
{
	assert_int_equal(psr_msg_fetch_encode(&p.buf, ++p.id, msg, NULL), PSR_OK);
	peer_send(&p);
	return p.id;
}

/* Takes parts from `offset` on, up to FETCH_END; returns behind the last byte. */
static uint64_t take(uint32_t id, uint64_t offset, struct psr_msg_fetch_end *end)
{
	struct psr_msg_fetch_part part;
	struct psr_message message;

	for (;;) {
		assert_int_equal(peer_next(&p, &message), 1);
		assert_int_equal(message.id, id);
		if (message.type == PSR_MSG_FETCH_END)
			break;
		assert_int_equal(message.type, PSR_MSG_FETCH_PART);
		assert_int_equal(psr_msg_fetch_part_decode(&part, message.payload, message.n, NULL), PSR_OK);
		assert_int_equal(part.offset, offset);
		assert_true(part.bytes <= n_file - offset);
		assert_memory_equal(part.data, file + offset, part.bytes);
		offset += part.bytes;
	}
	assert_int_equal(psr_msg_fetch_end_decode(end, message.payload, message.n, NULL), PSR_OK);
	return offset;
}

static void a_file_comes_by_name_or_handle_whole_or_in_parts(void **state)
{
	const struct {
		uint64_t offset, length, to;
	} parts[] = { { 0, 0, n_file }, { 0, 1, 1 }, { 100, 70000, 70100 }, { n_file - 5, 100, n_file },
		          { n_file, 0, n_file }, { n_file + 10, 10, n_file + 10 }, { 0, PSR_WIRE_MAX_INTEGER, n_file } };
	struct psr_msg_opened opened;

	(void)state;
	peer_hello(&p, &psrd, NULL);
	peer_expect_opened(&p, peer_ask_open(&p, "teapot"), &opened);
	for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++)
		for (int by_name = 0; by_name < 2; by_name++) {
			struct psr_msg_fetch msg = { .handle = by_name ? 0 : opened.handle, .offset = parts[i].offset,
				                         .length = parts[i].length, .file_hash = i % 2 ? hash : 0 };
			struct psr_msg_fetch_end end;

			strcpy(msg.name, by_name ? "teapot" : "");
			assert_int_equal(take(ask(&msg), parts[i].offset, &end), parts[i].to);
			assert_int_equal(end.file_bytes, n_file);
			assert_int_equal(end.file_hash, hash);
		}
	peer_close(&p);
}

static void what_cannot_be_had_is_refused_by_a_sentence(void **state)
{
	char text[PSR_ERROR_TEXT];

	(void)state;
	peer_hello(&p, &psrd, NULL);
	peer_expect_error(&p, ask(&(struct psr_msg_fetch){ .handle = 3 }), PSR_WIRE_NOT_FOUND, text);
	assert_non_null(strstr(text, "no open model has handle 3"));
	peer_expect_error(&p, ask(&(struct psr_msg_fetch){ .name = "kettle" }), PSR_WIRE_NOT_FOUND, text);
	peer_expect_error(&p, ask(&(struct psr_msg_fetch){ .name = "../teapot" }), PSR_WIRE_NOT_FOUND, text);
	peer_expect_error(&p, ask(&(struct psr_msg_fetch){ .name = "source" }), PSR_WIRE_UNSUPPORTED, text);
	assert_non_null(strstr(text, "OPEN it first"));
	peer_expect_error(&p, ask(&(struct psr_msg_fetch){ .name = "teapot", .file_hash = ~hash }), PSR_WIRE_NOT_FOUND, text);
	assert_non_null(strstr(text, "another one by now"));
	assert_null(strstr(text, folder));
	peer_close(&p);
}

static void many_at_once_are_answered_in_their_order(void **state)
{
	struct psr_msg_fetch_end end;
	uint32_t first = 0;

	(void)state;
	peer_hello(&p, &psrd, NULL);
	for (int i = 0; i < 64; i++) {
		const uint32_t id = ask(&(struct psr_msg_fetch){ .offset = 10 * (uint64_t)i, .length = 90000, .name = "teapot" });

		first = first != 0 ? first : id;
	}
	for (uint32_t i = 0; i < 64; i++)
		assert_int_equal(take(first + i, 10 * i, &end), 10 * i + 90000);
	peer_close(&p);
}

/* psrd answers PING and LIST while a reader takes no part of a file: they pass parts, and the parts that wait are few. */
static void other_answers_pass_a_file_that_nobody_reads(void **state)
{
	struct psr_msg_fetch msg = { .name = "large" };
	struct psr_message message;
	uint32_t list, id;
	long before;

	(void)state;
	peer_hello(&p, &psrd, NULL);
	before = daemon_resident_kb(&psrd);
	id = p.id + 1;
	for (int i = 0; i < 60; i++)
		ask(&msg);
	list = ++p.id;
	psr_msg_list_encode(&p.buf, list, NULL);
	peer_send(&p);
	usleep(300000);
	/* The 60 MiB are not read ahead: what a socket takes, and some parts. */
	assert_true(daemon_resident_kb(&psrd) - before < 60 * (LARGE_BYTES >> 10) / 4);
	for (int has_list = 0, n = 0; !has_list; n++) {
		assert_int_equal(peer_next(&p, &message), 1);
		has_list = message.type == PSR_MSG_LIST_END && message.id == list;
		assert_true(message.type != PSR_MSG_FETCH_END || message.id < id + 30);
	}
	peer_close(&p);
}

static void a_fetch_is_cancelled_while_it_waits_or_comes(void **state)
{
	struct psr_msg_fetch msg = { .name = "teapot" };
	struct psr_msg_fetch_end end;
	struct psr_message message;
	uint32_t first, second, third;

	(void)state;
	peer_hello(&p, &psrd, NULL);
	first = ask(&msg);
	second = ask(&msg);
	third = ask(&(struct psr_msg_fetch){ .name = "teapot", .length = 5 });
	psr_msg_cancel_encode(&p.buf, second, 0, NULL);
	psr_msg_cancel_encode(&p.buf, first, 0, NULL);
	peer_send(&p);
	for (int n_cancelled = 0, had_end = 0; n_cancelled + had_end < 2;) {
		assert_int_equal(peer_next(&p, &message), 1);
		assert_true(message.id == first || message.id == second);
		n_cancelled += message.type == PSR_MSG_CANCELLED;
		had_end += message.type == PSR_MSG_FETCH_END; /* it may have crossed the CANCEL */
	}
	assert_int_equal(take(third, 0, &end), 5);
	peer_close(&p);
}

static void a_client_that_goes_in_the_middle_leaves_nothing(void **state)
{
	struct psr_msg_fetch_end end;

	(void)state;
	for (int i = 0; i < 20; i++) {
		peer_hello(&p, &psrd, NULL);
		ask(&(struct psr_msg_fetch){ .name = "teapot" });
		ask(&(struct psr_msg_fetch){ .name = "plate" });
		peer_close(&p);
	}
	peer_hello(&p, &psrd, NULL);
	assert_int_equal(take(ask(&(struct psr_msg_fetch){ .name = "teapot" }), 0, &end), n_file);
	peer_close(&p);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_file_comes_by_name_or_handle_whole_or_in_parts),
		cmocka_unit_test(what_cannot_be_had_is_refused_by_a_sentence),
		cmocka_unit_test(many_at_once_are_answered_in_their_order),
		cmocka_unit_test(other_answers_pass_a_file_that_nobody_reads),
		cmocka_unit_test(a_fetch_is_cancelled_while_it_waits_or_comes),
		cmocka_unit_test(a_client_that_goes_in_the_middle_leaves_nothing),
	};

	return cmocka_run_group_tests(tests, set_up, tear_down);
}
