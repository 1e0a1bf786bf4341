/* What a hand does to a camera: turn, move, zoom, fly. Pure: the place of the cursor, the depth under it and the time
 * come in, a camera comes out. No window, no clock, no memory of its own.
 *
 * x and y are pixels of the picture from its top left corner (a pixel's centre is at +0.5), depth is the depth plane's:
 * world units along the view, INFINITY where nothing is, which counts as the depth of the pivot. Times are nanoseconds
 * of one monotonic clock. What would leave no valid camera changes nothing. */
#ifndef PSR_CLIENT_VIEW_HAND_H
#define PSR_CLIENT_VIEW_HAND_H

#include <stdint.h>
#include "psr/error.h"
#include "psr/view.h"

/* A camera in the words of `psr shot`, which draws the same picture from them. */
struct hand_pose {
	double eye[3], target[3], up[3]; /* --eye, --target, --up */
	double fov;                      /* --fov, degrees; 0: orthographic */
	double ortho_height;             /* --ortho */
};

enum hand_grip {
	HAND_NONE,
	HAND_ORBIT,     /* turns about the model's way up and up and down, about the pivot; a height is half a turn */
	HAND_TRACKBALL, /* turns freely about the pivot */
	HAND_PAN,       /* moves the point under the cursor with it */
	HAND_ROLL,      /* turns the picture about its middle */
	HAND_LOOK,      /* turns the head: the eye stays where it is */
};

struct hand_cursor { double x, y; };

/* The first fields are for all to read; has_inertia is for all to set, at any time. */
struct hand {
	struct hand_pose pose;
	struct psr_camera camera; /* of the pose, complete */
	double pivot[3];          /* world */
	enum hand_grip grip;      /* of the drag that is on; inertia may outlive it */
	int has_dragged;          /* 0: the grip only holds yet */
	int has_inertia;          /* 1 at first: what is let go in motion goes on, slower and slower */

	double box_min[3], box_max[3], up[3];
	uint32_t width, height;
	struct hand_cursor at;    /* the cursor, or where inertia carries it */
	double held[3];           /* the point that a pan holds, world */
	struct hand_cursor speed; /* pixels a second */
	enum hand_grip glide;     /* the grip that inertia goes on with */
	uint64_t moved_ns;        /* of the last drag, or of the last step of inertia */
	double fly[3];
	uint64_t flown_ns;
};

/* For a scene of this box and way up (any length but 0). The camera is home, of fov degrees (above 0, below 180; 0:
 * orthographic), for a picture of 1x1: after hand_set_size() call hand_home(). ARG: as psr_camera_complete(). */
int hand_init(struct hand *hand, const double box_min[3], const double box_max[3], const double up[3], double fov,
              struct psr_error *err);
void hand_set_size(struct hand *hand, uint32_t width, uint32_t height); /* pixels, at least 1 each */

/* Another box and way up, such as those of a finer build; the camera stays. */
void hand_set_box(struct hand *hand, const double box_min[3], const double box_max[3], const double up[3]);

/* ---- dragging ---- */

void hand_grab(struct hand *hand, enum hand_grip grip, struct hand_cursor at, double depth, uint64_t now_ns);
void hand_drag(struct hand *hand, struct hand_cursor at, uint64_t now_ns);
void hand_release(struct hand *hand, uint64_t now_ns);

/* ---- at once ---- */

/* Nearer by `steps` of a wheel (8 of them halve the distance; below 0: farther); the point below the cursor stays. */
void hand_zoom(struct hand *hand, struct hand_cursor at, double depth, double steps);
void hand_turn(struct hand *hand, double right, double up); /* orbits the camera to the right and up, degrees */
void hand_roll(struct hand *hand, double degrees);          /* turns the camera clockwise */
void hand_set_pivot(struct hand *hand, struct hand_cursor at, double depth); /* depth INFINITY: changes nothing */
void hand_home(struct hand *hand);
/* All of the model from this side, see psr_camera_wish; the pivot is its middle. */
void hand_look_from(struct hand *hand, double azimuth, double elevation);
void hand_set_camera(struct hand *hand, const struct psr_camera *camera); /* near_z is chosen anew */
void hand_set_pose(struct hand *hand, const struct hand_pose *pose);
/* From perspective to orthographic and back; what is as far as the pivot keeps its size. */
void hand_toggle_ortho(struct hand *hand);

/* ---- with the time ---- */

/* Flies to the right, up and forwards, each -1..1, until told otherwise; 1 crosses the model in four seconds. */
void hand_fly(struct hand *hand, const double direction[3]);

/* Flies, and goes on by inertia, up to now. 1: the camera has changed. */
int hand_tick(struct hand *hand, uint64_t now_ns);
/* A drag, inertia or a flight is on. A hand that only holds is at rest, so a click reads a picture at rest. */
int hand_is_moving(const struct hand *hand);
void hand_stop(struct hand *hand); /* ends them */

/* ---- places ---- */

void hand_point(const struct hand *hand, struct hand_cursor at, double depth, double point[3]);
/* 0: the point is behind the eye. *depth may be NULL. */
int hand_project(const struct hand *hand, const double point[3], struct hand_cursor *at, double *depth);

#endif
