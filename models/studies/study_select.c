#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/mem.h"
#include "models/studies/greedy/warp.h"
#include "study.h"

#define RADIANS (3.14159265358979323846 / 180)
#define N_FRAMES 16
#define N_ROUNDS 3

enum { BLOCKS, SAMPLES, FILLED, SIZE, SIZE_RATIO, WARP, WARP_RATIO, CULLED, MISSING, FIRST_PASS, SECONDS, N_COLUMNS };

static const struct study_column columns[N_COLUMNS] = {
	[BLOCKS] = { "blocks", "blocks", 0 },
	[SAMPLES] = { "samples", "samples", 0 },
	[FILLED] = { "% valid", "percent_valid", 1 },
	[SIZE] = { "MB", "megabytes", 3 },
	[SIZE_RATIO] = { "size", "size_ratio", 3 },
	[WARP] = { "warp us", "warp_us", 0 },
	[WARP_RATIO] = { "time", "time_ratio", 3 },
	[CULLED] = { "% culled", "percent_culled", 1 },
	[MISSING] = { "missing/10000", "missing_of_10000", 2 },
	[FIRST_PASS] = { "before", "blocks_before", 0 },
	[SECONDS] = { "s", "seconds", 2 },
};

int study_missing(double *missing, const struct study *study, const struct study_model *model,
                  const struct greedy *greedy, const struct greedy_result *result)
{
	struct greedy_point *point = psr_alloc_array(result->n_samples, sizeof *point);
	uint64_t n_trials = 0, n_missing = 0;
	int rc;

	if (point == NULL)
		return psr_fail(study->err, PSR_ERR_MEMORY, "no memory for %llu samples",
		                (unsigned long long)result->n_samples);
	greedy_points(greedy, point);
	rc = study_trials_run(model->trials, point, result->n_samples, greedy->ds, study->pool, &n_trials, &n_missing);
	psr_free(point);
	if (rc != PSR_OK)
		return psr_fail(study->err, rc, "no memory to measure adequacy");
	*missing = n_trials != 0 ? 1e4 * (double)n_missing / (double)n_trials : 0;
	return PSR_OK;
}

int study_put(struct study *study, int row, int model, const struct greedy *greedy, const struct greedy_result *result,
              double seconds)
{
	const struct study_table *table = &study->table;
	int rc = study_missing(study_at(table, row, model, MISSING), study, &study->model[model], greedy, result);

	if (rc == PSR_OK)
		rc = greedy_warp_create(&study->warp[row * study->n_models + model], greedy, study->err);
	*study_at(table, row, model, BLOCKS) = (double)result->n_blocks;
	*study_at(table, row, model, SAMPLES) = (double)result->n_samples;
	*study_at(table, row, model, FILLED) = 100 * (double)result->n_samples / (double)result->n_lanes;
	*study_at(table, row, model, SIZE) = (double)result->n_bytes / 1e6;
	if (result->n_first_pass != 0)
		*study_at(table, row, model, FIRST_PASS) = (double)result->n_first_pass;
	*study_at(table, row, model, SECONDS) = seconds;
	study_step(study, study->model[model].name);
	return rc;
}

int study_select(struct study *study, int row, int model, struct greedy *greedy,
                 const struct greedy_select_options *options)
{
	double before = options->goes_on ? *study_at(&study->table, row - 1, model, SECONDS) : greedy->seconds_scan;
	struct greedy_result result;
	int rc = greedy_select(greedy, options, &result, study->err);

	return rc == PSR_OK ? study_put(study, row, model, greedy, &result, before + result.seconds) : rc;
}

int study_scan(struct greedy **out, struct study *study, int model, double degrees, enum greedy_lattice lattice,
               enum greedy_directions directions)
{
	const struct study_model *m = &study->model[model];
	const struct greedy_scan_options options = { .resolution = study->resolution, .tolerance = degrees * RADIANS,
		                                         .lattice = lattice, .directions = directions };

	return greedy_create(out, m->mesh, m->scene, m->scale, &options, study->pool, study->err);
}

int study_start(struct study *study, const char *first, int n_rows)
{
	study->total = n_rows * study->n_models;
	study->warp = calloc((size_t)study->total, sizeof *study->warp);
	if (study->warp == NULL)
		return psr_fail(study->err, PSR_ERR_MEMORY, "no memory for %d rows", n_rows);
	study->n_warps = study->total;
	return study_table_init(&study->table, first, columns, N_COLUMNS, n_rows, study->n_models, study->err);
}

void study_drop(struct study *study)
{
	for (int i = 0; i < study->n_warps; i++)
		greedy_warp_destroy(study->warp[i]);
	free(study->warp);
	study->warp = NULL;
	study->n_warps = 0;
}

/* All rows of a model one after the other, some times: a machine's speed drifts. */
static int time_warps(struct study *study)
{
	const struct study_table *table = &study->table;

	for (int i = 0; i < N_ROUNDS * study->n_warps; i++) {
		int row = i % table->n_rows, model = i / table->n_rows % study->n_models;
		double *us = study_at(table, row, model, WARP);
		struct greedy_warp_time time;
		int rc = greedy_warp_run(study->warp[row * study->n_models + model], N_FRAMES, &time, study->err);

		if (rc != PSR_OK)
			return rc;
		*us = fmin(*us, 1e6 * time.seconds); /* NAN at first */
		*study_at(table, row, model, CULLED) = 100 * time.culled;
	}
	return PSR_OK;
}

int study_finish(struct study *study, int base)
{
	int rc = time_warps(study);

	study_drop(study);
	study_relate(&study->table, SIZE, SIZE_RATIO, base);
	study_relate(&study->table, WARP, WARP_RATIO, base);
	return rc;
}

static int run_angles(struct study *study, const double *degrees, int n, enum greedy_lattice lattice)
{
	struct greedy_select_options options;
	int rc = study_start(study, "degrees", n + (lattice == GREEDY_SQUARE)), base = n;

	greedy_select_default(&options);
	for (int i = 0; rc == PSR_OK && i < n; i++) {
		snprintf(study->table.label[i], sizeof study->table.label[i], "%.0f", degrees[i]);
		base = lattice == GREEDY_EQUILATERAL && degrees[i] == 25 ? i : base;
		for (int m = 0; rc == PSR_OK && m < study->n_models; m++) {
			struct greedy *greedy = NULL;

			rc = study_scan(&greedy, study, m, degrees[i], lattice, GREEDY_THESIS);
			if (rc == PSR_OK)
				rc = study_select(study, i, m, greedy, &options);
			greedy_destroy(greedy);
		}
	}
	for (int m = 0; rc == PSR_OK && lattice == GREEDY_SQUARE && m < study->n_models; m++) {
		struct greedy *greedy = NULL;

		snprintf(study->table.label[n], sizeof study->table.label[n], "25 (equilateral)");
		rc = study_scan(&greedy, study, m, 25, GREEDY_EQUILATERAL, GREEDY_THESIS);
		if (rc == PSR_OK)
			rc = study_select(study, n, m, greedy, &options);
		greedy_destroy(greedy);
	}
	if (rc == PSR_OK)
		rc = study_finish(study, base);
	return rc;
}

int study_run_tolerance(struct study *study)
{
	static const double degrees[] = { 5, 10, 15, 20, 25, 30, 35, 40, 45, 50 };

	return run_angles(study, degrees, (int)(sizeof degrees / sizeof *degrees), GREEDY_EQUILATERAL);
}

int study_run_square(struct study *study)
{
	static const double degrees[] = { 20, 25, 30, 35, 40, 44, 45, 46, 50, 55 };

	return run_angles(study, degrees, (int)(sizeof degrees / sizeof *degrees), GREEDY_SQUARE);
}

int study_run_block_size(struct study *study)
{
	static const int side[] = { 4, 8, 16, 32 };
	struct greedy_select_options options;
	int n = (int)(sizeof side / sizeof *side), rc = study_start(study, "block", n);

	greedy_select_default(&options);
	for (int m = 0; rc == PSR_OK && m < study->n_models; m++) {
		struct greedy *greedy = NULL;

		rc = study_scan(&greedy, study, m, 25, GREEDY_EQUILATERAL, GREEDY_THESIS);
		for (int i = 0; rc == PSR_OK && i < n; i++) {
			snprintf(study->table.label[i], sizeof study->table.label[i], "%dx%d", side[i], side[i]);
			options.side = side[i];
			rc = study_select(study, i, m, greedy, &options);
		}
		greedy_destroy(greedy);
	}
	if (rc == PSR_OK)
		rc = study_finish(study, 1);
	return rc;
}
