/* psr-view: a window on the models of a psrd. Files of this folder: main.c (command line), viewer.c (window and loop),
 * connect.c (to which psrd), news.c (wishes to the link, and what comes of them), input.c (mouse and keys), drag.c
 * (lights and instances by hand), save.c (screenshots, ways), bell.c (the link's news as events), gui.cc (Dear ImGui on
 * an SDL renderer), panel.cc (what stands on the picture), settings.cc (the panel of settings). */
#ifndef PSR_CLIENT_VIEW_WINDOW_VIEWER_H
#define PSR_CLIENT_VIEW_WINDOW_VIEWER_H

#include <SDL.h>
#include "client/scene/view.h"
#include "client/view/hand.h"
#include "client/home/home.h"
#include "client/view/link.h"
#include "client/view/path.h"
#include "client/view/show.h"
#include "client/view/subject.h"

#ifdef __cplusplus
extern "C" {
#endif

#define VIEWER_NAME "psr-view"
#define VIEWER_NOTE 512
#define VIEWER_SETTLE 3 /* frames after an event: the panel needs some to come to rest */

struct viewer_options {
	const char *address;
	const char *file;        /* viewed through a psrd of its own; NULL: the models of the one at `address` */
	struct subject subject;
	struct view_wish camera;
	uint32_t size[2];        /* of the window, in points of the desktop */
	const char *play, *record;
	int is_bare, has_inertia;
	double fps;
};

struct viewer_point { /* that was clicked */
	int is_set, has_normal;
	struct view_probe probe;
	double normal[3];        /* of the frame's plane; it comes a round trip later */
};

enum viewer_drag { DRAG_NONE, DRAG_NOTHING, DRAG_LIGHT, DRAG_INSTANCE };

/* Frames a second over the last second. */
struct viewer_rate { uint64_t since_ns; uint32_t n; double per_second; };

struct bell;
struct gui;

struct viewer {
	struct viewer_options options;
	SDL_Window *window;
	SDL_Renderer *renderer;
	SDL_Texture *texture;
	uint32_t texture_size[2];
	struct gui *gui;
	struct bell *bell;
	uint32_t bell_event;

	struct home *home;           /* of a file; NULL: none */
	const char *address;         /* of the psrd */
	struct link *link;
	struct link_state state;
	struct link_scene *scene;    /* NULL before the models are open */
	struct psr_msg_list_entry *list;
	uint32_t n_list;
	uint64_t wish;               /* number of the last one */
	uint32_t model_pixels;       /* that models are built for: the window's greater side, once it keeps its size */
	uint64_t resized_ns;

	struct subject subject;
	struct hand hand;
	int has_camera;              /* the camera of the command line was placed, in the box of a scene */
	int has_hand;                /* a scene came: there is a camera */
	uint32_t camera_of_file;     /* the next preset to be looked through */
	struct view_show *show;
	struct view_shown shown;
	const struct psr_frame *pixels; /* drawn last; NULL: none */

	/* the hand */
	struct hand_cursor press;    /* where a button went down */
	int is_pressed, is_click;    /* is_click: it has not moved since */
	int holds_light, holds_model; /* L and G, and the modifiers, when the event came: SDL knows of later ones already */
	SDL_Keymod mod;
	enum viewer_drag drag;       /* the press that is on drags no camera */
	uint32_t light;              /* that is dragged */
	int picked;                  /* instance that was clicked; -1: none */
	uint64_t probe;              /* number of the place that is asked for; 0: none */
	int probe_point;             /* which point waits for it */
	int fly_keys[6];             /* right, left, up, down, forwards, backwards */

	/* what is shown on top */
	int has_overlay, has_panel, has_help, is_measuring;
	struct viewer_point point[2];
	struct viewer_rate drawn, received;
	double bytes_per_second;
	uint64_t bytes_since, seen_pictures;
	char note[VIEWER_NOTE];      /* the last thing to tell, until note_ns */
	uint64_t note_ns;

	/* files */
	int wants_shot;              /* as soon as the picture is sharp */
	struct path path;            /* recorded, or read */
	int is_recording, is_playing;
	uint64_t path_start_ns;

	uint32_t frames_due;         /* to draw, though nothing moves */
	int is_over;
	double scale;                /* pixels a point of the desktop */
};

/* ---- viewer.c ---- */

int viewer_run(const struct viewer_options *options, struct psr_error *err);
void viewer_note(struct viewer *viewer, const char *format, ...) __attribute__((format(printf, 2, 3)));
int viewer_is_sharp(const struct viewer *viewer); /* the screen shows the last wish as it is */

/* ---- news.c ---- */

uint32_t news_greater_side(const struct viewer *viewer); /* of the picture, pixels */
void news_wish(struct viewer *viewer);
void news_hear(struct viewer *viewer);
void viewer_show_model(struct viewer *viewer, const char *name); /* alone */
void viewer_add_model(struct viewer *viewer, const char *name);
void viewer_set_stage(struct viewer *viewer, const char *name);  /* NULL: colours */

/* ---- connect.c ---- */

/* Leaves the psrd before, if there is one. */
int connect_to(struct viewer *viewer, const char *address, struct psr_error *err);
/* Views a file through a psrd of its own. After a failure all is as it was. */
int connect_file(struct viewer *viewer, const char *path, struct psr_error *err);
void connect_end(struct viewer *viewer);

/* ---- input.c ---- */

void input_event(struct viewer *viewer, const SDL_Event *event);
void input_next_camera(struct viewer *viewer); /* of those that came with the first model */

void input_surface(struct viewer *viewer); /* what link_probe() asked for has come */

/* ---- drag.c ---- */

int drag_begin(struct viewer *viewer);         /* 1: the press drags a light, an instance or nothing, but no camera */
void drag_move(struct viewer *viewer, double right, double down); /* pixels */

/* ---- save.c ---- */

void save_shot(struct viewer *viewer);         /* now: pixels and command line */
void save_toggle_record(struct viewer *viewer);
void save_toggle_play(struct viewer *viewer);
void save_step(struct viewer *viewer, uint64_t now_ns); /* records, or plays */

/* ---- bell.c: a thread that turns news of a link into SDL events ---- */

int bell_create(struct bell **out, int fd, uint32_t event, struct psr_error *err);
void bell_heard(struct bell *bell); /* after link_heard(): listen again */
void bell_destroy(struct bell *bell); /* NULL is fine */

#ifdef __cplusplus
}
#endif

#endif
