/* What the files of the client library share. */
#ifndef PSR_CLIENT_INTERNAL_H
#define PSR_CLIENT_INTERNAL_H

#include "psr/client.h"

#define CLIENT_IN_BYTES (4 * PSR_WIRE_MAX_MESSAGE)
#define CLIENT_OUT_BYTES (4 * PSR_WIRE_MAX_MESSAGE)

/* ---- address.c ---- */

struct client_address {
	int is_unix;
	char host[256]; /* without brackets */
	char port[6];
	char path[108];
};
int client_address_parse(struct client_address *address, const char *text, struct psr_error *err);

/* A connected, non-blocking socket. deadline_ns: of clock_ns(). */
int client_socket_connect(int *out, const char *address, uint64_t deadline_ns, struct psr_error *err);

/* ---- clock ---- */

uint64_t client_deadline_ns(int timeout_ms); /* UINT64_MAX for -1 */

/* poll(2) on one descriptor until the deadline: 1 ready, 0 time over, IO. */
int client_poll(int fd, int events, uint64_t deadline_ns, struct psr_error *err);

/* ---- decode.c: one coded rectangle into the picture ---- */

struct client_decoder; /* contexts and scratch memory, kept from rectangle to rectangle */
int client_decoder_create(struct client_decoder **out);
void client_decoder_destroy(struct client_decoder *decoder);

/* rect has passed client_assembly_rect's checks; data holds all rect->total bytes of it. PROTOCOL or MEMORY. */
int client_decode(struct client_decoder *decoder, struct psr_frame *picture, const struct psr_msg_rect *rect,
                  const uint8_t *data, struct psr_error *err);

/* ---- assembly.c: one frame from BEGIN to END; no sockets ---- */

struct client_assembly {
	struct psr_msg_frame asked;
	struct psr_msg_frame_begin begin;
	struct psr_frame picture;
	int has_begun;
	uint16_t pass;        /* that must come */
	unsigned lossy;       /* planes of which a rectangle came by JPEG or reduced */
	uint8_t *pieces;      /* of the rectangle that is coming in pieces; grows with what has come */
	size_t n_pieces, pieces_capacity;
	struct psr_msg_rect open; /* that rectangle; total 0: none */
};
/* Takes over nothing; the picture and its pieces are freed by fini. Memory for pixels is taken at BEGIN. */
void client_assembly_init(struct client_assembly *assembly, const struct psr_msg_frame *asked, uint16_t pass);
void client_assembly_fini(struct client_assembly *assembly);
int client_assembly_begin(struct client_assembly *assembly, const struct psr_msg_frame_begin *begin,
                          struct psr_error *err);
int client_assembly_rect(struct client_assembly *assembly, struct client_decoder *decoder,
                         const struct psr_msg_rect *rect, struct psr_error *err);
/* PROTOCOL: END does not fit; FORMAT: a hash is wrong, which costs this frame only. */
int client_assembly_end(struct client_assembly *assembly, const struct psr_msg_frame_end *end, unsigned *checked,
                        struct psr_error *err);

/* ---- client.c ---- */

enum client_answer { /* what the one control request that may be open has been answered */
	CLIENT_ANSWER_NONE, CLIENT_ANSWER_WELCOME, CLIENT_ANSWER_LIST_END, CLIENT_ANSWER_PROGRESS, CLIENT_ANSWER_OPENED,
	CLIENT_ANSWER_PRESETS_END, CLIENT_ANSWER_STATS, CLIENT_ANSWER_PONG, CLIENT_ANSWER_ERROR,
};

struct client_frame {
	uint32_t id; /* 0: this place is free */
	uint64_t sent_ns, bytes;
	struct client_assembly assembly;
};

struct client_list {
	struct psr_msg_list_entry *entry;
	uint32_t n, capacity;
};

struct client_presets {
	struct psr_msg_preset *preset; /* PSR_WIRE_MAX_PRESETS of each kind fit */
	uint32_t n[PSR_WIRE_PRESET_LIGHT + 1]; /* by kind */
};

struct psr_client {
	int fd, write_failed, is_open;
	char address[300];
	struct psr_error broken; /* code 0: the connection is sound */
	struct psr_framer framer;
	struct psr_buf out;
	size_t out_sent;
	uint8_t *in_storage;
	uint64_t n_received;
	uint32_t next_id;
	struct psr_msg_welcome welcome;
	uint32_t resolution;          /* for OPEN */
	struct client_decoder *decoder;
	struct client_frame frame[PSR_WIRE_MAX_OPEN];
	struct client_assembly done; /* of the last event */
	struct psr_msg_frame_end end;
	struct psr_msg_rect rect;
	/* the control request: LIST, OPEN, PRESETS, STATS or PING */
	uint32_t control_id;
	uint16_t control_type;
	enum client_answer answer;
	struct psr_error control_error;
	struct client_list list;
	struct client_presets presets;
	struct psr_msg_progress progress;
	struct psr_msg_opened opened;
	struct psr_msg_stats_reply stats;
};

int client_create(struct psr_client **out, int fd, const char *address, struct psr_error *err);

/* Marks the connection as lost for ever; returns the code. */
int client_break(struct psr_client *client, int code, const char *format, ...) __attribute__((format(printf, 3, 4)));

/* 1: `event` is filled, or (event->type 0) client->answer is set; 0: the deadline is over; negative: broken. */
int client_run(struct psr_client *client, uint64_t deadline_ns, struct psr_event *event, struct psr_error *err);

/* ---- dispatch.c ---- */

/* 1: there is an event or answer; 0: the message asked for nothing more; negative: client is broken. */
int client_dispatch(struct psr_client *client, const struct psr_message *message, struct psr_event *event);

#endif
