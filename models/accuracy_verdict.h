/* What a person wants to know of a comparison: is the picture right? */
#ifndef MODELS_ACCURACY_VERDICT_H
#define MODELS_ACCURACY_VERDICT_H

#include <stdint.h>
#include "measure/measure.h"
#include "psr/scene.h"

/* The bounds that a picture has to keep, as options give them; the others are the verdict's own. */
struct accuracy_bounds {
	double holes;    /* fraction of the pixels inside */
	double distance; /* spacings */
	double outside;  /* pixels */
	int has_holes, has_distance, has_outside;
};

enum accuracy_verdict { ACCURACY_PASS, ACCURACY_FAIL, ACCURACY_CAMERA };

#define ACCURACY_TEXT 512

/* A frame's depth and its comparison with the truth become a verdict and a line that gives its reasons. spacing_px: the
 * greatest distance of samples that the frame asked for, pixels.
 *
 * PASS: 1 pixel in 1,000 of those inside of the silhouette is a hole, or fewer; as few as 1 in 1,000 of those that show
 * the object are drawn more than a pixel outside of it; and 99.9 % of the pixels lie within one spacing of the samples
 * from the surface, or within spacing_px pixels at the depth of what is drawn farthest where those are wider: a sample
 * shows wherever in its pixel it falls.
 * CAMERA: fewer than half of the pixels that are drawn, or that should be, show the object in both pictures; or half of
 * those lie twice as far off: no model is so wrong, so the picture is of something else. */
enum accuracy_verdict accuracy_judge(char text[ACCURACY_TEXT], const struct psr_accuracy *accuracy,
                                     const struct accuracy_bounds *bounds, const struct psr_camera *camera,
                                     uint32_t width, uint32_t height, const float *depth, double spacing,
                                     double spacing_px);

const char *accuracy_verdict_name(enum accuracy_verdict verdict); /* "pass", "fail", "camera" */

#endif
