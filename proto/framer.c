#include <assert.h>
#include <string.h>
#include "wire.h"

enum { FROM_CLIENT = 1, FROM_SERVER = 2, FROM_BOTH = 3 };
enum { ZERO, POSITIVE, ANY };

/* The table under "Header" in PROTOCOL.md. */
static const struct kind {
	uint16_t type;
	uint8_t from, id, view;
	uint32_t min, max; /* bytes of payload; PSR_WIRE_GROWTH more are skipped */
	const char *name;
} kinds[] = {
	{ PSR_MSG_HELLO, FROM_CLIENT, ZERO, ZERO, 52, 1008, "HELLO" },
	{ PSR_MSG_WELCOME, FROM_SERVER, ZERO, ZERO, 58, 313, "WELCOME" },
	{ PSR_MSG_GOODBYE, FROM_BOTH, ZERO, ZERO, 6, 261, "GOODBYE" },
	{ PSR_MSG_PING, FROM_BOTH, ZERO, ZERO, 8, 8, "PING" },
	{ PSR_MSG_PONG, FROM_BOTH, ZERO, ZERO, 8, 8, "PONG" },
	{ PSR_MSG_ERROR, FROM_SERVER, ANY, ANY, 6, 517, "ERROR" },
	{ PSR_MSG_LIST, FROM_CLIENT, POSITIVE, ZERO, 0, 0, "LIST" },
	{ PSR_MSG_LIST_ENTRY, FROM_SERVER, POSITIVE, ZERO, 34, 289, "LIST_ENTRY" },
	{ PSR_MSG_LIST_END, FROM_SERVER, POSITIVE, ZERO, 4, 4, "LIST_END" },
	{ PSR_MSG_OPEN, FROM_CLIENT, POSITIVE, ZERO, 6, 261, "OPEN" },
	{ PSR_MSG_PROGRESS, FROM_SERVER, POSITIVE, ZERO, 24, 24, "PROGRESS" },
	{ PSR_MSG_OPENED, FROM_SERVER, POSITIVE, ZERO, 168, 168, "OPENED" },
	{ PSR_MSG_CLOSE, FROM_CLIENT, POSITIVE, ZERO, 4, 4, "CLOSE" },
	{ PSR_MSG_PRESETS, FROM_CLIENT, POSITIVE, ZERO, 4, 4, "PRESETS" },
	{ PSR_MSG_PRESET, FROM_SERVER, POSITIVE, ZERO, 107, 361, "PRESET" },
	{ PSR_MSG_PRESETS_END, FROM_SERVER, POSITIVE, ZERO, 8, 8, "PRESETS_END" },
	{ PSR_MSG_SCENE, FROM_CLIENT, POSITIVE, ZERO, 24, PSR_WIRE_MAX_PAYLOAD, "SCENE" },
	{ PSR_MSG_FRAME, FROM_CLIENT, POSITIVE, ANY, 176, 176, "FRAME" },
	{ PSR_MSG_FRAME_BEGIN, FROM_SERVER, POSITIVE, ANY, 160, 160, "FRAME_BEGIN" },
	{ PSR_MSG_RECT, FROM_SERVER, POSITIVE, ANY, 25, PSR_WIRE_MAX_PAYLOAD, "RECT" },
	{ PSR_MSG_FRAME_END, FROM_SERVER, POSITIVE, ANY, 40, 1256, "FRAME_END" },
	{ PSR_MSG_SUPERSEDED, FROM_SERVER, POSITIVE, POSITIVE, 4, 4, "SUPERSEDED" },
	{ PSR_MSG_CANCELLED, FROM_SERVER, POSITIVE, ANY, 0, 0, "CANCELLED" },
	{ PSR_MSG_ACK, FROM_CLIENT, POSITIVE, POSITIVE, 4, 4, "ACK" },
	{ PSR_MSG_CANCEL, FROM_CLIENT, POSITIVE, ANY, 0, 0, "CANCEL" },
	{ PSR_MSG_PAUSE, FROM_CLIENT, POSITIVE, ANY, 0, 0, "PAUSE" },
	{ PSR_MSG_RESUME, FROM_CLIENT, POSITIVE, ANY, 0, 0, "RESUME" },
	{ PSR_MSG_STATS, FROM_CLIENT, POSITIVE, ZERO, 0, 0, "STATS" },
	{ PSR_MSG_STATS_REPLY, FROM_SERVER, POSITIVE, ZERO, 8, 648, "STATS_REPLY" },
	{ PSR_MSG_FETCH, FROM_CLIENT, POSITIVE, ZERO, 34, 289, "FETCH" },
	{ PSR_MSG_FETCH_PART, FROM_SERVER, POSITIVE, ZERO, 17, PSR_WIRE_MAX_PAYLOAD, "FETCH_PART" },
	{ PSR_MSG_FETCH_END, FROM_SERVER, POSITIVE, ZERO, 16, 16, "FETCH_END" },
};

static const struct kind *find_kind(unsigned type)
{
	for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++)
		if (kinds[i].type == type)
			return &kinds[i];
	return NULL;
}

const char *psr_msg_name(unsigned type)
{
	const struct kind *kind = find_kind(type);

	return kind ? kind->name : NULL;
}

void psr_framer_init(struct psr_framer *framer, enum psr_side peer, void *storage, size_t capacity)
{
	memset(framer, 0, sizeof *framer);
	framer->peer = peer;
	framer->storage = storage;
	framer->capacity = capacity;
	framer->expects_hello = peer == PSR_CLIENT;
	framer->max_message = peer == PSR_CLIENT ? PSR_WIRE_MAX_MESSAGE_HELLO : PSR_WIRE_MAX_MESSAGE;
	assert(capacity >= framer->max_message);
}

void psr_framer_accept(struct psr_framer *framer, void *storage, size_t capacity)
{
	size_t n = framer->end - framer->begin;

	assert(capacity >= PSR_WIRE_MAX_MESSAGE && capacity >= n);
	memmove(storage, framer->storage + framer->begin, n);
	framer->storage = storage;
	framer->capacity = capacity;
	framer->begin = 0;
	framer->end = n;
	framer->max_message = PSR_WIRE_MAX_MESSAGE;
}

uint8_t *psr_framer_space(struct psr_framer *framer, size_t *n)
{
	if (framer->begin > 0) {
		framer->end -= framer->begin;
		memmove(framer->storage, framer->storage + framer->begin, framer->end);
		framer->begin = 0;
	}
	*n = framer->capacity - framer->end;
	return framer->storage + framer->end;
}

void psr_framer_filled(struct psr_framer *framer, size_t n)
{
	assert(n <= framer->capacity - framer->end);
	framer->end += n;
}

/* Compares the first 24 bytes of HELLO, which are the same on every connection except the lower half of the length. */
static int looks_like_hello(const uint8_t *bytes, size_t n)
{
	uint8_t expected[24] = { 0, 0, 0, 0, PSR_MSG_HELLO };

	memcpy(expected + 16, PSR_HELLO_MAGIC, 8);
	for (size_t i = 2; i < n && i < sizeof expected; i++)
		if (bytes[i] != expected[i])
			return 0;
	return 1;
}

static int keeps(unsigned rule, uint32_t v)
{
	return rule == ANY || (rule == ZERO) == (v == 0);
}

static int check_header(const struct psr_framer *framer, const struct kind *kind, const struct psr_message *m,
                        struct psr_error *err)
{
	if (!(kind->from & (framer->peer == PSR_CLIENT ? FROM_CLIENT : FROM_SERVER)))
		return psr_fail(err, PSR_ERR_PROTOCOL, "%s comes from the wrong side", kind->name);
	if (m->flags)
		return psr_fail(err, PSR_ERR_PROTOCOL, "%s has flags %#x, which it must not have", kind->name, m->flags);
	if (!keeps(kind->id, m->id))
		return psr_fail(err, PSR_ERR_PROTOCOL, "%s has id %u: it must%s be 0", kind->name, m->id,
		                kind->id == ZERO ? "" : " not");
	if (!keeps(kind->view, m->view))
		return psr_fail(err, PSR_ERR_PROTOCOL, "%s has view %u: it must%s be 0", kind->name, m->view,
		                kind->view == ZERO ? "" : " not");
	if (m->n < kind->min || m->n > kind->max + PSR_WIRE_GROWTH)
		return psr_fail(err, PSR_ERR_PROTOCOL, "%s has a payload of %zu bytes, which must have %u to %u", kind->name,
		                m->n, kind->min, kind->max + PSR_WIRE_GROWTH);
	return PSR_OK;
}

static int fail(struct psr_framer *framer, int code)
{
	framer->failed = code;
	return code;
}

/* Sets *kind to NULL for a valid header of an unknown type that may be skipped. */
static int read_header(struct psr_framer *framer, struct psr_message *m, const struct kind **kind,
                       struct psr_error *err)
{
	const uint8_t *p = framer->storage + framer->begin;
	uint32_t length = wire_get_u32(p);

	if (length < PSR_HEADER_SIZE || length > framer->max_message)
		return psr_fail(err, PSR_ERR_PROTOCOL, "a message claims a length of %u bytes: it must have %d to %zu", length,
		                PSR_HEADER_SIZE, framer->max_message);
	m->type = wire_get_u16(p + 4);
	m->flags = wire_get_u16(p + 6);
	m->id = wire_get_u32(p + 8);
	m->view = wire_get_u16(p + 12);
	m->payload = p + PSR_HEADER_SIZE;
	m->n = length - PSR_HEADER_SIZE;
	if ((m->flags & ~PSR_FLAG_SKIP) || wire_get_u16(p + 14))
		return psr_fail(err, PSR_ERR_PROTOCOL, "a message of type %u has reserved bits set in its header", m->type);
	*kind = find_kind(m->type);
	if (*kind)
		return check_header(framer, *kind, m, err);
	if (!(m->flags & PSR_FLAG_SKIP))
		return psr_fail(err, PSR_ERR_PROTOCOL, "a message has the unknown type %u", m->type);
	return PSR_OK;
}

int psr_framer_next(struct psr_framer *framer, struct psr_message *message, struct psr_error *err)
{
	if (framer->failed)
		return psr_fail(err, framer->failed, "an earlier message could not be read; close the connection");
	for (;;) {
		size_t n = framer->end - framer->begin;
		const struct kind *kind = NULL;
		int result;

		if (framer->expects_hello && !looks_like_hello(framer->storage + framer->begin, n))
			return fail(framer, psr_fail(err, PSR_ERR_FORMAT, "the peer is not a client of psr"));
		if (n < (framer->expects_hello ? 24 : PSR_HEADER_SIZE))
			return 0;
		result = read_header(framer, message, &kind, err);
		if (result != PSR_OK)
			return fail(framer, result);
		if (n < PSR_HEADER_SIZE + message->n)
			return 0;
		framer->begin += PSR_HEADER_SIZE + message->n;
		if (kind) {
			framer->expects_hello = 0;
			return 1;
		}
		framer->skipped++;
	}
}
