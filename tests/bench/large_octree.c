/* A cloud that memory cannot hold, to an octree that is drawn: large_octree [-n MILLIONS] [-l LEVELS] [-m MB]
 *
 * Makes the points as they are read, 20 to a square metre of hills and trees at survey coordinates, in the random order
 * of no scanner; so there is no file of them, and runs of sorted points go to TMPDIR, 16 bytes a point. Prints a table;
 * fails if a bound is broken. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <unistd.h>
#include "base/clock.h"
#include "base/random.h"
#include "model/cubes.h"
#include "model/tree.h"
#include "octree/build/build.h"
#include "psr/render.h"

#define DENSITY 20.0      /* points a square metre */
#define MOST_SECONDS 600.0 /* of 200 million points */
#define MOST_MB 2048.0
#define SIDE 1024

struct terrain {
	uint64_t n, next, random;
	double side; /* metres */
};

static int go_back(void *userdata, struct psr_error *err)
{
	struct terrain *terrain = userdata;

	(void)err;
	terrain->next = 0;
	terrain->random = 1;
	return PSR_OK;
}

/* A place on the ground, with 3 cm of noise; one of four is in a tree. */
static void make_point(struct octree_point *point, struct terrain *terrain)
{
	uint64_t *random = &terrain->random;
	const double x = random_in(random, 0.0, terrain->side), y = random_in(random, 0.0, terrain->side);
	const double ground = 40.0 * sin(x / 170.0) * cos(y / 130.0) + 6.0 * sin(x / 19.0 + y / 23.0);
	const int is_tree = random_below(random, 4) == 0 && sin(x / 7.0) * sin(y / 9.0) > 0.3;

	*point = (struct octree_point){ .at = { 412000.0 + x, 5312000.0 + y, 120.0 + ground } };
	point->at[2] += is_tree ? random_in(random, 2.0, 15.0) : random_in(random, -0.03, 0.03);
	point->color[0] = is_tree ? 35 : 117;
	point->color[1] = is_tree ? 117 : 101;
	point->color[2] = (uint8_t)(31 + random_below(random, 8));
}

static int read_points(size_t *n, struct octree_point *points, size_t room, void *userdata, struct psr_error *err)
{
	struct terrain *terrain = userdata;

	(void)err;
	for (*n = 0; *n < room && terrain->next < terrain->n; ++*n, terrain->next++)
		make_point(&points[*n], terrain);
	return PSR_OK;
}

/* ---- the table ---- */

struct clocks {
	uint64_t begin, used; /* of all; of this step, by the wall and by the processor */
	uint64_t step;
	const char *stage;
};

static double peak_mb(void)
{
	struct rusage usage;

	getrusage(RUSAGE_SELF, &usage);
	return (double)usage.ru_maxrss / 1024.0;
}

static void end_step(struct clocks *c, const char *name)
{
	const uint64_t now = clock_ns(), used = clock_read(CLOCK_PROCESS_CPUTIME_ID);

	printf("%-10s %7.1f s, %7.1f s of the processors, %7.0f MB at most until then\n", name, (double)(now - c->step) * 1e-9,
	       (double)(used - c->used) * 1e-9, peak_mb());
	fflush(stdout);
	c->step = now;
	c->used = used;
}

static void on_progress(const char *stage, uint64_t done, uint64_t total, void *userdata)
{
	struct clocks *c = userdata;

	(void)done;
	(void)total;
	if (c->stage != NULL && c->stage != stage)
		end_step(c, c->stage);
	c->stage = stage;
}

static int line(const char *name, const char *unit, double is, double most)
{
	printf("%-10s %7.1f of %7.1f %s%s\n", name, is, most, unit, is <= most ? "" : "  EXCEEDED");
	return is <= most;
}

/* ---- the work ---- */

static int make_model(struct psr_model **model, struct terrain *terrain, const struct octree_build_options *options,
                      struct psr_error *err)
{
	const struct octree_source source = { .name = "terrain", .has_color = 1, .n_points = terrain->n, .rewind = go_back,
		                                  .read = read_points, .userdata = terrain };
	struct psr_model_info info;
	struct octree *tree, inner;
	int rc = octree_build(&tree, &source, options, err);

	if (rc != PSR_OK)
		return rc;
	end_step(options->userdata, "normals");
	psr_octree_info(&info, tree);
	info.up[1] = 0;
	info.up[2] = 1;
	psr_octree_to_inner(&inner, tree, &info);
	rc = psr_model_create_octree(model, &info, &inner, NULL, err);
	octree_destroy(tree);
	end_step(options->userdata, "model");
	if (rc == PSR_OK)
		rc = psr_model_make_cubes(*model, err);
	end_step(options->userdata, "cubes");
	return rc;
}

/* Draws all of it, and what is near its middle, from a hundredth of the distance. */
static int draw(const struct psr_model *model, struct clocks *clocks, struct psr_error *err)
{
	const struct psr_model_info *info = psr_model_info(model);
	struct psr_instance instance = { .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	struct psr_scene scene = { .instance = &instance, .n_instances = 1, .n_lights = 1 };
	struct psr_light light;
	struct psr_settings settings;
	struct psr_renderer *renderer;
	struct psr_frame frame;
	int rc = psr_renderer_create(&renderer, err);

	if (rc != PSR_OK)
		return rc;
	psr_camera_frame(&scene.camera, info->box_min, info->box_max, info->up, 0.6, 1.0);
	psr_light_key(&light, &scene.camera);
	scene.light = &light;
	psr_settings_default(&settings, SIDE, SIDE);
	rc = psr_frame_alloc(&frame, SIDE, SIDE, 1u << PSR_PLANE_COLOR, err);
	for (int i = 0; i < 2 && rc == PSR_OK; i++) {
		rc = psr_render(renderer, &scene, &settings, NULL, &frame, err);
		if (rc == PSR_OK)
			printf("%llu samples drawn, %llu of %d pixels covered\n", (unsigned long long)frame.report.n_samples_drawn,
			       (unsigned long long)frame.report.n_covered, SIDE * SIDE);
		end_step(clocks, "frame");
		for (int a = 0; a < 3; a++)
			scene.camera.eye[a] = scene.camera.target[a] + 0.01 * (scene.camera.eye[a] - scene.camera.target[a]);
		scene.camera.near_z *= 0.01;
	}
	psr_frame_free(&frame);
	psr_renderer_destroy(renderer);
	return rc;
}

int main(int argc, char **argv)
{
	struct clocks clocks = { .begin = clock_ns(), .step = clock_ns() };
	struct octree_build_options options;
	struct terrain terrain = { .n = 200000000 };
	struct psr_model *model = NULL;
	struct psr_error err;
	int option, rc, is_good;

	octree_build_options_default(&options);
	options.levels = 13;
	options.memory = (uint64_t)512 << 20;
	options.on_progress = on_progress;
	options.userdata = &clocks;
	while ((option = getopt(argc, argv, "n:l:m:")) != -1) {
		if (option == '?') {
			fprintf(stderr, "usage: large_octree [-n MILLIONS] [-l LEVELS] [-m MB]\n");
			return 2;
		}
		terrain.n = option == 'n' ? strtoull(optarg, NULL, 10) * 1000000 : terrain.n;
		options.levels = option == 'l' ? atoi(optarg) : options.levels;
		options.memory = option == 'm' ? strtoull(optarg, NULL, 10) << 20 : options.memory;
	}
	terrain.side = sqrt((double)terrain.n / DENSITY);
	rc = make_model(&model, &terrain, &options, &err);
	if (rc == PSR_OK) {
		const struct octree *tree = psr_model_octree(model);

		printf("%.1f M points in %.1f M leaves of %.2f m, %d levels; model %.0f MB\n", (double)terrain.n * 1e-6,
		       (double)tree->n_leaves * 1e-6, ldexp(tree->edge, -tree->levels) * psr_model_info(model)->scale, tree->levels,
		       (double)psr_model_bytes(model) * 1e-6);
		rc = draw(model, &clocks, &err);
	}
	psr_model_unref(model);
	if (rc != PSR_OK) {
		fprintf(stderr, "large_octree: %s\n", err.text);
		return psr_exit_status(rc);
	}
	is_good = line("all", "s", (double)(clock_ns() - clocks.begin) * 1e-9, MOST_SECONDS * (double)terrain.n / 2e8);
	is_good &= line("all", "MB", peak_mb(), MOST_MB);
	return !is_good;
}
