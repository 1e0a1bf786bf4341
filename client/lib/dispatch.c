#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "internal.h"

int client_broke(struct psr_client *client, const struct psr_error *why)
{
	int code = why->code == PSR_ERR_MEMORY ? PSR_ERR_MEMORY : PSR_ERR_PROTOCOL;

	return client_break(client, code, "%.400s", why->text);
}

int client_unexpected(struct psr_client *client, const struct psr_message *message)
{
	return client_break(client, PSR_ERR_PROTOCOL, "the server sent %s for id %" PRIu32 " where it has no place",
	                    psr_msg_name(message->type), message->id);
}

static int is_answer_to(const struct psr_client *client, const struct psr_message *message, uint16_t type)
{
	return client->control_id != 0 && message->id == client->control_id && client->control_type == type;
}

static int answered(struct psr_client *client, enum client_answer answer)
{
	client->answer = answer;
	if (answer != CLIENT_ANSWER_PROGRESS && answer != CLIENT_ANSWER_PONG && answer != CLIENT_ANSWER_PART)
		client->control_id = 0;
	return 1;
}

static int on_error(struct psr_client *client, const struct psr_message *message, struct psr_event *event)
{
	struct client_frame *frame = client_find_frame(client, message->id);
	struct psr_msg_error msg;
	struct psr_error why;
	int code;

	if (psr_msg_error_decode(&msg, message->payload, message->n, &why) != PSR_OK)
		return client_broke(client, &why);
	code = psr_wire_error_to(msg.code);
	if (message->id == 0)
		return client_break(client, code, "the server refuses: %s", msg.text);
	if (message->id >= client->next_id)
		return client_unexpected(client, message);
	psr_fail(&why, code, "%s", msg.text);
	if (message->id == client->control_id) {
		client->control_error = why;
		return answered(client, CLIENT_ANSWER_ERROR);
	}
	if (frame != NULL)
		return client_frame_failed(client, frame, event, &why);
	event->type = PSR_EVENT_FAILED; /* the request is a SCENE or CLOSE */
	event->id = message->id;
	event->error = why;
	return 1;
}

static int on_entry(struct psr_client *client, const struct psr_message *message)
{
	struct client_list *list = &client->list;
	struct psr_error why;

	if (!is_answer_to(client, message, PSR_MSG_LIST))
		return client_unexpected(client, message);
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
		return client_broke(client, &why);
	list->n++;
	return 0;
}

static int on_list_end(struct psr_client *client, const struct psr_message *message)
{
	struct psr_msg_list_end end;
	struct psr_error why;

	if (!is_answer_to(client, message, PSR_MSG_LIST))
		return client_unexpected(client, message);
	if (psr_msg_list_end_decode(&end, message->payload, message->n, &why) != PSR_OK)
		return client_broke(client, &why);
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
		return client_unexpected(client, message);
	if (psr_msg_preset_decode(&preset, message->payload, message->n, &why) != PSR_OK)
		return client_broke(client, &why);
	if (preset.kind == 0) /* a later version's kind */
		return 0;
	if (got->n[preset.kind] == PSR_WIRE_MAX_PRESETS)
		return client_break(client, PSR_ERR_PROTOCOL, "the server sent more than %d cameras or lights",
		                    PSR_WIRE_MAX_PRESETS);
	if (n == 0) {
		free(got->preset); /* may hold presets of a request that ended in an error */
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
		return client_unexpected(client, message);
	if (psr_msg_presets_end_decode(&end, message->payload, message->n, &why) != PSR_OK)
		return client_broke(client, &why);
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
			return client_unexpected(client, message);
		code = psr_msg_progress_decode(&client->progress, message->payload, message->n, &why);
		answer = CLIENT_ANSWER_PROGRESS;
		break;
	case PSR_MSG_OPENED:
		if (!is_answer_to(client, message, PSR_MSG_OPEN))
			return client_unexpected(client, message);
		code = psr_msg_opened_decode(&client->opened, message->payload, message->n, &why);
		answer = CLIENT_ANSWER_OPENED;
		break;
	default:
		if (!is_answer_to(client, message, PSR_MSG_STATS))
			return client_unexpected(client, message);
		code = psr_msg_stats_reply_decode(&client->stats, message->payload, message->n, &why);
		answer = CLIENT_ANSWER_STATS;
		break;
	}
	return code == PSR_OK ? answered(client, answer) : client_broke(client, &why);
}

static int on_fetch_part(struct psr_client *client, const struct psr_message *message)
{
	struct client_fetch *fetch = &client->fetch;
	struct psr_msg_fetch_part part;
	struct psr_error why;
	int code;

	if (!is_answer_to(client, message, PSR_MSG_FETCH))
		return client_unexpected(client, message);
	if (psr_msg_fetch_part_decode(&part, message->payload, message->n, &why) != PSR_OK)
		return client_broke(client, &why);
	if (part.offset != fetch->next || part.bytes > fetch->end - fetch->next)
		return client_break(client, PSR_ERR_PROTOCOL, "the server sent bytes %" PRIu64 " to %" PRIu64 " of a file, where %"
		                    PRIu64 " follows", part.offset, part.offset + part.bytes, fetch->next);
	fetch->next += part.bytes;
	code = fetch->on_part(part.data, part.bytes, fetch->userdata, &why);
	return code == PSR_OK ? answered(client, CLIENT_ANSWER_PART) : client_break(client, code, "%.400s", why.text);
}

static int on_fetch_end(struct psr_client *client, const struct psr_message *message)
{
	const struct client_fetch *fetch = &client->fetch;
	struct psr_msg_fetch_end end;
	struct psr_error why;

	if (!is_answer_to(client, message, PSR_MSG_FETCH))
		return client_unexpected(client, message);
	if (psr_msg_fetch_end_decode(&end, message->payload, message->n, &why) != PSR_OK)
		return client_broke(client, &why);
	if (fetch->next < (end.file_bytes < fetch->end ? end.file_bytes : fetch->end))
		return client_break(client, PSR_ERR_PROTOCOL, "the server ends at byte %" PRIu64 " of a file of %" PRIu64,
		                    fetch->next, end.file_bytes);
	client->fetch.last = end;
	return answered(client, CLIENT_ANSWER_FETCH_END);
}

static int on_cancelled(struct psr_client *client, const struct psr_message *message, struct psr_event *event)
{
	struct client_frame *frame = client_find_frame(client, message->id);
	struct psr_error why;

	psr_fail(&why, PSR_ERR_CANCELLED, "the server gave the request up");
	if (frame != NULL)
		return client_frame_failed(client, frame, event, &why);
	if (!is_answer_to(client, message, PSR_MSG_OPEN))
		return client_unexpected(client, message);
	client->control_error = why;
	return answered(client, CLIENT_ANSWER_ERROR);
}

static int on_welcome(struct psr_client *client, const struct psr_message *message)
{
	struct psr_error why;

	if (client->is_open)
		return client_unexpected(client, message);
	if (psr_msg_welcome_decode(&client->welcome, message->payload, message->n, &why) != PSR_OK)
		return client_broke(client, &why);
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
		return client_broke(client, &why);
	return client_break(client, PSR_ERR_CONNECTION, "the server says goodbye: %s%s%s",
	                    reasons[msg.reason < 4 ? msg.reason : 0], msg.text[0] != '\0' ? "; " : "", msg.text);
}

static int on_ping(struct psr_client *client, const struct psr_message *message)
{
	struct psr_msg_ping ping;
	struct psr_error why;

	if (psr_msg_ping_decode(&ping, message->payload, message->n, &why) != PSR_OK)
		return client_broke(client, &why);
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
		return client_unexpected(client, message);
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
	case PSR_MSG_SUPERSEDED:
		return client_on_frame(client, message, event);
	case PSR_MSG_FETCH_PART:
		return on_fetch_part(client, message);
	case PSR_MSG_FETCH_END:
		return on_fetch_end(client, message);
	case PSR_MSG_CANCELLED:
		return on_cancelled(client, message, event);
	default:
		return client_unexpected(client, message);
	}
}
