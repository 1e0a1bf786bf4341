/* A scene: instances of models, a camera, lights. Plain data that the caller owns, in doubles.
 *
 * Object and world space are right-handed, +Y up. Camera space is [G] 7.1: the eye at the origin looking along +z; with
 * forward = target - eye, the picture's right is forward x up and its down is forward x right. Depth is z' in world
 * units along the view axis. Pixel centres are at +0.5, (0,0) is the top left pixel. */
#ifndef PSR_SCENE_H
#define PSR_SCENE_H

#include <stdint.h>
#include "error.h"
#include "model.h"
#include "tint.h"
#include "view.h"

#ifdef __cplusplus
extern "C" {
#endif

#define PSR_MAX_INSTANCES 1024
#define PSR_MAX_LIGHTS 32

/* How a model is drawn. Automatic: as blocks if it has any, else as an octree if it has one, else as differential
 * points. Blocks are nearest to the truth, and of closed surfaces the fastest (`psr-study octree`; octrees of plants
 * are faster). A choice by what a view needs would have pictures jump while the camera moves. */
enum psr_representation { PSR_AUTOMATIC, PSR_BLOCKS, PSR_OCTREE, PSR_DPOINTS };

/* world = translation + scale * rotate(rotation, object) */
struct psr_instance {
	const struct psr_model *model;
	double rotation[4];  /* unit quaternion x, y, z, w */
	double translation[3];
	double scale;        /* > 0 */
	enum psr_representation representation;
	/* Other than OWN: light does not change the colours, they only darken towards the rims of surfaces. INTENSITY,
	 * CLASS and RETURN are of octrees that keep this stream of their scan. */
	enum psr_color_by color_by;
};

struct psr_scene {
	const struct psr_instance *instance;
	uint32_t n_instances;
	const struct psr_light *light;
	uint32_t n_lights;
	double ambient[3];    /* linear */
	double background[3]; /* linear */
	struct psr_camera camera;
};

/* Checks all ranges above: PSR_ERR_ARG or LIMIT with a sentence that names the field. */
int psr_scene_validate(const struct psr_scene *scene, struct psr_error *err);

/* Tells what the instances that are coloured by a stream of their scan have of it together, as a legend shows it: one
 * range of intensities for all. The scene must be valid. */
void psr_scene_scan(struct psr_scan *scan, const struct psr_scene *scene);

/* Sets a camera that shows the whole box from a little to the right and above of the front, with a vertical angle of
 * fov_y radians (0: orthographic) and an aspect of width / height. `up` has any length but 0; camera->up gets it with
 * length 1. Right is +x unless up is within 25 degrees of it (then +y), and the front is right x up: +z where +y is up,
 * -y where +z is up. */
void psr_camera_frame(struct psr_camera *camera, const double box_min[3], const double box_max[3], const double up[3],
                      double fov_y, double aspect);

/* Finds the axes of an object with this way up, orthonormal: right, up, front. */
void psr_camera_axes(double axes[3][3], const double up[3]);

/* Sets a white directional light from behind the camera, above it and to its left. */
void psr_light_key(struct psr_light *light, const struct psr_camera *camera);

#ifdef __cplusplus
}
#endif
#endif
