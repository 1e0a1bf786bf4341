/* psr-study: the studies and figures of the thesis again, as tables, plots and pictures. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "base/json.h"
#include "kinds.h"
#include "models/shapes/generators.h"
#include "psr/build.h"
#include "base/cli.h"
#include "simd/isa.h"

#define MOST_MODELS 64

static const struct study_kind *find_kind(const char *name, int *is_figure, struct psr_error *err)
{
	char names[PSR_ERROR_TEXT] = "";
	size_t used = 0;

	for (size_t i = 0; i < n_study_tables + n_study_figures; i++) {
		const struct study_kind *kind = i < n_study_tables ? &study_tables[i] : &study_figures[i - n_study_tables];

		*is_figure = i >= n_study_tables;
		if (strcmp(kind->name, name) == 0)
			return kind;
		if (used < sizeof names) /* the error holds no more of them */
			used += (size_t)snprintf(names + used, sizeof names - used, "%s%s", i == 0 ? "" : ", ", kind->name);
	}
	psr_fail(err, PSR_ERR_ARG, "there is no study '%.64s'; there are: %s", name, names);
	return NULL;
}

/* The thesis, unless a study names its paper. */
static const char *paper(const struct study_kind *kind)
{
	return kind->figure[0] == '[' ? "" : "[G] ";
}

static void print_kind(const struct study_kind *kind)
{
	printf("%-15s  %s%-17s  %s\n", kind->name, paper(kind), kind->figure, kind->what);
}

static void print_list(void)
{
	puts("tables:");
	for (size_t i = 0; i < n_study_tables; i++)
		print_kind(&study_tables[i]);
	puts("\nfigures:");
	for (size_t i = 0; i < n_study_figures; i++)
		print_kind(&study_figures[i]);
}

/* ---- tables ---- */

static int load_model(struct study *study, const char *name)
{
	int rc;

	if (name[0] == '\0')
		return psr_fail(study->err, PSR_ERR_ARG, "--models: a name is empty");
	if (study->n_models == MOST_MODELS)
		return psr_fail(study->err, PSR_ERR_LIMIT, "--models: more than %d are given", MOST_MODELS);
	rc = study_model_load(&study->model[study->n_models], name, study->err);
	study->n_models += rc == PSR_OK;
	return rc;
}

/* names: NULL for the whole standard set. */
static int load_models(struct study *study, const char *names)
{
	char *copy = names != NULL ? strdup(names) : NULL, *rest = copy, *name;
	int rc = PSR_OK;

	study->model = calloc(MOST_MODELS, sizeof *study->model);
	if (study->model == NULL || (names != NULL && copy == NULL))
		rc = psr_fail(study->err, PSR_ERR_MEMORY, "no memory for models");
	while (rc == PSR_OK && (name = strsep(&rest, ",")) != NULL)
		rc = load_model(study, name);
	for (size_t i = 0; rc == PSR_OK && names == NULL && i < n_generators; i++)
		rc = load_model(study, generators[i].name);
	free(copy);
	return rc;
}

static cJSON *row_to_json(const struct study_table *table, int row, int model)
{
	cJSON *object = cJSON_CreateObject();

	for (int c = 0; c < table->n_columns; c++) {
		double value = model < 0 ? study_mean(table, row, c) : *study_at(table, row, model, c);

		if (!isnan(value))
			cJSON_AddNumberToObject(object, table->column[c].key, value);
	}
	return object;
}

static int print_json(const struct study *study)
{
	cJSON *root = cJSON_CreateObject(), *rows;
	const struct study_table *table = &study->table;

	cJSON_AddStringToObject(root, "study", study->kind->name);
	cJSON_AddNumberToObject(root, "resolution", study->resolution);
	rows = cJSON_AddArrayToObject(root, "rows");
	for (int row = 0; row < table->n_rows; row++) {
		cJSON *object = row_to_json(table, row, -1), *models;

		cJSON_AddStringToObject(object, "label", table->label[row]);
		models = table->n_models > 1 ? cJSON_AddObjectToObject(object, "models") : NULL;
		for (int m = 0; m < table->n_models && models != NULL; m++)
			cJSON_AddItemToObject(models, study->model[m].name, row_to_json(table, row, m));
		cJSON_AddItemToArray(rows, object);
	}
	return json_print(root, study->err);
}

static void print_text(const struct study *study)
{
	printf("%s (%s%s) at %u:", study->kind->what, paper(study->kind), study->kind->figure, study->resolution);
	for (int m = 0; m < study->n_models; m++)
		printf("%s %s", m == 0 ? "" : ",", study->model[m].name);
	printf("\n\n");
	study_table_print(&study->table, stdout);
	if (study->kind->note != NULL)
		printf("\n%s\n", study->kind->note);
}

static int run_table(struct study *study, const char *plot, int json)
{
	int rc = load_models(study, study->names);

	if (rc == PSR_OK)
		rc = study->kind->run(study);
	if (study->has_bar)
		fprintf(stderr, "\r%*s\r", 48, "");
	if (rc == PSR_OK && plot != NULL)
		rc = study_plot(study, plot, study->err);
	if (rc == PSR_OK && json)
		rc = print_json(study);
	else if (rc == PSR_OK)
		print_text(study);
	study_table_fini(&study->table);
	for (int m = 0; m < study->n_models; m++)
		study_model_fini(&study->model[m]);
	free(study->model);
	return rc;
}

/* ---- figures ---- */

static int run_figure(struct study *study)
{
	int rc = psr_renderer_create(&study->renderer, study->err);

	if (rc != PSR_OK)
		return rc;
	printf("%s (%s%s)\n\n", study->kind->what, paper(study->kind), study->kind->figure);
	rc = study->kind->run(study);
	psr_renderer_destroy(study->renderer);
	return rc;
}

int main(int argc, char **argv)
{
	struct psr_build_options defaults;
	struct psr_error err;
	struct study study = { .err = &err, .out = "." };
	const char *models = NULL, *plot = NULL;
	int list = 0, version = 0, json = 0, has_resolution = 0, has_out = 0, is_figure = 0, n_operands, code;
	int64_t resolution = 256, n_threads;
	const struct psr_opt opts[] = {
		{ .name = "list", .type = PSR_OPT_FLAG, .value = &list, .help = "Prints the names, and what each shows." },
		{ .name = "keep", .type = PSR_OPT_STRING, .value = &study.keep, .arg = "DIR",
		  .help = "Keeps generated models that were built in this folder, as NAME-RES.psr, and reads models that are there"
		          " instead of building them. It does not check that this program made them. Tables that time the building"
		          " build anyway." },
		{ .name = "threads", .type = PSR_OPT_INT, .value = &n_threads, .arg = "N",
		  .help = "Processor cores to use; only times depend on it.", .min = 1, .max = 256 },
		{ .name = "version", .type = PSR_OPT_FLAG, .value = &version, .help = "Prints the version." },
		{ .name = "Tables", .type = PSR_OPT_HEADING },
		{ .name = "models", .type = PSR_OPT_STRING, .value = &models, .arg = "LIST",
		  .help = "The models to study: names of generators (psr-model make --list), terrain, and files, with commas"
		          " between them. A name with a dot or a slash is a file; octrees of scan:NAME are of points that a"
		          " scanner finds on it. Each study has models of its own if none are given." },
		{ .name = "resolution", .letter = 'r', .type = PSR_OPT_INT, .value = &resolution, .arg = "RES",
		  .help = "The resolution of the models, as for psr-model build; times grow with its square.", .min = 16,
		  .max = 2048, .seen = &has_resolution },
		{ .name = "plot", .type = PSR_OPT_STRING, .value = &plot, .arg = "FILE",
		  .help = "Draws the table into this .svg or .png, with gnuplot, which must be installed." },
		{ .name = "json", .type = PSR_OPT_FLAG, .value = &json,
		  .help = "Prints the table as a JSON object, with a row for each model as well." },
		{ .name = "Figures", .type = PSR_OPT_HEADING },
		{ .name = "out", .type = PSR_OPT_STRING, .value = &study.out, .arg = "DIR",
		  .help = "The folder to write pictures to.", .seen = &has_out },
		{ .name = NULL },
	};
	const struct psr_cli cli = {
		.usage = "psr-study NAME [options] | psr-study --list",
		.summary = "Repeats a study of Grossman's thesis, Point Sample Rendering ([G]), of Botsch, Wiratanaya and Kobbelt's"
		           " octrees ([B]) or of Kalaiah and Varshney's differential points ([K]), and prints its table, the mean over"
		           " some models; or draws a counterpart of one of its figures, and prints how far its parts are from the"
		           " ray-traced truth.",
		.opts = opts,
		.footer = "Examples:\n"
		          "  psr-study tolerance --models top,kittyhawk --plot tolerance.svg\n"
		          "  psr-study gaps --out docs/figures\n"
		          "\n"
		          "docs/studies.md and docs/figures.md explain the columns.\n"
		          "PSR_ISA=c, avx2 or avx512 limits the instructions that draw. Exit codes are those of psr-model.",
	};

	psr_build_options_default(&defaults);
	n_threads = defaults.n_threads;
	code = psr_isa_check_environment(&err);
	if (code == PSR_OK)
		code = psr_cli_parse(&cli, argc, argv, &n_operands, &err);
	if (code > 0)
		return 0;
	if (code == PSR_OK && version) {
		puts("psr-study " PSR_VERSION);
		return 0;
	}
	if (code == PSR_OK && list) {
		print_list();
		return 0;
	}
	if (code == PSR_OK && n_operands != 1)
		code = psr_fail(&err, PSR_ERR_ARG, "expected one NAME, got %d; psr-study --list prints the names", n_operands);
	if (code == PSR_OK && (study.kind = find_kind(argv[1], &is_figure, &err)) == NULL)
		code = err.code;
	if (code == PSR_OK && is_figure && (has_resolution || plot != NULL || json))
		code = psr_fail(&err, PSR_ERR_ARG, "%s is a figure; --resolution, --plot and --json are for tables", argv[1]);
	if (code == PSR_OK && is_figure && models != NULL && study.kind->models == NULL)
		code = psr_fail(&err, PSR_ERR_ARG, "%s has models of its own; --models is for tables and figures of octrees", argv[1]);
	if (code == PSR_OK && !is_figure && has_out)
		code = psr_fail(&err, PSR_ERR_ARG, "%s is a table; --out is for figures, --plot FILE draws a table", argv[1]);
	if (code == PSR_OK)
		study.names = models != NULL ? models : study.kind->models;
	study.resolution = (uint32_t)resolution;
	study.n_threads = (int)n_threads;
	study.has_bar = isatty(STDERR_FILENO);
	if (code == PSR_OK && (code = psr_pool_create(&study.pool, study.n_threads, NULL)) != PSR_OK)
		psr_fail(&err, code, "%d threads cannot be started", study.n_threads);
	if (code == PSR_OK)
		code = is_figure ? run_figure(&study) : run_table(&study, plot, json);
	psr_pool_destroy(study.pool);
	if (code == PSR_OK && fflush(stdout) != 0)
		code = psr_fail(&err, PSR_ERR_IO, "standard output cannot be written");
	return code == PSR_OK ? 0 : psr_cli_fail("psr-study", &err);
}
