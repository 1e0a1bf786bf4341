/* budget [options] WORK CACHE: whether budgets of time are kept, how good the pictures are, whether these are as like
 * the source as was foreseen, and whether the geometric bound is one. */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "base/cli.h"
#include "budget.h"
#include "child.h"
#include "psr/build.h"
#include "psr/mesh.h"
#include "psr/model.h"
#include "report.h"
#include "truth.h"

#define SEED 20260 /* psr-model build --calibrate has another */
#define RAYS 6     /* along the side of a pixel */

static const struct {
	const char *name, *file; /* of the cache; NULL: of the standard set */
} models[] = {
	{ "dragon", NULL }, { "engine", "engine.glb" }, { "table", NULL },
	{ "clearcoat", "clearcoat/ClearCoatTest.gltf" }, { "pinetree", NULL },
};
#define N_MODELS (sizeof models / sizeof models[0])

struct bench {
	const char *work, *cache, *only;
	int64_t seed;
	int no_times, no_beside, no_bounds, no_rmse;
	struct truth_build build;
	struct budget_sums alone, beside;
	struct budget_bounds bounds;
	struct budget_likes likes;
};

static void path_of(char path[PATH_MAX], const char *folder, const char *name, const char *ending)
{
	if (snprintf(path, PATH_MAX, "%s/%s%s", folder, name, ending) >= PATH_MAX)
		report_die(folder, "is too long a path");
}

static void source_of(char path[PATH_MAX], const struct bench *bench, size_t m)
{
	char program[PATH_MAX];
	struct child_use use;

	if (models[m].file != NULL) {
		path_of(path, bench->cache, models[m].file, "");
		return;
	}
	path_of(path, bench->work, models[m].name, ".glb");
	path_of(program, bench->build.programs, "psr-model", "");
	const char *const argv[] = { program, "make", models[m].name, "-o", path, NULL };
	if (access(path, R_OK) != 0 && child_run(&use, argv) != 0)
		report_die(models[m].name, "cannot be made");
}

static void must(int code, const char *what, const struct psr_error *err)
{
	if (code != PSR_OK)
		report_die(what, err->text);
}

static void make_views(struct ladder_view *view, const struct bench *bench, struct ladder_look *look,
                       const char *file)
{
	struct psr_build_options options;
	struct psr_model *model;
	struct psr_error err;

	psr_build_options_default(&options);
	must(psr_model_map(&model, file, &err), file, &err);
	look->info = psr_model_info(model);
	look->width = look->height = BUDGET_SIDE;
	look->seed = (uint64_t)bench->seed;
	look->n_threads = options.n_threads;
	must(ladder_views_make(view, BUDGET_VIEWS, look, &err), file, &err);
	for (uint32_t i = 0; i < BUDGET_VIEWS; i++)
		must(ladder_view_trace(&view[i], look, RAYS, &err), file, &err);
	psr_model_unref(model);
	look->info = NULL;
}

static void run_model(struct bench *bench, size_t m)
{
	struct ladder_view view[BUDGET_VIEWS] = { 0 };
	struct ladder_look look = { .truth = NULL };
	char source[PATH_MAX], file[PATH_MAX], name[64], address[128];
	struct psr_mesh *mesh;
	struct psr_error err;

	source_of(source, bench, m);
	if (access(source, R_OK) != 0) {
		fprintf(stderr, "bench-budget: %s is not there (make models): left out\n", source);
		return;
	}
	snprintf(name, sizeof name, "%s-%d", models[m].name, BUDGET_RESOLUTION);
	path_of(file, bench->build.folder, name, ".psr");
	truth_build_model(&bench->build, models[m].name, source, BUDGET_RESOLUTION, 1);
	must(psr_mesh_import(&mesh, source, NULL, &err), source, &err);
	must(psr_truth_create(&look.truth, mesh, &err), source, &err);
	must(psr_source_create(&look.source, mesh, &err), source, &err);
	make_views(view, bench, &look, file);
	truth_build_start(&bench->build);
	snprintf(address, sizeof address, "unix:%s", bench->build.socket);
	if (!bench->no_times) {
		budget_times(&bench->alone, address, name, view, 0);
		if (!bench->no_beside)
			budget_times(&bench->beside, address, name, view, 1);
	}
	if (!bench->no_rmse)
		budget_rmse(&bench->likes, address, name, view);
	if (!bench->no_bounds)
		budget_bound(&bench->bounds, address, name, view, look.truth);
	truth_build_stop(&bench->build);
	for (uint32_t i = 0; i < BUDGET_VIEWS; i++)
		ladder_view_fini(&view[i]);
	psr_source_destroy(look.source);
	psr_truth_destroy(look.truth);
	psr_mesh_destroy(mesh);
}

int main(int argc, char **argv)
{
	static struct bench bench = { .seed = SEED };
	const char *programs = NULL;
	const struct psr_opt opts[] = {
		{ .name = "programs", .letter = 'p', .type = PSR_OPT_STRING, .value = &programs, .arg = "DIR",
		  .help = "The folder of the psrd and psr-model that are measured." },
		{ .name = "only", .type = PSR_OPT_STRING, .value = &bench.only, .arg = "NAME", .help = "This model." },
		{ .name = "seed", .type = PSR_OPT_INT, .value = &bench.seed, .arg = "N", .help = "Of the views.", .max = 1e15 },
		{ .name = "no-times", .type = PSR_OPT_FLAG, .value = &bench.no_times, .help = "Leaves budgets of time out." },
		{ .name = "no-beside", .type = PSR_OPT_FLAG, .value = &bench.no_beside,
		  .help = "Leaves budgets beside another client out." },
		{ .name = "no-bounds", .type = PSR_OPT_FLAG, .value = &bench.no_bounds,
		  .help = "Leaves the geometric bound out." },
		{ .name = "no-rmse", .type = PSR_OPT_FLAG, .value = &bench.no_rmse, .help = "Leaves budgets of RMSE out." },
		{ .name = NULL },
	};
	const struct psr_cli cli = {
		.usage = "budget --programs DIR [options] WORK CACHE",
		.summary = "Draws views of models with budgets of time, alone and beside another client, and holds what came"
		           " against its targets. WORK takes models.",
		.opts = opts,
	};
	struct psr_error err;
	int n;

	const int rc = psr_cli_parse(&cli, argc, argv, &n, &err);
	if (rc != PSR_OK)
		return rc == 1 ? 0 : psr_cli_fail("bench-budget", &err);
	if (n != 2 || programs == NULL)
		report_die("usage", cli.usage);
	bench.work = argv[1];
	bench.cache = argv[2];
	if (mkdir(bench.work, 0777) != 0 && access(bench.work, W_OK) != 0)
		report_die(bench.work, strerror(errno));
	truth_build_init(&bench.build, programs, bench.work);
	for (size_t m = 0; m < N_MODELS; m++)
		if (bench.only == NULL || strcmp(bench.only, models[m].name) == 0)
			run_model(&bench, m);
	budget_times_print(&bench.alone, "alone");
	budget_times_print(&bench.beside, "beside another client");
	budget_rmse_print(&bench.likes);
	budget_bound_print(&bench.bounds);
	report_print_targets();
	return 0;
}
