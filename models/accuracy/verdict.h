/* The answer to the question of a comparison: is the picture right? */
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

struct accuracy_frame {
	const struct psr_camera *camera;
	uint32_t width, height;
	const float *depth;
	double spacing;    /* of the model's samples, world units */
	double spacing_px; /* the greatest distance of samples that the frame asked for, pixels */
	int is_fine;       /* depths are those of the nearest of 2x2 sub-pixels */
};

/* A frame's depth and its comparison with the truth become a verdict and a line that gives its reasons.
 *
 * PASS needs all of these. At most 1 pixel in 1,000 inside of the silhouette is a hole. At most 1 in 1,000 of the
 * object's pixels is drawn more than a pixel outside of it. 99.9 % of the pixels lie within one spacing of the surface,
 * or within spacing_px pixels at the farthest drawn depth if that is wider: a sample may fall anywhere in its pixel.
 * To a fine picture's pixel add the way from its centre to a sub-pixel's, sqrt(2) / 4.
 * CAMERA: of the pixels that are drawn or should be, fewer than half show the object in both pictures, or half lie
 * twice as far off. No model is so wrong: the picture shows something else. */
enum accuracy_verdict accuracy_judge(char text[ACCURACY_TEXT], const struct psr_accuracy *accuracy,
                                     const struct accuracy_bounds *bounds, const struct accuracy_frame *frame);

const char *accuracy_verdict_name(enum accuracy_verdict verdict); /* "pass", "fail", "camera" */

#endif
