/* What the files of the link share. The user's thread and the link's own meet in struct link alone, under its lock. */
#ifndef PSR_CLIENT_VIEW_LINK_INSIDE_H
#define PSR_CLIENT_VIEW_LINK_INSIDE_H

#include <pthread.h>
#include "client/lib/pace.h"
#include "link.h"
#include "proto/proto.h"

#define LINK_VIEW 1
#define LINK_CONNECT_MS 5000
#define LINK_PING_NS UINT64_C(2000000000)   /* of silence, then a PING */
#define LINK_SILENCE_NS UINT64_C(7000000000) /* then the connection is lost */
#define LINK_BACKOFF_LOW_S 0.2
#define LINK_BACKOFF_HIGH_S 5.0

/* ---- link_wish.c ---- */

struct link_box { /* a wish with instances of its own; zeroed: none */
	struct link_wish wish;
	struct link_instance *instance;
	uint32_t capacity;
	uint64_t number;
};
int link_wish_check(const struct link_wish *wish);
int link_wish_is_same(const struct link_wish *a, const struct link_wish *b);
int link_wish_has_same_models(const struct link_wish *a, const struct link_wish *b); /* and sizes to build them for */
int link_box_set(struct link_box *box, const struct link_wish *wish, uint64_t number); /* MEMORY: it is as before */
void link_box_fini(struct link_box *box);

/* ---- link_pictures.c: pictures whose memory goes round ---- */

struct link_pictures; /* counted: by the link, and by each picture that somebody holds */
int link_pictures_create(struct link_pictures **out);
/* A picture of this size and these planes that nobody holds; NULL: too many are held, or there is no memory. It is
 * given back by link_release(). */
struct link_picture *link_pictures_get(struct link_pictures *pictures, uint32_t width, uint32_t height,
                                       unsigned planes);
void link_pictures_unref(struct link_pictures *pictures);

/* ---- link.c ---- */

struct link_place_asked { /* by link_probe() */
	uint64_t number;      /* 0: none was */
	struct psr_camera camera;
	uint32_t width, height;
	double x, y;
};

struct link {
	pthread_t thread;
	int wake_fd, news_fd;
	struct link_pictures *pictures;
	char address[300], program[PSR_WIRE_MAX_NAME + 1];

	pthread_mutex_t lock; /* of what follows */
	struct link_box wish;
	int is_closing, is_left; /* is_left: the thread frees it all */
	int is_connecting;       /* nothing can interrupt that */
	int fd;                  /* the connection, -1: none; shut down to interrupt the thread */
	int is_opening;          /* the thread waits for a model of the wish that it took */
	int is_interrupted;      /* because its models are not wished any more */
	int is_list_asked;
	unsigned news;
	struct link_state state;
	struct link_picture *picture;
	struct link_place_asked probe_asked;
	struct link_surface surface;
	struct link_scene *scene;
	struct psr_msg_list_entry *list;
	uint32_t n_list;
	int has_list;
};

void link_say(struct link *link, unsigned news); /* with the lock held */
void link_wake(int fd);
void link_drain(int fd);
void link_set_phase(struct link *link, enum link_phase phase, const struct psr_error *why); /* NULL: no error */
void link_set_progress(struct link *link, const char *model, const struct psr_msg_progress *progress);

/* ---- link_thread.c ---- */

void *link_thread(void *link);

/* ---- link_request.c: pure; from a wish to messages ---- */

struct link_request {        /* one that was sent */
	uint32_t id;             /* 0: none */
	uint64_t wish, sent_ns, begun_ns;
	uint64_t received;       /* bytes of the connection when it began */
	uint32_t width, height;  /* of the wish */
	int is_rest, is_direct;  /* is_direct: without loss from its first frame on */
	int is_smooth;           /* as wished */
	int is_coarse;           /* as in struct link_content */
	uint8_t color_by;        /* as in struct link_picture */
	int is_cancelled;        /* by link_view_cancel() */
};

struct link_place {          /* of one instance of the scene */
	uint32_t handle, index;  /* into the wish's instances */
};

/* What colours all instances of the wish; OWN if that differs. */
uint8_t link_color_by(const struct link_wish *wish);

/* What pace is to know of the wish; `capabilities`: enum psr_cap. */
void link_pace_wish(struct pace_wish *out, const struct link_wish *wish, uint64_t capabilities);

/* The camera and the size of a request: those of the wish at rest, else larger by its overscan and a multiple of 4. */
void link_frame_view(struct psr_msg_frame *frame, const struct link_wish *wish, int is_rest);

/* The request that pace asks for. box: of the scene, for the range of depth. request->settings may become finer, where
 * the size is no multiple of its scale. is_direct: asks for the sharp frame alone. */
void link_frame(struct psr_msg_frame *frame, struct pace_request *request, const struct link_wish *wish,
                const double box_min[3], const double box_max[3], int is_direct);

/* The scene of the wish, of n places, lit for this camera. */
void link_scene_message(struct psr_msg_scene *scene, const struct link_wish *wish, const struct link_place *place,
                        uint32_t n, const struct psr_camera *camera);

/* ---- link_errand.c: something that takes long, on a thread and a connection of its own ---- */

struct link_errand_model {
	char name[PSR_WIRE_MAX_NAME + 1];
	uint32_t pixels, levels; /* for psr_client_set_resolution(), psr_client_set_levels() */
};
struct link_errand;
/* Opens the models, so that the server has them; or, without any, gets the list. wake_fd is written to at progress and
 * at the end; a copy of it is kept. MEMORY, IO. */
int link_errand_start(struct link_errand **out, const struct link *link, const struct link_errand_model *model,
                      uint32_t n, struct psr_error *err);
/* 1: it has ended, with *code and *err; 0: it goes on. progress and model (of PSR_WIRE_MAX_NAME + 1 bytes): how far. */
int link_errand_ask(struct link_errand *errand, int *code, struct psr_error *err, char *model,
                    struct psr_msg_progress *progress);
struct psr_msg_list_entry *link_errand_list(struct link_errand *errand, uint32_t *n); /* the caller's */
void link_errand_leave(struct link_errand *errand); /* it ends by itself; NULL is fine */

/* ---- link_models.c: the models of a connection ---- */

struct link_open_model {
	char name[PSR_WIRE_MAX_NAME + 1];
	uint32_t pixels;         /* that it was asked for */
	int is_all;              /* there is no more of it, though it be a beginning: its file ends early */
	struct psr_msg_opened opened; /* handle 0: not open */
	struct psr_msg_preset *preset;
	uint32_t n_presets;
};

struct link_models {
	struct psr_client *client;
	struct link *link;
	struct link_open_model *model;
	uint32_t n, capacity;
};
void link_models_fini(struct link_models *models);
struct link_open_model *link_models_find(const struct link_models *models, const char *name); /* open, or NULL */
/* Models of the wish that are to be opened, without duplicates: all that are not open, coarse; or, with is_fine, those
 * that were opened for other sizes than wish->pixels, or are the beginning of an octree: each time a step more of it.
 * The list is the caller's; *n 0: none, and NULL. MEMORY. */
int link_models_lack(struct link_errand_model **out, uint32_t *n, const struct link_models *models,
                     const struct link_wish *wish, int is_fine);
/* Returns whether each model of the wish is open for pictures of its size, and whole, or as much as there is. */
int link_models_are_fine(const struct link_models *models, const struct link_wish *wish);
/* Opens it on the connection, in the place of an open one of its name. */
int link_models_open(struct link_models *models, const struct link_errand_model *wanted, struct psr_error *err);
/* The places of the instances whose models are open, their number in *n; NULL and 0: none is, or there is no memory. */
struct link_place *link_models_place(const struct link_models *models, const struct link_wish *wish, uint32_t *n);
/* What link_scene_take() gives; NULL: no memory. */
struct link_scene *link_models_scene(const struct link_models *models, const struct link_wish *wish,
                                     const struct link_place *place, uint32_t n);

/* ---- link_serve.c: one connection, from WELCOME to its end ---- */

/* Returns why it ended: negative; PSR_ERR_CANCELLED: link_close(), or the models are not wished any more. *has_shown: a
 * picture came. */
int link_serve(struct link *link, struct psr_client *client, int *has_shown, struct psr_error *err);

/* ---- link_view.c: requests and frames of the connection's view ---- */

#define LINK_REQUESTS 64

struct link_view {
	struct link *link;
	struct psr_client *client;
	struct pace pace;
	int is_paced;            /* pace is set up */
	struct pace_wish pace_wish;
	struct link_request request[LINK_REQUESTS];
	unsigned n_requests;     /* ever */
	uint32_t newest;         /* id of the last request; 0: none */
	struct psr_msg_frame last; /* that it was */
	struct psr_msg_scene *sent, *next; /* of slot 0; of the next request */
	int has_sent;
	int needs_direct;        /* the server ended a request at rest without its sharp frame */
	uint64_t retry_ns;       /* 0: nothing failed that may be tried again */
	double retry_s;
	uint64_t n_pictures;
	struct { uint32_t id; uint16_t pass; } unacked[PSR_WIRE_MAX_UNACKED]; /* that the client could not queue yet */
	unsigned n_unacked;
};
int link_view_init(struct link_view *view, struct link *link, struct psr_client *client);
void link_view_fini(struct link_view *view);

struct link_content { /* what is drawn now */
	const struct link_wish *wish;
	uint64_t number;
	const struct link_place *place;
	uint32_t n_places;
	const double *box_min, *box_max;
	int is_coarse;           /* models of the wish, or finer ones, are still to come */
};
/* The wish, or the scene, is another one. */
void link_view_changed(struct link_view *view, const struct link_wish *wish, uint64_t now_ns);
/* Sends what is due. *again_ns: when to call again, at the latest. */
int link_view_ask(struct link_view *view, const struct link_content *content, uint64_t now_ns, uint64_t *again_ns,
                  struct psr_error *err);
/* 1: the frame's ERROR, in *why, is about the newest request; 0: all is well. */
int link_view_event(struct link_view *view, const struct psr_event *event, struct psr_error *why);
void link_view_cancel(struct link_view *view);
/* Sends the scene, if the server has another one. */
int link_view_scene(struct link_view *view, const struct link_content *content, const struct psr_camera *camera,
                    struct psr_error *err);

/* ---- link_probe.c: the surface at a place ---- */

struct link_probe {
	uint64_t number;         /* of the last one that was sent */
	uint32_t id;             /* 0: none is under way */
	uint32_t index[PSR_WIRE_MAX_INSTANCES], n_places; /* of the scene then, into the wish's instances */
};
int link_probe_ask(struct link_probe *probe, struct link_view *view, const struct link_content *content,
                   struct psr_error *err);
int link_probe_event(struct link_probe *probe, struct link *link, const struct psr_event *event); /* 1: it was its */

#endif
