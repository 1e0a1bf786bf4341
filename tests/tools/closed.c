/* closed MODEL.psr SOURCE [SIDE [RAYS [ZOOM]]]: whether stills show what is behind a surface. Draws the middle of the
 * model, ZOOM times as large, in five views and all passes on a red and on a blue background, lit by ambient light
 * alone; the last pass, which takes three quarters of the time of all, in two of them. Of pixels at least four pixels
 * inside of what pass 0 covers, blended surfaces apart, it counts those whose colour depends on the background, and of
 * these those that are torn: all rays around them, as far as the samples may be wrong about an edge, meet the source,
 * and there is no veil as near as that, which is to let light through (thin.h). RAYS x RAYS rays, or one a pixel if
 * these are more. Prints a line for each view and pass; exits with 1 if any pixel is torn. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "measure/truth.h"
#include "model/blocks.h"
#include "render/stages.h"

#define INSIDE 4
#define VIEWS 5
#define LAST_PASS_VIEWS 2
#define MOST_RAYS 128

static const double direction[VIEWS][3] = {
	{ 0.45, 0.35, 1 }, { -1, 0.25, 0.4 }, { 0.15, 1, 0.3 }, { 0.7, -0.4, -0.8 }, { -0.3, 0.05, -1 },
};

struct closed {
	struct psr_instance instance;
	struct psr_scene scene;
	struct render_settings settings;
	struct psr_renderer *renderer;
	struct refiner *refiner;
	struct psr_pool *pool;
	struct psr_mesh *mesh;
	struct psr_truth *truth;
	struct psr_frame frame[2]; /* one a background */
	struct psr_frame bare;     /* as the second, without veils */
	struct psr_blocks *blocks;
	const uint8_t *opacity;    /* of the blocks */
	uint8_t *no_veils;         /* the same, but 0 in thin blocks; NULL: none is thin */
	float *depth;              /* of pass 0, */
	uint32_t *id;              /* behind blended surfaces: UINT32_MAX without a sample, */
	uint8_t *weight;           /* and then 255 without a fill */
	uint8_t *is_solid, *is_inside;
	uint32_t side, rays;
	double zoom;
	double spacing; /* of samples, in the source's units */
};

static void die(const char *what)
{
	fprintf(stderr, "closed: %s\n", what);
	exit(3);
}

static void *room(size_t size)
{
	void *p = malloc(size);
	if (!p)
		die("no memory");
	return p;
}

static void look_from(struct closed *c, const struct psr_model_info *info, const double from[3])
{
	struct psr_camera *camera = &c->scene.camera;
	const double length = sqrt(from[0] * from[0] + from[1] * from[1] + from[2] * from[2]);
	*camera = (struct psr_camera){ .up = { 0, fabs(from[1]) > 0.9 ? 0 : 1, fabs(from[1]) > 0.9 ? 1 : 0 },
		                           .kind = PSR_CAMERA_PERSPECTIVE, .fov_y = 2 * atan(tan(0.3) / c->zoom) };
	for (int k = 0; k < 3; k++) {
		camera->target[k] = (info->box_min[k] + info->box_max[k]) / 2;
		camera->eye[k] = camera->target[k] + from[k] / length * info->scale / sin(0.3) * 0.9;
	}
}

/* Copies the opacities, if a block is thin. The model is this program's alone, so its blocks may take either. */
static void find_veils(struct closed *c, const struct psr_model *model)
{
	struct psr_blocks *blocks = (struct psr_blocks *)psr_model_blocks(model);
	c->blocks = blocks;
	c->opacity = blocks->opacity;
	for (uint32_t b = 0; b < blocks->n_blocks; b++) {
		if (!(psr_blocks_traits(blocks, b) & PSR_BLOCK_THIN))
			continue;
		if (c->no_veils == NULL) {
			c->no_veils = room(blocks->n_samples);
			memcpy(c->no_veils, c->opacity, blocks->n_samples);
		}
		memset(c->no_veils + psr_blocks_attr_first(blocks, b), 0, (size_t)__builtin_popcountll(blocks->mask[b]));
	}
}

static void draw_frame(struct closed *c, struct psr_frame *frame)
{
	struct psr_error err;
	if (refiner_draw(c->refiner, &c->scene, &c->settings, c->pool, frame, &err))
		die(err.text);
}

static void draw(struct closed *c, unsigned pass)
{
	c->settings.pass = pass;
	for (int b = 0; b < 2; b++) {
		for (int k = 0; k < 3; k++)
			c->scene.background[k] = k == 2 * b;
		c->frame[b].depth = pass ? NULL : c->depth;
		c->frame[b].id = pass ? NULL : c->id;
		c->frame[b].weight = pass ? NULL : c->weight;
		draw_frame(c, &c->frame[b]);
	}
	if (c->no_veils == NULL)
		return;
	c->blocks->opacity = c->no_veils;
	draw_frame(c, &c->bare);
	c->blocks->opacity = c->opacity;
}

static int is_same(const struct psr_frame *a, const struct psr_frame *b, size_t at)
{
	return memcmp(a->rgb + 3 * at, b->rgb + 3 * at, 3) == 0;
}

/* Whether a ray ended on a surface that nothing is to show through: a blended one has holes. */
static int is_stopped(const struct psr_mesh *mesh, uint32_t prim)
{
	const uint32_t *material = prim < mesh->n_triangles ? mesh->triangle_material : mesh->point_material;
	return prim != RAY_NONE &&
	       mesh->material[material[prim < mesh->n_triangles ? prim : prim - mesh->n_triangles]].alpha != PSR_ALPHA_BLEND;
}

/* Pixels that pass 0 covers, not by blended surfaces alone, and whose middle is not on one. */
static void find_solid(struct closed *c, const struct view *view)
{
	for (uint32_t y = 0; y < c->side; y++)
		for (uint32_t x = 0; x < c->side; x++) {
			const size_t at = (size_t)y * c->side + x;
			struct ray ray;
			struct ray_hit hit;
			truth_ray(c->truth, view, x + 0.5, y + 0.5, &ray);
			truth_trace(c->truth, &ray, 1, c->scene.camera.near_z, &hit);
			c->is_solid[at] = isfinite(c->depth[at]) && (c->id[at] != UINT32_MAX || c->weight[at] < 255) &&
			                  (hit.prim == RAY_NONE || is_stopped(c->mesh, hit.prim));
		}
}

/* Those, less INSIDE pixels at their edges. */
static uint32_t find_inside(struct closed *c)
{
	const int side = (int)c->side;
	uint32_t n = 0;
	for (int y = 0; y < side; y++)
		for (int x = 0; x < side; x++) {
			int is_inside = x >= INSIDE && y >= INSIDE && x + INSIDE < side && y + INSIDE < side;
			for (int j = -INSIDE; is_inside && j <= INSIDE; j++)
				for (int i = -INSIDE; is_inside && i <= INSIDE; i++)
					is_inside = c->is_solid[(size_t)(y + j) * c->side + (size_t)(x + i)];
			c->is_inside[(size_t)y * c->side + (size_t)x] = (uint8_t)is_inside;
			n += (uint32_t)is_inside;
		}
	return n;
}

/* Finds how many pixels from its middle a pixel may rightly depend on the background. Samples a pixel apart know of an
 * edge where it is to half a pixel. Cells of pass 0 are one to two samples wide, and a pixel fades over four of them,
 * as far as one and a half cells away; those of up to INSIDE pixels have faded out where pixels are looked at. A pixel
 * of pass 1 counts the sub-pixels around it, too, half a pixel further (decision 0150). */
static double find_reach(const struct closed *c, const struct view *view, unsigned pass, size_t at)
{
	const double apart = c->spacing / (view->pixel * c->depth[at]), cell = 2 * apart;
	const double around = pass == 1 ? 0.5 : 0;

	if (cell <= INSIDE)
		return 1 + around;
	return pass == 0 ? 1.5 * cell : 0.5 + apart / 2 + around;
}

/* Whether all rays within `reach` pixels of a pixel's middle, along x and y, are stopped by the source. */
static int is_closed(const struct closed *c, const struct view *view, double x, double y, double reach)
{
	const uint32_t least = (uint32_t)ceil(2 * reach), rays = c->rays > least ? c->rays : least;
	const double step = 2 * reach / rays;
	struct ray ray[MOST_RAYS];
	struct ray_hit hit[MOST_RAYS];
	if (rays > MOST_RAYS)
		die("samples are too far apart in this picture");
	for (uint32_t j = 0; j < rays; j++) {
		for (uint32_t i = 0; i < rays; i++)
			truth_ray(c->truth, view, x - reach + (i + 0.5) * step, y - reach + (j + 0.5) * step, &ray[i]);
		truth_trace(c->truth, ray, (int)rays, c->scene.camera.near_z, hit);
		for (uint32_t i = 0; i < rays; i++)
			if (!is_stopped(c->mesh, hit[i].prim))
				return 0;
	}
	return 1;
}

/* Whether a veil changes a pixel that is at most `reach` from this one, along x and y. */
static int is_veiled(const struct closed *c, int x, int y, int reach)
{
	const int side = (int)c->side;
	for (int j = -reach; c->no_veils != NULL && j <= reach; j++)
		for (int i = -reach; i <= reach; i++)
			if (x + i >= 0 && x + i < side && y + j >= 0 && y + j < side &&
			    !is_same(&c->frame[1], &c->bare, (size_t)(y + j) * c->side + (size_t)(x + i)))
				return 1;
	return 0;
}

/* Whether a pixel is to be closed. In pass 1 it has sub-pixels of the eight around it, too. */
static int is_looked_at(const struct closed *c, unsigned pass, size_t at)
{
	const size_t up = at - c->side, down = at + c->side;
	const uint8_t *in = c->is_inside;

	return in[at] && (pass != 1 || (in[up - 1] & in[up] & in[up + 1] & in[at - 1] & in[at + 1] & in[down - 1] & in[down] &
	                                in[down + 1]));
}

static uint32_t look(struct closed *c, unsigned pass, const struct view *view, int number)
{
	uint32_t n_dependent = 0, n_veiled = 0, n_torn = 0;
	char example[64] = "";
	for (uint32_t y = 0; y < c->side; y++)
		for (uint32_t x = 0; x < c->side; x++) {
			const size_t at = (size_t)y * c->side + x;
			if (!is_looked_at(c, pass, at) || is_same(&c->frame[0], &c->frame[1], at))
				continue;
			n_dependent++;
			const double reach = find_reach(c, view, pass, at);
			if (is_veiled(c, (int)x, (int)y, (int)ceil(reach))) {
				n_veiled++;
				continue;
			}
			if (!is_closed(c, view, x + 0.5, y + 0.5, reach))
				continue;
			if (!n_torn++)
				snprintf(example, sizeof example, ", first at %u,%u", x, y);
		}
	printf("view %d pass %u: %u depend on the background, %u of them veiled, %u torn%s\n", number, pass, n_dependent,
	       n_veiled, n_torn, example);
	return n_torn;
}

int main(int argc, char **argv)
{
	struct closed c = { .side = argc > 3 ? (uint32_t)atoi(argv[3]) : 300,
		                .rays = argc > 4 ? (uint32_t)atoi(argv[4]) : 16,
		                .zoom = argc > 5 ? atof(argv[5]) : 1 };
	struct psr_model *model;
	struct psr_error err;
	uint32_t n_torn = 0;
	if (argc < 3 || argc > 6 || c.side < 16 || c.rays < 1 || c.rays > MOST_RAYS || !(c.zoom >= 1))
		die("usage: closed MODEL.psr SOURCE [SIDE [RAYS [ZOOM]]]");
	if (psr_model_read(&model, argv[1], &err) || psr_mesh_import(&c.mesh, argv[2], NULL, &err) ||
	    psr_truth_create(&c.truth, c.mesh, &err))
		die(err.text);
	c.spacing = psr_model_info(model)->spacing;
	const size_t area = (size_t)c.side * c.side;
	c.depth = room(area * sizeof *c.depth);
	c.id = room(area * sizeof *c.id);
	c.weight = room(area);
	c.is_solid = room(area);
	c.is_inside = room(area);
	for (int b = 0; b < 2; b++)
		c.frame[b] = (struct psr_frame){ .width = c.side, .height = c.side, .rgb = room(3 * area) };
	c.bare = (struct psr_frame){ .width = c.side, .height = c.side, .rgb = room(3 * area) };
	find_veils(&c, model);
	if (psr_renderer_create(&c.renderer, NULL) || refiner_create(&c.refiner, c.renderer, NULL)
	    || psr_pool_create(&c.pool, 2, NULL))
		die("no memory");
	c.instance = (struct psr_instance){ .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	c.scene = (struct psr_scene){ .instance = &c.instance, .n_instances = 1, .ambient = { 1, 1, 1 } };
	render_settings_default(&c.settings, c.side, c.side);
	for (int v = 0; v < VIEWS; v++) {
		struct view view;
		look_from(&c, psr_model_info(model), direction[v]);
		if (view_init(&view, &c.scene.camera, c.side, c.side, &err))
			die(err.text);
		const unsigned last = v < LAST_PASS_VIEWS ? PSR_MAX_PASS : PSR_MAX_PASS - 1;
		for (unsigned pass = 0; pass <= last; pass++) {
			draw(&c, pass);
			if (pass == 0) {
				find_solid(&c, &view);
				printf("view %d: %u pixels inside\n", v, find_inside(&c));
			}
			n_torn += look(&c, pass, &view, v);
		}
	}
	for (int b = 0; b < 2; b++)
		free(c.frame[b].rgb);
	free(c.bare.rgb);
	free(c.no_veils);
	free(c.depth);
	free(c.id);
	free(c.weight);
	free(c.is_solid);
	free(c.is_inside);
	refiner_destroy(c.refiner);
	psr_renderer_destroy(c.renderer);
	psr_pool_destroy(c.pool);
	psr_truth_destroy(c.truth);
	psr_mesh_destroy(c.mesh);
	psr_model_unref(model);
	return n_torn > 0;
}
