/* octree_closed MODEL.psr SOURCE: whether pictures of an octree have holes, or show what lies behind a surface. Draws
 * the middle of the model from the twelve corners of an icosahedron, and along its axes, turned by 45 degrees, so that
 * its leaves are half a pixel to four wide, with perspective and without, and compares with rays through SOURCE. Prints
 * a line for each width; exits with 1 if any pixel inside is a hole or a leak. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"
#include "measure/measure.h"
#include "model/cubes.h"
#include "psr/render.h"

#define SIDE 96
#define RAYS 3
#define N_THREADS 2
#define DISTANCE 4 /* of the eye, in radii */
#define GOLDEN 1.618033988749895

/* Around where levels change, at 0.93 pixels, and depth buffers, at 1 / sqrt 2 and its doubles. */
static const double widths[] = { 0.5, 0.72, 0.9, 1, 1.3, 1.5, 2.7, 4 };
#define N_CORNERS 12
#define N_VIEWS (N_CORNERS + 3)
static const double from[N_VIEWS][3] = {
	{ 0, 1, GOLDEN }, { 0, 1, -GOLDEN }, { 0, -1, GOLDEN }, { 0, -1, -GOLDEN },
	{ 1, GOLDEN, 0 }, { 1, -GOLDEN, 0 }, { -1, GOLDEN, 0 }, { -1, -GOLDEN, 0 },
	{ GOLDEN, 0, 1 }, { -GOLDEN, 0, 1 }, { GOLDEN, 0, -1 }, { -GOLDEN, 0, -1 },
	{ 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, -1 },
};

static void stop(const char *why)
{
	fprintf(stderr, "octree_closed: %s\n", why);
	exit(3);
}

/* Looks so that a picture's height is this many world units where the model's middle is. */
static void look(struct psr_camera *camera, const struct psr_model_info *info, int view, double height)
{
	const double away = DISTANCE * info->scale;
	double unit[3];

	*camera = (struct psr_camera){ .up = { 0.1, 0.3, 1 },
		                           .kind = view & 1 ? PSR_CAMERA_ORTHOGRAPHIC : PSR_CAMERA_PERSPECTIVE,
		                           .fov_y = 2 * atan(height / (2 * away)), .ortho_height = height };
	if (view >= N_CORNERS)
		v3d_set(camera->up, from[view][0] == 0, from[view][1] == 0, from[view][2] == 0);
	v3d_normalize(unit, from[view]);
	memcpy(camera->target, info->origin, sizeof camera->target);
	v3d_add_scaled(camera->eye, camera->target, away, unit);
}

struct closed {
	struct psr_source *source;
	struct psr_instance instance;
	struct psr_renderer *renderer;
	struct psr_pool *pool;
	struct psr_frame frame;
	struct psr_source_planes truth;
	double edge;
};

static uint64_t check(const struct closed *c, double width)
{
	const struct psr_model_info *info = psr_model_info(c->instance.model);
	uint64_t n_inside = 0, n_holes = 0, n_leaks = 0, n_samples = 0;
	struct psr_error err;

	for (int view = 0; view < N_VIEWS; view++) {
		struct psr_scene scene = { .instance = &c->instance, .n_instances = 1, .ambient = { 1, 1, 1 } };
		struct psr_frame frame = c->frame;
		struct psr_settings settings;
		struct psr_errors errors;

		look(&scene.camera, info, view, SIDE * c->edge / width);
		psr_settings_default(&settings, SIDE, SIDE);
		const struct psr_source_shot shot = { c->source, &scene, SIDE, SIDE, RAYS, N_THREADS };
		if (psr_render(c->renderer, &scene, &settings, c->pool, &frame, &err) != PSR_OK
		    || psr_source_draw(&shot, &c->truth, &err) != PSR_OK
		    || psr_errors_measure(&errors, &frame, &c->truth, sqrt(3) * c->edge, &err) != PSR_OK)
			stop(err.text);
		n_inside += errors.n_inside;
		n_holes += errors.n_holes;
		n_leaks += errors.n_leaks;
		n_samples += frame.report.n_samples_drawn;
	}
	printf("%g pixels a leaf: %llu holes and %llu leaks of %llu pixels inside, %.1f samples a pixel\n", width,
	       (unsigned long long)n_holes, (unsigned long long)n_leaks, (unsigned long long)n_inside,
	       (double)n_samples / (double)n_inside);
	return n_holes + n_leaks;
}

int main(int argc, char **argv)
{
	struct closed c = { .instance = { .rotation = { 0, 0, 0, 1 }, .scale = 1, .representation = PSR_OCTREE } };
	const size_t n = (size_t)SIDE * SIDE;
	struct psr_model *model;
	struct psr_mesh *mesh;
	struct psr_error err;
	uint64_t n_wrong = 0;

	if (argc != 3)
		stop("two files are needed, MODEL.psr SOURCE");
	if (psr_model_read(&model, argv[1], &err) != PSR_OK || psr_mesh_import(&mesh, argv[2], NULL, &err) != PSR_OK
	    || psr_source_create(&c.source, mesh, &err) != PSR_OK || psr_renderer_create(&c.renderer, &err) != PSR_OK
	    || psr_pool_create(&c.pool, N_THREADS, &err) != PSR_OK
	    || psr_frame_alloc(&c.frame, SIDE, SIDE, 1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH, &err) != PSR_OK)
		stop(err.text);
	if (psr_model_make_cubes(model, &err) != PSR_OK)
		stop(err.text);
	if (psr_model_cubes(model) == NULL)
		stop("the model has no octree");
	c.instance.model = model;
	c.edge = psr_model_cubes(model)->level[0].edge * psr_model_info(model)->scale;
	c.truth = (struct psr_source_planes){ .rgb = malloc(n * sizeof *c.truth.rgb),
		                                  .coverage = malloc(n * sizeof *c.truth.coverage),
		                                  .depth = malloc(n * sizeof *c.truth.depth),
		                                  .range = malloc(n * sizeof *c.truth.range) };
	if (c.truth.rgb == NULL || c.truth.coverage == NULL || c.truth.depth == NULL || c.truth.range == NULL)
		stop("no memory for pictures");
	for (unsigned i = 0; i < sizeof widths / sizeof *widths; i++)
		n_wrong += check(&c, widths[i]);
	return n_wrong > 0;
}
