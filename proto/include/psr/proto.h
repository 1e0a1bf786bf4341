/* The protocol between a client and psrd: structs <-> bytes, and framing. No sockets, no allocation, no clock, no state
 * but the framer's. proto/PROTOCOL.md is the contract that both sides follow; this header names its parts.
 *
 * Encoding appends one whole message (header and payload) to a psr_buf of the caller's. Decoding takes the payload of a
 * message that the framer handed out. Both check the same rules, and every failure is one of:
 *   PSR_ERR_PROTOCOL  decoding: the bytes are not such a message (too short, too long, reserved bits, bad UTF-8, ...);
 *                     the peer is broken: say so in an ERROR of id 0 and close the connection
 *   PSR_ERR_ARG       well-formed, but a value is outside of its documented range (NaN in a camera, a size of 0);
 *                     the request is refused by an ERROR with its id, the connection goes on
 *   PSR_ERR_LIMIT     the same for what is over a limit; encoding: also when the message would exceed 64 KiB
 *   PSR_ERR_MEMORY    encoding only: the psr_buf has too little room; nothing was written
 * A failed decode leaves the struct with unspecified content; a failed encode leaves the psr_buf as it was. */
#ifndef PSR_PROTO_H
#define PSR_PROTO_H

#include <stddef.h>
#include <stdint.h>
#include "psr/error.h"
#include "psr/frame.h"

#ifdef __cplusplus
extern "C" {
#endif

#define PSR_PROTO_MAJOR 0
#define PSR_PROTO_MINOR 1 /* 0.x speaks only with its own minor */

#define PSR_HEADER_SIZE 16
#define PSR_WIRE_MAX_MESSAGE 65536     /* header included */
#define PSR_WIRE_MAX_MESSAGE_HELLO 1024 /* before the server has accepted the HELLO */
#define PSR_WIRE_MAX_PAYLOAD (PSR_WIRE_MAX_MESSAGE - PSR_HEADER_SIZE)
#define PSR_WIRE_MAX_NAME 255          /* bytes of UTF-8 */
#define PSR_WIRE_MAX_SIDE 16384        /* pixels */
#define PSR_WIRE_MAX_PIXELS 67108864u  /* 64 Mpixel */
#define PSR_WIRE_MAX_RECT_PIXELS 2097152u /* 128 rows of 16384 */
#define PSR_WIRE_MAX_RECT_DATA (PSR_WIRE_MAX_PAYLOAD - 24) /* bytes of data in one RECT */
#define PSR_WIRE_MAX_INSTANCES 1024
#define PSR_WIRE_MAX_LIGHTS 32
#define PSR_WIRE_MAX_SCENES 16         /* slots 0..15 */
#define PSR_WIRE_MAX_OPEN 64           /* open ids of view 0 */
#define PSR_WIRE_MAX_UNACKED 2         /* frames of a view > 0 that are sent and not acknowledged */
#define PSR_WIRE_MAX_REPORT 64
#define PSR_WIRE_MAX_STATS 64
#define PSR_WIRE_MAX_LENGTH 1e30       /* magnitude of a coordinate or length; positive lengths are at least 1e-30 */
#define PSR_WIRE_MAX_INTENSITY 1e6
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
};

enum psr_msg_flag { PSR_FLAG_SKIP = 1 }; /* a receiver that does not know the type skips the message */

/* What a server offers (WELCOME) or a client understands (HELLO); unknown bits are ignored. What has no bit here every
 * server offers: view 0, colour as raw, JPEG or zstd, depth as float, raw or zstd, blocks, lights without shadows. */
enum psr_cap {
	PSR_CAP_VIEWS = 1 << 0,        /* views > 0: supersession, window of unacknowledged frames, ACK */
	PSR_CAP_REFINE = 1 << 1,       /* pass_limit > 0 */
	PSR_CAP_BASE = 1 << 2,         /* frames as changes to a base */
	PSR_CAP_TIME_BUDGET = 1 << 3,
	PSR_CAP_ERROR_BOUND = 1 << 4,
	PSR_CAP_SETTINGS = 1 << 5,     /* settings of a scale other than 1 */
	PSR_CAP_SHADOWS = 1 << 6,
	PSR_CAP_DEPTH_U16 = 1 << 7,    /* depth formats U16 and U16_HALF */
	PSR_CAP_NORMAL = 1 << 8,
	PSR_CAP_ID = 1 << 9,
	PSR_CAP_WEIGHT = 1 << 10,
	PSR_CAP_WORDS = 1 << 11,
	PSR_CAP_PNG = 1 << 12,
	PSR_CAP_OCTREE = 1 << 13,
	PSR_CAP_DPOINT = 1 << 14,
	PSR_CAP_APPEND = 1 << 15,      /* SCENE with PSR_WIRE_SCENE_APPEND */
	PSR_CAP_BUILD = 1 << 16,       /* OPEN builds source files */
	PSR_CAP_CHUNKS = 1 << 17,      /* the reserved model chunks */
	PSR_CAP_PAUSE = 1 << 18,
	PSR_CAP_PRESETS = 1 << 19,
	PSR_CAP_RESOLUTION = 1 << 21,  /* OPEN says for which pictures */
	PSR_CAP_BLOCK = 1 << 20,
};

/* ---- storage and header ---- */

struct psr_buf {
	uint8_t *data;   /* the caller's */
	size_t size;     /* bytes in use; messages are appended behind them */
	size_t capacity;
};

struct psr_message {
	uint16_t type, flags;
	uint32_t id;
	uint16_t view;
	const uint8_t *payload; /* in the framer's storage */
	size_t n;               /* bytes of payload */
};

/* Name of a message type ("FRAME_BEGIN"), or NULL if this version knows no such type. */
const char *psr_msg_name(unsigned type);

/* ---- the framer: arbitrary byte splits in, whole messages out ---- */

enum psr_side { PSR_CLIENT, PSR_SERVER };

/* Fill storage at psr_framer_space(), say how much with psr_framer_filled(), then take messages until there is none. */
struct psr_framer {
	uint8_t *storage;
	size_t capacity, begin, end, max_message;
	uint64_t skipped;        /* messages of unknown types that were marked as skippable */
	enum psr_side peer;
	int expects_hello, failed;
};

/* `peer` is who sends the bytes. From a client, the first message must be HELLO: its first bytes are compared as they
 * come, and no message may exceed 1 KiB until psr_framer_accept. From a server 64 KiB are taken at once. `capacity`
 * must hold the greatest message that may come (1 KiB, 64 KiB; asserted); more makes for fewer reads. */
void psr_framer_init(struct psr_framer *framer, enum psr_side peer, void *storage, size_t capacity);

/* The HELLO is accepted: messages up to 64 KiB from now on. What is already read moves to `storage` (>= 64 KiB; may be
 * the old one); payloads handed out before are invalid then. */
void psr_framer_accept(struct psr_framer *framer, void *storage, size_t capacity);

/* Where to read to, and how many bytes at most: never 0 if psr_framer_next returned 0 before. Invalidates payloads. */
uint8_t *psr_framer_space(struct psr_framer *framer, size_t *n);
void psr_framer_filled(struct psr_framer *framer, size_t n);

/* 1: *message is the next one, its payload valid until the next call of space or accept; 0: more bytes are needed;
 * PSR_ERR_PROTOCOL: the bytes cannot be messages of this peer (length, reserved bits, type, the id and view rules of
 * PROTOCOL.md), and so for ever; PSR_ERR_FORMAT: the same, but no client of psr at all (no magic): close without an
 * answer. Messages of unknown types with PSR_FLAG_SKIP are dropped and counted. */
int psr_framer_next(struct psr_framer *framer, struct psr_message *message, struct psr_error *err);

/* ---- the session ---- */

#define PSR_HELLO_MAGIC "\x89psrp\r\n\x1a" /* 8 bytes, without the NUL */

struct psr_msg_hello { /* client -> server, first; id 0 */
	uint16_t major, minor;     /* encode: PSR_PROTO_MAJOR, PSR_PROTO_MINOR, or another version for a test */
	uint64_t routing_key;      /* psr_routing_key of the model's name, or 0 */
	uint64_t capabilities;     /* enum psr_cap */
	char token[PSR_WIRE_MAX_NAME + 1]; /* "" if none */
	char client[PSR_WIRE_MAX_NAME + 1]; /* name and version of the program */
};
/* Decoding another version gives PSR_ERR_VERSION: major and minor are set, the rest was not looked at. */
int psr_msg_hello_encode(struct psr_buf *out, const struct psr_msg_hello *msg, struct psr_error *err);
int psr_msg_hello_decode(struct psr_msg_hello *msg, const uint8_t *payload, size_t n, struct psr_error *err);

uint64_t psr_routing_key(const char *model_name); /* XXH64, seed 0, of its bytes; 0 for NULL or "" */

struct psr_msg_welcome { /* server -> client, answers HELLO; id 0 */
	uint16_t major, minor;
	uint64_t capabilities;
	uint32_t max_message;    /* 1024..65536 */
	uint32_t max_side;       /* these are the server's own limits, at least 1, at most those of this header */
	uint32_t max_pixels;
	uint32_t max_instances;
	uint32_t max_lights;
	uint32_t max_scenes;
	uint32_t max_open;
	uint32_t max_models;     /* open handles of a connection */
	uint32_t idle_timeout_ms; /* a connection silent for so long is closed; 0: never */
	char server[PSR_WIRE_MAX_NAME + 1]; /* name and version */
};
int psr_msg_welcome_encode(struct psr_buf *out, const struct psr_msg_welcome *msg, struct psr_error *err);
int psr_msg_welcome_decode(struct psr_msg_welcome *msg, const uint8_t *payload, size_t n, struct psr_error *err);

enum psr_goodbye { PSR_GOODBYE_DONE = 0, PSR_GOODBYE_SHUTDOWN = 1, PSR_GOODBYE_IDLE = 2, PSR_GOODBYE_SLOW = 3 };
struct psr_msg_goodbye { /* either way; id 0; the sender sends nothing after it */
	uint16_t reason;
	char text[PSR_WIRE_MAX_NAME + 1];
};
int psr_msg_goodbye_encode(struct psr_buf *out, const struct psr_msg_goodbye *msg, struct psr_error *err);
int psr_msg_goodbye_decode(struct psr_msg_goodbye *msg, const uint8_t *payload, size_t n, struct psr_error *err);

struct psr_msg_ping { uint64_t token; }; /* PING and PONG, either way; id 0; PONG returns the token */
int psr_msg_ping_encode(struct psr_buf *out, const struct psr_msg_ping *msg, struct psr_error *err);
int psr_msg_pong_encode(struct psr_buf *out, const struct psr_msg_ping *msg, struct psr_error *err);
int psr_msg_ping_decode(struct psr_msg_ping *msg, const uint8_t *payload, size_t n, struct psr_error *err);

/* Codes on the wire; those up to 13 are the negative of enum psr_err. */
enum psr_wire_error {
	PSR_WIRE_ARG = 1, PSR_WIRE_MEMORY = 2, PSR_WIRE_IO = 3, PSR_WIRE_NOT_FOUND = 4, PSR_WIRE_FORMAT = 5,
	PSR_WIRE_VERSION = 6, PSR_WIRE_UNSUPPORTED = 7, PSR_WIRE_LIMIT = 8, PSR_WIRE_BUSY = 9,
	PSR_WIRE_CANCELLED = 10, PSR_WIRE_PROTOCOL = 11,
	PSR_WIRE_CONNECTION = 12, PSR_WIRE_INTERNAL = 13, PSR_WIRE_UNAUTHORIZED = 14,
};
uint16_t psr_wire_error_from(int code); /* enum psr_err -> wire; INTERNAL for what is none */
int psr_wire_error_to(uint16_t wire);   /* wire -> enum psr_err; UNAUTHORIZED gives CONNECTION, unknown INTERNAL */

struct psr_msg_error { /* server -> client; terminal of the id; id 0: about the connection, which the server closes */
	uint16_t code;               /* enum psr_wire_error, not 0; receivers take unknown codes */
	char text[PSR_ERROR_TEXT];   /* encode replaces what is not clean UTF-8 by '?': an ERROR can always be sent */
};
int psr_msg_error_encode(struct psr_buf *out, uint32_t id, uint16_t view, const struct psr_msg_error *msg,
                         struct psr_error *err);
int psr_msg_error_decode(struct psr_msg_error *msg, const uint8_t *payload, size_t n, struct psr_error *err);

/* ---- models ---- */

int psr_msg_list_encode(struct psr_buf *out, uint32_t id, struct psr_error *err); /* no payload */

enum psr_entry_state {
	PSR_ENTRY_READY = 1,   /* a model file */
	PSR_ENTRY_LOADED = 2,  /* the same, in the server's memory now */
	PSR_ENTRY_SOURCE = 3,  /* a source file: OPEN builds it first */
	PSR_ENTRY_FAILED = 4,  /* could not be built or read; OPEN says why */
};
struct psr_msg_list_entry { /* one a model, sorted by the names' bytes */
	uint8_t state;
	uint64_t file_bytes;
	uint8_t content_id[16]; /* zero if not known yet */
	char name[PSR_WIRE_MAX_NAME + 1];
};
int psr_msg_list_entry_encode(struct psr_buf *out, uint32_t id, const struct psr_msg_list_entry *msg,
                              struct psr_error *err);
int psr_msg_list_entry_decode(struct psr_msg_list_entry *msg, const uint8_t *payload, size_t n, struct psr_error *err);

struct psr_msg_list_end { uint32_t n_entries; };
int psr_msg_list_end_encode(struct psr_buf *out, uint32_t id, const struct psr_msg_list_end *msg,
                            struct psr_error *err);
int psr_msg_list_end_decode(struct psr_msg_list_end *msg, const uint8_t *payload, size_t n, struct psr_error *err);

struct psr_msg_open {
	uint32_t resolution;               /* 0..16384: the greater side of the pictures that it is opened for, pixels; 0: not
	                                    * known. Not 0 only towards a server with PSR_CAP_RESOLUTION */
	char name[PSR_WIRE_MAX_NAME + 1];  /* not empty */
};
int psr_msg_open_encode(struct psr_buf *out, uint32_t id, const struct psr_msg_open *msg, struct psr_error *err);
int psr_msg_open_decode(struct psr_msg_open *msg, const uint8_t *payload, size_t n, struct psr_error *err);

enum psr_progress_stage {
	PSR_PROGRESS_WAITING = 0, PSR_PROGRESS_IMPORT = 1, PSR_PROGRESS_SAMPLE = 2, PSR_PROGRESS_SELECT = 3,
	PSR_PROGRESS_WRITE = 4, PSR_PROGRESS_LOAD = 5,
};
struct psr_msg_progress { /* any number before OPENED; stages never go back */
	uint16_t stage;
	uint64_t done, total; /* in units of the stage; total 0: not known, then done only rises; else done <= total */
};
int psr_msg_progress_encode(struct psr_buf *out, uint32_t id, const struct psr_msg_progress *msg,
                            struct psr_error *err);
int psr_msg_progress_decode(struct psr_msg_progress *msg, const uint8_t *payload, size_t n, struct psr_error *err);

enum psr_wire_rep { PSR_WIRE_REP_AUTO = 0, PSR_WIRE_REP_BLOCKS = 1, PSR_WIRE_REP_OCTREE = 2, PSR_WIRE_REP_DPOINT = 3 };
struct psr_msg_opened {
	uint32_t handle;          /* not 0; of this connection */
	uint32_t representations; /* bit r: has representation r of enum psr_wire_rep; not 0, bit 0 is 0 */
	uint8_t content_id[16];
	double box_min[3], box_max[3]; /* of the samples, object coordinates (those of the source file) */
	double origin[3];
	double scale;             /* object units an inner unit; > 0 */
	double spacing;           /* of samples at the finest level, object units; > 0 */
	uint32_t resolution;      /* target resolution: pixels across the unit sphere at magnification 1; >= 1 */
	uint32_t n_levels;        /* >= 1 */
	uint64_t n_samples, n_blocks, bytes; /* bytes: in the server's memory */
};
int psr_msg_opened_encode(struct psr_buf *out, uint32_t id, const struct psr_msg_opened *msg, struct psr_error *err);
int psr_msg_opened_decode(struct psr_msg_opened *msg, const uint8_t *payload, size_t n, struct psr_error *err);

struct psr_msg_close { uint32_t handle; }; /* no answer but ERROR; scenes that hold the model keep it */
int psr_msg_close_encode(struct psr_buf *out, uint32_t id, const struct psr_msg_close *msg, struct psr_error *err);
int psr_msg_close_decode(struct psr_msg_close *msg, const uint8_t *payload, size_t n, struct psr_error *err);

/* ---- scenes ---- */

struct psr_msg_instance { /* world = translation + scale * rotate(rotation, object) */
	uint32_t handle;
	uint8_t representation;   /* enum psr_wire_rep */
	double rotation[4];       /* x, y, z, w; | |q|^2 - 1 | <= 1e-6; receivers normalise it */
	double translation[3];
	double scale;             /* 1e-30..1e30 */
};

enum psr_wire_light_kind { PSR_WIRE_LIGHT_DIRECTIONAL = 1, PSR_WIRE_LIGHT_POINT = 2, PSR_WIRE_LIGHT_SPOT = 3 };
enum psr_wire_light_flag { PSR_WIRE_LIGHT_SHADOW = 1 };
struct psr_msg_light { /* fields that a kind has no use for are 0 */
	uint8_t kind;
	uint8_t flags;
	uint8_t color[3];         /* sRGB */
	double intensity;         /* 0..1e6, multiplies the linear colour */
	double position[3];       /* point, spot: world */
	double direction[3];      /* directional, spot: the way the light travels, away from it; length >= 1e-30 */
	double inner, outer;      /* spot: half angles, radians, 0 <= inner <= outer, 1e-6 <= outer <= pi: full
	                           * inside of inner, none outside of outer */
	double reference;         /* point, spot: distance at which intensity holds, falling with the square; 0: it does
	                           * not fall */
};

/* APPEND adds to what the slot holds instead of replacing it (PSR_CAP_APPEND). */
enum psr_wire_scene_flag { PSR_WIRE_SCENE_APPEND = 1 };
struct psr_msg_scene {
	uint16_t slot;            /* 0..15, chosen by the client; replaces what the slot held */
	uint16_t flags;
	double ambient;           /* 0..1e6: light from everywhere, times diffuse colour */
	uint8_t background[3];    /* sRGB */
	uint16_t n_instances, n_lights;
	struct psr_msg_instance instance[PSR_WIRE_MAX_INSTANCES];
	struct psr_msg_light light[PSR_WIRE_MAX_LIGHTS];
}; /* about 80 KiB */
int psr_msg_scene_encode(struct psr_buf *out, uint32_t id, const struct psr_msg_scene *msg, struct psr_error *err);
int psr_msg_scene_decode(struct psr_msg_scene *msg, const uint8_t *payload, size_t n, struct psr_error *err);

/* ---- frames ---- */

enum psr_wire_camera_kind { PSR_WIRE_CAMERA_PERSPECTIVE = 1, PSR_WIRE_CAMERA_ORTHOGRAPHIC = 2 };
struct psr_msg_camera { /* world coordinates */
	uint8_t kind;
	double eye[3], target[3], up[3]; /* eye != target; up not parallel to target - eye (sine of the angle >= 1e-6) */
	double extent;       /* perspective: vertical field of view, radians, 1e-6 <= fov <= 3.14159;
	                      * orthographic: height of the picture, world units, > 0 */
	double near_z;       /* >= 0: z' below it is not drawn; 0: chosen from scene and camera */
};

/* ---- cameras and lights that came with a model ---- */

#define PSR_WIRE_MAX_PRESETS 256 /* of each kind */

struct psr_msg_presets { uint32_t handle; };
int psr_msg_presets_encode(struct psr_buf *out, uint32_t id, const struct psr_msg_presets *msg, struct psr_error *err);
int psr_msg_presets_decode(struct psr_msg_presets *msg, const uint8_t *payload, size_t n, struct psr_error *err);

enum psr_wire_preset_kind { PSR_WIRE_PRESET_CAMERA = 1, PSR_WIRE_PRESET_LIGHT = 2 };
struct psr_msg_preset { /* object coordinates; the part that the kind has no use for is 0 */
	uint8_t kind;
	struct psr_msg_camera camera;
	struct psr_msg_light light;          /* flags 0 */
	char name[PSR_WIRE_MAX_NAME + 1];    /* not empty */
};
int psr_msg_preset_encode(struct psr_buf *out, uint32_t id, const struct psr_msg_preset *msg, struct psr_error *err);
int psr_msg_preset_decode(struct psr_msg_preset *msg, const uint8_t *payload, size_t n, struct psr_error *err);

struct psr_msg_presets_end { uint32_t n_cameras, n_lights; }; /* how many were sent */
int psr_msg_presets_end_encode(struct psr_buf *out, uint32_t id, const struct psr_msg_presets_end *msg,
                               struct psr_error *err);
int psr_msg_presets_end_decode(struct psr_msg_presets_end *msg, const uint8_t *payload, size_t n,
                               struct psr_error *err);

enum psr_codec { PSR_CODEC_RAW = 0, PSR_CODEC_JPEG = 1, PSR_CODEC_ZSTD = 2, PSR_CODEC_PNG = 3 };
enum psr_wire_depth_format { PSR_WIRE_DEPTH_F32 = 1, PSR_WIRE_DEPTH_U16 = 2, PSR_WIRE_DEPTH_U16_HALF = 3 };
enum psr_wire_budget {
	PSR_WIRE_BUDGET_NONE = 0, PSR_WIRE_BUDGET_TIME = 1, PSR_WIRE_BUDGET_ERROR = 2, PSR_WIRE_BUDGET_SETTINGS = 3,
};

struct psr_msg_settings { /* resolved settings: with them a frame is a pure function of models and request */
	uint8_t scale;       /* drawn at 1/scale of the size in each direction and enlarged: 1, 2 or 4 */
	uint8_t is_smooth;   /* 1: edges are blended with what is behind, and pixels with those of their surface; else 0 */
	double spacing_px;   /* greatest distance of neighbouring samples, pixels: 1 is [G]'s adequate one; 2^-6..2^6 */
};

struct psr_msg_frame { /* client -> server */
	uint16_t slot;           /* scene */
	uint16_t pass_limit;     /* highest pass wanted; 0: one frame, no refinement */
	uint32_t width, height;  /* 1..16384 each, at most 64 Mpixel */
	uint32_t planes;         /* 1 << enum psr_plane, whose values are those on the wire; not 0 */
	uint8_t color_codec;     /* fields of planes that are not asked for are 0 */
	uint8_t color_quality;   /* JPEG: 1..100; else 0 */
	uint8_t depth_format;
	uint8_t depth_codec;     /* raw or zstd */
	uint8_t data_codec;      /* of normal, id, weight, words, block: raw or zstd */
	uint8_t budget;          /* enum psr_wire_budget: exactly one of the next three counts, the others are 0 */
	uint64_t time_budget_us; /* TIME: 1..2^53-1, from the start of work on the frame to its END in the output queue */
	double error_bound_px;   /* ERROR: of the geometric error, > 0 */
	struct psr_msg_settings settings; /* SETTINGS */
	uint32_t base;           /* id of an acknowledged frame of this view that the client still holds, or 0; that it is
	                          * below the request's id, and 0 in view 0, is the receiver's to check */
	struct psr_msg_camera camera;
};
int psr_msg_frame_encode(struct psr_buf *out, uint32_t id, uint16_t view, const struct psr_msg_frame *msg,
                         struct psr_error *err);
int psr_msg_frame_decode(struct psr_msg_frame *msg, const uint8_t *payload, size_t n, struct psr_error *err);

struct psr_msg_frame_begin { /* server -> client */
	uint16_t pass;           /* 0, 1, ... rising within an id */
	uint32_t width, height, planes; /* as asked */
	uint8_t color_codec, color_quality, depth_format, depth_codec, data_codec; /* as asked */
	uint8_t background[3];   /* what colour pixels without a rectangle have, when there is no base */
	uint32_t base;           /* 0: no base, else (base, base_pass) is what the rectangles go on top of */
	uint16_t base_pass;
	struct psr_msg_settings settings; /* resolved */
	double depth_min, depth_max; /* of the finite depths of this frame, both 0 if there are none; the range of
	                              * PSR_WIRE_DEPTH_U16* */
	struct psr_msg_camera camera;    /* as asked */
};
int psr_msg_frame_begin_encode(struct psr_buf *out, uint32_t id, uint16_t view, const struct psr_msg_frame_begin *msg,
                               struct psr_error *err);
int psr_msg_frame_begin_decode(struct psr_msg_frame_begin *msg, const uint8_t *payload, size_t n,
                               struct psr_error *err);

struct psr_msg_rect { /* server -> client; a piece of one coded rectangle */
	uint8_t plane, codec;
	uint8_t scale;           /* 1, 2, 4: the data has ceil(w / scale) x ceil(h / scale) pixels */
	uint16_t x, y, w, h;     /* within the picture, w, h >= 1, w * h <= PSR_WIRE_MAX_RECT_PIXELS */
	uint32_t total;          /* bytes of the coded rectangle */
	uint32_t offset, bytes;  /* this piece; bytes >= 1; offset + bytes <= total */
	const uint8_t *data;     /* encode: the caller's; decode: within the payload */
};
int psr_msg_rect_encode(struct psr_buf *out, uint32_t id, uint16_t view, const struct psr_msg_rect *msg,
                        struct psr_error *err);
int psr_msg_rect_decode(struct psr_msg_rect *msg, const uint8_t *payload, size_t n, struct psr_error *err);

/* Bytes of a pixel of a plane before its codec (depth: 4 for F32, 2 for U16*), and of the components that the row
 * filter works on. */
unsigned psr_plane_pixel_bytes(unsigned plane, unsigned depth_format);
unsigned psr_plane_component_bytes(unsigned plane, unsigned depth_format);

/* The bytes of a pixel of a plane (depth: F32) that a picture has where no rectangle came: 8 of them, of which the
 * plane has the first. Colour has FRAME_BEGIN's background instead. */
const uint8_t *psr_plane_background(unsigned plane);

uint64_t psr_plane_capability(unsigned plane); /* of enum psr_cap, what offers the plane; 0: every server does */

/* The greatest `total` that a rectangle of so many data pixels of so many bytes may claim: what a receiver holds. */
uint64_t psr_rect_total_max(uint64_t n_pixels, unsigned pixel_bytes);

enum psr_wire_frame_status {
	PSR_WIRE_FRAME_OK = 0,          /* drawn as asked */
	PSR_WIRE_FRAME_LATE = 1,        /* the time budget was not kept */
	PSR_WIRE_FRAME_COARSE = 2,      /* the error bound could not be reached with these models */
};

enum psr_wire_report_id { /* time in ns; what `count` counts stands beside it */
	PSR_WIRE_REPORT_PLAN = 1,    /* instances of the scene */
	PSR_WIRE_REPORT_CULL = 2,    /* blocks tested */
	PSR_WIRE_REPORT_WARP = 3,    /* samples that fell into the picture */
	PSR_WIRE_REPORT_GAPS = 4,    /* pixels with a sample whose weight is below 1 */
	PSR_WIRE_REPORT_RESOLVE = 5, /* pixels resolved: they have a sample and weight above 0 */
	PSR_WIRE_REPORT_SHADE = 6,   /* pixels shaded */
	PSR_WIRE_REPORT_FILL = 7,    /* pixels whose colour the fill changed */
	PSR_WIRE_REPORT_ENCODE = 8,  /* bytes of all RECT data of the frame */
	PSR_WIRE_REPORT_QUEUE = 9,   /* time waited before work started; frames of all clients waiting when it came */
	PSR_WIRE_REPORT_TOTAL = 10,  /* from the start of plan to the end of encode; threads of the server's pool */
	PSR_WIRE_REPORT_SHADOW = 11, /* samples drawn into the shadow maps made for this frame */
	PSR_WIRE_REPORT_SMOOTH = 12, /* pixels at edges */
	/* values only, ns is 0: */
	PSR_WIRE_REPORT_SAMPLES_WARPED = 32, /* all samples of the blocks drawn */
	PSR_WIRE_REPORT_BLOCKS_DRAWN = 33,   /* after culling */
	PSR_WIRE_REPORT_BLOCKS = 34,         /* of all instances of the scene */
	PSR_WIRE_REPORT_PIXELS_COVERED = 35, /* weight above 0 before the fill */
	PSR_WIRE_REPORT_PIXELS_FILLED = 36,  /* of weight 0 that the fill gave a colour */
	PSR_WIRE_REPORT_SAMPLES = 37,        /* of all instances of the scene */
	PSR_WIRE_REPORT_DEPTH_LEVELS = 38,   /* level buffers in use */
	PSR_WIRE_REPORT_LIGHTS = 39,
	PSR_WIRE_REPORT_SHADOW_MAPS = 40,       /* in use */
	PSR_WIRE_REPORT_SHADOW_MAPS_DRAWN = 41, /* of these made for this frame, not kept */
	PSR_WIRE_REPORT_EFFECTS = 64, /* and the effect's number, see PROTOCOL.md; ns is the reason's number */
};
struct psr_msg_report_entry { uint16_t id; uint64_t ns, count; };

struct psr_msg_frame_end { /* server -> client */
	uint16_t pass;             /* that of BEGIN */
	uint8_t is_final;          /* 1: the id ends here; else 0 */
	uint8_t status;            /* enum psr_wire_frame_status */
	double error_px;           /* bound on the geometric error of this frame, pixels, >= 0 */
	uint32_t planes;           /* those of BEGIN: which hashes follow */
	uint64_t hash[PSR_N_PLANES]; /* by plane; XXH64, seed 0, before the codec; 0 where the plane is absent */
	uint16_t n_entries;
	struct psr_msg_report_entry entry[PSR_WIRE_MAX_REPORT]; /* ids rising */
};
int psr_msg_frame_end_encode(struct psr_buf *out, uint32_t id, uint16_t view, const struct psr_msg_frame_end *msg,
                             struct psr_error *err);
int psr_msg_frame_end_decode(struct psr_msg_frame_end *msg, const uint8_t *payload, size_t n, struct psr_error *err);

struct psr_msg_superseded { uint32_t by; }; /* the newer id, > the superseded one */
int psr_msg_superseded_encode(struct psr_buf *out, uint32_t id, uint16_t view, const struct psr_msg_superseded *msg,
                              struct psr_error *err);
int psr_msg_superseded_decode(struct psr_msg_superseded *msg, const uint8_t *payload, size_t n, struct psr_error *err);

struct psr_msg_ack { uint16_t pass; }; /* client -> server: frame (id, pass) is decoded; view > 0 */
int psr_msg_ack_encode(struct psr_buf *out, uint32_t id, uint16_t view, const struct psr_msg_ack *msg,
                       struct psr_error *err);
int psr_msg_ack_decode(struct psr_msg_ack *msg, const uint8_t *payload, size_t n, struct psr_error *err);

/* No payload. */
int psr_msg_cancelled_encode(struct psr_buf *out, uint32_t id, uint16_t view, struct psr_error *err);
int psr_msg_cancel_encode(struct psr_buf *out, uint32_t id, uint16_t view, struct psr_error *err);
int psr_msg_pause_encode(struct psr_buf *out, uint16_t view, struct psr_error *err);
int psr_msg_resume_encode(struct psr_buf *out, uint16_t view, struct psr_error *err);

/* ---- statistics ---- */

int psr_msg_stats_encode(struct psr_buf *out, uint32_t id, struct psr_error *err); /* no payload */

enum psr_stat_id { /* of the whole server since its start */
	PSR_STAT_UPTIME_US = 1, PSR_STAT_CONNECTIONS = 2, PSR_STAT_CONNECTIONS_TOTAL = 3, PSR_STAT_MODELS = 4,
	PSR_STAT_MODEL_BYTES = 5, PSR_STAT_FRAMES = 6, PSR_STAT_FRAMES_FAILED = 7, PSR_STAT_FRAMES_WAITING = 8,
	PSR_STAT_BYTES_SENT = 9, PSR_STAT_BYTES_RECEIVED = 10, PSR_STAT_FRAMES_SUPERSEDED = 11,
	PSR_STAT_FRAMES_CANCELLED = 12, PSR_STAT_THREADS = 13,
	PSR_STAT_DROPPED_PEERS = 14, /* connections that the server closed for an error or a limit */
};
struct psr_msg_stat { uint16_t id; uint64_t value; };
struct psr_msg_stats_reply {
	uint16_t n_stats;
	struct psr_msg_stat stat[PSR_WIRE_MAX_STATS]; /* ids rising; unknown ones are skipped by receivers */
};
int psr_msg_stats_reply_encode(struct psr_buf *out, uint32_t id, const struct psr_msg_stats_reply *msg,
                               struct psr_error *err);
int psr_msg_stats_reply_decode(struct psr_msg_stats_reply *msg, const uint8_t *payload, size_t n,
                               struct psr_error *err);

/* ---- the row filter of codec zstd (PROTOCOL.md, "Row filter"); zstd itself is called by its users ----
 * width x height pixels of n_components components of component_bytes (1, 2, 4, 8) each, top-down, little-endian.
 * in and out hold width * height * n_components * component_bytes bytes and do not overlap. */
void psr_filter_rows(uint8_t *out, const uint8_t *in, uint32_t width, uint32_t height, unsigned n_components,
                     unsigned component_bytes);
void psr_unfilter_rows(uint8_t *out, const uint8_t *in, uint32_t width, uint32_t height, unsigned n_components,
                       unsigned component_bytes);

#ifdef __cplusplus
}
#endif
#endif
