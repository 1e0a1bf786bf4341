#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "internal.h"

static int broke(struct psr_client *client, const struct psr_error *why)
{
	int code = why->code == PSR_ERR_MEMORY ? PSR_ERR_MEMORY : PSR_ERR_PROTOCOL;

	return client_break(client, code, "%.400s", why->text);
}

static int unexpected(struct psr_client *client, const struct psr_message *message)
{
	return client_break(client, PSR_ERR_PROTOCOL, "the server sent %s for id %" PRIu32 " where it has no place",
	                    psr_msg_name(message->type), message->id);
}

static struct client_frame *find_frame(struct psr_client *client, uint32_t id)
{
	for (size_t i = 0; i < PSR_WIRE_MAX_OPEN; i++)
		if (id != 0 && client->frame[i].id == id)
			return &client->frame[i];
	return NULL;
}

static int is_answer_to(const struct psr_client *client, const struct psr_message *message, uint16_t type)
{
	return client->control_id != 0 && message->id == client->control_id && client->control_type == type;
}

static int answered(struct psr_client *client, enum client_answer answer)
{
	client->answer = answer;
	if (answer != CLIENT_ANSWER_PROGRESS && answer != CLIENT_ANSWER_PONG)
		client->control_id = 0;
	return 1;
}

static int end_frame_failed(struct client_frame *frame, struct psr_event *event, const struct psr_error *why)
{
	event->type = PSR_EVENT_FAILED;
	event->id = frame->id;
	event->error = *why;
	client_assembly_fini(&frame->assembly);
	frame->id = 0;
	return 1;
}

static int on_error(struct psr_client *client, const struct psr_message *message, struct psr_event *event)
{
	struct client_frame *frame = find_frame(client, message->id);
	struct psr_msg_error msg;
	struct psr_error why;
	int code;

	if (psr_msg_error_decode(&msg, message->payload, message->n, &why) != PSR_OK)
		return broke(client, &why);
	code = psr_wire_error_to(msg.code);
	if (message->id == 0)
		return client_break(client, code, "the server refuses: %s", msg.text);
	if (message->id >= client->next_id)
		return unexpected(client, message);
	psr_fail(&why, code, "%s", msg.text);
	if (message->id == client->control_id) {
		client->control_error = why;
		return answered(client, CLIENT_ANSWER_ERROR);
	}
	if (frame != NULL)
		return end_frame_failed(frame, event, &why);
	event->type = PSR_EVENT_FAILED; /* a SCENE or CLOSE */
	event->id = message->id;
	event->error = why;
	return 1;
}

static int on_entry(struct psr_client *client, const struct psr_message *message)
{
	struct client_list *list = &client->list;
	struct psr_error why;

	if (!is_answer_to(client, message, PSR_MSG_LIST))
		return unexpected(client, message);
	if (list->n == PSR_CLIENT_MAX_ENTRIES)
		return client_break(client, PSR_ERR_LIMIT, "the server lists more than %d models", PSR_CLIENT_MAX_ENTRIES);
	if (list->n == list->capacity) {
		uint32_t capacity = list->capacity == 0 ? 64 : 2 * list->capacity;
		struct psr_msg_list_entry *grown = realloc(list->entry, capacity * sizeof *grown);

		if (grown == NULL)
			return client_break(client, PSR_ERR_MEMORY, "no memory for a list of %" PRIu32 " models", capacity);
		list->entry = grown;
		list->capacity = capacity;
	}
	if (psr_msg_list_entry_decode(&list->entry[list->n], message->payload, message->n, &why) != PSR_OK)
		return broke(client, &why);
	list->n++;
	return 0;
}

static int on_list_end(struct psr_client *client, const struct psr_message *message)
{
	struct psr_msg_list_end end;
	struct psr_error why;

	if (!is_answer_to(client, message, PSR_MSG_LIST))
		return unexpected(client, message);
	if (psr_msg_list_end_decode(&end, message->payload, message->n, &why) != PSR_OK)
		return broke(client, &why);
	if (end.n_entries != client->list.n)
		return client_break(client, PSR_ERR_PROTOCOL,
		                    "the server sent %" PRIu32 " models and says that there are %" PRIu32, client->list.n,
		                    end.n_entries);
	return answered(client, CLIENT_ANSWER_LIST_END);
}

static int on_preset(struct psr_client *client, const struct psr_message *message)
{
	struct client_presets *got = &client->presets;
	uint32_t n = got->n[PSR_WIRE_PRESET_CAMERA] + got->n[PSR_WIRE_PRESET_LIGHT];
	struct psr_msg_preset preset;
	struct psr_error why;

	if (!is_answer_to(client, message, PSR_MSG_PRESETS))
		return unexpected(client, message);
	if (psr_msg_preset_decode(&preset, message->payload, message->n, &why) != PSR_OK)
		return broke(client, &why);
	if (got->n[preset.kind] == PSR_WIRE_MAX_PRESETS)
		return client_break(client, PSR_ERR_PROTOCOL, "the server sent more than %d cameras or lights",
		                    PSR_WIRE_MAX_PRESETS);
	if (n == 0) {
		free(got->preset); /* of a request that an error ended */
		got->preset = calloc(2 * PSR_WIRE_MAX_PRESETS, sizeof *got->preset);
		if (got->preset == NULL)
			return client_break(client, PSR_ERR_MEMORY, "no memory for cameras and lights");
	}
	got->preset[n] = preset;
	got->n[preset.kind]++;
	return 0;
}

static int on_presets_end(struct psr_client *client, const struct psr_message *message)
{
	const uint32_t *n = client->presets.n;
	struct psr_msg_presets_end end;
	struct psr_error why;

	if (!is_answer_to(client, message, PSR_MSG_PRESETS))
		return unexpected(client, message);
	if (psr_msg_presets_end_decode(&end, message->payload, message->n, &why) != PSR_OK)
		return broke(client, &why);
	if (end.n_cameras != n[PSR_WIRE_PRESET_CAMERA] || end.n_lights != n[PSR_WIRE_PRESET_LIGHT])
		return client_break(client, PSR_ERR_PROTOCOL, "the server sent %" PRIu32 " cameras and %" PRIu32
		                    " lights and says that there are %" PRIu32 " and %" PRIu32, n[PSR_WIRE_PRESET_CAMERA],
		                    n[PSR_WIRE_PRESET_LIGHT], end.n_cameras, end.n_lights);
	return answered(client, CLIENT_ANSWER_PRESETS_END);
}

static int on_control(struct psr_client *client, const struct psr_message *message)
{
	enum client_answer answer;
	struct psr_error why;
	int code;

	switch (message->type) {
	case PSR_MSG_PROGRESS:
		if (!is_answer_to(client, message, PSR_MSG_OPEN))
			return unexpected(client, message);
		code = psr_msg_progress_decode(&client->progress, message->payload, message->n, &why);
		answer = CLIENT_ANSWER_PROGRESS;
		break;
	case PSR_MSG_OPENED:
		if (!is_answer_to(client, message, PSR_MSG_OPEN))
			return unexpected(client, message);
		code = psr_msg_opened_decode(&client->opened, message->payload, message->n, &why);
		answer = CLIENT_ANSWER_OPENED;
		break;
	default:
		if (!is_answer_to(client, message, PSR_MSG_STATS))
			return unexpected(client, message);
		code = psr_msg_stats_reply_decode(&client->stats, message->payload, message->n, &why);
		answer = CLIENT_ANSWER_STATS;
		break;
	}
	return code == PSR_OK ? answered(client, answer) : broke(client, &why);
}

static int on_frame_end(struct psr_client *client, struct client_frame *frame, const struct psr_message *message,
                        struct psr_event *event)
{
	struct psr_error why;
	int code = psr_msg_frame_end_decode(&client->end, message->payload, message->n, &why);
	unsigned checked = 0;

	if (code == PSR_OK)
		code = client_assembly_end(&frame->assembly, &client->end, &checked, &why);
	if (code == PSR_ERR_FORMAT && client->end.is_final)
		return end_frame_failed(frame, event, &why);
	if (code != PSR_OK)
		return broke(client, &why);
	client->done = frame->assembly;
	if (client->end.is_final)
		memset(&frame->assembly, 0, sizeof frame->assembly);
	else
		client_assembly_init(&frame->assembly, &client->done.asked, (uint16_t)(client->done.pass + 1));
	event->type = PSR_EVENT_FRAME;
	event->id = frame->id;
	event->picture = &client->done.picture;
	event->begin = &client->done.begin;
	event->end = &client->end;
	event->bytes = frame->bytes;
	event->latency_ns = clock_ns() - frame->sent_ns;
	event->checked = checked;
	frame->bytes = 0;
	if (client->end.is_final)
		frame->id = 0;
	return 1;
}

static int on_frame(struct psr_client *client, const struct psr_message *message, struct psr_event *event)
{
	struct client_frame *frame = find_frame(client, message->id);
	struct psr_msg_frame_begin begin;
	struct psr_error why;
	int code;

	if (frame == NULL || message->view != 0)
		return unexpected(client, message);
	frame->bytes += PSR_HEADER_SIZE + message->n;
	if (message->type == PSR_MSG_FRAME_END)
		return on_frame_end(client, frame, message, event);
	if (message->type == PSR_MSG_FRAME_BEGIN) {
		code = psr_msg_frame_begin_decode(&begin, message->payload, message->n, &why);
		if (code == PSR_OK)
			code = client_assembly_begin(&frame->assembly, &begin, &why);
	} else {
		code = psr_msg_rect_decode(&client->rect, message->payload, message->n, &why);
		if (code == PSR_OK)
			code = client_assembly_rect(&frame->assembly, client->decoder, &client->rect, &why);
	}
	return code == PSR_OK ? 0 : broke(client, &why);
}

static int on_cancelled(struct psr_client *client, const struct psr_message *message, struct psr_event *event)
{
	struct client_frame *frame = find_frame(client, message->id);
	struct psr_error why;

	psr_fail(&why, PSR_ERR_CANCELLED, "the server gave the request up");
	if (frame != NULL)
		return end_frame_failed(frame, event, &why);
	if (!is_answer_to(client, message, PSR_MSG_OPEN))
		return unexpected(client, message);
	client->control_error = why;
	return answered(client, CLIENT_ANSWER_ERROR);
}

static int on_welcome(struct psr_client *client, const struct psr_message *message)
{
	struct psr_error why;

	if (client->is_open)
		return unexpected(client, message);
	if (psr_msg_welcome_decode(&client->welcome, message->payload, message->n, &why) != PSR_OK)
		return broke(client, &why);
	if (client->welcome.major != PSR_PROTO_MAJOR || client->welcome.minor != PSR_PROTO_MINOR)
		return client_break(client, PSR_ERR_VERSION,
		                    "the server speaks version %u.%u of the protocol, this client %d.%d", client->welcome.major,
		                    client->welcome.minor, PSR_PROTO_MAJOR, PSR_PROTO_MINOR);
	client->is_open = 1;
	return answered(client, CLIENT_ANSWER_WELCOME);
}

static int on_goodbye(struct psr_client *client, const struct psr_message *message)
{
	static const char *const reasons[] = { "it has no more to do", "it shuts down", "this client was idle for too long",
		                                   "this client reads too slowly" };
	struct psr_msg_goodbye msg;
	struct psr_error why;

	if (psr_msg_goodbye_decode(&msg, message->payload, message->n, &why) != PSR_OK)
		return broke(client, &why);
	return client_break(client, PSR_ERR_CONNECTION, "the server says goodbye: %s%s%s",
	                    reasons[msg.reason < 4 ? msg.reason : 0], msg.text[0] != '\0' ? "; " : "", msg.text);
}

static int on_ping(struct psr_client *client, const struct psr_message *message)
{
	struct psr_msg_ping ping;
	struct psr_error why;

	if (psr_msg_ping_decode(&ping, message->payload, message->n, &why) != PSR_OK)
		return broke(client, &why);
	if (message->type == PSR_MSG_PONG)
		return answered(client, CLIENT_ANSWER_PONG);
	if (psr_msg_pong_encode(&client->out, &ping, &why) != PSR_OK)
		return client_break(client, PSR_ERR_PROTOCOL, "the server sends PING and takes no PONG");
	return 0;
}

int client_dispatch(struct psr_client *client, const struct psr_message *message, struct psr_event *event)
{
	switch (message->type) {
	case PSR_MSG_WELCOME:
		return on_welcome(client, message);
	case PSR_MSG_ERROR:
		return on_error(client, message, event);
	case PSR_MSG_GOODBYE:
		return on_goodbye(client, message);
	case PSR_MSG_PING:
	case PSR_MSG_PONG:
		return on_ping(client, message);
	default:
		break;
	}
	if (!client->is_open)
		return unexpected(client, message);
	switch (message->type) {
	case PSR_MSG_LIST_ENTRY:
		return on_entry(client, message);
	case PSR_MSG_LIST_END:
		return on_list_end(client, message);
	case PSR_MSG_PRESET:
		return on_preset(client, message);
	case PSR_MSG_PRESETS_END:
		return on_presets_end(client, message);
	case PSR_MSG_PROGRESS:
	case PSR_MSG_OPENED:
	case PSR_MSG_STATS_REPLY:
		return on_control(client, message);
	case PSR_MSG_FRAME_BEGIN:
	case PSR_MSG_RECT:
	case PSR_MSG_FRAME_END:
		return on_frame(client, message, event);
	case PSR_MSG_CANCELLED:
		return on_cancelled(client, message, event);
	default:
		return unexpected(client, message);
	}
}
