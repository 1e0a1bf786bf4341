/* Cameras from options and camera files. */
#ifndef PSR_CLIENT_SCENE_VIEW_H
#define PSR_CLIENT_SCENE_VIEW_H

#include "client/cli/optlist.h"
#include "client/lib/camera.h"
#include "psr/client.h"
#include "scene.h"

struct view_wish {
	struct psr_camera_wish camera;
	double fov; /* degrees */
	int has_fov, has_ortho, has_azimuth, has_elevation, has_roll, has_zoom;
	const char *view;   /* front, ..., or NULL */
	const char *preset; /* name of the model's camera, or NULL */
};

void view_wish_init(struct view_wish *wish);
void view_add_options(struct optlist *list, struct view_wish *wish);

/* Finds azimuth and elevation, in degrees, of a side: front, back, left, right, top, bottom, iso or home. Returns 0 for
 * any other name. */
int view_side(const char *name, double angles[2]);

/* Returns whether any camera option was given. */
int view_is_said(const struct view_wish *wish);

/* The cameras of a command line: a single one, or one for each of --view front,left,..., or one for each line of a
 * file. A line's options come on top of the command line's. */
struct views {
	struct view_wish *wish;
	uint32_t n;
	char *text; /* holds the strings of the wishes */
};

#define VIEWS_MAX 100000

/* Makes the cameras and checks them. `file` may be NULL. ARG, LIMIT, and the errors of wordfile_read(). */
int views_make(struct views *views, const struct view_wish *wish, const char *file, struct psr_error *err);
void views_fini(struct views *views);

/* Checks the wish, unless views_make() did, for one camera. ARG. */
int view_check(struct view_wish *wish, struct psr_error *err);

/* Places the camera in the scene. n_turn: the scene stays in the picture at so many equal turns; 0: no turns. */
int view_place(struct psr_camera *camera, const struct view_wish *wish, const struct scene *scene, double aspect,
               uint32_t n_turn, struct psr_error *err);

/* Places all cameras of the wishes; with n_turn > 0 the only one, and n_turn - 1 more that go around the scene. */
int views_place(struct psr_camera *camera, const struct views *views, const struct scene *scene, double aspect,
                uint32_t n_turn, struct psr_error *err);

/* Returns the axis of turns: --up, the model's natural up, or +Y. */
void view_up(double up[3], const struct view_wish *wish, const struct scene *scene);

#endif
