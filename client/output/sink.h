/* Where the pictures of a command go. */
#ifndef PSR_CLIENT_OUTPUT_SINK_H
#define PSR_CLIENT_OUTPUT_SINK_H

#include "client/draw.h"
#include "notes.h"

#define SINK_HELD 8 /* pictures that came before their turn: fewer than a series has under way */

enum sink_kind { SINK_NONE, SINK_FILE, SINK_NUMBERED, SINK_SHEET, SINK_ANIMATION };

struct sink {
	const struct draw_wish *wish;
	const struct scene *scene;
	const struct psr_msg_frame *frame;
	uint32_t n; /* pictures */
	enum sink_kind kind;
	const struct show *show;
	unsigned plane; /* that -o writes, unless `show` does */
	int depth_numbered, report_numbered;
	uint64_t start_ns; /* of the command, for the report */
	const char *server;
	/* while it runs */
	struct notes notes;
	uint32_t n_done;
	struct sink_hashes { /* n, for --hash */
		uint32_t planes;
		uint64_t hash[PSR_N_PLANES];
	} *hashes;
	struct psr_msg_frame_end end; /* of the last one, for --effects */
	struct sheet sheet;
	struct psr_animation *animation;
	uint32_t n_shown;              /* pictures that the animation has */
	struct { uint32_t k; uint8_t *rgb; } held[SINK_HELD];
};

/* What of `wish` can be refused before anything is drawn; chooses kind, show, plane. */
int sink_check(struct sink *sink, const struct draw_wish *wish, uint32_t n, struct psr_error *err);

/* Planes that the files need: bits of enum psr_plane. */
uint32_t sink_planes(const struct sink *sink);

/* For a series: picture k. */
int sink_take(uint32_t k, const struct psr_event *event, void *sink, struct psr_error *err);

/* Ends it; the files are whole, and hashes and notes printed, if code is PSR_OK. Returns code, or what failed. */
int sink_finish(struct sink *sink, int code, struct psr_error *err);

#endif
