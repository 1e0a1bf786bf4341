#include <stdlib.h>
#include "conn.h"
#include "handshake.h"
#include "server/log.h"
#include "server/server.h"

#define INPUT_OPEN (2 * PSR_WIRE_MAX_MESSAGE)

static void welcome(struct conn *conn)
{
	const struct options *options = conn->server->options;
	double idle_ms = options->idle_timeout * 1000;
	const struct psr_msg_welcome msg = {
		.major = PSR_PROTO_MAJOR,
		.minor = PSR_PROTO_MINOR,
		.capabilities = PSR_CAP_REFINE | PSR_CAP_SHADOWS | PSR_CAP_BUILD | PSR_CAP_PRESETS | PSR_CAP_NORMAL |
		                PSR_CAP_ID | PSR_CAP_WEIGHT | PSR_CAP_WORDS | PSR_CAP_BLOCK | PSR_CAP_RESOLUTION,
		.max_message = PSR_WIRE_MAX_MESSAGE,
		.max_side = PSR_WIRE_MAX_SIDE,
		.max_pixels = (uint32_t)options->max_pixels,
		.max_instances = PSR_WIRE_MAX_INSTANCES,
		.max_lights = PSR_WIRE_MAX_LIGHTS,
		.max_scenes = PSR_WIRE_MAX_SCENES,
		.max_open = (uint32_t)options->max_open,
		.max_models = (uint32_t)options->max_handles,
		.idle_timeout_ms = options->idle_timeout > 0 && idle_ms < 1 ? 1 : (uint32_t)idle_ms,
		.server = "psrd " PSR_VERSION,
	};
	uint8_t bytes[512];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };

	if (psr_msg_welcome_encode(&buf, &msg, NULL) == PSR_OK)
		conn_send(conn, &buf);
}

void handshake_take(struct conn *conn, const struct psr_message *message)
{
	struct psr_msg_hello hello;
	struct psr_error error;
	uint8_t *input;
	int code = psr_msg_hello_decode(&hello, message->payload, message->n, &error);

	if (code == PSR_OK && conn->is_surplus)
		code = psr_fail(&error, PSR_ERR_BUSY, "the server is full: it serves %lld clients; try again later",
		                (long long)conn->server->options->max_clients);
	if (code != PSR_OK) {
		conn_fail(conn, code, error.text);
		return;
	}
	input = malloc(INPUT_OPEN);
	if (input == NULL || session_init(&conn->session, (uint32_t)conn->server->options->max_handles) != PSR_OK) {
		free(input);
		conn_fail(conn, PSR_ERR_MEMORY, "the server has no memory for another client");
		return;
	}
	psr_framer_accept(&conn->framer, input, INPUT_OPEN);
	free(conn->input);
	conn->input = input;
	conn->state = CONN_OPEN;
	log_info("connection %llu: %s", (unsigned long long)conn->number, hello.client);
	welcome(conn);
}
