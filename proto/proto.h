/* The protocol between a client and psrd: structs <-> bytes, and framing. No sockets, no allocation, no clock; only the
 * framer has state. proto/PROTOCOL.md is the contract that both sides follow; this header names its parts.
 *
 * Encoding appends one whole message (header and payload) to the caller's psr_buf. Decoding takes the payload of a
 * message that the framer returned. It skips bytes behind the last field, and replaces unknown values of the enums that
 * PROTOCOL.md lists under "Versions" by their fallbacks. Else both check the same rules, and every failure is one of:
 *   PSR_ERR_PROTOCOL  decoding: the bytes are no message of this type (too short, reserved bits, bad UTF-8, ...);
 *                     the peer is broken: say so in an ERROR of id 0 and close the connection
 *   PSR_ERR_ARG       well-formed, but a value is outside of its documented range (NaN in a camera, a size of 0);
 *                     the request is refused by an ERROR with its id, the connection goes on
 *   PSR_ERR_LIMIT     the same for a value over a limit; encoding: also when the message would exceed 64 KiB
 *   PSR_ERR_MEMORY    encoding only: the psr_buf has too little room; nothing was written
 * A failed decode leaves the struct undefined; a failed encode leaves the psr_buf as it was. */
#ifndef PSR_PROTO_PROTO_H
#define PSR_PROTO_PROTO_H

#include <stddef.h>
#include <stdint.h>
#include "psr/error.h"
#include "psr/message.h"

#define PSR_PROTO_MAJOR 0
#define PSR_PROTO_MINOR 2 /* 0.x speaks only with its own minor */

#define PSR_HEADER_SIZE 16
#define PSR_WIRE_MAX_MESSAGE 65536     /* header included */
#define PSR_WIRE_MAX_MESSAGE_HELLO 1024 /* before the server has accepted the HELLO */
#define PSR_WIRE_MAX_PAYLOAD (PSR_WIRE_MAX_MESSAGE - PSR_HEADER_SIZE)
#define PSR_WIRE_GROWTH 256            /* bytes behind the fields of this version that a receiver skips */
#define PSR_WIRE_MAX_RECT_PIXELS 2097152u /* 128 rows of 16384 */
#define PSR_WIRE_MAX_RECT_DATA (PSR_WIRE_MAX_PAYLOAD - 24) /* bytes of data in one RECT */
#define PSR_WIRE_MAX_PART (PSR_WIRE_MAX_PAYLOAD - 16) /* bytes of a file in one FETCH_PART */
#define PSR_WIRE_MAX_UNACKED 2         /* frames of a view > 0 that are sent and not acknowledged */
#define PSR_WIRE_PART_WIDTH 128        /* a frame on a base sends the parts of this grid that changed */
#define PSR_WIRE_PART_HEIGHT 32
#define PSR_WIRE_MAX_INTEGER 9007199254740991u /* 2^53 - 1: integers that need arithmetic */

enum psr_msg_type {
	PSR_MSG_HELLO = 1, PSR_MSG_WELCOME = 2, PSR_MSG_GOODBYE = 3, PSR_MSG_PING = 4, PSR_MSG_PONG = 5, PSR_MSG_ERROR = 6,
	PSR_MSG_LIST = 16, PSR_MSG_LIST_ENTRY = 17, PSR_MSG_LIST_END = 18,
	PSR_MSG_OPEN = 19, PSR_MSG_PROGRESS = 20, PSR_MSG_OPENED = 21, PSR_MSG_CLOSE = 22,
	PSR_MSG_PRESETS = 23, PSR_MSG_PRESET = 24, PSR_MSG_PRESETS_END = 25,
	PSR_MSG_SCENE = 32, PSR_MSG_FRAME = 33, PSR_MSG_FRAME_BEGIN = 34, PSR_MSG_RECT = 35, PSR_MSG_FRAME_END = 36,
	PSR_MSG_SUPERSEDED = 37, PSR_MSG_CANCELLED = 38, PSR_MSG_ACK = 39, PSR_MSG_CANCEL = 40, PSR_MSG_PAUSE = 41,
	PSR_MSG_RESUME = 42,
	PSR_MSG_STATS = 48, PSR_MSG_STATS_REPLY = 49,
	PSR_MSG_FETCH = 64, PSR_MSG_FETCH_PART = 65, PSR_MSG_FETCH_END = 66,
};

enum psr_msg_flag { PSR_FLAG_SKIP = 1 }; /* a receiver that does not know the type skips the message */

/* ---- storage and header ---- */

struct psr_buf {
	uint8_t *data;   /* owned by the caller */
	size_t size;     /* bytes in use; the next message goes behind them */
	size_t capacity;
};

struct psr_message {
	uint16_t type, flags;
	uint32_t id;
	uint16_t view;
	const uint8_t *payload; /* in the framer's storage */
	size_t n;               /* bytes of payload */
};

/* Returns the name of a message type ("FRAME_BEGIN"), or NULL if this version has no such type. */
const char *psr_msg_name(unsigned type);

/* ---- the framer: arbitrary byte splits in, whole messages out ---- */

enum psr_side { PSR_CLIENT, PSR_SERVER };

/* Read bytes into psr_framer_space(), report their number to psr_framer_filled(), then take messages until there is
 * none. */
struct psr_framer {
	uint8_t *storage;
	size_t capacity, begin, end, max_message;
	uint64_t skipped;        /* messages of unknown types that were marked as skippable */
	enum psr_side peer;
	int expects_hello, failed;
};

/* `peer` sends the bytes. A client's first message must be HELLO: the framer compares its first bytes as they arrive,
 * and no message may exceed 1 KiB until psr_framer_accept(). A server may send 64 KiB at once. `capacity` must hold the
 * largest message that may come (1 KiB, 64 KiB; asserted); with more, fewer reads are needed. */
void psr_framer_init(struct psr_framer *framer, enum psr_side peer, void *storage, size_t capacity);

/* The HELLO is accepted: from now on messages may have 64 KiB. Bytes already read move to `storage` (>= 64 KiB; may be
 * the old one); earlier payloads become invalid. */
void psr_framer_accept(struct psr_framer *framer, void *storage, size_t capacity);

/* Returns where to read to, and how many bytes at most: never 0 if psr_framer_next() returned 0 before. Invalidates
 * payloads. */
uint8_t *psr_framer_space(struct psr_framer *framer, size_t *n);
void psr_framer_filled(struct psr_framer *framer, size_t n);

/* Returns 1: *message is the next one, its payload valid until the next call of space or accept; 0: it needs more
 * bytes; PSR_ERR_PROTOCOL, now and ever after: the bytes cannot be messages of this peer (length, reserved bits, type,
 * the id and view rules of PROTOCOL.md); PSR_ERR_FORMAT: the peer is not a psr client at all (no magic): close without
 * an answer. Drops and counts messages of unknown types with PSR_FLAG_SKIP. */
int psr_framer_next(struct psr_framer *framer, struct psr_message *message, struct psr_error *err);

/* ---- messages that psr/message.h lacks ---- */

#define PSR_HELLO_MAGIC "\x89psrp\r\n\x1a" /* 8 bytes, without the NUL */

struct psr_msg_hello { /* client -> server, first; id 0 */
	uint16_t major, minor;     /* encode: PSR_PROTO_MAJOR, PSR_PROTO_MINOR, or another version for a test */
	uint64_t routing_key;      /* psr_routing_key of the model's name, or 0 */
	uint64_t capabilities;     /* sent as 0, ignored */
	char token[PSR_WIRE_MAX_NAME + 1]; /* "" if none */
	char client[PSR_WIRE_MAX_NAME + 1]; /* name and version of the program */
};

enum psr_goodbye { PSR_GOODBYE_DONE = 0, PSR_GOODBYE_SHUTDOWN = 1, PSR_GOODBYE_IDLE = 2, PSR_GOODBYE_SLOW = 3 };
struct psr_msg_goodbye { /* either way; id 0; the sender sends nothing after it */
	uint16_t reason; /* the decoder turns an unknown one into DONE */
	char text[PSR_WIRE_MAX_NAME + 1];
};

struct psr_msg_ping { uint64_t token; }; /* PING and PONG, either way; id 0; PONG returns PING's token */

/* Codes on the wire; up to 13 they are the negatives of enum psr_err. */
enum psr_wire_error {
	PSR_WIRE_ARG = 1, PSR_WIRE_MEMORY = 2, PSR_WIRE_IO = 3, PSR_WIRE_NOT_FOUND = 4, PSR_WIRE_FORMAT = 5,
	PSR_WIRE_VERSION = 6, PSR_WIRE_UNSUPPORTED = 7, PSR_WIRE_LIMIT = 8, PSR_WIRE_BUSY = 9,
	PSR_WIRE_CANCELLED = 10, PSR_WIRE_PROTOCOL = 11,
	PSR_WIRE_CONNECTION = 12, PSR_WIRE_INTERNAL = 13, PSR_WIRE_UNAUTHORIZED = 14,
};
uint16_t psr_wire_error_from(int code); /* enum psr_err -> wire; INTERNAL for any other number */
int psr_wire_error_to(uint16_t wire);   /* wire -> enum psr_err; UNAUTHORIZED becomes CONNECTION, an unknown one
                                         * INTERNAL */

struct psr_msg_error { /* server -> client; ends the id; id 0: about the connection, which the server closes */
	uint16_t code;               /* enum psr_wire_error, not 0; receivers accept unknown codes */
	char text[PSR_ERROR_TEXT];   /* encoding replaces bytes that are not clean UTF-8 by '?', so that any ERROR can be
	                              * sent */
};

struct psr_msg_list_end { uint32_t n_entries; };
struct psr_msg_open {
	uint16_t resolution;               /* the greater side, in pixels, of the pictures that the model is opened for;
	                                    * 0..16384; 0: unknown. Other values only for a server with
	                                    * PSR_CAP_RESOLUTION */
	uint8_t levels;                    /* of a packed octree's file its shortest beginning of at least so many levels;
	                                    * 0..PSR_WIRE_MAX_LEVELS, 0: all. Other values only with PSR_CAP_LEVELS */
	char name[PSR_WIRE_MAX_NAME + 1];  /* not empty */
};
struct psr_msg_close { uint32_t handle; }; /* only a failure is answered, by ERROR; scenes with the model keep it */
struct psr_msg_presets { uint32_t handle; };
struct psr_msg_presets_end { uint32_t n_cameras, n_lights; }; /* how many PRESETs came before */

struct psr_msg_rect { /* server -> client; a piece of one coded rectangle */
	uint8_t plane, codec;
	uint8_t scale;           /* 1, 2, 4: the data has ceil(w / scale) x ceil(h / scale) pixels */
	uint16_t x, y, w, h;     /* within the picture, w, h >= 1, w * h <= PSR_WIRE_MAX_RECT_PIXELS */
	uint32_t total;          /* bytes of the coded rectangle */
	uint32_t offset, bytes;  /* this piece; bytes >= 1; offset + bytes <= total */
	const uint8_t *data;     /* encode: the caller's; decode: within the payload */
};

struct psr_msg_superseded { uint32_t by; }; /* the newer id, > the superseded one */
struct psr_msg_ack { uint16_t pass; }; /* client -> server: END of frame (id, pass) has arrived; view > 0 */

/* ---- encoding and decoding ---- */

/* encode(out, message, err), encode(out, id, message, err) or encode(out, id, view, message, err), depending on whether
 * the type has an id and a view. decode(message, payload, n, err). A HELLO of another version gives PSR_ERR_VERSION:
 * only major and minor are set, and the error's text, which goes into the answering ERROR, begins with "psr 0.2: ". */
#define PROTO_DECODE(name) \
	int psr_msg_##name##_decode(struct psr_msg_##name *msg, const uint8_t *payload, size_t n, struct psr_error *err);
#define PROTO_PLAIN(name) \
	int psr_msg_##name##_encode(struct psr_buf *out, const struct psr_msg_##name *msg, struct psr_error *err); \
	PROTO_DECODE(name)
#define PROTO_ID(name) \
	int psr_msg_##name##_encode(struct psr_buf *out, uint32_t id, const struct psr_msg_##name *msg, \
	                            struct psr_error *err); \
	PROTO_DECODE(name)
#define PROTO_VIEW(name) \
	int psr_msg_##name##_encode(struct psr_buf *out, uint32_t id, uint16_t view, const struct psr_msg_##name *msg, \
	                            struct psr_error *err); \
	PROTO_DECODE(name)
PROTO_PLAIN(hello) PROTO_PLAIN(welcome) PROTO_PLAIN(goodbye) PROTO_PLAIN(ping)
PROTO_ID(list_entry) PROTO_ID(list_end) PROTO_ID(open) PROTO_ID(progress) PROTO_ID(opened) PROTO_ID(close)
PROTO_ID(presets) PROTO_ID(preset) PROTO_ID(presets_end) PROTO_ID(scene) PROTO_ID(stats_reply)
PROTO_ID(fetch) PROTO_ID(fetch_part) PROTO_ID(fetch_end)
PROTO_VIEW(error) PROTO_VIEW(frame) PROTO_VIEW(frame_begin) PROTO_VIEW(rect) PROTO_VIEW(frame_end)
PROTO_VIEW(superseded) PROTO_VIEW(ack)

int psr_msg_pong_encode(struct psr_buf *out, const struct psr_msg_ping *msg, struct psr_error *err);

/* For messages without a payload; a framer accepts them with any bytes behind the header. */
int psr_msg_list_encode(struct psr_buf *out, uint32_t id, struct psr_error *err);
int psr_msg_stats_encode(struct psr_buf *out, uint32_t id, struct psr_error *err);
int psr_msg_cancelled_encode(struct psr_buf *out, uint32_t id, uint16_t view, struct psr_error *err);
int psr_msg_cancel_encode(struct psr_buf *out, uint32_t id, uint16_t view, struct psr_error *err);
int psr_msg_pause_encode(struct psr_buf *out, uint32_t id, uint16_t view, struct psr_error *err);
int psr_msg_resume_encode(struct psr_buf *out, uint32_t id, uint16_t view, struct psr_error *err);

uint64_t psr_routing_key(const char *model_name); /* XXH64, seed 0, of its bytes; 0 for NULL or "" */

/* Turn a decoded message into the library's light; and a light into the nearest message: sRGB codes, and an intensity
 * of 1e6 at most. */
void psr_msg_light_get(struct psr_light *light, const struct psr_msg_light *msg);
void psr_msg_light_set(struct psr_msg_light *msg, const struct psr_light *light);

/* ---- planes on the wire ---- */

/* Return the bytes of a plane's pixel before its codec (depth: 4 for F32, 2 for U16*), and the bytes of the components
 * that the row filter works on. */
unsigned psr_plane_pixel_bytes(unsigned plane, unsigned depth_format);
unsigned psr_plane_component_bytes(unsigned plane, unsigned depth_format);

/* Returns 8 bytes that begin with a pixel of the plane (depth: F32) as it is where no rectangle came. Colour has
 * FRAME_BEGIN's background there instead. */
const uint8_t *psr_plane_background(unsigned plane);

uint64_t psr_plane_capability(unsigned plane); /* the bit of enum psr_cap that offers the plane; 0: every server has
                                                * it */

/* Returns the greatest `total` that a rectangle of so many data pixels of so many bytes may claim: a receiver holds
 * that. */
uint64_t psr_rect_total_max(uint64_t n_pixels, unsigned pixel_bytes);

/* ---- the row filter of codec zstd (PROTOCOL.md, "Row filter"); zstd itself is called by its users ----
 * width x height pixels of n_components components of component_bytes (1, 2, 4, 8) each, top-down, little-endian.
 * in and out hold width * height * n_components * component_bytes bytes and do not overlap. */
void psr_filter_rows(uint8_t *out, const uint8_t *in, uint32_t width, uint32_t height, unsigned n_components,
                     unsigned component_bytes);
void psr_unfilter_rows(uint8_t *out, const uint8_t *in, uint32_t width, uint32_t height, unsigned n_components,
                       unsigned component_bytes);

/* ---- depth as u16 (PROTOCOL.md, RECT) ---- */

struct psr_depth_range {
	double min, max; /* min < max; min > 0 unless linear */
	int is_linear;   /* linear in z, for an orthographic camera; else in 1/z */
};
struct psr_depth_range psr_depth_range_of(const struct psr_msg_frame *frame);

/* Convert n depths to q, which rises with z: 0 up to min, 65534 from max on, 65535 for empty pixels (+inf); and back,
 * off by at most half a step of q and the rounding to float. */
void psr_depth_quantise(uint16_t *q, const float *z, size_t n, const struct psr_depth_range *range);
void psr_depth_restore(float *z, const uint16_t *q, size_t n, const struct psr_depth_range *range);

#endif
