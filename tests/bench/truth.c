/* truth [options] WORK CACHE: how near the frames of one or more builds come to the truth of the source, with all
 * effects, beside the targets. */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "base/cli.h"
#include "child.h"
#include "report.h"
#include "surface/validate.h"
#include "truth.h"

static const struct {
	const char *name, *file; /* of the cache; NULL: of the standard set */
} models[] = {
	{ "chair", NULL },     { "dragon", NULL },     { "gavel", NULL },     { "kittyhawk", NULL },
	{ "pencil", NULL },    { "pinetree", NULL },   { "plant", NULL },     { "sailboat", NULL },
	{ "table", NULL },     { "teapot", NULL },     { "top", NULL },       { "toybird", NULL },
	{ "tree", NULL },      { "wheel", NULL },      { "stanford", "dragon.ply" },
	{ "bunny", "bunny.obj" }, { "engine", "engine.glb" }, { "clearcoat", "clearcoat/ClearCoatTest.gltf" },
	{ "helmet", "helmet.off" }, { "couplingdown", "couplingdown.off" }, { "nefertiti", "nefertiti.off" },
	{ "armadillo", "armadillo.off" }, { "fandisk", "fandisk.off" },
};
#define N_MODELS (sizeof models / sizeof models[0])

struct bench {
	const char *work, *cache, *only, *rows;
	struct truth_build build[TRUTH_BUILDS];
	const char *programs[TRUTH_BUILDS];
	unsigned n_builds;
};

/* Whether a list with blanks or commas between its words has this one; NULL has all. */
static int has_word(const char *list, const char *word)
{
	const size_t n = strlen(word);

	for (const char *at = list; at != NULL && *at != '\0';) {
		const size_t length = strcspn(at, " ,");

		if (length == n && memcmp(at, word, n) == 0)
			return 1;
		at += length + strspn(at + length, " ,");
	}
	return list == NULL || *list == '\0';
}

static int take_programs(const char *text, void *userdata, struct psr_error *err)
{
	struct bench *bench = userdata;

	if (bench->n_builds == TRUTH_BUILDS)
		return psr_fail(err, PSR_ERR_ARG, "more than %d builds", TRUTH_BUILDS);
	bench->programs[bench->n_builds++] = text;
	return PSR_OK;
}

/* Finds or makes a model's source. */
static void source_of(char path[PATH_MAX], const struct bench *bench, size_t m)
{
	char program[PATH_MAX];
	struct child_use use;
	int n;

	if (models[m].file != NULL)
		n = snprintf(path, PATH_MAX, "%s/%s", bench->cache, models[m].file);
	else
		n = snprintf(path, PATH_MAX, "%s/%s.glb", bench->work, models[m].name);
	if (n >= PATH_MAX || snprintf(program, sizeof program, "%s/psr-model", bench->programs[0]) >= PATH_MAX)
		report_die(bench->work, "is too long a path");
	const char *const argv[] = { program, "make", models[m].name, "-o", path, NULL };
	if (models[m].file == NULL && access(path, R_OK) != 0 && child_run(&use, argv) != 0)
		report_die(models[m].name, "cannot be made");
}

static void open_subject(struct truth_subject *subject, size_t m, const char *path)
{
	struct psr_error err;

	*subject = (struct truth_subject){ .name = models[m].name };
	if (psr_mesh_import(&subject->mesh, path, NULL, &err) != PSR_OK ||
	    psr_source_create(&subject->source, subject->mesh, &err) != PSR_OK ||
	    validate_bound_mesh(subject->mesh, subject->center, &subject->radius, &err) != PSR_OK)
		report_die(path, err.text);
}

static int wants(const struct bench *bench, const struct truth_row *row, const char *model)
{
	return has_word(bench->rows, row->name) && has_word(row->models, model);
}

static void run_row(struct bench *bench, const struct truth_row *row, struct truth_subject *subject, size_t m,
                    const char *path)
{
	struct truth_result result[TRUTH_BUILDS] = { { 0 } };
	unsigned n_known = 0;

	for (unsigned b = 0; b < bench->n_builds; b++)
		n_known += (unsigned)(result[b].is_known =
		                          truth_table_find(&result[b], &bench->build[b], models[m].name, row));
	if (n_known < bench->n_builds) {
		if (subject->mesh == NULL)
			open_subject(subject, m, path);
		for (unsigned b = 0; b < bench->n_builds; b++)
			if (!result[b].is_known) {
				truth_build_model(&bench->build[b], models[m].name, path, row->resolution, 0);
				truth_build_start(&bench->build[b]);
			}
		truth_row_run(row, subject, bench->build, bench->n_builds, result);
	}
	for (unsigned b = 0; b < bench->n_builds; b++) {
		truth_build_stop(&bench->build[b]);
		if (!result[b].is_known)
			truth_table_add(&result[b], &bench->build[b], models[m].name, row);
	}
	truth_table_print(result, bench->n_builds, models[m].name, row);
}

static void run_model(struct bench *bench, size_t m)
{
	struct truth_subject subject = { .name = models[m].name };
	char path[PATH_MAX];

	source_of(path, bench, m);
	if (access(path, R_OK) != 0) {
		fprintf(stderr, "bench-truth: %s is not there (make models): left out\n", path);
		return;
	}
	for (unsigned r = 0; r < truth_n_rows; r++)
		if (wants(bench, &truth_rows[r], models[m].name))
			run_row(bench, &truth_rows[r], &subject, m, path);
	psr_source_destroy(subject.source);
	psr_mesh_destroy(subject.mesh);
}

int main(int argc, char **argv)
{
	static struct bench bench;
	const struct psr_opt opts[] = {
		{ "programs", 'p', PSR_OPT_CALL, &bench, "DIR",
		  "Measures the psr, psrd and psr-model of this folder. Repeat it to see builds side by side.", 0, 0,
		  take_programs, NULL, NULL },
		{ "only", 0, PSR_OPT_STRING, &bench.only, "NAMES", "These models, with commas between them.", 0, 0, NULL, NULL,
		  NULL },
		{ "rows", 0, PSR_OPT_STRING, &bench.rows, "NAMES",
		  "These rows: defaults, raw, double, smooth, shadows, lamps, close, texture, still.", 0, 0, NULL, NULL, NULL },
		{ .name = NULL },
	};
	const struct psr_cli cli = {
		"truth --programs DIR [options] WORK CACHE",
		"Compares frames with the truth of their sources. WORK takes models, the first picture of each row, and\n"
		"results, which a later run of the same programs takes up. Remove it after a change of the truth itself.",
		opts, NULL, NULL,
	};
	struct psr_error err;
	char path[PATH_MAX];
	int n;

	const int rc = psr_cli_parse(&cli, argc, argv, &n, &err);
	if (rc != PSR_OK)
		return rc == 1 ? 0 : psr_cli_fail("bench-truth", &err);
	if (n != 2 || bench.n_builds == 0)
		report_die("usage", "truth --programs DIR [options] WORK CACHE");
	bench.work = argv[1];
	bench.cache = argv[2];
	if (mkdir(bench.work, 0777) != 0 && access(bench.work, W_OK) != 0)
		report_die(bench.work, strerror(errno));
	for (unsigned b = 0; b < bench.n_builds; b++) {
		truth_build_init(&bench.build[b], bench.programs[b], bench.work);
		printf("build %u: %s\n", b + 1, bench.programs[b]);
	}
	if (snprintf(path, sizeof path, "%s/results", bench.work) >= PATH_MAX)
		report_die(bench.work, "is too long a path");
	truth_table_open(path);
	truth_table_head();
	for (size_t m = 0; m < N_MODELS; m++)
		if (has_word(bench.only, models[m].name))
			run_model(&bench, m);
	truth_table_sum_up(bench.build, bench.n_builds);
	return 0;
}
