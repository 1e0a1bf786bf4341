#include <errno.h>
#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>
#include "base/clock.h"
#include "internal.h"

int client_create(struct psr_client **out, int fd, const char *address, struct psr_error *err)
{
	struct psr_client *client = calloc(1, sizeof *client);

	if (client == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a connection");
	client->fd = -1; /* still the caller's until this function succeeds */
	client->next_id = 1;
	snprintf(client->address, sizeof client->address, "%s", address);
	client->in_storage = malloc(CLIENT_IN_BYTES);
	client->out.data = malloc(CLIENT_OUT_BYTES);
	client->out.capacity = CLIENT_OUT_BYTES;
	if (client->in_storage == NULL || client->out.data == NULL || client_decoder_create(&client->decoder) != PSR_OK) {
		psr_client_close(client);
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a connection");
	}
	psr_framer_init(&client->framer, PSR_SERVER, client->in_storage, CLIENT_IN_BYTES);
	client->fd = fd;
	*out = client;
	return PSR_OK;
}

void psr_client_close(struct psr_client *client)
{
	struct psr_msg_goodbye goodbye = { .reason = PSR_GOODBYE_DONE };

	if (client == NULL)
		return;
	if (client->fd >= 0 && client->is_open && client->broken.code == PSR_OK && !client->write_failed) {
		if (psr_msg_goodbye_encode(&client->out, &goodbye, NULL) == PSR_OK
		    && send(client->fd, client->out.data + client->out_sent, client->out.size - client->out_sent,
		            MSG_NOSIGNAL | MSG_DONTWAIT)
		           > 0)
			shutdown(client->fd, SHUT_WR);
	}
	if (client->fd >= 0)
		close(client->fd);
	for (size_t i = 0; i < PSR_WIRE_MAX_OPEN; i++)
		client_assembly_fini(&client->frame[i].assembly);
	client_assembly_fini(&client->done);
	client_free_queued(client);
	client_free_held(client);
	client_decoder_destroy(client->decoder);
	client_crew_destroy(client->crew);
	free(client->list.entry);
	free(client->presets.preset);
	free(client->in_storage);
	free(client->out.data);
	free(client);
}

int client_break(struct psr_client *client, int code, const char *format, ...)
{
	char text[PSR_ERROR_TEXT];
	va_list args;

	va_start(args, format);
	vsnprintf(text, sizeof text, format, args);
	va_end(args);
	return psr_fail(&client->broken, code, "%.200s: %s", client->address, text);
}

int client_check(const struct psr_client *client, struct psr_error *err)
{
	return client->broken.code == PSR_OK ? PSR_OK : psr_fail(err, client->broken.code, "%s", client->broken.text);
}

int psr_client_use_threads(struct psr_client *client, int n_threads, struct psr_error *err)
{
	if (n_threads < 1 || n_threads > PSR_CLIENT_MAX_THREADS || client->crew != NULL)
		return psr_fail(err, PSR_ERR_ARG, "%d threads are to decode: 1 to %d can, and it is said once", n_threads,
		                PSR_CLIENT_MAX_THREADS);
	if (client_crew_create(&client->crew, n_threads) != PSR_OK)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %d threads", n_threads);
	return PSR_OK;
}

const struct psr_msg_welcome *psr_client_welcome(const struct psr_client *client)
{
	return &client->welcome;
}

int psr_client_fd(const struct psr_client *client, short *events)
{
	if (events != NULL)
		*events = (short)(POLLIN | (client->out.size > 0 ? POLLOUT : 0));
	return client->fd;
}

uint64_t psr_client_bytes_received(const struct psr_client *client)
{
	return client->n_received;
}

/* A peer that has closed may have sent the reason before. So a failed write is no error yet: reading goes on. */
void client_flush(struct psr_client *client)
{
	struct psr_buf *out = &client->out;

	while (!client->write_failed && client->out_sent < out->size) {
		ssize_t n = send(client->fd, out->data + client->out_sent, out->size - client->out_sent, MSG_NOSIGNAL);

		if (n >= 0)
			client->out_sent += (size_t)n;
		else if (errno == EAGAIN || errno == EWOULDBLOCK)
			break;
		else if (errno != EINTR)
			client->write_failed = 1;
	}
	if (client->write_failed || client->out_sent == out->size) {
		out->size = 0;
		client->out_sent = 0;
	} else if (client->out_sent > 0) {
		memmove(out->data, out->data + client->out_sent, out->size - client->out_sent);
		out->size -= client->out_sent;
		client->out_sent = 0;
	}
}

/* Returns 1: bytes came; 0: there are none now; negative: the connection is broken. */
static int fill_input(struct psr_client *client)
{
	size_t room;
	uint8_t *to = psr_framer_space(&client->framer, &room);
	ssize_t n;

	do
		n = recv(client->fd, to, room, 0);
	while (n < 0 && errno == EINTR);
	if (n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK))
		return 0;
	if (n < 0)
		return client_break(client, PSR_ERR_CONNECTION, "the connection is lost: %s", strerror(errno));
	if (n == 0)
		return client_break(client, PSR_ERR_CONNECTION,
		                    client->is_open ? "the server closed the connection"
		                                    : "the peer closed the connection unanswered; is it a psrd of this "
		                                      "version?");
	psr_framer_filled(&client->framer, (size_t)n);
	client->n_received += (uint64_t)n;
	return 1;
}

static int take_messages(struct psr_client *client, struct psr_event *event)
{
	struct psr_message message;
	struct psr_error why;

	for (;;) {
		int got = psr_framer_next(&client->framer, &message, &why);

		if (got == 0)
			return 0;
		if (got < 0)
			return client_break(
				client, PSR_ERR_PROTOCOL,
				client->is_open ? "the server broke the protocol: %.300s" : "no psrd answers there: %.300s", why.text);
		got = client_dispatch(client, &message, event);
		if (got != 0)
			return got;
	}
}

int client_run(struct psr_client *client, uint64_t deadline_ns, struct psr_event *event, struct psr_error *err)
{
	client_assembly_fini(&client->done);
	client_free_given(client);
	memset(event, 0, sizeof *event);
	client->answer = CLIENT_ANSWER_NONE;
	for (int has_read = 0; client->broken.code == PSR_OK; has_read = 1) {
		int got = take_messages(client, event);

		if (got > 0)
			return 1;
		if (got < 0)
			break;
		if (has_read && clock_ns() >= deadline_ns) /* for a server that never stops sending */
			return 0;
		client_flush(client);
		got = fill_input(client);
		if (got != 0)
			continue;
		got = client_poll(client->fd, POLLIN | (client->out.size > 0 ? POLLOUT : 0), deadline_ns, err);
		if (got <= 0)
			return got;
	}
	return client_check(client, err);
}

int psr_client_wait(struct psr_client *client, int timeout_ms, struct psr_event *event, struct psr_error *err)
{
	uint64_t deadline_ns = client_deadline_ns(timeout_ms);
	int got;

	if (client->broken.code == PSR_OK && client_take_queued(client, event))
		return 1;
	do
		got = client_run(client, deadline_ns, event, err);
	while (got > 0 && event->type == 0); /* a late PONG makes no event */
	return got;
}
