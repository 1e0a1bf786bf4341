/* What a viewer shows, and in what light: in the words of `psr shot`, which draws the same picture from them. */
#ifndef PSR_CLIENT_VIEW_SUBJECT_H
#define PSR_CLIENT_VIEW_SUBJECT_H

#include "client/output/show.h"
#include "client/scene/quality.h"
#include "client/scene/scene.h"
#include "client/scene/view.h"
#include "hand.h"
#include "lens.h"
#include "link.h"

#define SUBJECT_INSTANCES 64
#define SUBJECT_TEXT 512

struct subject_instance {
	char text[SUBJECT_TEXT];     /* NAME[,at=...][,rotate=...][,scale=...]; a NAME with =: is_plain */
	int is_plain;                /* the text is the name alone */
	struct link_instance link;
};
struct subject_light {
	char text[SUBJECT_TEXT];     /* as --light takes it */
	struct psr_msg_light light;  /* of preset:NAME once the models are open; kind 0 before */
};

struct subject {
	struct subject_instance instance[SUBJECT_INSTANCES];
	uint32_t n_instances;
	struct subject_light light[PSR_WIRE_MAX_LIGHTS];
	uint32_t n_lights;           /* 0 with has_key_light: one light moves with the camera */
	int has_key_light, is_shadowed, wants_lights; /* wants_lights: all of the model, once it is open */
	double ambient;
	uint8_t background[3];
	uint8_t color_by;            /* of all instances: enum psr_wire_color */
	double spacing;
	int is_smooth, with_splats;
	uint16_t passes;
	const struct show *stage;    /* a picture of a stage in the place of colours; NULL: none */
	const char *stage_name;
};

/* From the options of a command line. LIMIT. */
int subject_init(struct subject *subject, const struct scene_wish *scene, const struct psr_msg_frame *quality,
                 struct psr_error *err);

/* Shows one model alone, where its file puts it; lights of its own are forgotten. ARG: no such name is possible. */
int subject_set_model(struct subject *subject, const char *name, struct psr_error *err);
int subject_add_model(struct subject *subject, const char *name, struct psr_error *err);      /* LIMIT */
/* Reads the instance again from text. */
int subject_place(struct subject *subject, uint32_t k, const char *text, struct psr_error *err);

/* The key light, which moves with the camera, becomes one that stays where it is now. */
void subject_fix_light(struct subject *subject, const struct psr_camera *camera);
/* Light k becomes this one. The cone of a spot fades from 0.9 of its angle on, as --light has it. */
void subject_set_light(struct subject *subject, uint32_t k, const struct psr_msg_light *light);
/* Reads the light again from text. ARG. */
int subject_read_light(struct subject *subject, uint32_t k, const char *text, struct psr_error *err);

/* ---- subject_move.c: by hand, as a camera sees it ---- */

/* Turns light k, a directional one or a spot, about the camera's up and right, radians; others stay. */
void subject_turn_light(struct subject *subject, uint32_t k, const struct lens *lens, double right, double down);
/* Moves light k, a point or a spot, to the right, down and nearer, pixels at its depth; others stay. */
void subject_move_light(struct subject *subject, uint32_t k, const struct lens *lens, const double by[3]);

/* Corners of the box of instance k, in its place: bit i of the corner's number is the greater side of axis i. 0: its
 * model is not open. */
int subject_instance_box(double corner[8][3], const struct subject *subject, const struct link_scene *scene,
                         uint32_t k);
/* Move instance k to the right and down, pixels at the depth of its middle; turn it about the camera's up and right
 * there, radians; scale it there. UNSUPPORTED: its name leaves no room for a place. ARG: it would leave the range. */
int subject_move_instance(struct subject *subject, const struct link_scene *scene, uint32_t k, const struct lens *lens,
                          const double by[2], struct psr_error *err);
int subject_turn_instance(struct subject *subject, const struct link_scene *scene, uint32_t k, const struct lens *lens,
                          const double by[2], struct psr_error *err);
int subject_scale_instance(struct subject *subject, const struct link_scene *scene, uint32_t k, double factor,
                           struct psr_error *err);

/* ---- subject_color.c: colours that tell a number of each point ---- */

/* Whether each of these models can be coloured by this number; what a server does not tell: by heights alone. */
int subject_has_color(const struct link_scene *scene, uint8_t color_by);
/* Colours by the next number that the models have, and after the last one as they are. scene NULL: as they are. Writes
 * what a viewer says of it. */
void subject_next_color(struct subject *subject, const struct link_scene *scene, char *note, size_t note_size);
/* UNSUPPORTED: a model of the scene does not have the number; colours are its own now. */
int subject_check_color(struct subject *subject, const struct link_scene *scene, struct psr_error *err);

/* ---- subject_octree.c ---- */

/* Whether an octree is shown: an instance that asks for its model's, or leaves it to the server, of a model without
 * blocks. scene NULL: no. */
int subject_has_octree(const struct subject *subject, const struct link_scene *scene);
/* Shows octrees as splats, or as points again; without one nothing changes. Writes what a viewer says of it. */
void subject_toggle_splats(struct subject *subject, const struct link_scene *scene, char *note, size_t note_size);

/* ---- subject.c, again ---- */

/* A camera or light that came with the first model, in its place in the scene: preset k of it. 0: there is none. */
int subject_preset(const struct subject *subject, const struct link_scene *scene, uint32_t k,
                   struct psr_msg_preset *preset);

/* The camera of the command line, in the box of the scene. NOT_FOUND: the first model has none of that name. ARG. */
int subject_camera(struct psr_camera *camera, const struct subject *subject, const struct link_scene *scene,
                   const struct view_wish *wish, double aspect, struct psr_error *err);

/* Finds the lights of the models (preset:NAME, and all of them). NOT_FOUND: one is not there; it is left out. */
int subject_resolve(struct subject *subject, const struct link_scene *scene, struct psr_error *err);

/* Sets all but camera and size. `instance` has room for SUBJECT_INSTANCES and lives until link_wish(). */
void subject_wish(const struct subject *subject, struct link_wish *wish, struct link_instance *instance);

/* The command line that draws this picture, for a shell; without -o FILE. Of server and file one is NULL: a file is
 * served by a psrd of the command's own. The caller's (free). NULL: no memory. */
char *subject_command(const struct subject *subject, const struct hand *hand, const char *server, const char *file);

#endif
