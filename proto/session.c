#define XXH_INLINE_ALL
#include <string.h>
#include <xxhash.h>
#include "wire.h"

static void layout_hello(struct wire *w, void *p)
{
	struct psr_msg_hello *m = p;
	uint8_t magic[8];

	memcpy(magic, PSR_HELLO_MAGIC, 8);
	wire_bytes(w, magic, 8);
	if (memcmp(magic, PSR_HELLO_MAGIC, 8))
		wire_fail(w, PSR_ERR_PROTOCOL, "the magic is wrong");
	wire_u64(w, &m->routing_key);
	wire_u16(w, &m->major);
	wire_u16(w, &m->minor);
	if (!w->writing && w->code == PSR_OK && (m->major != PSR_PROTO_MAJOR || m->minor != PSR_PROTO_MINOR)) {
		wire_fail(w, PSR_ERR_VERSION, "another version");
		return;
	}
	wire_reserved(w, 4);
	wire_u64(w, &m->capabilities);
	wire_reserved(w, 16);
	wire_string(w, m->token, sizeof m->token);
	wire_string(w, m->client, sizeof m->client);
}

int psr_msg_hello_encode(struct psr_buf *out, const struct psr_msg_hello *msg, struct psr_error *err)
{
	return wire_encode(out, WIRE(HELLO, layout_hello, NULL), 0, 0, msg, err);
}

int psr_msg_hello_decode(struct psr_msg_hello *msg, const uint8_t *payload, size_t n, struct psr_error *err)
{
	int result;

	if (n < 48)
		return psr_fail(err, PSR_ERR_PROTOCOL, "HELLO: the message has %zu of at least 48 bytes", n);
	result = wire_decode(msg, WIRE(HELLO, layout_hello, NULL), payload, n, err);
	if (result == PSR_ERR_VERSION)
		return psr_fail(err, PSR_ERR_VERSION, "psr %d.%d: this server speaks this version of the protocol alone, the "
		                "client %u.%u: use programs of the same release", PSR_PROTO_MAJOR, PSR_PROTO_MINOR, msg->major,
		                msg->minor);
	return result;
}

uint64_t psr_routing_key(const char *model_name)
{
	return model_name && *model_name ? XXH64(model_name, strlen(model_name), 0) : 0;
}

static void layout_welcome(struct wire *w, void *p)
{
	struct psr_msg_welcome *m = p;

	wire_u16(w, &m->major);
	wire_u16(w, &m->minor);
	wire_reserved(w, 4);
	wire_u64(w, &m->capabilities);
	wire_u32(w, &m->max_message);
	wire_u32(w, &m->max_side);
	wire_u32(w, &m->max_pixels);
	wire_u32(w, &m->max_instances);
	wire_u32(w, &m->max_lights);
	wire_u32(w, &m->max_scenes);
	wire_u32(w, &m->max_open);
	wire_u32(w, &m->max_models);
	wire_u32(w, &m->idle_timeout_ms);
	wire_reserved(w, 4);
	wire_string(w, m->server, sizeof m->server);
}

static int check_welcome(const void *p, struct psr_error *err)
{
	const struct psr_msg_welcome *m = p;

	if (m->major != PSR_PROTO_MAJOR || m->minor != PSR_PROTO_MINOR)
		return psr_fail(err, PSR_ERR_VERSION, "the server answers in version %u.%u of the protocol, this client speaks "
		                "%u.%u: use programs of the same release", m->major, m->minor, PSR_PROTO_MAJOR,
		                PSR_PROTO_MINOR);
	if (check_integer("the limit of a message", m->max_message, PSR_WIRE_MAX_MESSAGE_HELLO, PSR_WIRE_MAX_MESSAGE,
	                  err) ||
	    check_integer("the limit of a picture's sides", m->max_side, 1, PSR_WIRE_MAX_SIDE, err) ||
	    check_integer("the limit of a picture's pixels", m->max_pixels, 1, PSR_WIRE_MAX_PIXELS, err) ||
	    check_integer("the limit of instances", m->max_instances, 1, PSR_WIRE_MAX_INSTANCES, err) ||
	    check_integer("the limit of lights", m->max_lights, 1, PSR_WIRE_MAX_LIGHTS, err) ||
	    check_integer("the limit of scenes", m->max_scenes, 1, PSR_WIRE_MAX_SCENES, err) ||
	    check_integer("the limit of open ids", m->max_open, 1, PSR_WIRE_MAX_OPEN, err) ||
	    check_integer("the limit of open models", m->max_models, 1, UINT32_MAX, err))
		return PSR_ERR_ARG;
	return PSR_OK;
}

WIRE_PLAIN(welcome, WELCOME, check_welcome)

static void layout_goodbye(struct wire *w, void *p)
{
	struct psr_msg_goodbye *m = p;

	wire_u16(w, &m->reason);
	wire_reserved(w, 2);
	wire_string(w, m->text, sizeof m->text);
	if (!w->writing && m->reason > PSR_GOODBYE_SLOW)
		m->reason = PSR_GOODBYE_DONE;
}

WIRE_PLAIN(goodbye, GOODBYE, NULL)

static void layout_ping(struct wire *w, void *p)
{
	struct psr_msg_ping *m = p;

	wire_u64(w, &m->token);
}

WIRE_PLAIN(ping, PING, NULL)

int psr_msg_pong_encode(struct psr_buf *out, const struct psr_msg_ping *msg, struct psr_error *err)
{
	return wire_encode(out, WIRE(PONG, layout_ping, NULL), 0, 0, msg, err);
}

static void layout_error(struct wire *w, void *p)
{
	struct psr_msg_error *m = p;

	wire_u16(w, &m->code);
	wire_reserved(w, 2);
	wire_string(w, m->text, sizeof m->text);
}

static int check_error(const void *p, struct psr_error *err)
{
	const struct psr_msg_error *m = p;

	return m->code ? PSR_OK : psr_fail(err, PSR_ERR_ARG, "an ERROR has the code 0, which means no error");
}

int psr_msg_error_encode(struct psr_buf *out, uint32_t id, uint16_t view, const struct psr_msg_error *msg,
                         struct psr_error *err)
{
	struct psr_msg_error clean = { .code = msg->code };

	wire_clean(clean.text, msg->text, sizeof clean.text);
	return wire_encode(out, WIRE(ERROR, layout_error, check_error), id, view, &clean, err);
}

WIRE_DECODE(error, ERROR, check_error)

uint16_t psr_wire_error_from(int code)
{
	return code < 0 && code >= -PSR_WIRE_INTERNAL ? (uint16_t)-code : PSR_WIRE_INTERNAL;
}

int psr_wire_error_to(uint16_t wire)
{
	if (wire == PSR_WIRE_UNAUTHORIZED)
		return PSR_ERR_CONNECTION;
	return wire >= 1 && wire <= PSR_WIRE_INTERNAL ? -(int)wire : PSR_ERR_INTERNAL;
}
