/* Cameras and lights as command lines say them. */
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
	double natural_up[3]; /* of the model; used if `up` is unset; 0, 0, 0: +Y */
	double azimuth, elevation; /* has_angles: degrees about the up vector from the front to the right, and above the
	                            * horizon; the whole box is in the picture then. psr_camera_axes() says which way is
	                            * front */
	double roll;         /* degrees by which the camera is turned clockwise about its view */
	double zoom;         /* as a lens has it: 2 shows everything twice as large; 0: not said, 1 */
	uint32_t n_turn;     /* the box is to stay in the picture at so many equal turns about the up vector (see
	                      * psr_camera_turn); 0 and 1: as it is. Has no use with an eye */
	double fov_y;        /* radians; 0: orthographic */
	double ortho_height; /* world units; 0: as tall as the box needs */
};

/* Where the azimuth and the elevation are for which nobody asked, degrees. */
#define PSR_CAMERA_AZIMUTH 21.5246
#define PSR_CAMERA_ELEVATION 17.4576

/* Completes it: nothing said gives psr_camera_frame's; an eye alone looks at the middle of the box; a target alone is
 * seen from that camera's side. A natural up that runs along the view gives way to the back (-Z where +Y is up). near_z
 * is 1/1000 of the way to the far end of the box, but half of the way to its near end at most when the eye is outside
 * (orthographic: 0).
 * ARG: eye and target are the same point, up runs along the view, the zoom leaves no angle that the protocol has. */
int psr_camera_complete(struct psr_camera *camera, const struct psr_camera_wish *wish, const double box_min[3],
                        const double box_max[3], double aspect, struct psr_error *err);

/* Turns eye and up by `degrees` about the axis `up` (any length but 0) through the target, counter-clockwise seen from
 * where up points to. Perspective: near_z is chosen anew. */
void psr_camera_turn(struct psr_camera *camera, const double up[3], double degrees, const double box_min[3],
                     const double box_max[3]);

/* psr_light_key() as a message has it. */
void client_light_key(struct psr_msg_light *light, const struct psr_camera *camera);

#endif
