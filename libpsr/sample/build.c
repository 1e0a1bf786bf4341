#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#include "../base/maths.h"
#include "door.h"
#include "lattice.h"
#include "pack.h"
#include "projection.h"
#include "psr/build.h"
#include "psr/pool.h"
#include "ray.h"
#include "select.h"

#define LEAST_RESOLUTION 8
#define MOST_RESOLUTION 8192
#define MOST_TOLERANCE 1.0471975511965979 /* 60 degrees, and a rounding more */
#define MOST_THREADS 256

struct build {
	const struct psr_mesh *mesh;
	const struct psr_build_options *options;
	struct psr_pool *pool;
	struct ray_scene *scene;
	struct psr_projection projection[MOST_PROJECTIONS];
	struct lattice lattice[MOST_PROJECTIONS];
	struct selection selection;
	struct psr_model_info info;
	struct psr_build_report report;
	struct psr_error *err;
};

static double now(void)
{
	struct timespec t;

	clock_gettime(CLOCK_MONOTONIC, &t);
	return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

void psr_build_options_default(struct psr_build_options *options)
{
	long n = sysconf(_SC_NPROCESSORS_ONLN);

	memset(options, 0, sizeof *options);
	options->resolution = 512;
	options->tolerance = 0.43633231299858238; /* 25 degrees */
	options->n_threads = n < 1 ? 1 : n > MOST_THREADS ? MOST_THREADS : (int)n;
}

static int check_options(const struct psr_build_options *options, struct psr_error *err)
{
	if (options->resolution < LEAST_RESOLUTION || options->resolution > MOST_RESOLUTION)
		return psr_fail(err, PSR_ERR_ARG, "resolution %u is outside of %d..%d pixels", options->resolution,
		                LEAST_RESOLUTION, MOST_RESOLUTION);
	if (!(options->tolerance > 0 && options->tolerance <= MOST_TOLERANCE))
		return psr_fail(err, PSR_ERR_ARG, "tolerance %g is outside of 0..60 degrees",
		                options->tolerance * 57.295779513082323);
	if (options->n_threads < 1 || options->n_threads > MOST_THREADS)
		return psr_fail(err, PSR_ERR_ARG, "%d threads are outside of 1..%d", options->n_threads, MOST_THREADS);
	return PSR_OK;
}

static void report_rays(struct build *build, uint64_t done)
{
	if (build->options->on_progress != NULL)
		build->options->on_progress("rays", done, N_PROJECTIONS, build->options->userdata);
}

static void report_select(uint64_t done, uint64_t total, void *userdata)
{
	const struct psr_build_options *options = userdata;

	if (options->on_progress != NULL)
		options->on_progress("select", done, total, options->userdata);
}

static int trace_projections(struct build *build)
{
	double started = now();
	int rc = ray_scene_create(&build->scene, build->mesh, build->info.origin, build->info.scale, build->err);

	if (rc != PSR_OK)
		return rc;
	projection_list(build->projection, 2.0 / build->options->resolution, build->options->tolerance);
	for (unsigned i = 0; i < N_PROJECTIONS; i++) {
		rc = lattice_trace(&build->lattice[i], build->scene, &build->projection[i], 1, build->pool);
		if (rc != PSR_OK)
			return psr_fail(build->err, rc, "no memory for the samples of projection %u at resolution %u; use a lower one",
			                i, build->options->resolution);
		build->report.n_rays += build->lattice[i].n_rays;
		build->report.n_candidates += build->lattice[i].n_blocks;
		report_rays(build, i + 1);
	}
	build->report.seconds_rays = now() - started;
	if (build->report.n_candidates == 0)
		return psr_fail(build->err, PSR_ERR_ARG,
		                "no ray meets the mesh: all of it is transparent, turned away or too thin");
	return PSR_OK;
}

static int select_and_pack(struct build *build, struct psr_model **out)
{
	struct select_input input = { .mesh = build->mesh, .scene = build->scene, .lattice = build->lattice,
		                          .projection = build->projection,
		                          .ds = 2.0 / build->options->resolution, .pool = build->pool,
		                          .on_progress = report_select, .userdata = (void *)build->options };
	struct psr_presets presets = { .n_cameras = build->mesh->n_cameras, .n_lights = build->mesh->n_lights,
		                           .camera = build->mesh->camera, .light = build->mesh->light };
	double started = now(), sine, cosine;
	int rc;

	psr_sincos(build->options->tolerance, &sine, &cosine);
	input.cosine = (float)cosine;
	rc = select_blocks(&build->selection, &input);
	build->report.seconds_select = now() - started;
	if (rc != PSR_OK)
		return psr_fail(build->err, rc, "no memory to select the blocks at resolution %u; use a lower one",
		                build->options->resolution);
	return pack_model(out, &build->info, &presets, build->scene, build->projection, build->lattice, &build->selection,
	                  build->err);
}

static int prepare(struct build *build)
{
	const struct psr_build_options *options = build->options;
	int rc = door_check_mesh(build->mesh, build->err);

	if (rc == PSR_OK)
		rc = door_bound_mesh(build->mesh, build->info.origin, &build->info.scale, build->err);
	if (rc != PSR_OK)
		return rc;
	build->info.spacing = 2.0 / options->resolution * build->info.scale;
	build->info.tolerance = options->tolerance;
	build->info.resolution = options->resolution;
	snprintf(build->info.builder, sizeof build->info.builder, "psr %s", PSR_VERSION);
	rc = psr_pool_create(&build->pool, options->n_threads, 0);
	return rc == PSR_OK ? rc : psr_fail(build->err, rc, "%d threads cannot be started", options->n_threads);
}

int psr_model_build(struct psr_model **out, const struct psr_mesh *mesh, const struct psr_build_options *options,
                    struct psr_build_report *report, struct psr_error *err)
{
	double started = now();
	struct build *build;
	int rc = check_options(options, err);

	if (rc != PSR_OK)
		return rc;
	build = calloc(1, sizeof *build);
	if (build == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to build a model");
	build->mesh = mesh;
	build->options = options;
	build->err = err;
	rc = prepare(build);
	if (rc == PSR_OK)
		rc = trace_projections(build);
	if (rc == PSR_OK)
		rc = select_and_pack(build, out);
	build->report.seconds_total = now() - started;
	if (rc == PSR_OK && report != NULL)
		*report = build->report;
	for (unsigned i = 0; i < MOST_PROJECTIONS; i++)
		lattice_fini(&build->lattice[i]);
	selection_fini(&build->selection);
	ray_scene_destroy(build->scene);
	psr_pool_destroy(build->pool);
	free(build);
	return rc;
}
