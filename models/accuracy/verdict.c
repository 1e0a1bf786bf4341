#include "verdict.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include "base/stats.h"

#define PART 0.001     /* of the pixels may be wrong */
#define CAMERA_PART 0.5
#define CAMERA_FACTOR 2

struct limits {
	double holes, distance;
	uint64_t outside;
};

/* World width of a pixel at the 99th percentile of the drawn depths, and the number of drawn pixels. A few wild depths
 * do not count; the other bounds see them. */
static double find_pixel(uint64_t *n_drawn, const struct accuracy_frame *frame)
{
	const struct psr_camera *camera = frame->camera;
	const size_t n = (size_t)frame->width * frame->height;
	double *drawn = malloc(sizeof *drawn * n);
	double z = 0;

	*n_drawn = 0;
	for (size_t i = 0; i < n; i++) {
		if (!isfinite(frame->depth[i]))
			continue;
		if (drawn != NULL)
			drawn[*n_drawn] = (double)frame->depth[i];
		++*n_drawn;
	}
	if (drawn != NULL) {
		stats_sort(drawn, *n_drawn);
		z = stats_percentile(drawn, *n_drawn, 0.99);
	}
	free(drawn);
	return (camera->kind == PSR_CAMERA_PERSPECTIVE ? 2 * tan(camera->fov_y / 2) * z : camera->ortho_height)
	       / frame->height;
}

static enum accuracy_verdict fail_camera(char text[ACCURACY_TEXT], const struct psr_accuracy *a, uint64_t n_drawn,
                                         double allowed)
{
	double part = (double)a->n_compared / (double)(n_drawn > a->n_truth ? n_drawn : a->n_truth);

	if (a->n_truth == 0 || n_drawn == 0 || part < CAMERA_PART)
		snprintf(text, ACCURACY_TEXT,
		         "the camera seems wrong: the frame shows something in %" PRIu64 " pixels, SOURCE shows from there in %" PRIu64
		         ", and only %" PRIu64 " are the same; give the camera of the frame (--report), and the SOURCE of its model",
		         n_drawn, a->n_truth, a->n_compared);
	else
		snprintf(text, ACCURACY_TEXT,
		         "the camera seems wrong: half of the pixels are more than %.2f spacings from the surface of SOURCE, where "
		         "%.2f is good; give the camera of the frame (--report), and the SOURCE of its model",
		         a->distance_p50, allowed);
	return ACCURACY_CAMERA;
}

enum accuracy_verdict accuracy_judge(char text[ACCURACY_TEXT], const struct psr_accuracy *a,
                                     const struct accuracy_bounds *bounds, const struct accuracy_frame *frame)
{
	uint64_t n_drawn;
	const double pixel = find_pixel(&n_drawn, frame) / frame->spacing;
	const double allowed = fmax(1, frame->spacing_px * pixel) + (frame->is_fine ? M_SQRT2 / 4 * pixel : 0);
	const struct limits limits = {
		.holes = bounds->has_holes ? bounds->holes : PART,
		.distance = bounds->has_distance ? bounds->distance : allowed,
		.outside = bounds->has_outside ? (uint64_t)bounds->outside : (uint64_t)(PART * (double)a->n_truth),
	};
	double most = (double)(n_drawn > a->n_truth ? n_drawn : a->n_truth);
	int is_good = (double)a->n_holes <= limits.holes * (double)a->n_inside && a->distance_p999 <= limits.distance
	              && a->n_outside_drawn <= limits.outside;

	if (a->n_truth == 0 || (double)a->n_compared < CAMERA_PART * most || a->distance_p50 > CAMERA_FACTOR * allowed)
		return fail_camera(text, a, n_drawn, allowed);
	snprintf(text, ACCURACY_TEXT,
	         "%s: %" PRIu64 " holes in %" PRIu64 " pixels (%.0f may be), 99.9 %% within %.2f spacings of the surface (%.2f may "
	         "be), %" PRIu64 " pixels drawn outside (%" PRIu64 " may be)",
	         is_good ? "PASS" : "FAIL", a->n_holes, a->n_inside, floor(limits.holes * (double)a->n_inside),
	         a->distance_p999, limits.distance, a->n_outside_drawn, limits.outside);
	return is_good ? ACCURACY_PASS : ACCURACY_FAIL;
}

const char *accuracy_verdict_name(enum accuracy_verdict verdict)
{
	static const char *const names[] = { "pass", "fail", "camera" };

	return names[verdict];
}
