/* The files that the pictures of a command go to. */
#ifndef PSR_CLIENT_OUTPUT_SINK_H
#define PSR_CLIENT_OUTPUT_SINK_H

#include "client/cli/optlist.h"
#include "notes.h"
#include "output.h"
#include "show.h"

#define SINK_HELD 8 /* most pictures held until their turn comes; a series has fewer under way */

struct sink_wish {
	const char *program; /* "psr shot", for messages */
	const char *output, *depth, *report, *plane_text, *show_text;
	uint32_t sheet[2];   /* columns and rows */
	int hash, effects, has_sheet, has_no_legend;
	int64_t n_turn;      /* pictures of a turntable; 0: this is not one */
	double seconds;      /* one turn of an animation takes */
};

/* The options that shot and turntable share. */
void sink_add_file_options(struct optlist *list, struct sink_wish *wish);
void sink_add_developer_options(struct optlist *list, struct sink_wish *wish);

enum sink_kind { SINK_NONE, SINK_FILE, SINK_NUMBERED, SINK_SHEET, SINK_ANIMATION };

struct sink {
	const struct sink_wish *wish;
	const struct scene *scene;
	const struct psr_msg_frame *frame;
	uint32_t n; /* pictures */
	enum sink_kind kind;
	const struct show *show;
	unsigned plane; /* the plane that -o writes, unless `show` is set */
	int depth_numbered, report_numbered;
	uint64_t start_ns; /* when the command began, for the report */
	const char *server;
	/* while it runs */
	struct notes notes;
	uint32_t n_done;
	struct sink_hashes { /* one a picture, for --hash */
		uint32_t planes;
		uint64_t hash[PSR_N_PLANES];
	} *hashes;
	struct psr_msg_frame_end end; /* of the last picture, for --effects */
	struct sheet sheet;
	struct psr_animation *animation;
	uint32_t n_shown;              /* pictures already in the animation */
	struct { uint32_t k; uint8_t *rgb; } held[SINK_HELD];
};

/* Prepares for n pictures of this width and height: chooses kind, show and plane, and finds errors before anything is
 * drawn. */
int sink_check(struct sink *sink, const struct sink_wish *wish, uint32_t n, const uint32_t size[2],
               struct psr_error *err);

/* Returns the planes that the files need: bits of enum psr_plane. */
uint32_t sink_planes(const struct sink *sink);

/* Takes picture k of a series. */
int sink_take(uint32_t k, const struct psr_event *event, void *sink, struct psr_error *err);

/* Completes the files and prints hashes and notes if code is PSR_OK; else drops them. Returns code, or the first
 * error. */
int sink_finish(struct sink *sink, int code, struct psr_error *err);

#endif
