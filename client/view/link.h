/* A viewer's connection to psrd, held by a thread of its own: the newest wish goes in, the newest picture comes out.
 * The thread opens the models, paces the requests (client/lib/pace.h) and reconnects; when the wish rests it brings the
 * sharp picture of it, and then refined ones. No call here waits for network or server. One thread may use a link. */
#ifndef PSR_CLIENT_VIEW_LINK_H
#define PSR_CLIENT_VIEW_LINK_H

#include <stdint.h>
#include "psr/client.h"

struct link;

/* ---- in: what is wished ---- */

struct link_instance { /* world = translation + scale * rotate(rotation, object), as struct psr_msg_instance */
	char model[PSR_WIRE_MAX_NAME + 1];
	double rotation[4], translation[3], scale;
	uint8_t representation, color_by; /* enum psr_wire_rep, psr_wire_color */
};

/* link_wish_default() sets what is said here; models, camera and size are the caller's to set. */
struct link_wish {
	const struct link_instance *instance; /* the caller's, until link_wish() returns */
	uint32_t n_instances;        /* 0..PSR_WIRE_MAX_INSTANCES: 0 */
	uint32_t pixels;             /* greater side of the pictures that models are built for: 0, the server decides */
	uint32_t coarse_pixels;      /* models are opened for pictures of this size first, and for `pixels` once a picture
	                              * has come, which replaces them: 0, not so. Packed octrees come coarse first in any
	                              * case, a step after the other */

	struct psr_camera camera;
	uint32_t width, height;      /* pixels of the picture; 0 x 0: models are opened, and nothing is drawn. At most
	                              * PSR_WIRE_MAX_SIDE each */
	double overscan;             /* 1..2: 1; while the camera moves the received picture is so many times wider and
	                              * higher, with the same size of a pixel, and the same middle */

	struct psr_msg_light light[PSR_WIRE_MAX_LIGHTS];
	uint32_t n_lights;           /* 0 */
	int has_key_light;           /* light[0] is the key light of the request's camera (psr_light_key()): 1, and n_lights
	                              * 1; only its `flags` are looked at */
	double ambient;              /* 0.15 */
	uint8_t background[3];       /* sRGB: 20 24 28 in hexadecimal */

	double spacing_px;           /* 2^-6..2^6: 1 */
	int is_smooth;               /* at rest: 1 */
	int with_splats;             /* octrees as splats, in motion, too, where the server can: 0 */
	uint16_t pass_limit;         /* refinement at rest: 0 */
	uint32_t planes;             /* 1 << enum psr_plane: colour and depth. Others exclude refinement: pass_limit is 0 */

	double fps;                  /* 1..1000: 30; pictures a second while something moves */
	uint8_t least_quality, most_quality; /* JPEG, 1..100: 30, 85 */
	uint8_t most_scale;          /* 1, 2, 4: 4 */
	int is_rest;                 /* 1: the hand has let go, so the sharp picture is asked for at once: 0, and then it is
	                              * asked for when the wish has not changed for PACE_REST_NS */
};
void link_wish_default(struct link_wish *wish);

/* ---- out: what came ---- */

struct link_picture {
	struct psr_frame frame;      /* width x height as received; depth in world units (psr/frame.h) */
	struct psr_camera camera;    /* that it was drawn for; with overscan its angle is wider than the wish's */
	uint32_t width, height;      /* of the wish, which is in the middle of the frame */
	uint64_t wish;               /* number of the wish that it shows, as link_wish() returned it */
	int is_sharp;                /* the wish itself: its size and camera, full scale, without loss, and smooth if the
	                              * wish is. Nothing better comes, but finer refinement */
	int is_final;                /* and nothing at all comes until the wish changes, or finer models are there */
	int is_coarse;               /* they are to come, or models that are missing in it */
	uint8_t color_by;            /* enum psr_wire_color of all instances; OWN: they differ, too */
	struct psr_msg_frame_begin begin; /* codec, settings, level of refinement */
	struct psr_msg_frame_end end;     /* what ran, times, error bound */
	uint64_t bytes;              /* of its messages */
	uint64_t asked_ns, begun_ns, came_ns; /* of clock_ns(): when it was asked for, its first bytes came, and it was
	                              * handed over */
	uint64_t decode_ns;          /* spent on decoding, and on handing over */
};

enum link_phase {
	LINK_CONNECTING, /* for the first time */
	LINK_OPENING,    /* `model`, `stage`, `done` and `total` tell how far */
	LINK_LIVE,       /* pictures come as wished */
	LINK_REFUSED,    /* the server cannot do it, as `error` says: a wish with other models, or what was wrong, changes
	                  * that. What is short of memory or time is tried again by itself */
	LINK_LOST,       /* as `error` says; tries again at retry_ns, and brings everything back */
};

struct link_state {
	enum link_phase phase;
	struct psr_error error;      /* code PSR_OK: none */
	char model[PSR_WIRE_MAX_NAME + 1];
	struct psr_msg_progress progress; /* OPENING, or is_refining: stage, done, total; total 0: not known */
	int is_refining;             /* LIVE: finer models are being built meanwhile */
	uint64_t retry_ns;           /* LOST: of clock_ns() */
	uint32_t n_connected;        /* connections that were made */
	uint64_t n_bytes;            /* received, over all connections */
	uint64_t n_pictures;         /* received */
	double rate;                 /* bytes a second that the network was found to carry; 0: not known, or very many */
	double round_s;              /* mean seconds from request to picture while moving; 0: not known */
	char server[PSR_WIRE_MAX_NAME + 1]; /* its name and version */
	uint64_t capabilities;       /* enum psr_cap */
};

/* The models of the wish as the server opened them. */
struct link_model {
	char name[PSR_WIRE_MAX_NAME + 1];
	struct psr_msg_opened opened;
	struct psr_msg_preset *preset; /* cameras and lights that came with it, in object coordinates */
	uint32_t n_presets;
};
struct link_scene {
	uint32_t n_models;           /* without duplicates, in the order of the instances */
	struct link_model *model;
	double box_min[3], box_max[3]; /* of all instances, in their places */
	double up[3];                /* natural up of the first instance, in its place */
};

/* ---- the link ---- */

/* Starts the thread, which connects to `address` (psr/client.h) and says it is `program`. ARG: the address is none;
 * MEMORY, IO. */
int link_open(struct link **out, const char *address, const char *program, struct psr_error *err);

/* Ends everything under way. Pictures that were taken and not released stay valid. NULL is fine. */
void link_close(struct link *link);

/* Replaces the wish before; copies it. A wish that is the same as the last one changes nothing. Returns its number,
 * which rises: 1 is the first. 0: no memory for the instances, or a field is out of its range; the
 * wish before stays. */
uint64_t link_wish(struct link *link, const struct link_wish *wish);

/* Readable when something is new, until link_heard(). The link's own. */
int link_fd(const struct link *link);

enum link_news {
	LINK_NEWS_PICTURE = 1, LINK_NEWS_STATE = 2, LINK_NEWS_SCENE = 4, LINK_NEWS_LIST = 8,
	LINK_NEWS_PROBE = 16,
};
/* What is new since the last call, OR-ed. */
unsigned link_heard(struct link *link);

/* The newest picture, or NULL if none came since the last call. The caller's until link_release(), which any thread may
 * call; at most 4 are held at once, else no new one comes. NULL is fine. */
struct link_picture *link_take(struct link *link);
void link_release(struct link_picture *picture);

void link_state(struct link *link, struct link_state *state);

/* The scene of the wish once its models are open, again after each change of models; NULL: none since the last call.
 * The caller's to free. A camera can be chosen by its box. */
struct link_scene *link_scene_take(struct link *link);
void link_scene_free(struct link_scene *scene); /* NULL is fine */

/* Asks what the camera sees at a place of a picture of `size` pixels, in pixels from its top left
 * corner. The newest place counts. Returns its number, which rises; the answer comes as NEWS_PROBE. */
uint64_t link_probe(struct link *link, const struct psr_camera *camera, const uint32_t size[2], const double at[2]);
struct link_surface {
	uint64_t number;             /* of the place; 0: no answer has come */
	int has_surface;             /* 0: nothing else is set. Nothing is there, or the server does not tell */
	double normal[3];            /* of the frame's plane: world, unit length */
	uint32_t instance;           /* of the wish */
};
void link_probed(struct link *link, struct link_surface *surface); /* the last answer */

/* Asks for the list of the server's models; it comes as NEWS_LIST, also beside pictures. take: entries that the caller
 * frees (free()), NULL if none came since the last call. */
void link_list_ask(struct link *link);
struct psr_msg_list_entry *link_list_take(struct link *link, uint32_t *n_entries);

#endif
