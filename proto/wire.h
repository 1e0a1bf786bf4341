/* Private to proto/: one walk over a message's fields does the writing and the reading, so that both share a layout. */
#ifndef PSR_PROTO_WIRE_H
#define PSR_PROTO_WIRE_H

#include "proto.h"

/* A walk. Writing beyond `room` only advances `at`; fields read beyond the end are 0. code, what and where keep the
 * first error. */
struct wire {
	int writing;
	uint8_t *out;
	const uint8_t *in;
	size_t at, room;
	int code;
	const char *what;
	size_t where;
};

void wire_u8(struct wire *w, uint8_t *v);
void wire_u16(struct wire *w, uint16_t *v);
void wire_u32(struct wire *w, uint32_t *v);
void wire_u64(struct wire *w, uint64_t *v);
void wire_f64(struct wire *w, double *v, int n);
void wire_bytes(struct wire *w, uint8_t *v, size_t n);
void wire_reserved(struct wire *w, size_t n);
void wire_string(struct wire *w, char *text, size_t size); /* size of the array, NUL included */

/* A field of all remaining bytes: `data` when writing, a pointer into the payload when reading. */
void wire_data(struct wire *w, const uint8_t **data, uint32_t n);

/* Copies text, replacing each byte that strings on the wire exclude by '?'. */
void wire_clean(char *out, const char *text, size_t size);

void wire_fail(struct wire *w, int code, const char *what);

typedef void wire_layout(struct wire *w, void *msg);
typedef int wire_check(const void *msg, struct psr_error *err);

/* A kind of message. check may be NULL; it runs before writing and after reading. */
struct wire_kind {
	unsigned type;
	wire_layout *layout; /* NULL: no payload */
	wire_check *check;
};
#define WIRE(name, layout, check) (&(const struct wire_kind){ PSR_MSG_##name, layout, check })

int wire_encode(struct psr_buf *out, const struct wire_kind *kind, uint32_t id, uint16_t view, const void *msg,
                struct psr_error *err);
int wire_decode(void *msg, const struct wire_kind *kind, const uint8_t *payload, size_t n, struct psr_error *err);

/* The functions that proto.h declares by PROTO_PLAIN(), PROTO_ID() and PROTO_VIEW(), for a message with layout_NAME();
 * check may be NULL. The EMPTY ones have no payload, and so no decoder. */
#define WIRE_DECODE(name, type, check)                                                                              \
	int psr_msg_##name##_decode(struct psr_msg_##name *msg, const uint8_t *payload, size_t n, struct psr_error *err) \
	{                                                                                                               \
		return wire_decode(msg, WIRE(type, layout_##name, check), payload, n, err);                                 \
	}
#define WIRE_PLAIN(name, type, check)                                                                               \
	int psr_msg_##name##_encode(struct psr_buf *out, const struct psr_msg_##name *msg, struct psr_error *err)       \
	{                                                                                                               \
		return wire_encode(out, WIRE(type, layout_##name, check), 0, 0, msg, err);                                  \
	}                                                                                                               \
	WIRE_DECODE(name, type, check)
#define WIRE_ID(name, type, check)                                                                                  \
	int psr_msg_##name##_encode(struct psr_buf *out, uint32_t id, const struct psr_msg_##name *msg,                 \
	                            struct psr_error *err)                                                              \
	{                                                                                                               \
		return wire_encode(out, WIRE(type, layout_##name, check), id, 0, msg, err);                                 \
	}                                                                                                               \
	WIRE_DECODE(name, type, check)
#define WIRE_VIEW(name, type, check)                                                                                \
	int psr_msg_##name##_encode(struct psr_buf *out, uint32_t id, uint16_t view, const struct psr_msg_##name *msg,  \
	                            struct psr_error *err)                                                              \
	{                                                                                                               \
		return wire_encode(out, WIRE(type, layout_##name, check), id, view, msg, err);                              \
	}                                                                                                               \
	WIRE_DECODE(name, type, check)
#define WIRE_EMPTY_ID(name, type)                                                                                   \
	int psr_msg_##name##_encode(struct psr_buf *out, uint32_t id, struct psr_error *err)                            \
	{                                                                                                               \
		return wire_encode(out, WIRE(type, NULL, NULL), id, 0, NULL, err);                                          \
	}
#define WIRE_EMPTY_VIEW(name, type)                                                                                 \
	int psr_msg_##name##_encode(struct psr_buf *out, uint32_t id, uint16_t view, struct psr_error *err)             \
	{                                                                                                               \
		return wire_encode(out, WIRE(type, NULL, NULL), id, view, NULL, err);                                       \
	}

/* Checks of values; `what` names the field in the error text. */
int check_lengths(const char *what, const double *v, int n, struct psr_error *err);
int check_positive(const char *what, double v, struct psr_error *err);
int check_range(const char *what, double v, double min, double max, struct psr_error *err);
int check_integer(const char *what, uint64_t v, uint64_t min, uint64_t max, struct psr_error *err);
int check_zero(const char *what, int all_zero, struct psr_error *err);

/* Layouts and checks of parts that several messages share. */
void layout_camera(struct wire *w, struct psr_camera *camera); /* 96 bytes */
int check_camera(const struct psr_camera *camera, struct psr_error *err);
void layout_light(struct wire *w, struct psr_msg_light *light); /* 88 bytes */
int check_light(const struct psr_msg_light *light, struct psr_error *err);

uint32_t wire_get_u32(const uint8_t *p);
uint16_t wire_get_u16(const uint8_t *p);

#endif
