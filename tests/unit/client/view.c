/* A client in a view above 0: bases, ACK, supersession; and servers that lie about them. The server is this test: it
 * says a message, the client waits. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>
#include "client/lib/internal.h"

#define SIDE 40
#define VIEW 3

static struct psr_client *client;
static int server;
static struct psr_framer framer;
static uint8_t in[2 * PSR_WIRE_MAX_MESSAGE], out_bytes[PSR_WIRE_MAX_MESSAGE];
static struct psr_buf out;
static struct psr_event event;
static struct psr_error err;

/* What the server has queued is sent, and the client takes it: as psr_client_wait(). */
static int give(void)
{
	assert_int_equal(send(server, out.data, out.size, 0), out.size);
	out.size = 0;
	return psr_client_wait(client, 0, &event, &err);
}

static int set_up_with(uint64_t capabilities)
{
	const struct psr_msg_welcome welcome = {
		.major = PSR_PROTO_MAJOR, .minor = PSR_PROTO_MINOR, .capabilities = capabilities, .max_message = 65536,
		.max_side = 4096, .max_pixels = 1 << 20, .max_instances = 1, .max_lights = 1, .max_scenes = 1, .max_open = 64,
		.max_models = 1, .server = "test",
	};
	const struct psr_msg_hello hello = { .major = PSR_PROTO_MAJOR, .minor = PSR_PROTO_MINOR };
	int ends[2];

	assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
	assert_int_equal(fcntl(ends[0], F_SETFL, O_NONBLOCK), 0);
	assert_int_equal(fcntl(ends[1], F_SETFL, O_NONBLOCK), 0);
	server = ends[1];
	psr_framer_init(&framer, PSR_CLIENT, in, sizeof in);
	out = (struct psr_buf){ .data = out_bytes, .capacity = sizeof out_bytes };
	assert_int_equal(client_create(&client, ends[0], "test", NULL), PSR_OK);
	assert_int_equal(psr_msg_hello_encode(&client->out, &hello, NULL), PSR_OK);
	client_flush(client);
	assert_int_equal(psr_msg_welcome_encode(&out, &welcome, NULL), PSR_OK);
	assert_int_equal(give(), 0);
	return 0;
}

static int set_up(void **state)
{
	(void)state;
	return set_up_with(PSR_CAP_VIEWS | PSR_CAP_BASE | PSR_CAP_REFINE | PSR_CAP_PAUSE | PSR_CAP_SHARP | PSR_CAP_DEPTH_U16);
}

static int tear_down(void **state)
{
	(void)state;
	psr_client_close(client);
	close(server);
	return 0;
}

/* The next message of the client; its type is 0 if there is none. HELLO is taken silently. */
static struct psr_message heard(void)
{
	struct psr_message message = { 0 };

	for (;;) {
		const int got = psr_framer_next(&framer, &message, NULL);
		size_t room;
		uint8_t *space;
		ssize_t n;

		assert_true(got >= 0);
		if (got > 0 && message.type != PSR_MSG_HELLO)
			return message;
		if (got > 0) {
			psr_framer_accept(&framer, in, sizeof in);
			continue;
		}
		space = psr_framer_space(&framer, &room);
		n = recv(server, space, room, 0);
		if (n <= 0)
			return (struct psr_message){ 0 };
		psr_framer_filled(&framer, (size_t)n);
	}
}

static struct psr_msg_frame request(void)
{
	return (struct psr_msg_frame){
		.width = SIDE, .height = SIDE, .planes = 1, .color_codec = PSR_CODEC_JPEG, .color_quality = 50,
		.camera = { .kind = PSR_CAMERA_PERSPECTIVE, .eye = { 0, 0, 1 }, .up = { 0, 1, 0 }, .fov_y = 1 },
	};
}

static uint32_t ask(const struct psr_msg_frame *frame)
{
	uint32_t id;

	if (psr_client_frame_in(client, VIEW, frame, &id, &err) != PSR_OK)
		fail_msg("%s", err.text);
	return id;
}

/* ---- what the server says ---- */

struct say {
	uint32_t id;
	uint16_t pass;
	uint32_t base;
	uint16_t base_pass;
	int rows;        /* from the top, that are sent as `grey`: raw */
	uint8_t grey;
	int is_final;
};

static struct psr_msg_frame_begin begin_of(const struct say *say)
{
	const struct psr_msg_frame asked = request();

	return (struct psr_msg_frame_begin){
		.pass = say->pass, .refine = say->pass, .width = SIDE, .height = SIDE, .planes = 1,
		.color_codec = PSR_CODEC_JPEG, .color_quality = 50, .background = { 1, 2, 3 }, .base = say->base,
		.base_pass = say->base_pass, .settings = { .scale = 1, .spacing_px = 1 }, .camera = asked.camera,
	};
}

static void put_begin(const struct say *say)
{
	const struct psr_msg_frame_begin begin = begin_of(say);

	assert_int_equal(psr_msg_frame_begin_encode(&out, say->id, VIEW, &begin, NULL), PSR_OK);
}

static void put_rest(const struct say *say)
{
	static uint8_t rgb[3 * SIDE * SIDE];
	const uint32_t bytes = (uint32_t)(3 * SIDE * say->rows);
	const struct psr_msg_rect rect = { .codec = PSR_CODEC_RAW, .scale = 1, .w = SIDE, .h = (uint16_t)say->rows,
		                               .total = bytes, .bytes = bytes, .data = rgb };
	const struct psr_msg_frame_end end = { .pass = say->pass, .is_final = (uint8_t)say->is_final, .planes = 1 };

	memset(rgb, say->grey, sizeof rgb);
	if (say->rows > 0)
		assert_int_equal(psr_msg_rect_encode(&out, say->id, VIEW, &rect, NULL), PSR_OK);
	assert_int_equal(psr_msg_frame_end_encode(&out, say->id, VIEW, &end, NULL), PSR_OK);
}

/* A whole frame; the client must like it. */
static void show(struct say say)
{
	put_begin(&say);
	if (give() != 1)
		fail_msg("%s", err.text);
	assert_true(event.type == PSR_EVENT_BEGIN && event.id == say.id && event.bytes > 0);
	put_rest(&say);
	if (give() != 1)
		fail_msg("%s", err.text);
	assert_true(event.type == PSR_EVENT_FRAME && event.id == say.id && event.end->pass == say.pass);
}

static struct psr_msg_frame plain(void)
{
	struct psr_msg_frame frame = request();

	frame.flags = PSR_WIRE_FRAME_NO_HASHES;
	return frame;
}

/* ---- tests ---- */

static void a_frame_on_a_base_starts_as_it(void **state)
{
	struct psr_msg_frame frame = plain();
	uint32_t first = ask(&frame), second;

	(void)state;
	show((struct say){ .id = first, .rows = SIDE, .grey = 90, .is_final = 1 });
	assert_int_equal(psr_client_base(client, VIEW), 0);
	assert_int_equal(psr_client_ack(client, first, 0, &err), PSR_OK);
	assert_int_equal(psr_client_base(client, VIEW), first);
	frame.base = first;
	second = ask(&frame);
	show((struct say){ .id = second, .base = first, .rows = 10, .grey = 200, .is_final = 1 });
	for (int i = 0; i < SIDE * SIDE; i++)
		assert_int_equal(event.picture->rgb[3 * i], i < 10 * SIDE ? 200 : 90);
}

static void a_later_frame_of_an_answer_may_build_on_an_earlier_one(void **state)
{
	struct psr_msg_frame frame = plain();
	uint32_t id;

	(void)state;
	frame.pass_limit = 2;
	id = ask(&frame);
	show((struct say){ .id = id, .rows = SIDE, .grey = 90 });
	assert_int_equal(psr_client_ack(client, id, 0, &err), PSR_OK);
	show((struct say){ .id = id, .pass = 1, .base = id, .rows = 10, .grey = 200 });
	show((struct say){ .id = id, .pass = 2, .base = id, .rows = 5, .grey = 7, .is_final = 1 }); /* on 0, again */
	for (int i = 0; i < SIDE * SIDE; i++)
		assert_int_equal(event.picture->rgb[3 * i], i < 5 * SIDE ? 7 : 90);
}

static void the_picture_stays_until_it_is_acknowledged(void **state)
{
	const struct psr_msg_frame frame = plain();
	const uint32_t first = ask(&frame), second = ask(&frame);
	const struct psr_frame *picture;

	(void)state;
	show((struct say){ .id = first, .rows = SIDE, .grey = 90, .is_final = 1 });
	picture = event.picture;
	show((struct say){ .id = second, .rows = SIDE, .grey = 91, .is_final = 1 });
	assert_int_equal(picture->rgb[3 * SIDE * SIDE - 1], 90);
}

/* Frames that come meanwhile are told afterwards, in order, and their pictures stay until they are acknowledged. */
static void models_are_listed_and_opened_while_frames_come(void **state)
{
	const struct psr_msg_list_entry entry = { .state = PSR_ENTRY_READY, .name = "bunny" };
	const struct psr_msg_opened opened = { .handle = 7, .representations = 2, .box_max = { 1, 1, 1 }, .scale = 1,
		                                   .spacing = 0.1, .resolution = 64, .n_levels = 1, .up = { 0, 1, 0 } };
	const struct psr_msg_frame frame = plain();
	const uint32_t id = ask(&frame);
	struct psr_msg_list_entry *entries;
	struct psr_msg_opened got;
	uint32_t n;

	(void)state;
	put_begin(&(struct say){ .id = id });
	psr_msg_list_entry_encode(&out, id + 1, &entry, NULL);
	psr_msg_list_end_encode(&out, id + 1, &(struct psr_msg_list_end){ 1 }, NULL);
	put_rest(&(struct say){ .id = id, .is_final = 1 });
	psr_msg_opened_encode(&out, id + 2, &opened, NULL);
	assert_int_equal(send(server, out.data, out.size, 0), out.size);
	assert_int_equal(psr_client_list(client, &entries, &n, 1000, &err), PSR_OK);
	assert_int_equal(n, 1);
	free(entries);
	assert_int_equal(psr_client_open(client, "bunny", 1000, &got, &err), PSR_OK);
	assert_int_equal(got.handle, 7);
	assert_int_equal(psr_client_wait(client, 0, &event, &err), 1);
	assert_int_equal(event.type, PSR_EVENT_BEGIN);
	assert_int_equal(event.begin->width, frame.width);
	assert_int_equal(psr_client_wait(client, 0, &event, &err), 1);
	assert_int_equal(event.type, PSR_EVENT_FRAME);
	assert_int_equal(event.id, id);
	assert_int_equal(event.end->is_final, 1);
	assert_non_null(event.picture->rgb);
	assert_int_equal(psr_client_wait(client, 0, &event, &err), 0);
	assert_int_equal(psr_client_ack(client, id, 0, &err), PSR_OK);
}

static void acks_go_out_in_order(void **state)
{
	const struct psr_msg_frame frame = plain();
	const uint32_t first = ask(&frame), second = ask(&frame);
	struct psr_message message;
	struct psr_msg_ack ack;

	(void)state;
	show((struct say){ .id = first, .is_final = 1 });
	show((struct say){ .id = second, .is_final = 1 });
	assert_int_equal(psr_client_ack(client, second, 0, &err), PSR_ERR_ARG);
	assert_int_equal(psr_client_ack(client, first, 1, &err), PSR_ERR_NOT_FOUND);
	assert_int_equal(psr_client_ack(client, first, 0, &err), PSR_OK);
	assert_int_equal(psr_client_ack(client, first, 0, &err), PSR_ERR_NOT_FOUND);
	assert_int_equal(psr_client_ack(client, second, 0, &err), PSR_OK);
	assert_int_equal(heard().type, PSR_MSG_FRAME);
	assert_int_equal(heard().type, PSR_MSG_FRAME);
	message = heard();
	assert_int_equal(message.type, PSR_MSG_ACK);
	assert_true(message.id == first && message.view == VIEW);
	assert_int_equal(psr_msg_ack_decode(&ack, message.payload, message.n, NULL), PSR_OK);
	assert_int_equal(ack.pass, 0);
	assert_int_equal(heard().id, second);
}

static unsigned count_held(void)
{
	unsigned n = 0;

	for (const struct client_held *held = client->held; held != NULL; held = held->next)
		n++;
	return n;
}

static void few_pictures_are_held(void **state)
{
	struct psr_msg_frame frame = plain();

	(void)state;
	frame.pass_limit = 9;
	for (int round = 0; round < 20; round++) {
		const uint32_t id = ask(&frame);

		for (uint16_t pass = 0; pass < 10; pass++) {
			const uint16_t first_pass = frame.base != 0 ? 9 : 0;

			show((struct say){ .id = id, .pass = pass, .base = pass > 0 ? id : frame.base,
			                   .base_pass = pass > 0 ? pass - 1 : first_pass, .is_final = pass == 9 });
			assert_int_equal(psr_client_ack(client, id, pass, &err), PSR_OK);
			assert_true(count_held() <= 4);
		}
		assert_int_equal(count_held(), 1);
		frame.base = psr_client_base(client, VIEW);
		assert_int_equal(frame.base, id);
	}
}

static void an_offered_base_is_held_until_its_frame_has_ended(void **state)
{
	struct psr_msg_frame frame = plain();
	uint32_t first = ask(&frame), second, third;

	(void)state;
	show((struct say){ .id = first, .rows = SIDE, .grey = 90, .is_final = 1 });
	psr_client_ack(client, first, 0, &err);
	second = ask(&frame);
	frame.base = first;
	third = ask(&frame);
	show((struct say){ .id = second, .is_final = 1 });
	psr_client_ack(client, second, 0, &err);
	assert_int_equal(count_held(), 2);
	show((struct say){ .id = third, .base = first, .is_final = 1 });
	assert_int_equal(event.picture->rgb[0], 90);
	assert_int_equal(count_held(), 2);
	psr_client_ack(client, third, 0, &err);
	assert_int_equal(count_held(), 1);
}

static void only_the_last_acknowledged_frame_can_be_offered(void **state)
{
	struct psr_msg_frame frame = plain();
	uint32_t first = ask(&frame), id;

	(void)state;
	frame.base = first;
	assert_int_equal(psr_client_frame_in(client, VIEW, &frame, &id, &err), PSR_ERR_ARG);
	show((struct say){ .id = first, .is_final = 1 });
	assert_int_equal(psr_client_frame_in(client, VIEW, &frame, &id, &err), PSR_ERR_ARG);
	psr_client_ack(client, first, 0, &err);
	assert_int_equal(psr_client_frame_in(client, VIEW + 1, &frame, &id, &err), PSR_ERR_ARG);
	assert_int_equal(psr_client_frame_in(client, VIEW, &frame, &id, &err), PSR_OK);
}

static void a_superseded_frame_ends(void **state)
{
	const struct psr_msg_frame frame = plain();
	const uint32_t first = ask(&frame), second = ask(&frame);
	const struct psr_msg_superseded by = { .by = second };

	(void)state;
	put_begin(&(struct say){ .id = first });
	assert_int_equal(give(), 1);
	assert_int_equal(psr_msg_superseded_encode(&out, first, VIEW, &by, NULL), PSR_OK);
	assert_int_equal(give(), 1);
	assert_true(event.type == PSR_EVENT_SUPERSEDED && event.id == first);
	assert_int_equal(psr_client_cancel(client, first, &err), PSR_ERR_NOT_FOUND);
	assert_int_equal(client_count_unacked(client, VIEW), 0);
	show((struct say){ .id = second, .is_final = 1 });
}

static void cancel_and_pause_name_their_view(void **state)
{
	const struct psr_msg_frame frame = plain();
	const uint32_t id = ask(&frame);
	struct psr_message message;

	(void)state;
	assert_int_equal(psr_client_cancel(client, id, &err), PSR_OK);
	assert_int_equal(psr_client_pause(client, VIEW, 1, &err), PSR_OK);
	assert_int_equal(psr_client_pause(client, VIEW, 0, &err), PSR_OK);
	heard();
	message = heard();
	assert_true(message.type == PSR_MSG_CANCEL && message.id == id && message.view == VIEW);
	message = heard();
	assert_true(message.type == PSR_MSG_PAUSE && message.id > id && message.view == VIEW);
	message = heard();
	assert_true(message.type == PSR_MSG_RESUME && message.view == VIEW);
	psr_msg_cancelled_encode(&out, id, VIEW, NULL);
	assert_int_equal(give(), 1);
	assert_true(event.type == PSR_EVENT_FAILED && event.error.code == PSR_ERR_CANCELLED);
}

static void a_frame_may_come_better_than_asked(void **state)
{
	const struct psr_msg_frame frame = plain();
	const struct say say = { .id = ask(&frame), .is_final = 1 };
	struct psr_msg_frame_begin begin = begin_of(&say);

	(void)state;
	begin.color_codec = PSR_CODEC_ZSTD;
	begin.color_quality = 0;
	assert_int_equal(psr_msg_frame_begin_encode(&out, say.id, VIEW, &begin, NULL), PSR_OK);
	assert_int_equal(give(), 1);
}

/* The frames of an answer with these levels, each acknowledged; the last is final. */
static void take_levels(const struct psr_msg_frame *frame, const uint16_t *level, uint16_t n)
{
	struct say say = { .id = ask(frame) };

	for (; say.pass < n; say.pass++) {
		struct psr_msg_frame_begin begin = begin_of(&say);

		begin.refine = level[say.pass];
		begin.color_codec = say.pass > 0 ? PSR_CODEC_ZSTD : frame->color_codec;
		begin.color_quality = say.pass > 0 ? 0 : frame->color_quality;
		say.is_final = say.pass == n - 1;
		assert_int_equal(psr_msg_frame_begin_encode(&out, say.id, VIEW, &begin, NULL), PSR_OK);
		put_rest(&say);
		if (give() != 1 || psr_client_wait(client, 0, &event, &err) != 1)
			fail_msg("%s", err.text);
		assert_int_equal(psr_client_ack(client, say.id, say.pass, &err), PSR_OK);
	}
}

static void a_sharp_frame_comes_before_refined_ones(void **state)
{
	struct psr_msg_frame frame = plain();

	(void)state;
	frame.flags |= PSR_WIRE_FRAME_SHARP;
	frame.pass_limit = 2;
	take_levels(&frame, (const uint16_t[]){ 0, 0, 1, 2 }, 4);
}

static void a_first_frame_that_is_sharp_is_refined_at_once(void **state)
{
	struct psr_msg_frame frame = plain();

	(void)state;
	frame.flags |= PSR_WIRE_FRAME_SHARP;
	frame.pass_limit = 2;
	frame.budget = PSR_WIRE_BUDGET_SETTINGS;
	frame.settings = (struct psr_msg_settings){ .scale = 1, .smooth = 1, .spacing_px = 1 };
	frame.color_codec = PSR_CODEC_ZSTD;
	frame.color_quality = 0;
	take_levels(&frame, (const uint16_t[]){ 0, 1, 2 }, 3);
}

static void what_is_not_offered_is_refused_here(void **state)
{
	struct psr_msg_frame frame = plain();
	uint32_t id;

	(void)state;
	set_up_with(0);
	assert_int_equal(psr_client_frame_in(client, VIEW, &frame, &id, &err), PSR_ERR_UNSUPPORTED);
	assert_int_equal(psr_client_pause(client, VIEW, 1, &err), PSR_ERR_UNSUPPORTED);
	frame.planes = 2;
	frame.color_codec = frame.color_quality = 0;
	frame.depth_format = PSR_WIRE_DEPTH_U16;
	frame.depth_max = 1;
	frame.depth_min = 0.5;
	assert_int_equal(psr_client_frame(client, &frame, &id, &err), PSR_ERR_UNSUPPORTED);
}

/* ---- lies ---- */

static void expect_broken(void)
{
	int code;

	do
		code = give();
	while (code > 0);
	assert_int_equal(code, PSR_ERR_PROTOCOL);
	assert_int_equal(psr_client_wait(client, 0, &event, &err), PSR_ERR_PROTOCOL);
}

static void bases_that_the_client_does_not_hold_end_the_connection(void **state)
{
	enum { NOT_OFFERED, OTHER_PASS, NOT_ACKNOWLEDGED, UNKNOWN, ITSELF, N };

	for (int lie = 0; lie < N; lie++) {
		struct psr_msg_frame frame = plain();
		struct say say = { .is_final = 1 };
		uint32_t first, waiting;

		if (lie > 0)
			tear_down(state);
		set_up_with(PSR_CAP_VIEWS | PSR_CAP_BASE);
		first = ask(&frame);
		show((struct say){ .id = first, .is_final = 1 });
		psr_client_ack(client, first, 0, &err);
		waiting = ask(&frame);
		show((struct say){ .id = waiting, .is_final = 1 }); /* and no ACK */
		frame.base = lie == NOT_OFFERED ? 0 : first;
		say.id = ask(&frame);
		say.base = lie == NOT_ACKNOWLEDGED ? waiting : lie == UNKNOWN ? 77 : lie == ITSELF ? say.id : first;
		say.base_pass = lie == OTHER_PASS;
		put_begin(&say);
		expect_broken();
	}
}

static void a_base_of_another_size_or_scale_ends_the_connection(void **state)
{
	for (int lie = 0; lie < 2; lie++) {
		struct psr_msg_frame frame = plain();
		struct psr_msg_frame_begin begin;
		struct say say = { 0 };

		if (lie > 0)
			tear_down(state);
		set_up_with(PSR_CAP_VIEWS | PSR_CAP_BASE);
		say.base = ask(&frame);
		show((struct say){ .id = say.base, .is_final = 1 });
		psr_client_ack(client, say.base, 0, &err);
		frame.base = say.base;
		frame.width = lie == 0 ? 2 * SIDE : SIDE;
		say.id = ask(&frame);
		begin = begin_of(&say);
		begin.width = frame.width;
		begin.settings.scale = lie == 0 ? 1 : 2;
		assert_int_equal(psr_msg_frame_begin_encode(&out, say.id, VIEW, &begin, NULL), PSR_OK);
		expect_broken();
	}
}

static void an_earlier_frame_without_its_ack_is_no_base(void **state)
{
	struct psr_msg_frame frame = plain();
	uint32_t id;

	(void)state;
	frame.pass_limit = 1;
	id = ask(&frame);
	show((struct say){ .id = id });
	put_begin(&(struct say){ .id = id, .pass = 1, .base = id });
	expect_broken();
}

static void a_third_frame_before_the_first_ack_ends_the_connection(void **state)
{
	const struct psr_msg_frame frame = plain();
	uint32_t id[3];

	(void)state;
	for (int i = 0; i < 3; i++)
		id[i] = ask(&frame);
	show((struct say){ .id = id[0], .is_final = 1 });
	show((struct say){ .id = id[1], .is_final = 1 });
	put_begin(&(struct say){ .id = id[2] });
	expect_broken();
}

static void lies_about_views_end_the_connection(void **state)
{
	enum { UNKNOWN_SUPERSEDES, VIEW_OF_SUPERSEDED, VIEW_OF_BEGIN, VIEW_0, WORSE_QUALITY, REFINED_AT_ONCE, N };

	for (int lie = 0; lie < N; lie++) {
		const struct psr_msg_frame frame = plain();
		struct psr_msg_frame_begin begin = begin_of(&(struct say){ 0 });
		struct psr_msg_superseded by;
		uint32_t id;

		if (lie > 0)
			tear_down(state);
		set_up_with(PSR_CAP_VIEWS);
		id = ask(&frame);
		by.by = lie == UNKNOWN_SUPERSEDES ? id + 1 : ask(&frame);
		begin.color_quality = lie == WORSE_QUALITY ? 49 : 50;
		begin.refine = lie == REFINED_AT_ONCE;
		if (lie <= VIEW_OF_SUPERSEDED)
			psr_msg_superseded_encode(&out, id, lie == VIEW_OF_SUPERSEDED ? VIEW + 1 : VIEW, &by, NULL);
		else
			psr_msg_frame_begin_encode(&out, id, lie == VIEW_OF_BEGIN ? VIEW + 1 : lie == VIEW_0 ? 0 : VIEW, &begin, NULL);
		assert_true(out.size > 0);
		expect_broken();
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(a_frame_on_a_base_starts_as_it, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_later_frame_of_an_answer_may_build_on_an_earlier_one, set_up, tear_down),
		cmocka_unit_test_setup_teardown(the_picture_stays_until_it_is_acknowledged, set_up, tear_down),
		cmocka_unit_test_setup_teardown(models_are_listed_and_opened_while_frames_come, set_up, tear_down),
		cmocka_unit_test_setup_teardown(acks_go_out_in_order, set_up, tear_down),
		cmocka_unit_test_setup_teardown(few_pictures_are_held, set_up, tear_down),
		cmocka_unit_test_setup_teardown(an_offered_base_is_held_until_its_frame_has_ended, set_up, tear_down),
		cmocka_unit_test_setup_teardown(only_the_last_acknowledged_frame_can_be_offered, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_superseded_frame_ends, set_up, tear_down),
		cmocka_unit_test_setup_teardown(cancel_and_pause_name_their_view, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_frame_may_come_better_than_asked, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_sharp_frame_comes_before_refined_ones, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_first_frame_that_is_sharp_is_refined_at_once, set_up, tear_down),
		cmocka_unit_test_teardown(what_is_not_offered_is_refused_here, tear_down),
		cmocka_unit_test_teardown(bases_that_the_client_does_not_hold_end_the_connection, tear_down),
		cmocka_unit_test_teardown(a_base_of_another_size_or_scale_ends_the_connection, tear_down),
		cmocka_unit_test_setup_teardown(an_earlier_frame_without_its_ack_is_no_base, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_third_frame_before_the_first_ack_ends_the_connection, set_up, tear_down),
		cmocka_unit_test_teardown(lies_about_views_end_the_connection, tear_down),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
