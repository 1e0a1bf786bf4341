/* Pacing of a viewer: when to ask for the next frame, and how sharp it may be. A pure state machine: events and the
 * time come in, requests go out. It has no socket, no clock and no memory of its own.
 *
 * All times are nanoseconds of one monotonic clock of the caller, and never go back. After each event, and at the time
 * that pace_next() named, the caller calls pace_next(), sends the request if there is one, and reports that to
 * pace_sent(). The caller sets the request's camera at the moment of sending. */
#ifndef PSR_CLIENT_LIB_PACE_H
#define PSR_CLIENT_LIB_PACE_H

#include "psr/message.h"

#define PACE_WINDOW 2               /* most requests of a movement that wait for their frames at a time */
#define PACE_REST_NS UINT64_C(50000000) /* a camera that has not moved for this long is at rest */
/* On a way too long for the wished rate, drawing, sending and decoding of a frame may take so many frame times all the
 * same: warping makes up for frames that are late or rare, not for coarse ones. */
#define PACE_WORK_FRAMES 1.5
#define PACE_OPEN 16                /* most requests that wait for their frames at a time, those at rest included */
#define PACE_SAMPLES 6              /* frames over which the link's rate is measured */
#define PACE_SCALES 3               /* 1, 2, 4 */
#define PACE_NEVER UINT64_MAX

/* The user's wishes for a moving picture. */
struct pace_wish {
	double fps;                     /* 1..1000; goes before sharpness, unless the way is too long for it */
	uint32_t width, height;         /* of the window: 1..16384 pixels each */
	uint8_t least_quality;          /* JPEG, 1..100: a larger scale looks better than a lower quality */
	uint8_t most_quality;           /* least_quality..100 */
	uint8_t most_scale;             /* 1, 2 or 4 */
	uint16_t pass_limit;            /* of the request at rest */
};

/* The fields of FRAME that the pacer sets. */
struct pace_request {
	struct psr_msg_settings settings;
	uint8_t color_codec, color_quality;
	uint8_t is_sharp;               /* a sharp frame follows: pass 0 again at full size, smooth, lossless */
	uint16_t pass_limit;            /* and then refined ones; 0 unless is_sharp */
};

/* The cost of one frame. Unknown fields are 0. */
struct pace_cost {
	uint64_t bytes;                 /* in the frame's messages */
	uint64_t queue_ns, server_ns;   /* from the report: time until its turn came; from the start of work to the end of
	                                 * encoding */
};

/* Predicts a cost as per_unit[scale] * units; units are about pixels. */
struct pace_model {
	double per_unit[PACE_SCALES];
	int is_known;
};

struct pace_open {                  /* a request that waits for its first frame */
	uint32_t id;                    /* 0: this place is free */
	uint64_t sent_ns, first_ns;     /* first_ns 0: no byte has come */
	uint64_t first_bytes;
	int is_complete;                /* complete; waits for its ACK */
	struct pace_request request;
};

struct pace_sample {
	double frame;                   /* the frame's bytes */
	double bytes, seconds;          /* bytes after the first read, and the time in which they came */
};

struct pace {
	struct pace_wish wish;
	int is_moving, is_drawn;        /* is_drawn: the last request has the current camera */
	int wants_sharp;                /* this place still has to ask for its sharp frame */
	uint64_t moved_ns, due_ns;      /* time of the last movement; time of a movement's next request */
	struct pace_open open[PACE_OPEN];
	struct pace_sample sample[PACE_SAMPLES];
	unsigned n_samples;             /* since the start */
	struct pace_model bytes, draw, decode;
	double latency;                 /* mean seconds from request to ACK; 0: unknown */
	double away;                    /* the part of latency that neither the server's work nor the frame's own bytes
	                                 * explain */
	unsigned rung;                  /* of the ladder of scale and smoothness */
};

/* Starts a pacer, whose first picture is due at once. */
void pace_init(struct pace *pace, const struct pace_wish *wish, uint64_t now_ns);
/* Changes the wishes. Counts as a movement; the pacer keeps what it has learnt. */
void pace_set_wish(struct pace *pace, const struct pace_wish *wish, uint64_t now_ns);

void pace_moved(struct pace *pace, uint64_t now_ns);   /* camera or scene changed */
void pace_rested(struct pace *pace);                   /* the user let go; otherwise PACE_REST_NS decides */

/* Returns 1: send *request now. Returns 0: do not send before *again_ns, or at all (PACE_NEVER), unless an event
 * comes. */
int pace_next(struct pace *pace, uint64_t now_ns, struct pace_request *request, uint64_t *again_ns);
void pace_sent(struct pace *pace, uint32_t id, const struct pace_request *request, uint64_t now_ns);

/* A frame begins to arrive. Frames of ids that are not open, and frames of an id after the first, change nothing.
 * bytes: the part of this frame's messages that the first read brought. */
void pace_first_bytes(struct pace *pace, uint32_t id, uint64_t bytes, uint64_t now_ns);
void pace_complete(struct pace *pace, uint32_t id, const struct pace_cost *cost, uint64_t now_ns);
/* The frame is complete; decode_ns: the time spent on decoding. */
void pace_acknowledged(struct pace *pace, uint32_t id, uint64_t decode_ns, uint64_t now_ns);
/* The request ended by SUPERSEDED, CANCELLED or ERROR. */
void pace_ended(struct pace *pace, uint32_t id);

/* Returns the link's measured rate in bytes a second; 0: unknown, or too fast to measure. */
double pace_rate(const struct pace *pace);

#endif
