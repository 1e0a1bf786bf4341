#include "notes.h"
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "base/vec.h"

#define ROUGH 1.5 /* pixels between samples; a smaller distance looks no better */
#define GRID 16
#define MOST 8192 /* largest resolution of psr-model build */
#define DRAFT 2  /* pixels of --spacing: from here on the user asked for a coarse picture */
#define STEP 128  /* of advised resolutions */

/* Finds p in the camera's frame: right, up, forward. */
static void project(double out[3], const struct psr_camera *camera, const double p[3])
{
	double forward[3], right[3], up[3], arm[3];

	v3d_sub(forward, camera->target, camera->eye);
	v3d_normalize(forward, forward);
	v3d_cross(right, forward, camera->up);
	v3d_normalize(right, right);
	v3d_cross(up, right, forward);
	v3d_sub(arm, p, camera->eye);
	v3d_set(out, v3d_dot(arm, right), v3d_dot(arm, up), v3d_dot(arm, forward));
}

/* Returns the size of a pixel at depth z, in world units. */
static double pixel_at(const struct psr_camera *camera, double z, uint32_t height)
{
	if (camera->kind == PSR_CAMERA_ORTHOGRAPHIC)
		return camera->ortho_height / height;
	return 2 * z * tan(camera->fov_y / 2) / height;
}

static void corner_of(double out[3], const double box_min[3], const double box_max[3], int corner)
{
	for (int i = 0; i < 3; i++)
		out[i] = corner >> i & 1 ? box_max[i] : box_min[i];
}

/* Whether a point in the frame of the camera is inside of the picture. */
static int is_in_picture(const struct psr_camera *camera, const double seen[3], double aspect)
{
	double half = camera->kind == PSR_CAMERA_ORTHOGRAPHIC ? camera->ortho_height / 2 : seen[2] * tan(camera->fov_y / 2);

	return seen[2] >= camera->near_z && seen[2] > 0 && fabs(seen[1]) <= half && fabs(seen[0]) <= half * aspect;
}

/* Returns the depth of the nearest visible point of a grid on the faces of the model's box, whose nearest corner is
 * often outside of the picture. INFINITY: none is visible. */
static double nearest_depth(const struct scene *scene, uint32_t instance, const struct psr_camera *camera,
                            double aspect)
{
	const struct psr_msg_opened *opened = &scene->model[scene->model_of[instance]].opened;
	double nearest = INFINITY;

	for (int face = 0; face < 6; face++) {
		for (int at = 0; at < (GRID + 1) * (GRID + 1); at++) {
			const double part[3] = { face % 2, (double)(at % (GRID + 1)) / GRID, (double)(at / (GRID + 1)) / GRID };
			double p[3], seen[3];

			for (int i = 0; i < 3; i++) {
				int axis = (face / 2 + i) % 3;

				p[axis] = opened->box_min[axis] * (1 - part[i]) + opened->box_max[axis] * part[i];
			}
			instance_apply(p, &scene->msg.instance[instance], p);
			project(seen, camera, p);
			if (is_in_picture(camera, seen, aspect))
				nearest = fmin(nearest, seen[2]);
		}
	}
	return nearest;
}

/* Returns a lower bound of that depth; 0: the box reaches behind the camera. */
static double depth_before(const struct scene *scene, uint32_t instance, const struct psr_camera *camera)
{
	const struct psr_msg_opened *opened = &scene->model[scene->model_of[instance]].opened;
	double depth = INFINITY, p[3], seen[3];

	for (int corner = 0; corner < 8; corner++) {
		corner_of(p, opened->box_min, opened->box_max, corner);
		instance_apply(p, &scene->msg.instance[instance], p);
		project(seen, camera, p);
		depth = fmin(depth, seen[2]);
	}
	return fmax(depth, 0);
}

static double apart_at(const struct scene *scene, uint32_t i, const struct psr_camera *camera, double z,
                       uint32_t height)
{
	const struct psr_msg_opened *opened = &scene->model[scene->model_of[i]].opened;

	return opened->spacing * scene->msg.instance[i].scale / pixel_at(camera, z, height);
}

double notes_magnification(const struct scene *scene, uint32_t i, const struct psr_camera *camera, uint32_t width,
                           uint32_t height)
{
	double z = nearest_depth(scene, i, camera, (double)width / height);

	return z < INFINITY ? apart_at(scene, i, camera, z, height) : 0;
}

static const char *why_empty(const struct scene *scene, const struct psr_camera *camera)
{
	int n_before = 0;

	for (int corner = 0; corner < 8; corner++) {
		double p[3], seen[3];

		corner_of(p, scene->box_min, scene->box_max, corner);
		project(seen, camera, p);
		n_before += seen[2] > camera->near_z;
	}
	return n_before == 0 ? "the camera looks away from it; say --target, or leave --eye out"
	                     : "the camera looks past it; say --target, or leave --eye out";
}

static int is_empty(const struct psr_msg_frame_end *end)
{
	for (unsigned i = 0; i < end->n_entries; i++)
		if (end->entry[i].id == PSR_WIRE_REPORT_PIXELS_COVERED)
			return end->entry[i].count == 0;
	return 0;
}

void notes_add(struct notes *notes, const struct scene *scene, const struct psr_msg_frame *asked,
               const struct psr_event *event)
{
	const struct psr_camera *camera = &event->begin->camera;

	notes->n_pictures++;
	notes->n_over += event->end->status != PSR_WIRE_FRAME_OK;
	if (is_empty(event->end)) {
		notes->n_empty++;
		notes->why_empty = why_empty(scene, camera);
	}
	if (event->end->pass < asked->pass_limit) {
		notes->least_pass = notes->n_fewer_passes == 0 || event->end->pass < notes->least_pass ? event->end->pass
		                                                                                       : notes->least_pass;
		notes->n_fewer_passes++;
	}
	for (uint32_t i = 0; i < scene->msg.n_instances; i++) {
		double apart, most = apart_at(scene, i, camera, depth_before(scene, i, camera), asked->height);

		if (most <= fmax(notes->coarsest, ROUGH)) /* true of most instances of most scenes */
			continue;
		apart = notes_magnification(scene, i, camera, asked->width, asked->height);
		if (apart <= notes->coarsest)
			continue;
		notes->coarsest = apart;
		notes->coarsest_model = &scene->model[scene->model_of[i]];
	}
}

void notes_print(const struct notes *notes, const char *program, const struct psr_msg_frame *asked)
{
	const struct scene_model *model = notes->coarsest_model;

	if (notes->n_empty > 0) {
		if (notes->n_pictures > 1)
			fprintf(stderr, "%s: nothing of the model is in %u of %u pictures: %s\n", program, notes->n_empty,
			        notes->n_pictures, notes->why_empty);
		else
			fprintf(stderr, "%s: nothing of the model is in the picture: %s\n", program, notes->why_empty);
	}
	if (notes->n_fewer_passes > 0)
		fprintf(stderr, "%s: the server stopped at pass %u of %u: the picture is less smooth than asked for\n", program,
		        notes->least_pass, asked->pass_limit);
	if (notes->n_over > 0 && notes->n_pictures > 1)
		fprintf(stderr, "%s: %u of %u pictures are over the budget\n", program, notes->n_over, notes->n_pictures);
	/* Differential points have no resolution. */
	if (model != NULL && model->opened.representations != 1u << PSR_WIRE_REP_DPOINT && notes->coarsest > ROUGH
	    && asked->settings.spacing_px < DRAFT) {
		double resolution = ceil(notes->coarsest * model->opened.resolution / STEP) * STEP;

		if (model->opened.octree_levels < model->opened.of_levels)
			fprintf(stderr, "%s: %s has %u of its %u levels, for %u pixels; edges will look rough here without the others: "
			        "raise --level, or leave it out\n", program, model->name, model->opened.octree_levels,
			        model->opened.of_levels, model->opened.resolution);
		else if (!(model->opened.representations >> PSR_WIRE_REP_BLOCKS & 1))
			fprintf(stderr, "%s: %s is an octree for %u pixels; edges will look rough here; %.0f more --levels help "
			        "if its file is finer\n", program, model->name, model->opened.resolution, ceil(log2(notes->coarsest)));
		else if (resolution <= MOST)
			fprintf(stderr, "%s: %s is sampled for %u pixels; edges will look rough here; build it with -r %.0f\n",
			        program, model->name, model->opened.resolution, resolution);
		else
			fprintf(stderr, "%s: %s is sampled for %u pixels; from so near its edges look rough\n", program,
			        model->name, model->opened.resolution);
	}
}
