/* A pacer before a simulated link, server and user: steps of 0.1 ms of a clock of its own. */
#ifndef TESTS_UNIT_LIB_PACE_WORLD_H
#define TESTS_UNIT_LIB_PACE_WORLD_H

#include "client/lib/pace.h"

#define WORLD_MS UINT64_C(1000000)
#define WORLD_SECOND UINT64_C(1000000000)
#define WORLD_SHARP_BYTES 600000.0
#define WORLD_CODE_RATE 60e6     /* bytes a second that the server codes */
#define WORLD_NO_SMOOTH 0.75     /* of the time to draw */

struct world {
	double mbit, rtt_ms, jitter_ms; /* jitter: each way takes up to so much longer */
	double draw_ms, decode_ms;      /* full size, smooth */
	double cost_low, cost_high;     /* of a frame's bytes, against world_bytes(); the scene changes with the camera */
	double slow_from_s, slow_to_s;  /* the link has a tenth of its rate */
	double move_s, rest_s;          /* the user moves, then rests, by turns; rest 0: never */
	double total_s;
};

/* What is to be seen from outside. */
struct world_found {
	unsigned most_unacked;          /* in the server */
	unsigned most_open;             /* requests that waited when a movement sent one, that one included */
	unsigned n_rests, n_asked, n_late; /* sharp frames asked for; of these more than 0.1 s after the last movement */
	unsigned n_sharp;               /* sharp frames that came while the user rested */
	unsigned n_backwards;           /* frames shown after one of a later camera */
	int is_last_shown;              /* the last camera is */
	double most_queue_ms;           /* of frames of movements, before the link */
	double sharp_ms;                /* from the last movement to its sharp frame, at most */
};

/* Of frames shown between two times. */
struct world_figures {
	double fps, p50_ms, p99_ms;     /* from request to decoded picture */
	double gap_ms;                  /* longest between two frames shown */
	double scale, quality, bytes;   /* means */
	unsigned n_changes;             /* of scale */
};

void world_run(const struct world *world, const struct pace_wish *wish, uint64_t seed);
const struct world_found *world_found(void);            /* of the last run */
struct world_figures world_figures(double from_s, double to_s);

/* Bytes of a frame of 1920x1080: those of the model `engine`, as psrd codes it. */
double world_bytes(uint8_t scale, double quality);

#endif
