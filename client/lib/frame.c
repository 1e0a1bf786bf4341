#include <inttypes.h>
#include <string.h>
#include "base/clock.h"
#include "internal.h"

struct client_frame *client_find_frame(struct psr_client *client, uint32_t id)
{
	for (size_t i = 0; i < PSR_WIRE_MAX_OPEN; i++)
		if (id != 0 && client->frame[i].id == id)
			return &client->frame[i];
	return NULL;
}

/* Ends the frame's id. */
static void close_frame(struct psr_client *client, struct client_frame *frame)
{
	client_assembly_fini(&frame->assembly);
	frame->id = 0;
	client_release_held(client);
}

int client_frame_failed(struct psr_client *client, struct client_frame *frame, struct psr_event *event,
                        const struct psr_error *why)
{
	event->type = PSR_EVENT_FAILED;
	event->id = frame->id;
	event->error = *why;
	close_frame(client, frame);
	return 1;
}

/* Keeps the frames of views above 0 until later ones are acknowledged. */
static int show(struct psr_client *client, struct client_frame *frame, struct psr_event *event)
{
	struct client_held *held;

	event->picture = &client->done.picture;
	event->begin = &client->done.begin;
	if (frame->view == 0)
		return PSR_OK;
	if (client_hold(client, frame, &client->done) != PSR_OK)
		return client_break(client, PSR_ERR_MEMORY, "no memory to hold a frame");
	held = client_find_held(client, frame->view, frame->id, client->done.pass);
	event->picture = &held->picture;
	event->begin = &held->begin;
	return PSR_OK;
}

static int on_frame_end(struct psr_client *client, struct client_frame *frame, const struct psr_message *message,
                        struct psr_event *event)
{
	struct psr_error why;
	const uint64_t start_ns = clock_ns();
	int code = psr_msg_frame_end_decode(&client->end, message->payload, message->n, &why);
	unsigned checked = 0;

	if (code == PSR_OK)
		code = client_assembly_end(&frame->assembly, &client->end, &checked, &why);
	frame->decode_ns += clock_ns() - start_ns;
	if (code == PSR_ERR_FORMAT && client->end.is_final && frame->view == 0)
		return client_frame_failed(client, frame, event, &why);
	if (code != PSR_OK)
		return client_broke(client, &why);
	client->done = frame->assembly;
	if (client->end.is_final)
		memset(&frame->assembly, 0, sizeof frame->assembly);
	else
		client_assembly_init(&frame->assembly, &client->done.asked, (uint16_t)(client->done.pass + 1));
	code = show(client, frame, event);
	if (code != PSR_OK)
		return code;
	event->type = PSR_EVENT_FRAME;
	event->id = frame->id;
	event->end = &client->end;
	event->bytes = frame->bytes;
	event->latency_ns = clock_ns() - frame->sent_ns;
	event->decode_ns = frame->decode_ns;
	event->checked = checked;
	frame->bytes = frame->decode_ns = 0;
	if (client->end.is_final)
		close_frame(client, frame);
	return 1;
}

static int on_frame_begin(struct psr_client *client, struct client_frame *frame, const struct psr_message *message,
                          struct psr_event *event)
{
	const uint64_t start_ns = clock_ns();
	struct psr_msg_frame_begin begin;
	struct psr_error why;
	int code = psr_msg_frame_begin_decode(&begin, message->payload, message->n, &why);

	frame->assembly.crew = client->crew;
	if (code == PSR_OK)
		code = client_assembly_begin(&frame->assembly, &begin,
		                             client_find_base(client, frame, begin.base, begin.base_pass), &why);
	frame->decode_ns += clock_ns() - start_ns;
	if (code != PSR_OK)
		return client_broke(client, &why);
	if (frame->view == 0)
		return 0;
	if (client_count_unacked(client, frame->view) > PSR_WIRE_MAX_UNACKED)
		return client_break(client, PSR_ERR_PROTOCOL, "the server began a frame of view %u while %d wait for their ACK",
		                    frame->view, PSR_WIRE_MAX_UNACKED);
	event->type = PSR_EVENT_BEGIN;
	event->id = frame->id;
	event->begin = &frame->assembly.begin;
	event->bytes = frame->bytes;
	event->latency_ns = clock_ns() - frame->sent_ns;
	return 1;
}

static int on_superseded(struct psr_client *client, struct client_frame *frame, const struct psr_message *message,
                         struct psr_event *event)
{
	struct psr_msg_superseded msg;
	struct psr_error why;

	if (psr_msg_superseded_decode(&msg, message->payload, message->n, &why) != PSR_OK)
		return client_broke(client, &why);
	if (msg.by <= frame->id || msg.by >= client->next_id)
		return client_break(client, PSR_ERR_PROTOCOL, "the server says that frame %" PRIu32 " superseded frame %" PRIu32,
		                    msg.by, frame->id);
	event->type = PSR_EVENT_SUPERSEDED;
	event->id = frame->id;
	close_frame(client, frame);
	return 1;
}

static int on_rect(struct psr_client *client, struct client_frame *frame, const struct psr_message *message)
{
	const uint64_t start_ns = clock_ns();
	struct psr_error why;
	int code = psr_msg_rect_decode(&client->rect, message->payload, message->n, &why);

	if (code == PSR_OK)
		code = client_assembly_rect(&frame->assembly, client->decoder, &client->rect, &why);
	frame->decode_ns += clock_ns() - start_ns;
	return code == PSR_OK ? 0 : client_broke(client, &why);
}

int client_on_frame(struct psr_client *client, const struct psr_message *message, struct psr_event *event)
{
	struct client_frame *frame = client_find_frame(client, message->id);

	if (frame == NULL || message->view != frame->view)
		return client_unexpected(client, message);
	frame->bytes += PSR_HEADER_SIZE + message->n;
	switch (message->type) {
	case PSR_MSG_FRAME_BEGIN:
		return on_frame_begin(client, frame, message, event);
	case PSR_MSG_RECT:
		return on_rect(client, frame, message);
	case PSR_MSG_FRAME_END:
		return on_frame_end(client, frame, message, event);
	default:
		return on_superseded(client, frame, message, event);
	}
}
