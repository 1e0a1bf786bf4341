/* A connection to psrd: requests out, pictures in. Prints nothing; one thread at a time may use a client.
 *
 * All that a server sends is checked against PROTOCOL.md and against what was asked; memory is bounded by the limits of
 * proto.h and by the size of the pictures that were asked for. A function that finds the connection broken (CONNECTION,
 * PROTOCOL, VERSION, or the server's own ERROR of id 0) says so again in every later call; the client can only be
 * closed then. Every call ends by its timeout. */
#ifndef PSR_CLIENT_H
#define PSR_CLIENT_H

#include <stddef.h>
#include <stdint.h>
#include "psr/error.h"
#include "psr/proto.h"

#ifdef __cplusplus
extern "C" {
#endif

#define PSR_CLIENT_DEFAULT_ADDRESS "127.0.0.1:7447"
#define PSR_CLIENT_MAX_ENTRIES 65536 /* of a server's list */

struct psr_client;

/* ---- connecting ---- */

/* HOST:PORT, [V6]:PORT, tcp://HOST:PORT or unix:PATH. ARG with what is wrong; UNSUPPORTED for tls://. */
int psr_address_check(const char *address, struct psr_error *err);

/* Connects, says HELLO (with `program`, the name and version of the caller, and the routing key of `model`, which may
 * be NULL) and waits for WELCOME, timeout_ms for all of it. CONNECTION, PROTOCOL (no psrd answers there), VERSION,
 * BUSY, MEMORY, and what psr_address_check refuses. */
int psr_client_connect(struct psr_client **out, const char *address, const char *program, const char *model,
                       int timeout_ms, struct psr_error *err);

/* Says GOODBYE if the connection is sound, without waiting, and frees all. NULL is fine. */
void psr_client_close(struct psr_client *client);

const struct psr_msg_welcome *psr_client_welcome(const struct psr_client *client);
uint64_t psr_client_bytes_received(const struct psr_client *client);

/* ---- short exchanges: no frame may be under way (BUSY) ---- */

/* All models of the server; *entries belongs to the caller (free), NULL if there are none. timeout_ms: the longest
 * silence. */
int psr_client_list(struct psr_client *client, struct psr_msg_list_entry **entries, uint32_t *n_entries,
                    int timeout_ms, struct psr_error *err);

/* The greater side of the pictures that models opened from now on are for, in pixels (what is above 16384 counts as
 * 16384): a server that has to build a model builds one that is fine enough for them, up to its own limit; OPENED says
 * the resolution. 0, as at first: not known, and the server has its way. Servers that do not take it are not told. */
void psr_client_set_resolution(struct psr_client *client, uint32_t pixels);

/* Opens a model, which the server may have to build first: that can take minutes, in which on_progress (may be NULL) is
 * told how far it is. A server that does not even answer PING within timeout_ms is given up (CONNECTION). NOT_FOUND,
 * FORMAT and so on as the server has it. */
int psr_client_open(struct psr_client *client, const char *name,
                    void (*on_progress)(const struct psr_msg_progress *progress, void *userdata), void *userdata,
                    int timeout_ms, struct psr_msg_opened *opened, struct psr_error *err);

/* The cameras and lights that came with an open model; *presets belongs to the caller (free), NULL if there are none.
 * UNSUPPORTED by an older server. */
int psr_client_presets(struct psr_client *client, uint32_t handle, struct psr_msg_preset **presets, uint32_t *n_presets,
                       int timeout_ms, struct psr_error *err);

int psr_client_stats(struct psr_client *client, struct psr_msg_stats_reply *stats, int timeout_ms,
                     struct psr_error *err);

/* ---- scenes and frames: what is sent here is answered by events ---- */

/* Queues a SCENE. Nothing answers it unless it fails: then an event PSR_EVENT_FAILED with this id. *id may be NULL. */
int psr_client_scene(struct psr_client *client, const struct psr_msg_scene *scene, uint32_t *id,
                     struct psr_error *err);

/* Queues a FRAME in view 0: planes that the server offers, depth as f32, without base, or budget of time or error (else
 * UNSUPPORTED). BUSY when WELCOME's max_open frames are under way. Exactly one event ends *id: FRAME with
 * end->is_final, or FAILED; with a pass_limit above 0 (UNSUPPORTED unless the server refines) FRAMEs of its earlier
 * passes come before. */
int psr_client_frame(struct psr_client *client, const struct psr_msg_frame *frame, uint32_t *id,
                     struct psr_error *err);

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
	uint64_t latency_ns; /* from psr_client_frame to the decoded picture */
	unsigned checked;    /* bit of each plane whose pixels have the hash that END gives: all that came losslessly */
	/* FAILED: */
	struct psr_error error;
};

/* Sends and receives for at most timeout_ms (0: only what needs no waiting; -1: no limit). 1: *event is filled; 0: the
 * time is over; negative: the connection is lost. A frame whose pixels do not have their hash ends in FAILED with
 * FORMAT; one that cannot be decoded, in PROTOCOL. */
int psr_client_wait(struct psr_client *client, int timeout_ms, struct psr_event *event, struct psr_error *err);

/* ---- helpers for command lines ---- */

/* One light (what follows --light):
 *   dir:X,Y,Z[,option...]                the direction in which the light travels
 *   point:X,Y,Z[,option...]              a position
 *   spot:X,Y,Z:TX,TY,TZ:ANGLE[,option...] position, a point on the axis, half angle of the cone in degrees (0..90];
 *                                        full light within 0.9 of it
 * options: color=#rrggbb (white), intensity=I (1; 0..1e6), shadow, ref=R (point, spot: the distance at which the
 * intensity holds, falling with the square of the distance; without it the light does not fall). ARG. */
int psr_light_parse(struct psr_msg_light *light, const char *text, struct psr_error *err);

/* "jpeg:Q" (Q of 1..100), "lossless" or "raw". ARG. */
int psr_codec_parse(uint8_t *codec, uint8_t *quality, const char *text, struct psr_error *err);

/* What a person said about the camera. */
struct psr_camera_wish {
	int has_eye, has_target, has_up, has_angles;
	double eye[3], target[3], up[3];
	double natural_up[3]; /* of the model, in the place of `up` if nobody said that; 0, 0, 0: +Y */
	double azimuth, elevation; /* has_angles: degrees about the up vector from the front to the right, and above the
	                            * horizon; the whole box is in the picture then. psr_camera_axes() says which way is
	                            * front */
	double roll;         /* degrees by which the camera is turned clockwise about its view */
	double zoom;         /* as a lens has it: 2 shows everything twice as large; 0: not said, 1 */
	uint32_t n_turn;     /* the box is to stay in the picture at so many equal turns about the up vector (see
	                      * psr_camera_turn); 0 and 1: as it is. Has no use with an eye */
	double fov_y;        /* radians; 0: orthographic */
	double ortho_height; /* world units; 0: as tall as the box needs */
};

/* Where the azimuth and the elevation are for which nobody asked, degrees. */
#define PSR_CAMERA_AZIMUTH 21.5246
#define PSR_CAMERA_ELEVATION 17.4576

/* Completes it: nothing said gives psr_camera_frame's; an eye alone looks at the middle of the box; a target alone is
 * seen from that camera's side. A natural up that runs along the view gives way to the back (-Z where +Y is up). near_z
 * is 1/1000 of the way to the far end of the box, but half of the way to its near end at most when the eye is outside
 * (orthographic: 0).
 * ARG: eye and target are the same point, up runs along the view, the zoom leaves no angle that the protocol has. */
int psr_camera_complete(struct psr_msg_camera *camera, const struct psr_camera_wish *wish, const double box_min[3],
                        const double box_max[3], double aspect, struct psr_error *err);

/* Turns eye and up by `degrees` about the axis `up` (any length but 0) through the target, counter-clockwise seen from
 * where up points to. Perspective: near_z is chosen anew. */
void psr_camera_turn(struct psr_msg_camera *camera, const double up[3], double degrees, const double box_min[3],
                     const double box_max[3]);

/* The light of pictures for which nobody asked for one: directional, white, from behind the camera, above it and to its
 * left. */
void client_light_key(struct psr_msg_light *light, const struct psr_msg_camera *camera);

#ifdef __cplusplus
}
#endif
#endif
