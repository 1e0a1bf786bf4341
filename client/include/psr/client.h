/* A connection to psrd: requests out, pictures in. Prints nothing; one thread at a time may use a client.
 *
 * Every byte from the server is checked against PROTOCOL.md and against the request; memory is bounded by the limits of
 * psr/message.h and by the size of the pictures that were asked for. A function that finds the connection broken
 * (CONNECTION, PROTOCOL, VERSION, or the server's own ERROR of id 0) says so again in every later call; the client can
 * only be closed then. timeout_ms is the longest silence of the server; every call ends by it. */
#ifndef PSR_CLIENT_H
#define PSR_CLIENT_H

#include <stdint.h>
#include "psr/error.h"
#include "psr/message.h"
#include "psr/shot.h"

#ifdef __cplusplus
extern "C" {
#endif

#define PSR_CLIENT_DEFAULT_ADDRESS "127.0.0.1:7447"
#define PSR_CLIENT_MAX_ENTRIES 65536 /* of a server's list */

struct psr_client;

/* ---- a picture in one call ---- */

/* Opens the model, draws the shot, and gives it to `frame`, which the caller frees (psr_frame_free()). The planes come
 * without loss: they have the pixels of psr_shot_draw(). Colours of lights go as 8-bit sRGB and an intensity: the
 * nearest. No frame may be under way (BUSY). The errors of psr_client_open() and of psr_render(); the frame is zero
 * then. */
int psr_client_draw(struct psr_client *client, const char *model, const struct psr_shot *shot, struct psr_frame *frame,
                    int timeout_ms, struct psr_error *err);

/* The same with a connection of its own: connects, opens, draws, closes. */
int psr_shot_draw_at(const char *address, const char *model, const struct psr_shot *shot, struct psr_frame *frame,
                     int timeout_ms, struct psr_error *err);

/* ---- connecting ---- */

/* HOST:PORT, [V6]:PORT, tcp://HOST:PORT or unix:PATH. ARG with what is wrong; UNSUPPORTED for tls://. */
int psr_address_check(const char *address, struct psr_error *err);

/* Connects, says HELLO (with `program`, the name and version of the caller, and the routing key of `model`, which may
 * be NULL) and waits for WELCOME, timeout_ms for all of it. CONNECTION, PROTOCOL (no psrd answers there), VERSION,
 * BUSY, MEMORY, and the errors of psr_address_check(). */
int psr_client_connect(struct psr_client **out, const char *address, const char *program, const char *model,
                       int timeout_ms, struct psr_error *err);

/* Says GOODBYE if the connection is sound, without waiting, and frees all. NULL is fine. */
void psr_client_close(struct psr_client *client);

const struct psr_msg_welcome *psr_client_welcome(const struct psr_client *client);
uint64_t psr_client_bytes_received(const struct psr_client *client);

/* For an event loop: the socket, the client's own. *events, if not NULL, gets what to poll it for: POLLIN, and POLLOUT
 * while requests wait to be sent. When it is ready, psr_client_wait() with a timeout of 0 does the work. */
int psr_client_fd(const struct psr_client *client, short *events);

/* ---- short exchanges: no frame may be under way (BUSY) ---- */

/* All models of the server; *entries belongs to the caller (free), NULL if there are none. */
int psr_client_list(struct psr_client *client, struct psr_msg_list_entry **entries, uint32_t *n_entries,
                    int timeout_ms, struct psr_error *err);

/* The greater side of the pictures that models opened from now on are for, in pixels (above 16384 counts as 16384): a
 * server that has to build a model builds one that is fine enough for them, up to its own limit; OPENED says the
 * resolution. 0, as at first: the server decides. Servers without PSR_CAP_RESOLUTION are not told. */
void psr_client_set_resolution(struct psr_client *client, uint32_t pixels);

/* psr_client_open() calls fn while the server builds or loads. NULL, as at first: nobody is told. */
void psr_client_on_progress(struct psr_client *client,
                            void (*fn)(const struct psr_msg_progress *progress, void *userdata), void *userdata);

/* Opens a model, which the server may have to build first: that can take minutes. A server that does not even answer
 * PING within timeout_ms is given up (CONNECTION). NOT_FOUND, FORMAT and so on as the server says. */
int psr_client_open(struct psr_client *client, const char *name, int timeout_ms, struct psr_msg_opened *opened,
                    struct psr_error *err);

/* Queues a CLOSE: the handle is gone, scenes that hold the model keep it. Nothing answers it unless it fails: then an
 * event PSR_EVENT_FAILED. ARG: a handle of 0. */
int psr_client_close_model(struct psr_client *client, uint32_t handle, struct psr_error *err);

/* The cameras and lights that came with an open model; *presets belongs to the caller (free), NULL if there are none.
 * UNSUPPORTED by an older server. */
int psr_client_presets(struct psr_client *client, uint32_t handle, struct psr_msg_preset **presets, uint32_t *n_presets,
                       int timeout_ms, struct psr_error *err);

int psr_client_stats(struct psr_client *client, struct psr_msg_stats_reply *stats, int timeout_ms,
                     struct psr_error *err);

/* ---- scenes and frames: events answer them ---- */

/* Queues a SCENE. Nothing answers it unless it fails: then an event PSR_EVENT_FAILED with this id. *id may be NULL. */
int psr_client_scene(struct psr_client *client, const struct psr_msg_scene *scene, uint32_t *id,
                     struct psr_error *err);

/* Queues a FRAME in view 0: planes that the server offers, depth as f32, without base, or budget of time or error (else
 * UNSUPPORTED). BUSY when WELCOME's max_open frames are under way. Exactly one event ends *id: FRAME with
 * end->is_final, or FAILED; with a pass_limit above 0 (UNSUPPORTED unless the server refines) FRAMEs of its earlier
 * passes come before. */
int psr_client_frame(struct psr_client *client, const struct psr_msg_frame *frame, uint32_t *id,
                     struct psr_error *err);

/* Queues a CANCEL of a frame that is under way. An event ends the frame as ever: FAILED with CANCELLED, or the one that
 * was on its way. NOT_FOUND: no such frame is under way. */
int psr_client_cancel(struct psr_client *client, uint32_t id, struct psr_error *err);

enum psr_event_type {
	PSR_EVENT_FRAME = 1, /* a frame is complete and checked */
	PSR_EVENT_FAILED,    /* the request `id` failed: `error` says why; the connection goes on */
};

struct psr_event {
	enum psr_event_type type;
	uint32_t id;
	/* FRAME; pointers are valid until the next call with this client: */
	const struct psr_frame *picture;
	const struct psr_msg_frame_begin *begin;
	const struct psr_msg_frame_end *end;
	uint64_t bytes;      /* of the frame's messages, headers included */
	uint64_t latency_ns; /* from psr_client_frame() to the decoded picture */
	unsigned checked;    /* bit of each plane whose pixels have the hash of END: all that came losslessly */
	/* FAILED: */
	struct psr_error error;
};

/* Sends and receives for at most timeout_ms (0: only what needs no waiting; -1: no limit). 1: *event is filled; 0: the
 * time is over; negative: the connection is lost. A frame whose pixels do not have their hash ends in FAILED with
 * FORMAT; one that cannot be decoded, in PROTOCOL. */
int psr_client_wait(struct psr_client *client, int timeout_ms, struct psr_event *event, struct psr_error *err);

#ifdef __cplusplus
}
#endif
#endif
