/* Tables 8.1 and 8.3: the standard set beside the thesis's. */
#include <string.h>
#include "models/studies/cull/cull.h"
#include "tables.h"

#define THESIS_COLUMNS 3 /* the first ones of both tables */

struct thesis {
	const char *name;
	double value[THESIS_COLUMNS];
};

static int run(struct study *study, const struct study_column *column, int n_columns, const struct thesis thesis[14],
               int (*put)(struct study *study, int row))
{
	const struct study_form form = { "model", column, n_columns };
	int rc = study_table_init(&study->table, form, study->n_models, 1, study->err);

	study->total = study->n_models;
	for (int row = 0; rc == PSR_OK && row < study->n_models; row++) {
		const char *name = study->model[row].name;

		study_label(&study->table, row, "%s", name);
		for (int i = 0; i < 14; i++)
			if (strcmp(thesis[i].name, name) == 0)
				memcpy(study_at(&study->table, row, 0, 0), thesis[i].value, sizeof thesis[i].value);
		rc = put(study, row);
		study_step(study, name);
	}
	return rc;
}

/* ---- table 8.1: sizes ---- */

enum { BLOCKS, SAMPLES, SIZE, SECONDS, MISSING, N_SIZES };
enum { GREEDY = THESIS_COLUMNS, PRODUCT = GREEDY + N_SIZES, N_SIZE_COLUMNS = PRODUCT + N_SIZES };

static int put_sizes(struct study *study, int row, int first, const struct greedy *greedy,
                     const struct greedy_result *result, double seconds)
{
	double *value = study_at(&study->table, row, 0, first);

	value[BLOCKS] = (double)result->n_blocks;
	value[SAMPLES] = (double)result->n_samples;
	value[SIZE] = (double)result->n_bytes / 1e6;
	value[SECONDS] = seconds;
	return selection_missing(&value[MISSING], study, &study->model[row], greedy, result);
}

static int put_models(struct study *study, int row)
{
	static const struct selection thesis;
	struct greedy *greedy = NULL;
	struct greedy_select_options options;
	struct greedy_result result;
	double seconds;
	int rc = selection_scan(&greedy, study, row, &thesis);

	greedy_select_default(&options);
	if (rc == PSR_OK)
		rc = greedy_select(greedy, &options, &result, study->err);
	if (rc == PSR_OK)
		rc = put_sizes(study, row, GREEDY, greedy, &result, greedy->seconds_scan + result.seconds);
	greedy_destroy(greedy);
	greedy = NULL;
	if (rc == PSR_OK)
		rc = selection_of_model(&greedy, &result, &seconds, study, &study->model[row]);
	if (rc == PSR_OK)
		rc = put_sizes(study, row, PRODUCT, greedy, &result, seconds);
	greedy_destroy(greedy);
	return rc;
}

int table_models(struct study *study)
{
	static const struct thesis thesis[14] = {
		{ "chair", { 15, 2666, 1.32 } },     { "dragon", { 18, 2100, 0.96 } },    { "gavel", { 8, 1779, 1.20 } },
		{ "kittyhawk", { 62, 3390, 1.73 } }, { "pencil", { 9, 682, 0.38 } },      { "pinetree", { 95, 11051, 7.12 } },
		{ "plant", { 34, 3973, 2.33 } },     { "sailboat", { 13, 1786, 1.00 } },  { "table", { 78, 3128, 1.86 } },
		{ "teapot", { 34, 2871, 1.94 } },    { "top", { 43, 4473, 2.96 } },       { "toybird", { 11, 2411, 1.46 } },
		{ "tree", { 248, 10694, 7.41 } },    { "wheel", { 64, 4742, 2.19 } },
	};
	static const struct study_column columns[N_SIZE_COLUMNS] = {
		{ "[G] min", "thesis_minutes", 0 },
		{ "blocks", "thesis_blocks", 0 },
		{ "MB", "thesis_megabytes", 2 },
		[GREEDY + BLOCKS] = { "| greedy blocks", "greedy_blocks", 0 },
		[GREEDY + SAMPLES] = { "samples", "greedy_samples", 0 },
		[GREEDY + SIZE] = { "MB", "greedy_megabytes", 2 },
		[GREEDY + SECONDS] = { "s", "greedy_seconds", 2 },
		[GREEDY + MISSING] = { "missing", "greedy_missing_of_10000", 1 },
		[PRODUCT + BLOCKS] = { "| psr blocks", "blocks", 0 },
		[PRODUCT + SAMPLES] = { "samples", "samples", 0 },
		[PRODUCT + SIZE] = { "MB", "megabytes", 2 },
		[PRODUCT + SECONDS] = { "s", "seconds", 2 },
		[PRODUCT + MISSING] = { "missing", "missing_of_10000", 1 },
	};

	return run(study, columns, N_SIZE_COLUMNS, thesis, put_models);
}

/* ---- table 8.3: culling ---- */

#define N_VIEWS 24
#define ZOOM 4 /* of the views that show how much a frustum culls */

enum {
	CONE = THESIS_COLUMNS, MASK, BOTH, BLOCKS_HIDDEN, BOTH_SAMPLES, SAMPLES_HIDDEN, BOTH_WRONG, FRUSTUM, FRUSTUM_BOTH,
	FRUSTUM_HIDDEN, N_CULLING
};

static int put_culling(struct study *study, int row)
{
	static const struct cull_choice choice[] = {
		{ 1, CULL_NO_MASK, 0 }, { 0, CULL_THESIS_LEVEL, CULL_THESIS_N }, { 1, CULL_THESIS_LEVEL, CULL_THESIS_N },
		{ 0, CULL_NO_MASK, 0 },
	};
	const struct cull_views whole = { N_VIEWS, 1, 0, choice, 3 }, part = { N_VIEWS, ZOOM, 0, choice, 4 };
	const struct study_model *model = &study->model[row];
	double *value = study_at(&study->table, row, 0, 0);
	struct cull_result result;
	struct cull_set *set = NULL;
	int rc = culling_set(&set, study, model, CULL_THESIS_LEVEL);

	if (rc == PSR_OK)
		rc = cull_measure(&result, set, model->scene, &whole, study->pool, study->err);
	if (rc == PSR_OK) {
		for (int i = 0; i < 3; i++)
			value[CONE + i] = 100 * result.figures[i].blocks;
		value[BLOCKS_HIDDEN] = 100 * result.blocks;
		value[BOTH_SAMPLES] = 100 * result.figures[2].samples;
		value[SAMPLES_HIDDEN] = 100 * result.samples;
		value[BOTH_WRONG] = 100 * result.figures[2].wrong;
		rc = cull_measure(&result, set, model->scene, &part, study->pool, study->err);
	}
	if (rc == PSR_OK) {
		value[FRUSTUM] = 100 * result.figures[3].blocks;
		value[FRUSTUM_BOTH] = 100 * result.figures[2].blocks;
		value[FRUSTUM_HIDDEN] = 100 * result.blocks;
	}
	cull_set_destroy(set);
	return rc;
}

int table_culling(struct study *study)
{
	static const struct thesis thesis[14] = {
		{ "chair", { 13.5, 15.6, 19.0 } },     { "dragon", { 16.1, 19.1, 24.1 } },   { "gavel", { 19.3, 29.1, 31.9 } },
		{ "kittyhawk", { 14.3, 25.0, 26.6 } }, { "pencil", { 23.8, 26.8, 30.5 } },   { "pinetree", { 1.2, 11.1, 11.6 } },
		{ "plant", { 29.3, 27, 34 } },         { "sailboat", { 27.2, 26.9, 31.0 } }, { "table", { 26.0, 30.7, 36.0 } },
		{ "teapot", { 32.1, 25.5, 35.3 } },    { "top", { 39.6, 37.5, 46.4 } },      { "toybird", { 23.0, 20.5, 27.5 } },
		{ "tree", { 4.9, 36.5, 36.8 } },       { "wheel", { 20.3, 22.2, 25.3 } },
	};
	static const struct study_column columns[N_CULLING] = {
		{ "[G] cone", "thesis_percent_cone", 1 },
		{ "mask", "thesis_percent_mask", 1 },
		{ "both", "thesis_percent_both", 1 },
		[CONE] = { "| cone", "percent_cone", 1 },
		[MASK] = { "mask", "percent_mask", 1 },
		[BOTH] = { "both", "percent_both", 1 },
		[BLOCKS_HIDDEN] = { "hidden", "percent_hidden", 1 },
		[BOTH_SAMPLES] = { "| samples", "percent_samples_both", 1 },
		[SAMPLES_HIDDEN] = { "hidden", "percent_samples_hidden", 1 },
		[BOTH_WRONG] = { "| wrong", "percent_wrong", 3 },
		[FRUSTUM] = { "| frustum", "zoomed_percent_frustum", 1 },
		[FRUSTUM_BOTH] = { "all", "zoomed_percent_all", 1 },
		[FRUSTUM_HIDDEN] = { "hidden", "zoomed_percent_hidden", 1 },
	};

	return run(study, columns, N_CULLING, thesis, put_culling);
}
