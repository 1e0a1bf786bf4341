/* Where points of the world are in a camera's picture, and back. Pixels count from the top left corner; a pixel's
 * centre is at +0.5. Depth is z', world units along the view ([G] 7.1). */
#ifndef PSR_CLIENT_VIEW_LENS_H
#define PSR_CLIENT_VIEW_LENS_H

#include <stdint.h>
#include "psr/view.h"

struct lens {
	double eye[3], right[3], up[3], forward[3]; /* the last three are orthonormal */
	double width, height;                       /* pixels */
	double tangent;     /* of half the angle from top to bottom; 0: orthographic */
	double ortho_height;
};
void lens_init(struct lens *lens, const struct psr_camera *camera, double width, double height);

double lens_pixel(const struct lens *lens, double depth); /* world units a pixel */
void lens_point(const struct lens *lens, double x, double y, double depth, double point[3]);
/* 0: the point is not before the eye, so it is nowhere in the picture. *depth may be NULL. */
int lens_project(const struct lens *lens, const double point[3], double at[2], double *depth);

#endif
