/* A connection to psrd: requests out, pictures in. Prints nothing; one thread at a time may use a client.
 *
 * Every byte from the server is checked against PROTOCOL.md and against the request; memory is bounded by the limits of
 * psr/message.h and by the size of the pictures that were asked for. A function that finds the connection broken
 * (CONNECTION, PROTOCOL, VERSION, or the server's own ERROR of id 0) says so again in every later call; the client can
 * only be closed then. timeout_ms is the longest silence of the server; every call ends by it. */
#ifndef PSR_CLIENT_H
#define PSR_CLIENT_H

#include <stddef.h>
#include <stdint.h>
#include "psr/error.h"
#include "psr/message.h"
#include "psr/shot.h"

#ifdef __cplusplus
extern "C" {
#endif

#define PSR_CLIENT_DEFAULT_ADDRESS "127.0.0.1:7447"
#define PSR_CLIENT_MAX_ENTRIES 65536 /* in a server's list */

struct psr_client;

/* ---- a picture in one call ---- */

/* Opens the model, draws the shot, and gives the picture to `frame`, which the caller frees (psr_frame_free()). The
 * planes travel without loss: their pixels are those of psr_shot_draw(). A light's colour travels as 8-bit sRGB and an
 * intensity: the nearest values count. BUSY while a frame is under way or an event waits; the errors of
 * psr_client_open() and of psr_render(). After a failure the frame is zero. */
int psr_client_draw(struct psr_client *client, const char *model, const struct psr_shot *shot, struct psr_frame *frame,
                    int timeout_ms, struct psr_error *err);

/* psr_client_draw() with a connection of its own: connects, draws, closes. */
int psr_shot_draw_at(const char *address, const char *model, const struct psr_shot *shot, struct psr_frame *frame,
                     int timeout_ms, struct psr_error *err);

/* ---- connecting ---- */

/* Checks the form of an address: HOST:PORT, [V6]:PORT, tcp://HOST:PORT or unix:PATH. ARG tells what is wrong with it;
 * UNSUPPORTED for tls://. */
int psr_address_check(const char *address, struct psr_error *err);

/* Connects, says HELLO (with `program`, the name and version of the caller, and the routing key of `model`, which may
 * be NULL) and waits for WELCOME; all of it takes timeout_ms at most. CONNECTION, PROTOCOL (no psrd answers there),
 * VERSION, BUSY, MEMORY, and the errors of psr_address_check(). */
int psr_client_connect(struct psr_client **out, const char *address, const char *program, const char *model,
                       int timeout_ms, struct psr_error *err);

#define PSR_CLIENT_MAX_THREADS 8

/* Lets n_threads (1..PSR_CLIENT_MAX_THREADS) decode frames while the caller of psr_client_wait() reads on, and beside
 * it. Without this call it decodes alone. No frame may be under way. ARG, also the second time; MEMORY. */
int psr_client_use_threads(struct psr_client *client, int n_threads, struct psr_error *err);

/* Says GOODBYE if the connection is sound, without waiting, and frees the client. NULL is fine. */
void psr_client_close(struct psr_client *client);

const struct psr_msg_welcome *psr_client_welcome(const struct psr_client *client);
uint64_t psr_client_bytes_received(const struct psr_client *client);

/* For an event loop: returns the socket, which the client owns. *events, if not NULL, gets the events to poll for:
 * POLLIN, and POLLOUT while requests wait to be sent. When the socket is ready, call psr_client_wait() with a timeout
 * of 0. */
int psr_client_fd(const struct psr_client *client, short *events);

/* ---- short exchanges ----
 *
 * Frames may be under way: events that come before the answer wait for psr_client_wait(), which is to be called until it
 * returns 0 before the socket is polled again. BUSY, as the server says: too many requests are under way. */

/* Lists all models of the server; *entries belongs to the caller (free), NULL if there are none. */
int psr_client_list(struct psr_client *client, struct psr_msg_list_entry **entries, uint32_t *n_entries,
                    int timeout_ms, struct psr_error *err);

/* Sets the greater side, in pixels, of the pictures that models opened from now on are for (above 16384 counts as
 * 16384). A server that has to build a model builds it fine enough for such pictures, up to its own limit; OPENED tells
 * the resolution. 0, the default: the server decides. Servers without PSR_CAP_RESOLUTION are not told. */
void psr_client_set_resolution(struct psr_client *client, uint32_t pixels);

/* Has models opened from now on be the first levels of packed octrees, at least so many where the file can be cut
 * there: a coarser model that is there at once. OPENED tells the levels. 0, the default: all. Servers without
 * PSR_CAP_LEVELS are not told. */
void psr_client_set_levels(struct psr_client *client, uint32_t levels);

/* psr_client_open() calls fn while the server builds or loads. NULL, the default: it calls nothing. */
void psr_client_on_progress(struct psr_client *client,
                            void (*fn)(const struct psr_msg_progress *progress, void *userdata), void *userdata);

/* Opens a model. The server may have to build it first, which can take minutes. CONNECTION: the server did not even
 * answer PING within timeout_ms. NOT_FOUND, FORMAT and so on as the server says. */
int psr_client_open(struct psr_client *client, const char *name, int timeout_ms, struct psr_msg_opened *opened,
                    struct psr_error *err);

/* Queues a CLOSE: gives up the handle; scenes with the model keep it. Only a failure is answered, by an event
 * PSR_EVENT_FAILED. ARG: the handle is 0. */
int psr_client_close_model(struct psr_client *client, uint32_t handle, struct psr_error *err);

/* Gets the cameras and lights that came with an open model; *presets belongs to the caller (free), NULL if there are
 * none. UNSUPPORTED by an older server. */
int psr_client_presets(struct psr_client *client, uint32_t handle, struct psr_msg_preset **presets, uint32_t *n_presets,
                       int timeout_ms, struct psr_error *err);

/* Who takes parts of a file. An error of on_part ends the connection with it. */
struct psr_fetch_user {
	int (*on_part)(const uint8_t *bytes, size_t n, void *userdata, struct psr_error *err);
	void *userdata;
};

/* Gets a part of the file that an open model comes from: on_part takes its bytes in their order, without gaps. They are
 * those of the server's disk, not checked (docs/format.md has the hashes). NOT_FOUND: the file is gone, or is not that of
 * fetch->file_hash; UNSUPPORTED by an older server. */
int psr_client_fetch(struct psr_client *client, const struct psr_msg_fetch *fetch,
                     const struct psr_fetch_user *user, struct psr_msg_fetch_end *end, int timeout_ms,
                     struct psr_error *err);

int psr_client_stats(struct psr_client *client, struct psr_msg_stats_reply *stats, int timeout_ms,
                     struct psr_error *err);

/* Queues a PING. Its answer is no event, but counts in psr_client_bytes_received(): who has heard nothing for a while
 * finds out whether the server is still there. BUSY, and what broke the connection. */
int psr_client_ping(struct psr_client *client, struct psr_error *err);

/* ---- scenes and frames: events answer them ---- */

/* Queues a SCENE. Only a failure is answered, by an event PSR_EVENT_FAILED with this id. *id may be NULL. */
int psr_client_scene(struct psr_client *client, const struct psr_msg_scene *scene, uint32_t *id,
                     struct psr_error *err);

/* Queues a FRAME in view 0, where every request is drawn. UNSUPPORTED: the request has a base, or anything that the
 * server does not offer. BUSY: WELCOME's max_open frames are under way. Exactly one event ends *id: FRAME with
 * end->is_final, or FAILED; a pass_limit above 0 brings FRAMEs of the earlier passes before it. With a budget of time or
 * error begin->settings are those that the server chose. Depth requested as u16 arrives as float, off by at most half a
 * step. */
int psr_client_frame(struct psr_client *client, const struct psr_msg_frame *frame, uint32_t *id,
                     struct psr_error *err);

/* Queues a CANCEL of a frame that is under way. One event still ends the frame: FAILED with CANCELLED, or the event
 * that was already on its way. NOT_FOUND: no such frame is under way. */
int psr_client_cancel(struct psr_client *client, uint32_t id, struct psr_error *err);

/* ---- views: a picture that follows a moving camera ----
 *
 * In a view v > 0 a request supersedes the ones before: SUPERSEDED ends them, or their last FRAME. An event BEGIN comes
 * before each FRAME. The server sends no third frame of a view before the first is acknowledged, so acknowledge each
 * FRAME: its picture stays valid until then, and not until the next call only. The client holds the last acknowledged
 * pictures of a view, 4 at most, as bases. */

/* psr_client_frame() in view v. frame->base is 0 or psr_client_base(); ARG for any other. BUSY: 64 requests are under
 * way. */
int psr_client_frame_in(struct psr_client *client, uint16_t view, const struct psr_msg_frame *frame, uint32_t *id,
                        struct psr_error *err);

/* The id of the view's last acknowledged frame, which the next request may name as its base; 0: there is none. */
uint32_t psr_client_base(const struct psr_client *client, uint16_t view);

/* Queues an ACK of the frame of a FRAME event. NOT_FOUND: no such frame waits for one; ARG: an earlier frame of its
 * view waits first; BUSY: the server takes nothing now, try again. */
int psr_client_ack(struct psr_client *client, uint32_t id, uint16_t pass, struct psr_error *err);

/* Queues a PAUSE or a RESUME: a paused view gets only the frame that is under way. View 0 can pause, too. UNSUPPORTED,
 * BUSY. */
int psr_client_pause(struct psr_client *client, uint16_t view, int is_paused, struct psr_error *err);

/* ---- events ---- */

enum psr_event_type {
	PSR_EVENT_FRAME = 1,  /* a frame is complete and checked */
	PSR_EVENT_FAILED,     /* the request `id` failed: `error` says why; the connection goes on */
	PSR_EVENT_BEGIN,      /* view > 0: a frame begins to arrive; `begin`, `bytes` and `latency_ns` are set */
	PSR_EVENT_SUPERSEDED, /* view > 0: a newer request has ended `id` */
};

struct psr_event {
	enum psr_event_type type;
	uint32_t id;
	/* FRAME; the pointers are valid until the next call with this client (picture and begin in a view > 0: until
	 * psr_client_ack()): */
	const struct psr_frame *picture;
	const struct psr_msg_frame_begin *begin;
	const struct psr_msg_frame_end *end;
	uint64_t bytes;      /* of the frame's messages, headers included */
	uint64_t latency_ns; /* from psr_client_frame() to the decoded picture */
	uint64_t decode_ns;  /* the part of latency_ns spent on decoding */
	unsigned checked;    /* a bit for each plane whose pixels have the hash of END: all planes that came without
	                      * loss */
	/* FAILED: */
	struct psr_error error;
};

/* Sends and receives for at most timeout_ms (0: does not wait; -1: no limit). Returns 1: *event is filled in; 0: the
 * time is over; negative: the connection is lost. A frame that cannot be decoded, or whose pixels do not have their
 * hash, ends in FAILED with FORMAT; in a view > 0, where later frames build on it, with PROTOCOL. */
int psr_client_wait(struct psr_client *client, int timeout_ms, struct psr_event *event, struct psr_error *err);

#ifdef __cplusplus
}
#endif
#endif
