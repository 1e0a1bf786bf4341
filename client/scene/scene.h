/* Models and lights: options, scene files, and the scene that the server draws. */
#ifndef PSR_CLIENT_SCENE_SCENE_H
#define PSR_CLIENT_SCENE_SCENE_H

#include "instance.h"
#include "client/cli/optlist.h"
#include "psr/client.h"

#define SCENE_AMBIENT 0.15

extern const char *const scene_colors[5]; /* "intensity" and so on, by enum psr_wire_color; "" for OWN */

struct scene_wish {
	struct instance_wish *instance;
	uint32_t n_instances;
	struct psr_msg_light light[PSR_WIRE_MAX_LIGHTS];
	const char *preset_light[PSR_WIRE_MAX_LIGHTS]; /* preset's name for light[i]; NULL: light[i] is set */
	const char *light_text[PSR_WIRE_MAX_LIGHTS]; /* as the user wrote them */
	uint32_t n_lights;
	const char *lights_of; /* "model": adds all lights of the model */
	double ambient;
	uint8_t background[3];
	int is_shadowed, has_ambient;
	const char *color_by;  /* of all instances, as scene_colors names it; NULL: their own colours */
	const char *file;
	char *file_text; /* holds the strings above */
	int n_said;   /* how many of these options were given */
	uint32_t pixels; /* the greater side of the pictures */
	int64_t levels; /* for psr_client_set_levels() */
	int is_quiet; /* shows no progress on the terminal */
};

void scene_wish_init(struct scene_wish *wish);
void scene_wish_fini(struct scene_wish *wish);

/* Makes a wish of the same options, before scene_check(); their strings are the first one's. MEMORY. */
int scene_wish_copy(struct scene_wish *to, const struct scene_wish *from, struct psr_error *err);

/* Adds a model where its file puts it, as --model does. ARG: its name is too long; LIMIT, MEMORY. */
int scene_add_model(struct scene_wish *wish, const char *name, struct psr_error *err);

/* Lists --model, --instance, --scene. The options point into *wish. */
void scene_add_model_options(struct optlist *list, struct scene_wish *wish);
void scene_add_light_options(struct optlist *list, struct scene_wish *wish);

/* Reads what --color-by says, an enum psr_wire_color. NULL: OWN. ARG. */
int scene_color_parse(uint8_t *by, const char *text, struct psr_error *err);

/* Reads the scene file and checks the options together. */
int scene_check(struct scene_wish *wish, struct psr_error *err);

#define SCENE_LIGHT_HELP \
	"A light is one of\n" \
	"  dir:X,Y,Z[,...]                  X,Y,Z is the direction in which the light travels\n" \
	"  point:X,Y,Z[,...]                X,Y,Z is its position\n" \
	"  spot:X,Y,Z:TX,TY,TZ:ANGLE[,...]  position, the point it shines at, half the angle of its cone in\n" \
	"                                   degrees; the light is full within 0.9 of it\n" \
	"  preset:NAME                      a light that came with the first model (`psr list --presets`)\n" \
	"and, but for the last, followed by any of color=#rrggbb (white), intensity=I (1), shadow, and for\n" \
	"point and spot ref=R: the distance at which the intensity holds, falling with its square; without it\n" \
	"the light does not fall.\n" \
	"Without --light, --lights and --ambient there is one white light from the upper left behind the\n" \
	"camera, which moves with the camera, and ambient 0.15.\n"

struct scene_model {
	char name[PSR_WIRE_MAX_NAME + 1];
	struct psr_msg_opened opened;
};

/* A scene on a connection. */
struct scene {
	struct psr_client *client;
	struct psr_msg_scene msg;
	int has_key_light;            /* scene_light() sets light[0] */
	int is_key_shadowed;
	double box_min[3], box_max[3]; /* around all instances, in their places */
	double up[3];                 /* the first instance's natural up */
	struct scene_model *model;    /* without duplicates */
	uint32_t n_models;
	uint32_t *model_of;           /* by instance */
	struct psr_msg_preset *preset; /* the first model's, in its place */
	uint32_t n_presets;
};

/* Opens the models, shows the progress, and gets the first model's cameras and lights. NOT_FOUND suggests a name. */
int scene_open(struct scene **out, const struct scene_wish *wish, struct psr_client *client, int timeout_ms,
               struct psr_error *err);
void scene_close(struct scene *scene); /* NULL is fine */

/* Moves the key light with the camera. Returns whether the scene has one. */
int scene_light(struct scene *scene, const struct psr_camera *camera);

#endif
