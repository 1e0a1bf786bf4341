/* Views above 0: the pictures that a client holds until it acknowledges them, or because a frame may come as changes to
 * them. */
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include "internal.h"

static void free_held(struct client_held *held)
{
	psr_frame_free(&held->picture);
	free(held);
}

void client_free_held(struct psr_client *client)
{
	while (client->held != NULL) {
		struct client_held *held = client->held;

		client->held = held->next;
		free_held(held);
	}
}

struct client_held *client_find_held(struct psr_client *client, uint16_t view, uint32_t id, uint16_t pass)
{
	for (struct client_held *held = client->held; held != NULL; held = held->next)
		if (held->view == view && held->id == id && held->pass == pass)
			return held;
	return NULL;
}

const struct client_held *client_find_base(struct psr_client *client, const struct client_frame *frame, uint32_t id,
                                           uint16_t pass)
{
	const struct client_held *held = client_find_held(client, frame->view, id, pass);
	const int is_allowed = id != 0 && (id == frame->assembly.asked.base || id == frame->id);

	return held != NULL && held->is_acked && is_allowed ? held : NULL;
}

/* Whether the server may still name an acknowledged picture as a base. It has all ACKs of an id but the last one,
 * because it begins no frame while two wait for their ACKs. */
static int may_be_base(const struct psr_client *client, const struct client_held *held)
{
	const struct client_held *last = NULL;
	int n_later = 0;

	for (const struct client_held *other = client->held; other != NULL; other = other->next) {
		if (other->view == held->view && other->is_acked)
			last = other;
		n_later += other->id == held->id && other->is_acked && other->pass > held->pass;
	}
	if (last == held)
		return 1;
	for (size_t i = 0; i < PSR_WIRE_MAX_OPEN && n_later < PSR_WIRE_MAX_UNACKED; i++) {
		const struct client_frame *frame = &client->frame[i];

		if (frame->id != 0 && (frame->id == held->id || frame->assembly.asked.base == held->id))
			return 1;
	}
	return 0;
}

void client_release_held(struct psr_client *client)
{
	struct client_held **at = &client->held;

	while (*at != NULL) {
		struct client_held *held = *at;

		if (!held->is_acked || may_be_base(client, held)) {
			at = &held->next;
		} else {
			*at = held->next;
			free_held(held);
		}
	}
}

int client_hold(struct psr_client *client, const struct client_frame *frame, struct client_assembly *done)
{
	struct client_held *held = calloc(1, sizeof *held), **last = &client->held;

	if (held == NULL)
		return PSR_ERR_MEMORY;
	*held = (struct client_held){ .view = frame->view, .id = frame->id, .pass = done->pass, .begin = done->begin,
		                          .lossy = done->lossy, .picture = done->picture };
	memset(&done->picture, 0, sizeof done->picture);
	while (*last != NULL)
		last = &(*last)->next;
	*last = held;
	return PSR_OK;
}

unsigned client_count_unacked(const struct psr_client *client, uint16_t view)
{
	unsigned n = 0;

	for (const struct client_held *held = client->held; held != NULL; held = held->next)
		n += held->view == view && !held->is_acked;
	for (size_t i = 0; i < PSR_WIRE_MAX_OPEN; i++)
		n += client->frame[i].id != 0 && client->frame[i].view == view && client->frame[i].assembly.has_begun;
	return n;
}

int psr_client_ack(struct psr_client *client, uint32_t id, uint16_t pass, struct psr_error *err)
{
	const struct psr_msg_ack ack = { .pass = pass };
	struct client_held *held = client->held;
	int code = client_check(client, err);

	if (code != PSR_OK)
		return code;
	while (held != NULL && (held->is_acked || held->id != id || held->pass != pass))
		held = held->next;
	if (held == NULL)
		return psr_fail(err, PSR_ERR_NOT_FOUND, "no frame %" PRIu32 " with pass %u waits to be acknowledged", id, pass);
	for (const struct client_held *before = client->held; before != held; before = before->next)
		if (before->view == held->view && !before->is_acked)
			return psr_fail(err, PSR_ERR_ARG, "frame %" PRIu32 " with pass %u is to be acknowledged before", before->id,
			                before->pass);
	code = psr_msg_ack_encode(&client->out, id, held->view, &ack, err);
	if (code == PSR_ERR_MEMORY)
		return psr_fail(err, PSR_ERR_BUSY, "%s waits until the server has taken earlier requests", client->address);
	if (code != PSR_OK)
		return code;
	held->is_acked = 1;
	client_release_held(client);
	client_flush(client);
	return PSR_OK;
}

uint32_t psr_client_base(const struct psr_client *client, uint16_t view)
{
	uint32_t id = 0;

	for (const struct client_held *held = client->held; held != NULL; held = held->next)
		if (held->view == view && held->is_acked)
			id = held->id;
	return id;
}
