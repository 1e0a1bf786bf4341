#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "base/clock.h"
#include "base/mem.h"
#include "base/vec.h"
#include "level.h"
#include "psr/build.h"
#include "sample/levels/draft.h"
#include "sample/pack/pack.h"
#include "surface/stipple.h"
#include "surface/validate.h"

#define LEAST_RESOLUTION 8
#define MOST_RESOLUTION 8192
#define MOST_TOLERANCE 1.0471975511965979 /* 60 degrees, and a rounding more */
#define MOST_THREADS 256
#define LEAST_LEVEL_RESOLUTION 64

struct build {
	const struct psr_mesh *mesh;
	const struct psr_build_options *options;
	struct psr_pool *pool;
	struct ray_scene *scene;
	struct surface surface;
	struct level level[2];                           /* that under way, and the next finer one */
	struct psr_projection projection[N_PROJECTIONS]; /* of level 0 */
	unsigned n_levels, n_levels_done;
	struct draft draft;
	struct psr_model_info info;
	struct psr_build_report report;
	struct psr_error *err;
};

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
	for (int k = 0; k < 3; k++)
		if (!(fabs(options->up[k]) <= 1e30))
			return psr_fail(err, PSR_ERR_ARG, "up %g,%g,%g is not finite or too long", options->up[0], options->up[1],
			                options->up[2]);
	if (options->n_threads < 1 || options->n_threads > MOST_THREADS)
		return psr_fail(err, PSR_ERR_ARG, "%d threads are outside of 1..%d", options->n_threads, MOST_THREADS);
	return PSR_OK;
}

/* Coarser levels stop where a model is so small that nothing is saved. */
static unsigned count_levels(uint32_t resolution)
{
	unsigned n = 1;

	while (n < PSR_MAX_LEVELS && resolution >> n >= LEAST_LEVEL_RESOLUTION)
		n++;
	return n;
}

static void report_step(unsigned done, unsigned total, void *userdata)
{
	struct build *build = userdata;
	const struct psr_build_options *options = build->options;

	if (options->on_progress != NULL)
		options->on_progress("sample", (uint64_t)build->n_levels_done * total + done, (uint64_t)build->n_levels * total,
		                     options->userdata);
}

static int check_samples(struct build *build, const struct level *level)
{
	if (level->kept.n != 0)
		return PSR_OK;
	return psr_fail(build->err, PSR_ERR_ARG,
	                "no ray meets the mesh: all of it is transparent, turned away or too thin");
}

static void start_level(struct build *build, struct level *level, const struct level *finer)
{
	const unsigned number = build->n_levels_done;

	level_fini(level);
	level->sampling = (struct sampling){ .mesh = build->mesh,
		                                 .scene = build->scene,
		                                 .surface = &build->surface,
		                                 .pool = build->pool,
		                                 .level = number,
		                                 .ds = build->draft.ds * (double)(1u << number) };
	memcpy(level->sampling.projection, build->projection, sizeof build->projection);
	for (int i = 0; i < N_PROJECTIONS; i++)
		level->sampling.projection[i].spacing *= (float)(1u << number);
	level->finer = number > 0 ? finer : NULL;
}

static int make_level(struct build *build, struct level *level)
{
	const struct level_progress progress = { report_step, build };
	int rc;

	rc = level_make(level, &progress);
	if (rc == PSR_OK)
		rc = check_samples(build, level);
	if (rc == PSR_OK && build->n_levels_done == 0) {
		struct adequacy adequacy;

		rc = level_reach(&adequacy, level);
		build->info.n_trials = adequacy.n_trials;
		build->info.n_missing = adequacy.n_missing;
	}
	if (rc == PSR_OK)
		rc = draft_add(&build->draft, level->sheets, &level->kept);
	build->report.n_rays += level->n_rays;
	build->report.n_candidates += level->n_patches;
	build->report.seconds_rays += level->seconds_rays;
	return rc;
}

static int make_levels(struct build *build)
{
	double started = clock_seconds();
	int rc = PSR_OK;

	build->n_levels = count_levels(build->options->resolution);
	build->draft.projection = build->projection;
	build->draft.ds = 2.0 / build->options->resolution;
	for (; rc == PSR_OK && build->n_levels_done < build->n_levels; build->n_levels_done++) {
		struct level *level = &build->level[build->n_levels_done % 2];

		start_level(build, level, &build->level[(build->n_levels_done + 1) % 2]);
		rc = make_level(build, level);
		level_trim(level);
	}
	for (int i = 0; i < 2; i++)
		level_fini(&build->level[i]);
	build->report.seconds_select = clock_seconds() - started - build->report.seconds_rays;
	if (rc == PSR_ERR_MEMORY || rc == PSR_ERR_LIMIT)
		return psr_fail(build->err, rc, "no memory to sample the mesh at resolution %u; use a lower one",
		                build->options->resolution);
	return rc;
}

static int sample_and_pack(struct build *build, struct psr_model **out)
{
	const struct psr_presets presets = { build->mesh->n_cameras, build->mesh->n_lights, build->mesh->camera,
		                                 build->mesh->light };
	struct pack_source source = { .surface = &build->surface, .draft = &build->draft, .presets = &presets,
		                          .pool = build->pool };
	int rc = ray_scene_create(&build->scene, build->mesh, build->info.origin, build->info.scale, build->err);

	if (rc == PSR_OK)
		rc = ray_scene_index_distances(build->scene, build->err);
	if (rc != PSR_OK)
		return rc;
	if (surface_init(&build->surface, build->mesh, build->info.scale) != PSR_OK)
		return psr_fail(build->err, PSR_ERR_MEMORY, "no memory for the mesh's textures");
	ray_scene_stipple(build->scene, STIPPLE_PIXELS * 2.0 / build->options->resolution);
	projection_list(build->projection, 2.0 / build->options->resolution, build->options->tolerance);
	rc = make_levels(build);
	if (rc == PSR_OK && draft_group(&build->draft, build->pool) != PSR_OK)
		rc = psr_fail(build->err, PSR_ERR_MEMORY, "no memory to cut the model into clusters");
	if (rc == PSR_OK) {
		rc = draft_join(&build->draft);
		if (rc != PSR_OK)
			psr_fail(build->err, rc, "no memory or no numbers for all samples of the model; use a lower resolution");
	}
	source.scene = build->scene;
	if (rc == PSR_OK)
		rc = pack_model(out, &build->info, &source, build->err);
	return rc;
}

static int prepare(struct build *build)
{
	const struct psr_build_options *options = build->options;
	int rc = validate_mesh(build->mesh, build->err);

	if (rc == PSR_OK)
		rc = validate_bound_mesh(build->mesh, build->info.origin, &build->info.scale, build->err);
	if (rc != PSR_OK)
		return rc;
	v3d_normalize(build->info.up, v3d_length(options->up) > 0 ? options->up : build->mesh->up);
	build->info.spacing = 2.0 / options->resolution * build->info.scale;
	build->info.tolerance = options->tolerance;
	build->info.resolution = options->resolution;
	snprintf(build->info.builder, sizeof build->info.builder, "psr %s", PSR_VERSION);
	rc = psr_pool_create(&build->pool, options->n_threads, NULL);
	return rc == PSR_OK ? rc : psr_fail(build->err, rc, "%d threads cannot be started", options->n_threads);
}

int psr_model_build(struct psr_model **out, const struct psr_mesh *mesh, const struct psr_build_options *options,
                    struct psr_build_report *report, struct psr_error *err)
{
	double started = clock_seconds();
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
		rc = sample_and_pack(build, out);
	build->report.seconds_total = clock_seconds() - started;
	if (rc == PSR_OK && report != NULL)
		*report = build->report;
	draft_fini(&build->draft);
	surface_fini(&build->surface);
	ray_scene_destroy(build->scene);
	psr_pool_destroy(build->pool);
	free(build);
	return rc;
}
