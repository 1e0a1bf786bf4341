#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "internal.h"

int psr_client_connect(struct psr_client **out, const char *address, const char *program, const char *model,
                       int timeout_ms, struct psr_error *err)
{
	uint64_t deadline_ns = client_deadline_ns(timeout_ms);
	struct psr_msg_hello hello = { .major = PSR_PROTO_MAJOR,
		                           .minor = PSR_PROTO_MINOR,
		                           .routing_key = psr_routing_key(model) };
	struct psr_client *client;
	struct psr_event event;
	int fd, code = client_socket_connect(&fd, address, deadline_ns, err);

	if (code != PSR_OK)
		return code;
	code = client_create(&client, fd, address, err);
	if (code != PSR_OK) {
		close(fd);
		return code;
	}
	strncpy(hello.client, program, sizeof hello.client - 1);
	code = psr_msg_hello_encode(&client->out, &hello, err);
	if (code == PSR_OK) {
		do
			code = client_run(client, deadline_ns, &event, err);
		while (code > 0 && client->answer != CLIENT_ANSWER_WELCOME);
		if (code == 0)
			code = psr_fail(err, PSR_ERR_CONNECTION, "%s: no WELCOME within %d ms; is it a psrd?", address, timeout_ms);
	}
	if (code < 0) {
		psr_client_close(client);
		return code;
	}
	*out = client;
	return PSR_OK;
}

static int start_control(struct psr_client *client, uint16_t type, struct psr_error *err)
{
	if (client->broken.code != PSR_OK)
		return psr_fail(err, client->broken.code, "%s", client->broken.text);
	if (client->control_id != 0)
		return psr_fail(err, PSR_ERR_BUSY, "%s has not answered the request before", client->address);
	if (client->next_id == UINT32_MAX)
		return psr_fail(err, PSR_ERR_LIMIT, "%s: the ids of this connection are used up; connect again",
		                client->address);
	client->control_id = client->next_id++;
	client->control_type = type;
	return PSR_OK;
}

/* Waits for the next answer to the control request, and keeps events that come before it. Half way through the time it
 * sends a PING to a silent server. */
static int next_answer(struct psr_client *client, int timeout_ms, struct psr_error *err)
{
	struct psr_event event;
	int is_asked = 0;

	for (;;) {
		uint64_t deadline_ns = client_deadline_ns(timeout_ms < 0 ? -1 : timeout_ms - timeout_ms / 2);
		struct psr_msg_ping ping = { .token = client->control_id };
		int got = client_run(client, deadline_ns, &event, err);

		if (got < 0)
			return got;
		if (got > 0 && event.type != 0 && client_queue_event(client, &event) != PSR_OK)
			return client_check(client, err);
		if (got > 0 && event.type == 0 && client->answer != CLIENT_ANSWER_PONG)
			return client->answer == CLIENT_ANSWER_ERROR
			           ? psr_fail(err, client->control_error.code, "%s", client->control_error.text)
			           : PSR_OK;
		if (got > 0) {
			is_asked = 0;
			continue;
		}
		if (is_asked || psr_msg_ping_encode(&client->out, &ping, NULL) != PSR_OK) {
			client_break(client, PSR_ERR_CONNECTION, "the server has not answered for %d ms", timeout_ms);
			return psr_fail(err, client->broken.code, "%s", client->broken.text);
		}
		is_asked = 1;
	}
}

/* The request was too long, or its name is not valid: its id was never sent. */
static int withdraw(struct psr_client *client, int code)
{
	client->control_id = 0;
	return code;
}

int psr_client_list(struct psr_client *client, struct psr_msg_list_entry **entries, uint32_t *n_entries, int timeout_ms,
                    struct psr_error *err)
{
	struct client_list *list = &client->list;
	int code = start_control(client, PSR_MSG_LIST, err);

	if (code != PSR_OK)
		return code;
	list->n = 0;
	code = psr_msg_list_encode(&client->out, client->control_id, err);
	if (code != PSR_OK)
		return withdraw(client, code);
	code = next_answer(client, timeout_ms, err);
	if (code != PSR_OK)
		return code;
	if (list->n == 0) {
		free(list->entry);
		list->entry = NULL;
	}
	*entries = list->entry;
	*n_entries = list->n;
	memset(list, 0, sizeof *list);
	return PSR_OK;
}

void psr_client_set_resolution(struct psr_client *client, uint32_t pixels)
{
	client->resolution = pixels < PSR_WIRE_MAX_SIDE ? pixels : PSR_WIRE_MAX_SIDE;
}

void psr_client_set_levels(struct psr_client *client, uint32_t levels)
{
	client->levels = (uint8_t)(levels < PSR_WIRE_MAX_LEVELS ? levels : PSR_WIRE_MAX_LEVELS);
}

void psr_client_on_progress(struct psr_client *client,
                            void (*fn)(const struct psr_msg_progress *progress, void *userdata), void *userdata)
{
	client->on_progress = fn;
	client->userdata = userdata;
}

int psr_client_open(struct psr_client *client, const char *name, int timeout_ms, struct psr_msg_opened *opened,
                    struct psr_error *err)
{
	struct psr_msg_open msg = { .resolution = 0 };
	int code;

	if (name[0] == '\0' || strlen(name) > PSR_WIRE_MAX_NAME)
		return psr_fail(err, PSR_ERR_ARG, "a model's name has 1 to %d bytes", PSR_WIRE_MAX_NAME);
	code = start_control(client, PSR_MSG_OPEN, err);
	if (code != PSR_OK)
		return code;
	strcpy(msg.name, name);
	if (client->welcome.capabilities & PSR_CAP_RESOLUTION)
		msg.resolution = (uint16_t)client->resolution;
	if (client->welcome.capabilities & PSR_CAP_LEVELS)
		msg.levels = client->levels;
	code = psr_msg_open_encode(&client->out, client->control_id, &msg, err);
	if (code != PSR_OK)
		return withdraw(client, code);
	do {
		code = next_answer(client, timeout_ms, err);
		if (code == PSR_OK && client->answer == CLIENT_ANSWER_PROGRESS && client->on_progress != NULL)
			client->on_progress(&client->progress, client->userdata);
	} while (code == PSR_OK && client->answer != CLIENT_ANSWER_OPENED);
	if (code == PSR_OK)
		*opened = client->opened;
	return code;
}

int psr_client_presets(struct psr_client *client, uint32_t handle, struct psr_msg_preset **presets, uint32_t *n_presets,
                       int timeout_ms, struct psr_error *err)
{
	struct client_presets *got = &client->presets;
	const struct psr_msg_presets msg = { .handle = handle };
	int code;

	if (!(client->welcome.capabilities & PSR_CAP_PRESETS))
		return psr_fail(err, PSR_ERR_UNSUPPORTED,
		                "%s: this server tells no cameras and lights of models (capability bit "
		                "19)",
		                client->address);
	code = start_control(client, PSR_MSG_PRESETS, err);
	if (code != PSR_OK)
		return code;
	memset(got->n, 0, sizeof got->n);
	code = psr_msg_presets_encode(&client->out, client->control_id, &msg, err);
	if (code != PSR_OK)
		return withdraw(client, code);
	code = next_answer(client, timeout_ms, err);
	if (code != PSR_OK)
		return code;
	if (got->n[PSR_WIRE_PRESET_CAMERA] + got->n[PSR_WIRE_PRESET_LIGHT] == 0) {
		free(got->preset);
		got->preset = NULL;
	}
	*presets = got->preset;
	*n_presets = got->n[PSR_WIRE_PRESET_CAMERA] + got->n[PSR_WIRE_PRESET_LIGHT];
	memset(got, 0, sizeof *got);
	return PSR_OK;
}

int psr_client_stats(struct psr_client *client, struct psr_msg_stats_reply *stats, int timeout_ms,
                     struct psr_error *err)
{
	int code = start_control(client, PSR_MSG_STATS, err);

	if (code != PSR_OK)
		return code;
	code = psr_msg_stats_encode(&client->out, client->control_id, err);
	if (code != PSR_OK)
		return withdraw(client, code);
	code = next_answer(client, timeout_ms, err);
	if (code == PSR_OK)
		*stats = client->stats;
	return code;
}

int psr_client_fetch(struct psr_client *client, const struct psr_msg_fetch *fetch,
                     const struct psr_fetch_user *user, struct psr_msg_fetch_end *end, int timeout_ms,
                     struct psr_error *err)
{
	int code;

	if (!(client->welcome.capabilities & PSR_CAP_FETCH))
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "%s: this server gives no model files away (capability bit 17)",
		                client->address);
	code = start_control(client, PSR_MSG_FETCH, err);
	if (code != PSR_OK)
		return code;
	client->fetch = (struct client_fetch){ .next = fetch->offset, .end = UINT64_MAX, .on_part = user->on_part,
		                                   .userdata = user->userdata };
	if (fetch->length > 0)
		client->fetch.end = fetch->offset + fetch->length;
	code = psr_msg_fetch_encode(&client->out, client->control_id, fetch, err);
	if (code != PSR_OK)
		return withdraw(client, code);
	do
		code = next_answer(client, timeout_ms, err);
	while (code == PSR_OK && client->answer == CLIENT_ANSWER_PART);
	if (code == PSR_OK)
		*end = client->fetch.last;
	return code;
}
