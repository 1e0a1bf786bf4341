#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include "base/stats.h"
#include "base/vec.h"
#include "budget.h"
#include "report.h"

#define BOUND_RUNGS 6 /* those without passes: the depth of a refined pixel is that of any of its sub-pixels */
#define TARGET_RATIO 2
#define AWAY 20 /* pictures high: the object is before the eye, and floats still tell depths apart */

/* The same picture of the target by parallel rays: a pixel is as wide everywhere. Returns its width, world units. */
static double flatten(struct psr_camera *camera, uint32_t height)
{
	double to[3], distance;

	v3d_sub(to, camera->target, camera->eye);
	distance = v3d_length(to);
	camera->kind = PSR_CAMERA_ORTHOGRAPHIC;
	camera->ortho_height = 2 * distance * tan(camera->fov_y / 2);
	camera->fov_y = 0;
	v3d_add_scaled(camera->eye, camera->target, -AWAY * camera->ortho_height / distance, to);
	return camera->ortho_height / height;
}

/* The 99.9th percentile of the pixels' bounds. */
static double most_of_plane(const struct psr_frame *picture)
{
	const size_t n_pixels = (size_t)picture->width * picture->height;
	double *bound = report_alloc(n_pixels, sizeof *bound), most;
	size_t n = 0;

	for (size_t i = 0; i < n_pixels; i++)
		if (isfinite(picture->depth[i]))
			bound[n++] = picture->bound[i] / (double)PSR_BOUND_ONE;
	stats_sort(bound, n);
	most = n > 0 ? stats_percentile(bound, n, 0.999) : 0;
	free(bound);
	return most;
}

static void measure(struct budget_bounds *bounds, const struct psr_event *event, const struct psr_truth_shot *shot,
                    double pixel)
{
	const double bound = event->end->error_px, plane = most_of_plane(event->picture);
	struct psr_accuracy accuracy;
	struct psr_error err;

	if (psr_accuracy_measure(&accuracy, shot, event->picture->depth, pixel, &err) != PSR_OK)
		report_die("a picture", err.text);
	if (accuracy.n_compared == 0)
		return;
	bounds->n_frames++;
	bounds->n_broken += accuracy.distance_max > bound;
	bounds->ratio = realloc(bounds->ratio, (bounds->n + 1) * sizeof *bounds->ratio);
	bounds->plane = realloc(bounds->plane, (bounds->n + 1) * sizeof *bounds->plane);
	if (bounds->ratio == NULL || bounds->plane == NULL)
		report_die("figures", "have no memory");
	bounds->ratio[bounds->n] = bound / accuracy.distance_p999;
	bounds->plane[bounds->n++] = plane / accuracy.distance_p999;
	printf("    bound %7.3f px  plane 99.9 %% %7.3f  distances 99.9 %% %7.3f  most %7.3f%s\n", bound, plane,
	       accuracy.distance_p999, accuracy.distance_max, accuracy.distance_max > bound ? "  BROKEN" : "");
}

void budget_bound(struct budget_bounds *bounds, const char *address, const char *model, const struct ladder_view *view,
                  struct psr_truth *truth)
{
	struct budget_link link;

	budget_link_open(&link, address, model, view);
	printf("%s, bounds\n", model);
	for (uint32_t r = 0; r < BOUND_RUNGS; r++) {
		printf("  rung %u\n", r);
		for (uint32_t v = 0; v < BUDGET_VIEWS; v++) {
			struct psr_msg_frame frame;
			struct psr_event event;

			budget_link_request(&frame, &link, v);
			frame.settings = budget_rungs[r];
			frame.width /= frame.settings.scale; /* what a scale draws, without enlarging it */
			frame.height /= frame.settings.scale;
			frame.settings.scale = 1;
			const double pixel = flatten(&frame.camera, frame.height);
			const struct psr_truth_shot shot = { truth, &frame.camera, frame.width, frame.height, 0 };

			frame.planes |= 1u << PSR_PLANE_DEPTH | 1u << PSR_PLANE_BOUND;
			frame.depth_format = PSR_WIRE_DEPTH_F32;
			frame.depth_codec = PSR_CODEC_RAW;
			frame.budget = PSR_WIRE_BUDGET_SETTINGS;
			budget_link_draw(&event, &link, &frame);
			measure(bounds, &event, &shot, pixel);
		}
	}
	budget_link_close(&link);
	fflush(stdout);
}

void budget_bound_print(struct budget_bounds *bounds)
{
	if (bounds->n == 0)
		return;
	report_target("frames whose geometric bound is broken", (double)bounds->n_broken, "", REPORT_AT_MOST, 0);
	report_target("bound over 99.9th percentile, median", stats_median(bounds->ratio, bounds->n), "x", REPORT_AT_MOST,
	              TARGET_RATIO);
	report_target("plane of bounds, its 99.9th percentile over that of distances, median",
	              stats_median(bounds->plane, bounds->n), "x", REPORT_AT_MOST, TARGET_RATIO);
	free(bounds->ratio);
	free(bounds->plane);
}
