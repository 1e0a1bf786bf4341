#include "study.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "models/commands.h"
#include "models/shapes/generators.h"
#include "base/json.h"
#include "psr/build.h"
#include "base/cli.h"

#define PROGRAM "psr-model study"
#define MOST_MODELS 64
/* Five as different as [G] 5.3 wants, "from the large smooth surfaces of 'top' to the intricate features of
 * 'kittyhawk'". */
#define FIVE "top,teapot,chair,plant,kittyhawk"

/* Size and time, relative, over the rows; x are the labels. Columns of $table: 3 + the table's. */
#define PLOT_SIZE_TIME(xlabel) PLOT_SIZE_TIME_OF(xlabel, "")
#define PLOT_SIZE_TIME_OF(xlabel, every) \
	"set style data linespoints\nset grid ytics\nset key top center\nset xlabel '" xlabel "'\n" \
	"set ylabel 'relative'\nset pointsize 1\nset xrange [-0.4:*]\nset offsets 0,0.4,0.02,0.02\n" \
	"plot $table " every " using 1:7:xtic(2) title 'file size' lw 2 pt 7, " \
	"'' " every " using 1:9 title 'warping time' lw 2 pt 5"

/* The last row is the equilateral lattice, the reference. */
#define PLOT_SQUARE \
	PLOT_SIZE_TIME_OF("tolerance angle, degrees", "every ::0::9") \
	", [-0.4:9.4] 1 title 'equilateral lattice, 25 degrees' lt 0 lw 2\n"

/* Rows 0-4 without cones, 5-9 with them. */
#define PLOT_MASKS \
	"set multiplot layout 1,2\nset style data linespoints\nset grid ytics\nset key bottom right\n" \
	"set xlabel 'bits of the mask'\nset xrange [-0.4:4.4]\nset yrange [*:*]\nset pointsize 1\n" \
	"set xtics ('none' 0, '8' 1, '32' 2, '128' 3, '512' 4)\n" \
	"set ylabel '% of blocks culled'\n" \
	"plot $table every ::0::4 using 1:3 title 'masks' lw 2 pt 7, " \
	"'' every ::5::9 using ($1-5):3 title 'masks and cones' lw 2 pt 5, " \
	"'' every ::0::4 using 1:5 title 'hidden' lt 0 lw 2 pt -1\n" \
	"set ylabel '% speedup'\n" \
	"plot $table every ::0::4 using 1:9 title 'masks' lw 2 pt 7, " \
	"'' every ::5::9 using ($1-5):9 title 'masks and cones' lw 2 pt 5\nunset multiplot\n"
#define PLOT_SUBDIVISION \
	"set style data linespoints\nset grid ytics\nset key top left\nset xlabel 'regions of the screen'\n" \
	"set ylabel '% over 1x1'\nset pointsize 1\nset xrange [-0.4:*]\nset offsets 0,0.4,0.02,0.02\n" \
	"plot $table using 1:10:xtic(2) title 'blocks culled' lw 2 pt 7, '' using 1:9 title 'speed' lw 2 pt 5\n"
#define NOTE_CULLING \
	"hidden: no ray from a sample gets to the eye; wrong: culled though one does; speedup: over the first line."

const struct study_kind study_kinds[] = {
	{ "tolerance", "figure 5.5", "tolerance angle, equilateral lattice", FIVE, study_run_tolerance,
	  PLOT_SIZE_TIME("tolerance angle, degrees"), NULL },
	{ "block-size", "figure 5.6", "side of the blocks", FIVE, study_run_block_size, PLOT_SIZE_TIME("block"), NULL },
	{ "square-lattice", "figure 5.7", "tolerance angle, square lattice", FIVE, study_run_square,
	  PLOT_SQUARE, NULL },
	{ "selection", "sections 5.2, 9.2", "what was tried to select blocks", FIVE, study_run_selection, NULL, NULL },
	{ "masks", "figure 6.7", "visibility tests and bits of the masks", FIVE, study_run_masks, PLOT_MASKS,
	  NOTE_CULLING },
	{ "subdivision", "figure 6.8", "subdivision of the screen, cones and 128 bits", FIVE, study_run_subdivision,
	  PLOT_SUBDIVISION, NOTE_CULLING },
	{ "models", "table 8.1", "the standard set", NULL, study_run_models, NULL, NULL },
	{ "culling", "table 8.3", "% of blocks culled by cones and masks", NULL, study_run_culling, NULL,
	  "hidden: no ray from a sample gets to the eye; wrong: culled though one does. frustum and after it: the same\n"
	  "views zoomed in, a quarter of the picture wide." },
};
const int n_study_kinds = sizeof study_kinds / sizeof *study_kinds;

void study_step(struct study *study, const char *what)
{
	study->done++;
	if (study->has_bar)
		fprintf(stderr, "\r%-14s %3d/%-3d %-24.24s", study->kind->name, study->done, study->total, what);
}

static void clear_bar(const struct study *study)
{
	if (study->has_bar)
		fprintf(stderr, "\r%*s\r", 48, "");
}

int study_find_name(const char *what, const char *name, int n, const char *(*name_of)(int), struct psr_error *err)
{
	char names[256] = "";
	size_t used = 0;

	for (int i = 0; i < n; i++)
		if (strcmp(name_of(i), name) == 0)
			return i;
	for (int i = 0; i < n && used < sizeof names; i++)
		used += (size_t)snprintf(names + used, sizeof names - used, "%s%s", i == 0 ? "" : ", ", name_of(i));
	return psr_fail(err, PSR_ERR_ARG, "there is no %s '%.64s'; there are: %s", what, name, names);
}

static const char *name_of(int i)
{
	return study_kinds[i].name;
}

static const struct study_kind *find_kind(const char *name, struct psr_error *err)
{
	int i = study_find_name("study", name, n_study_kinds, name_of, err);

	return i < 0 ? NULL : &study_kinds[i];
}

static int load_model(struct study *study, const char *name)
{
	int rc;

	if (name[0] == '\0')
		return psr_fail(study->err, PSR_ERR_ARG, "--models: there is an empty name");
	if (study->n_models == MOST_MODELS)
		return psr_fail(study->err, PSR_ERR_LIMIT, "--models: there are more than %d", MOST_MODELS);
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
	printf("%s ([G] %s) at %u:", study->kind->what, study->kind->figure, study->resolution);
	for (int m = 0; m < study->n_models; m++)
		printf("%s %s", m == 0 ? "" : ",", study->model[m].name);
	printf("\n\n");
	study_table_print(&study->table, stdout);
	if (study->kind->note != NULL)
		printf("\n%s\n", study->kind->note);
}

static int run_study(struct study *study, const char *models, const char *plot, int json)
{
	int rc = psr_pool_create(&study->pool, study->n_threads, NULL);

	if (rc != PSR_OK)
		return psr_fail(study->err, rc, "%d threads cannot be started", study->n_threads);
	rc = load_models(study, models != NULL ? models : study->kind->models);
	if (rc == PSR_OK)
		rc = study->kind->run(study);
	clear_bar(study);
	if (rc == PSR_OK && plot != NULL)
		rc = study_plot(study, plot, study->err);
	if (rc == PSR_OK && json)
		rc = print_json(study);
	else if (rc == PSR_OK)
		print_text(study);
	study_drop(study);
	study_table_fini(&study->table);
	for (int m = 0; m < study->n_models; m++)
		study_model_fini(&study->model[m]);
	free(study->model);
	psr_pool_destroy(study->pool);
	return rc;
}

static void print_list(void)
{
	for (int i = 0; i < n_study_kinds; i++)
		printf("%-14s  [G] %-17s  %s\n", study_kinds[i].name, study_kinds[i].figure, study_kinds[i].what);
}

int cmd_study(int argc, char **argv)
{
	struct psr_build_options defaults;
	struct psr_error err;
	struct study study = { .err = &err };
	const char *models = NULL, *plot = NULL;
	int list = 0, json = 0, n_operands, code;
	int64_t resolution = 256, n_threads;
	const struct psr_opt opts[] = {
		{ .name = "list", .type = PSR_OPT_FLAG, .value = &list, .help = "Prints the names of the studies, and what each shows." },
		{ .name = "models", .type = PSR_OPT_STRING, .value = &models, .arg = "LIST",
		  .help = "The models to study: names of generators (psr-model make --list) and files, with commas between them. If not"
		          " given: those that the study is made for." },
		{ .name = "resolution", .letter = 'r', .type = PSR_OPT_INT, .value = &resolution, .arg = "RES",
		  .help = "The resolution that models are built at, as of psr-model build; times grow with its square.", .min = 16, .max = 2048 },
		{ .name = "plot", .type = PSR_OPT_STRING, .value = &plot, .arg = "FILE",
		  .help = "Draws the table into this .svg or .png, with gnuplot, which must be installed." },
		{ .name = "keep", .type = PSR_OPT_STRING, .value = &study.keep, .arg = "DIR",
		  .help = "A folder that keeps generated models that were built, so that another run need not build them. Studies that"
		          " time the building build them anyway." },
		{ .name = "threads", .type = PSR_OPT_INT, .value = &n_threads, .arg = "N",
		  .help = "Processor cores to use; only times depend on it.", .min = 1, .max = 256 },
		{ .name = "json", .type = PSR_OPT_FLAG, .value = &json, .help = "Prints the table as a JSON object, and a row for each model." },
		{ .name = NULL },
	};
	const struct psr_cli cli = {
		.usage = "psr-model study NAME [options] | psr-model study --list",
		.summary = "Repeats a study of Grossman's thesis and prints its table, the mean over some models.",
		.opts = opts,
		.footer = "Example: psr-model study tolerance --models top,kittyhawk --plot tolerance.svg",
	};

	psr_build_options_default(&defaults);
	n_threads = defaults.n_threads;
	code = psr_cli_parse(&cli, argc, argv, &n_operands, &err);
	if (code > 0)
		return 0;
	if (code == PSR_OK && list) {
		print_list();
		return 0;
	}
	if (code == PSR_OK && n_operands != 1)
		code = psr_fail(&err, PSR_ERR_ARG, "one NAME is needed; psr-model study --list prints them");
	if (code == PSR_OK && (study.kind = find_kind(argv[1], &err)) == NULL)
		code = err.code;
	if (code == PSR_OK) {
		study.resolution = (uint32_t)resolution;
		study.n_threads = (int)n_threads;
		study.has_bar = isatty(STDERR_FILENO);
		code = run_study(&study, models, plot, json);
	}
	if (code == PSR_OK && fflush(stdout) != 0)
		code = psr_fail(&err, PSR_ERR_IO, "standard output cannot be written");
	return code == PSR_OK ? 0 : psr_cli_fail(PROGRAM, &err);
}
