/* Cameras and lights as users write them on the command line. */
#ifndef PSR_CLIENT_LIB_CAMERA_H
#define PSR_CLIENT_LIB_CAMERA_H

#include "psr/client.h"

/* One light (what follows --light):
 *   dir:X,Y,Z[,option...]                the direction in which the light travels
 *   point:X,Y,Z[,option...]              a position
 *   spot:X,Y,Z:TX,TY,TZ:ANGLE[,option...] position, a point on the axis, half angle of the cone in degrees (0..90];
 *                                        full light within 0.9 of it
 * options: color=#rrggbb (white), intensity=I (1; 0..1e6), shadow, ref=R (point, spot: the distance at which the
 * intensity holds, falling with the square of the distance; without it the light does not fall). ARG. */
int psr_light_parse(struct psr_msg_light *light, const char *text, struct psr_error *err);

/* "jpeg:Q" (Q of 1..100), "lossless" or "raw". ARG. */
int psr_codec_parse(uint8_t *codec, uint8_t *quality, const char *text, struct psr_error *err);

/* A partial camera; unset fields come from the model's box. */
struct psr_camera_wish {
	int has_eye, has_target, has_up, has_angles;
	double eye[3], target[3], up[3];
	double natural_up[3]; /* the model's; used if `up` is unset; 0, 0, 0: +Y */
	double azimuth, elevation; /* if has_angles: degrees about the up vector from the front to the right, and degrees
	                            * above the horizon. The picture then shows the whole box. psr_camera_axes() tells which
	                            * side is the front */
	double roll;         /* degrees by which the camera is turned clockwise about its view */
	double zoom;         /* as of a lens: 2 shows everything twice as large; 0: unset, counts as 1 */
	uint32_t n_turn;     /* the box stays in the picture at so many equal turns about the up vector (psr_camera_turn());
	                      * 0 and 1: no turns. Ignored with an eye */
	double fov_y;        /* radians; 0: orthographic */
	double ortho_height; /* world units; 0: as tall as the box needs */
};

/* Returns the default azimuth and elevation, in degrees. */
#define PSR_CAMERA_AZIMUTH 21.5246
#define PSR_CAMERA_ELEVATION 17.4576

/* Completes the camera. With nothing set it becomes psr_camera_frame()'s; with an eye alone it looks at the middle of
 * the box; with a target alone it looks from that camera's side. A natural up that runs along the view is replaced by
 * the back (-Z where +Y is up). near_z is 1/1000 of the way to the far end of the box, but at most half of the way to
 * its near end when the eye is outside (orthographic: 0). ARG: eye and target are the same point, up runs along the
 * view, or the zoom makes an angle that the protocol excludes. */
int psr_camera_complete(struct psr_camera *camera, const struct psr_camera_wish *wish, const double box_min[3],
                        const double box_max[3], double aspect, struct psr_error *err);

/* Turns eye and up by `degrees` about the axis `up` (any length but 0) through the target, counter-clockwise as seen
 * from the tip of up. Perspective: near_z is chosen anew. */
void psr_camera_turn(struct psr_camera *camera, const double up[3], double degrees, const double box_min[3],
                     const double box_max[3]);

/* Makes psr_light_key()'s light as a message. */
void client_light_key(struct psr_msg_light *light, const struct psr_camera *camera);

#endif
