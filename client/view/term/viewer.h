/* psr-view-term: the models of a psrd in a terminal. Files of this folder: main.c (command line), viewer.c (wishes,
 * news, the screen), keys.c (keys and mouse), tty.c (the terminal), input.c (its bytes), canvas.c (pictures as its
 * bytes). */
#ifndef PSR_CLIENT_VIEW_TERM_VIEWER_H
#define PSR_CLIENT_VIEW_TERM_VIEWER_H

#include "canvas.h"
#include "client/scene/view.h"
#include "client/view/hand.h"
#include "client/view/link.h"
#include "client/view/show.h"
#include "client/view/subject.h"

#define VIEWER_NAME "psr-view-term"
#define VIEWER_NOTE 256

struct viewer_options {
	const char *address;
	struct subject subject;
	struct view_wish camera;
	enum canvas_way way;
	uint32_t coarse_pixels;      /* see link_wish */
	double fps;
};

struct viewer {
	const struct viewer_options *options;
	struct tty tty;
	struct canvas canvas;
	struct link *link;
	struct link_state state;
	struct link_scene *scene;    /* NULL before the models are open */
	uint64_t wish;               /* number of the last one */
	struct subject subject;
	struct hand hand;
	int has_hand;                /* a scene came: there is a camera */
	struct view_show *show;
	struct view_shown shown;
	int is_pressed;
	char note[VIEWER_NOTE];
	char status[PSR_ERROR_TEXT + 64];           /* that stands in the last row */
	int must_draw, is_over;
};

int viewer_run(const struct viewer_options *options, struct psr_error *err);

/* ---- keys.c ---- */

void keys_event(struct viewer *viewer, const struct input_event *event);

#endif
