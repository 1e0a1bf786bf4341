#include <assert.h>
#include <math.h>
#include <string.h>
#include "wire.h"

uint16_t wire_get_u16(const uint8_t *p)
{
	return (uint16_t)(p[0] | p[1] << 8);
}

uint32_t wire_get_u32(const uint8_t *p)
{
	return p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

void wire_fail(struct wire *w, int code, const char *what)
{
	if (w->code != PSR_OK)
		return;
	w->code = code;
	w->what = what;
	w->where = w->at;
}

/* Moves on by n bytes; returns them, or NULL beyond the end. */
static uint8_t *advance_out(struct wire *w, size_t n)
{
	size_t at = w->at;

	w->at += n;
	return w->at <= w->room ? w->out + at : NULL;
}

static const uint8_t *advance_in(struct wire *w, size_t n)
{
	const uint8_t *p;

	if (n > w->room - w->at) {
		wire_fail(w, PSR_ERR_PROTOCOL, "the message ends too early");
		w->at = w->room;
		return NULL;
	}
	p = w->in + w->at;
	w->at += n;
	return p;
}

static void put(struct wire *w, uint64_t v, unsigned n)
{
	uint8_t *p = advance_out(w, n);

	for (unsigned i = 0; p && i < n; i++)
		p[i] = (uint8_t)(v >> 8 * i);
}

static uint64_t get(struct wire *w, unsigned n)
{
	const uint8_t *p = advance_in(w, n);
	uint64_t v = 0;

	for (unsigned i = 0; p && i < n; i++)
		v |= (uint64_t)p[i] << 8 * i;
	return v;
}

/* Writing must not store to the message, which may be constant. */
void wire_u8(struct wire *w, uint8_t *v)
{
	if (w->writing)
		put(w, *v, 1);
	else
		*v = (uint8_t)get(w, 1);
}

void wire_u16(struct wire *w, uint16_t *v)
{
	if (w->writing)
		put(w, *v, 2);
	else
		*v = (uint16_t)get(w, 2);
}

void wire_u32(struct wire *w, uint32_t *v)
{
	if (w->writing)
		put(w, *v, 4);
	else
		*v = (uint32_t)get(w, 4);
}

void wire_u64(struct wire *w, uint64_t *v)
{
	if (w->writing)
		put(w, *v, 8);
	else
		*v = get(w, 8);
}

void wire_f64(struct wire *w, double *v, int n)
{
	for (int i = 0; i < n; i++) {
		uint64_t bits;

		memcpy(&bits, &v[i], sizeof bits);
		wire_u64(w, &bits);
		if (!w->writing)
			memcpy(&v[i], &bits, sizeof bits);
	}
}

void wire_bytes(struct wire *w, uint8_t *v, size_t n)
{
	if (w->writing) {
		uint8_t *p = advance_out(w, n);

		if (p)
			memcpy(p, v, n);
		return;
	}
	const uint8_t *p = advance_in(w, n);

	if (p)
		memcpy(v, p, n);
	else
		memset(v, 0, n);
}

void wire_reserved(struct wire *w, size_t n)
{
	if (w->writing) {
		uint8_t *p = advance_out(w, n);

		if (p)
			memset(p, 0, n);
		return;
	}
	const uint8_t *p = advance_in(w, n);

	for (size_t i = 0; p && i < n; i++)
		if (p[i])
			wire_fail(w, PSR_ERR_PROTOCOL, "a reserved field is not zero");
}

void wire_data(struct wire *w, const uint8_t **data, uint32_t n)
{
	if (w->writing) {
		uint8_t *p = advance_out(w, n);

		if (p)
			memcpy(p, *data, n);
		return;
	}
	*data = advance_in(w, n);
}

/* Returns the length of the well-formed character at p, or 0; control characters, which could steer a terminal, give
 * 0. */
static size_t character(const uint8_t *p, size_t n)
{
	static const uint32_t least[5] = { 0, 0, 0x80, 0x800, 0x10000 };
	size_t length = p[0] < 0x80 ? 1 : p[0] < 0xc0 ? 0 : p[0] < 0xe0 ? 2 : p[0] < 0xf0 ? 3 : p[0] < 0xf8 ? 4 : 0;
	uint32_t c;

	if (length == 0 || length > n)
		return 0;
	if (length == 1)
		return p[0] < 0x20 || p[0] == 0x7f ? 0 : 1;
	c = p[0] & (0x7fu >> length);
	for (size_t i = 1; i < length; i++) {
		if ((p[i] & 0xc0) != 0x80)
			return 0;
		c = c << 6 | (p[i] & 0x3f);
	}
	if (c < least[length] || c < 0xa0 || (c >= 0xd800 && c < 0xe000) || c > 0x10ffff)
		return 0;
	return length;
}

void wire_string(struct wire *w, char *text, size_t size)
{
	size_t length = w->writing ? strnlen(text, size) : 0;
	uint16_t n = (uint16_t)length;

	if (length >= size) {
		wire_fail(w, PSR_ERR_ARG, "a text is not terminated");
		return;
	}
	wire_u16(w, &n);
	if (n >= size) {
		wire_fail(w, PSR_ERR_PROTOCOL, "a text is too long");
		n = 0;
	}
	wire_bytes(w, (uint8_t *)text, n);
	if (!w->writing)
		text[n] = 0;
	for (size_t i = 0, step; w->code == PSR_OK && i < n; i += step) {
		step = character((const uint8_t *)text + i, n - i);
		if (step == 0)
			wire_fail(w, w->writing ? PSR_ERR_ARG : PSR_ERR_PROTOCOL, "a text is not UTF-8 without control characters");
	}
}

void wire_clean(char *out, const char *text, size_t size)
{
	size_t n = strnlen(text, size - 1), i = 0;

	while (i < n) {
		size_t step = character((const uint8_t *)text + i, n - i);

		memcpy(out + i, step ? text + i : "?", step ? step : 1);
		i += step ? step : 1;
	}
	out[n] = 0;
}

int wire_encode(struct psr_buf *out, const struct wire_kind *kind, uint32_t id, uint16_t view, const void *msg,
                struct psr_error *err)
{
	struct wire w = { .writing = 1, .out = out->capacity > 0 ? out->data + out->size : NULL,
		              .room = out->capacity - out->size };
	const char *name = psr_msg_name(kind->type);
	uint16_t type = (uint16_t)kind->type, flags = 0;
	uint32_t length = 0;
	int result;

	assert(out->size <= out->capacity && name);
	result = kind->check ? kind->check(msg, err) : PSR_OK;
	if (result != PSR_OK)
		return result;
	wire_u32(&w, &length);
	wire_u16(&w, &type);
	wire_u16(&w, &flags);
	wire_u32(&w, &id);
	wire_u16(&w, &view);
	wire_reserved(&w, 2);
	if (kind->layout)
		kind->layout(&w, (void *)msg); /* reads msg only, as `writing` is set */
	if (w.code != PSR_OK)
		return psr_fail(err, w.code, "%s: %s", name, w.what);
	if (w.at > PSR_WIRE_MAX_MESSAGE)
		return psr_fail(err, PSR_ERR_LIMIT, "%s: the message would have %zu bytes; the limit is %d", name, w.at,
		                PSR_WIRE_MAX_MESSAGE);
	if (w.at > w.room)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: the message has %zu bytes, but the buffer has room for %zu", name,
		                w.at,
		                w.room);
	for (int i = 0; i < 4; i++)
		w.out[i] = (uint8_t)(w.at >> 8 * i);
	out->size += w.at;
	return PSR_OK;
}

int wire_decode(void *msg, const struct wire_kind *kind, const uint8_t *payload, size_t n, struct psr_error *err)
{
	struct wire w = { .in = payload, .room = n };

	kind->layout(&w, msg);
	if (w.code != PSR_OK)
		return psr_fail(err, w.code, "%s: %s (byte %zu of the payload)", psr_msg_name(kind->type), w.what, w.where);
	return kind->check ? kind->check(msg, err) : PSR_OK;
}

int check_lengths(const char *what, const double *v, int n, struct psr_error *err)
{
	for (int i = 0; i < n; i++)
		if (!(fabs(v[i]) <= PSR_WIRE_MAX_LENGTH))
			return psr_fail(err, PSR_ERR_ARG, "%s holds %g: it must be finite and at most %g in magnitude", what, v[i],
			                PSR_WIRE_MAX_LENGTH);
	return PSR_OK;
}

int check_positive(const char *what, double v, struct psr_error *err)
{
	return check_range(what, v, 1 / PSR_WIRE_MAX_LENGTH, PSR_WIRE_MAX_LENGTH, err);
}

int check_range(const char *what, double v, double min, double max, struct psr_error *err)
{
	if (v >= min && v <= max)
		return PSR_OK;
	return psr_fail(err, PSR_ERR_ARG, "%s is %g: it must be within %g and %g", what, v, min, max);
}

int check_integer(const char *what, uint64_t v, uint64_t min, uint64_t max, struct psr_error *err)
{
	if (v >= min && v <= max)
		return PSR_OK;
	return psr_fail(err, PSR_ERR_ARG, "%s is %llu: it must be within %llu and %llu", what, (unsigned long long)v,
	                (unsigned long long)min, (unsigned long long)max);
}

int check_zero(const char *what, int all_zero, struct psr_error *err)
{
	return all_zero ? PSR_OK : psr_fail(err, PSR_ERR_ARG, "%s must be 0 here", what);
}
