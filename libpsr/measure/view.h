/* The rays of a camera's pixels ([G] 7.1, psr/scene.h). */
#ifndef PSR_MEASURE_VIEW_H
#define PSR_MEASURE_VIEW_H

#include <stdint.h>
#include "psr/error.h"
#include "psr/scene.h"

struct view {
	double eye[3], right[3], down[3], forward[3];
	double width, height;
	double pixel;       /* a pixel's width in world units; perspective: at z' = 1 */
	double near_z;
	int is_perspective;
};

/* ARG, LIMIT: as psr_scene_validate. */
int view_init(struct view *view, const struct psr_camera *camera, uint32_t width, uint32_t height,
              struct psr_error *err);

/* Makes the ray through point (x, y) of the picture, in pixels from its top left corner: world = origin + z' *
 * direction. */
void view_ray(const struct view *view, double x, double y, double origin[3], double direction[3]);

/* Returns a pixel's width in world units at depth z'. */
static inline double view_pixel(const struct view *view, double z)
{
	return view->is_perspective ? view->pixel * z : view->pixel;
}

#endif
