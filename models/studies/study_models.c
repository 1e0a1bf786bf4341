#include <string.h>
#include "study.h"

/* [G] table 8.1. */
static const struct thesis {
	const char *name;
	double megabytes, blocks, minutes;
} thesis[] = {
	{ "chair", 1.32, 2666, 15 },      { "dragon", 0.96, 2100, 18 },   { "gavel", 1.20, 1779, 8 },
	{ "kittyhawk", 1.73, 3390, 62 },  { "pencil", 0.38, 682, 9 },     { "pinetree", 7.12, 11051, 95 },
	{ "plant", 2.33, 3973, 34 },      { "sailboat", 1.00, 1786, 13 }, { "table", 1.86, 3128, 78 },
	{ "teapot", 1.94, 2871, 34 },     { "top", 2.96, 4473, 43 },      { "toybird", 1.46, 2411, 11 },
	{ "tree", 7.41, 10694, 248 },     { "wheel", 2.19, 4742, 64 },
};
#define N_THESIS ((int)(sizeof thesis / sizeof *thesis))

enum {
	THESIS_MINUTES, THESIS_BLOCKS, THESIS_SIZE, BLOCKS, SAMPLES, SIZE, SECONDS, MISSING,
	PRODUCT_BLOCKS, PRODUCT_SAMPLES, PRODUCT_SIZE, PRODUCT_SECONDS, PRODUCT_MISSING, N_COLUMNS
};

static const struct study_column columns[N_COLUMNS] = {
	[THESIS_MINUTES] = { "[G] min", "thesis_minutes", 0 },
	[THESIS_BLOCKS] = { "blocks", "thesis_blocks", 0 },
	[THESIS_SIZE] = { "MB", "thesis_megabytes", 2 },
	[BLOCKS] = { "| greedy blocks", "greedy_blocks", 0 },
	[SAMPLES] = { "samples", "greedy_samples", 0 },
	[SIZE] = { "MB", "greedy_megabytes", 2 },
	[SECONDS] = { "s", "greedy_seconds", 2 },
	[MISSING] = { "missing", "greedy_missing_of_10000", 1 },
	[PRODUCT_BLOCKS] = { "| psr blocks", "blocks", 0 },
	[PRODUCT_SAMPLES] = { "samples", "samples", 0 },
	[PRODUCT_SIZE] = { "MB", "megabytes", 2 },
	[PRODUCT_SECONDS] = { "s", "seconds", 2 },
	[PRODUCT_MISSING] = { "missing", "missing_of_10000", 1 },
};

static void put_thesis(const struct study *study, int row)
{
	for (int i = 0; i < N_THESIS; i++) {
		if (strcmp(thesis[i].name, study->model[row].name) != 0)
			continue;
		*study_at(&study->table, row, 0, THESIS_MINUTES) = thesis[i].minutes;
		*study_at(&study->table, row, 0, THESIS_BLOCKS) = thesis[i].blocks;
		*study_at(&study->table, row, 0, THESIS_SIZE) = thesis[i].megabytes;
	}
}

static int put_greedy(struct study *study, int row)
{
	const struct study_model *model = &study->model[row];
	struct greedy_select_options options;
	struct greedy_result result;
	double missing = 0;
	struct greedy *greedy = NULL;
	int rc = study_scan(&greedy, study, row, 25, GREEDY_EQUILATERAL, GREEDY_THESIS);

	greedy_select_default(&options);
	if (rc == PSR_OK)
		rc = greedy_select(greedy, &options, &result, study->err);
	if (rc == PSR_OK)
		rc = study_missing(&missing, study, model, greedy, &result);
	if (rc == PSR_OK) {
		*study_at(&study->table, row, 0, BLOCKS) = (double)result.n_blocks;
		*study_at(&study->table, row, 0, SAMPLES) = (double)result.n_samples;
		*study_at(&study->table, row, 0, SIZE) = (double)result.n_bytes / 1e6;
		*study_at(&study->table, row, 0, SECONDS) = greedy->seconds_scan + result.seconds;
		*study_at(&study->table, row, 0, MISSING) = missing;
	}
	greedy_destroy(greedy);
	return rc;
}

static int put_product(struct study *study, int row)
{
	struct greedy_result result;
	struct greedy *greedy = NULL;
	double seconds, missing = 0;
	int rc = study_build(&greedy, &result, &seconds, study, &study->model[row]);

	if (rc == PSR_OK)
		rc = study_missing(&missing, study, &study->model[row], greedy, &result);
	greedy_destroy(greedy);
	if (rc != PSR_OK)
		return rc;
	*study_at(&study->table, row, 0, PRODUCT_BLOCKS) = (double)result.n_blocks;
	*study_at(&study->table, row, 0, PRODUCT_SAMPLES) = (double)result.n_samples;
	*study_at(&study->table, row, 0, PRODUCT_SIZE) = (double)result.n_bytes / 1e6;
	*study_at(&study->table, row, 0, PRODUCT_SECONDS) = seconds;
	*study_at(&study->table, row, 0, PRODUCT_MISSING) = missing;
	return PSR_OK;
}

int study_run_models(struct study *study)
{
	int rc = study_table_init(&study->table, "model", columns, N_COLUMNS, study->n_models, 1, study->err);

	study->total = study->n_models;
	for (int i = 0; rc == PSR_OK && i < study->n_models; i++) {
		snprintf(study->table.label[i], sizeof study->table.label[i], "%s", study->model[i].name);
		put_thesis(study, i);
		rc = put_greedy(study, i);
		if (rc == PSR_OK)
			rc = put_product(study, i);
		study_step(study, study->model[i].name);
	}
	return rc;
}
