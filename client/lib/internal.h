/* Shared by the files of the client library. */
#ifndef PSR_CLIENT_INTERNAL_H
#define PSR_CLIENT_INTERNAL_H

#include "proto/proto.h"
#include "psr/client.h"

#define CLIENT_IN_BYTES (4 * PSR_WIRE_MAX_MESSAGE)
#define CLIENT_OUT_BYTES (4 * PSR_WIRE_MAX_MESSAGE)

/* ---- address.c ---- */

/* Returns a connected, non-blocking socket. deadline_ns: of clock_ns(). */
int client_socket_connect(int *out, const char *address, uint64_t deadline_ns, struct psr_error *err);

/* ---- clock ---- */

uint64_t client_deadline_ns(int timeout_ms); /* UINT64_MAX for -1 */

/* Waits with poll(2) on one descriptor until the deadline. Returns 1: ready, 0: the time is over, or IO. */
int client_poll(int fd, int events, uint64_t deadline_ns, struct psr_error *err);

/* ---- decode.c: one coded rectangle into the picture ---- */

struct client_decoder; /* contexts and scratch memory, kept from rectangle to rectangle */
int client_decoder_create(struct client_decoder **out);
void client_decoder_destroy(struct client_decoder *decoder);

/* Decodes a rectangle. `rect` has passed client_assembly_rect()'s checks; data holds all rect->total bytes of it. Turns
 * depth into float. PROTOCOL or MEMORY. */
int client_decode(struct client_decoder *decoder, struct psr_frame *picture, const struct psr_msg_frame *asked,
                  const struct psr_msg_rect *rect, const uint8_t *data, struct psr_error *err);

/* ---- crew.c: threads that decode while the caller reads on ---- */

struct client_crew;
struct client_assembly;
/* n_threads beside the caller's: 1..8. MEMORY, also when the system starts no more threads. */
int client_crew_create(struct client_crew **out, int n_threads);
/* Jobs must have ended: client_crew_wait(). NULL is fine. */
void client_crew_destroy(struct client_crew *crew);
/* As client_decode(), but the pixels are there only after client_crew_wait(). Copies `data`. The caller works, too,
 * where it would wait. MEMORY. */
int client_crew_decode(struct client_crew *crew, const struct client_assembly *assembly,
                       const struct psr_msg_rect *rect, const uint8_t *data, struct psr_error *err);
/* Returns the first error of any rectangle; with err NULL it only waits. */
int client_crew_wait(struct client_crew *crew, struct psr_error *err);

/* ---- assembly.c: one frame from BEGIN to END; no sockets ---- */

struct client_held { /* a picture of a view above 0; the list has the order of arrival */
	struct client_held *next;
	uint32_t id;
	uint16_t view, pass;
	int is_acked;
	unsigned lossy;       /* planes that may differ from the server's picture */
	struct psr_msg_frame_begin begin;
	struct psr_frame picture;
};

struct client_assembly {
	struct psr_msg_frame asked;
	struct psr_msg_frame_begin begin;
	struct psr_frame picture;
	int has_begun;
	uint16_t pass;        /* expected next */
	unsigned lossy;       /* planes with a rectangle that came by JPEG, reduced, or as u16 */
	unsigned base_lossy;  /* planes in which the base differs from the server's picture */
	uint8_t *pieces;      /* of the rectangle that arrives in pieces; grows with them */
	size_t n_pieces, pieces_capacity;
	struct psr_msg_rect open; /* that rectangle; total 0: none */
	struct client_crew *crew; /* the caller's: decodes rectangles; NULL: they are decoded at once */
};
/* Begins a frame. Takes ownership of nothing; fini frees the picture and its pieces. BEGIN allocates the pixels. */
void client_assembly_init(struct client_assembly *assembly, const struct psr_msg_frame *asked, uint16_t pass);
void client_assembly_fini(struct client_assembly *assembly);
/* base: the picture that BEGIN names, if the client holds it; else NULL. */
int client_assembly_begin(struct client_assembly *assembly, const struct psr_msg_frame_begin *begin,
                          const struct client_held *base, struct psr_error *err);
int client_assembly_rect(struct client_assembly *assembly, struct client_decoder *decoder,
                         const struct psr_msg_rect *rect, struct psr_error *err);
/* Waits for the crew. PROTOCOL: END does not fit, or a rectangle was damaged; FORMAT: a hash is wrong, and this frame
 * alone is lost. *checked gets the planes that have their hash, `lossy` the planes that may differ from the server's
 * picture. */
int client_assembly_end(struct client_assembly *assembly, const struct psr_msg_frame_end *end, unsigned *checked,
                        struct psr_error *err);

/* ---- client.c ---- */

enum client_answer { /* how the one control request that may be open was answered */
	CLIENT_ANSWER_NONE, CLIENT_ANSWER_WELCOME, CLIENT_ANSWER_LIST_END, CLIENT_ANSWER_PROGRESS, CLIENT_ANSWER_OPENED,
	CLIENT_ANSWER_PRESETS_END, CLIENT_ANSWER_STATS, CLIENT_ANSWER_PART, CLIENT_ANSWER_FETCH_END, CLIENT_ANSWER_PONG, CLIENT_ANSWER_ERROR,
};

struct client_frame {
	uint32_t id; /* 0: this place is free */
	uint16_t view;
	uint64_t sent_ns, bytes, decode_ns;
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

struct client_queued {
	struct client_queued *next;
	struct psr_event event; /* its pointers are to the rest, or to a held picture */
	struct psr_msg_frame_begin begin;
	struct psr_msg_frame_end end;
	struct client_assembly done;
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
	uint8_t levels;               /* for OPEN */
	void (*on_progress)(const struct psr_msg_progress *progress, void *userdata);
	void *userdata;
	struct client_decoder *decoder;
	struct client_crew *crew;     /* NULL: none */
	struct client_frame frame[PSR_WIRE_MAX_OPEN];
	struct client_assembly done; /* the frame of the last event */
	struct client_queued *queued, *given; /* given: by the last psr_client_wait() */
	struct client_held *held;
	struct psr_msg_frame_end end;
	struct psr_msg_rect rect;
	/* the control request: LIST, OPEN, PRESETS, STATS, FETCH or PING */
	uint32_t control_id;
	uint16_t control_type;
	enum client_answer answer;
	struct psr_error control_error;
	struct client_list list;
	struct client_presets presets;
	struct psr_msg_progress progress;
	struct psr_msg_opened opened;
	struct psr_msg_stats_reply stats;
	struct client_fetch {
		uint64_t next, end;       /* byte of the file; behind the last one asked for */
		int (*on_part)(const uint8_t *bytes, size_t n, void *userdata, struct psr_error *err);
		void *userdata;
		struct psr_msg_fetch_end last;
	} fetch;
};

int client_create(struct psr_client **out, int fd, const char *address, struct psr_error *err);

/* Marks the connection as lost for good; returns the code. */
int client_break(struct psr_client *client, int code, const char *format, ...) __attribute__((format(printf, 3, 4)));

int client_check(const struct psr_client *client, struct psr_error *err); /* the error that broke it, or PSR_OK */
void client_flush(struct psr_client *client);

/* Returns 1: `event` is filled in, or (event->type 0) client->answer is set; 0: the deadline is over; negative:
 * broken. */
int client_run(struct psr_client *client, uint64_t deadline_ns, struct psr_event *event, struct psr_error *err);

/* ---- queue.c ---- */

/* Keeps an event, the last of client_run(), for psr_client_wait(). MEMORY: the client is broken. */
int client_queue_event(struct psr_client *client, const struct psr_event *event);
int client_take_queued(struct psr_client *client, struct psr_event *event); /* 1: *event is filled */
void client_free_given(struct psr_client *client);
void client_free_queued(struct psr_client *client);

/* ---- view.c ---- */

struct client_held *client_find_held(struct psr_client *client, uint16_t view, uint32_t id, uint16_t pass);
/* Returns the picture that a frame may have as its base; NULL if it may not, or the client does not hold it. */
const struct client_held *client_find_base(struct psr_client *client, const struct client_frame *frame, uint32_t id,
                                           uint16_t pass);
/* Takes the picture out of `done`. MEMORY. */
int client_hold(struct psr_client *client, const struct client_frame *frame, struct client_assembly *done);
void client_release_held(struct psr_client *client); /* frees pictures that can no longer be a base */
void client_free_held(struct psr_client *client);
/* Counts the view's frames that have begun and are not acknowledged. */
unsigned client_count_unacked(const struct psr_client *client, uint16_t view);

/* ---- frame.c ---- */

struct client_frame *client_find_frame(struct psr_client *client, uint32_t id); /* NULL: it is not open */
/* Ends the frame's id. Returns 1. */
int client_frame_failed(struct psr_client *client, struct client_frame *frame, struct psr_event *event,
                        const struct psr_error *why);
/* Handle FRAME_BEGIN, RECT, FRAME_END, SUPERSEDED; return as client_dispatch(). */
int client_on_frame(struct psr_client *client, const struct psr_message *message, struct psr_event *event);

/* ---- dispatch.c ---- */

/* Breaks the connection: the server broke the protocol with this message, or as a decoder says. */
int client_unexpected(struct psr_client *client, const struct psr_message *message);
int client_broke(struct psr_client *client, const struct psr_error *why);

/* Handles a message. Returns 1: there is an event or answer; 0: there is none; negative: client is broken. */
int client_dispatch(struct psr_client *client, const struct psr_message *message, struct psr_event *event);

#endif
