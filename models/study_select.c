#include <math.h>
#include <string.h>
#include "base/mem.h"
#include "sample/greedy_warp.h"
#include "study.h"

#define RADIANS (3.14159265358979323846 / 180)
#define N_FRAMES 16

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

int study_measure(struct study_measure *out, const struct study *study, const struct study_model *model,
                  const struct greedy *greedy, const struct greedy_result *result)
{
	struct greedy_point *point = psr_alloc_array(result->n_samples, sizeof *point);
	struct greedy_warp *warp = NULL;
	struct greedy_warp_time time = { 0 };
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
	rc = greedy_warp_create(&warp, greedy, study->err);
	if (rc == PSR_OK)
		rc = greedy_warp_run(warp, N_FRAMES, &time, study->err);
	greedy_warp_destroy(warp);
	*out = (struct study_measure){ .result = *result, .warp = time.seconds, .culled = time.culled,
		                           .missing = n_trials != 0 ? 1e4 * (double)n_missing / (double)n_trials : 0 };
	return rc;
}

void study_put(struct study *study, int row, int model, const struct study_measure *m, double seconds)
{
	const struct study_table *table = &study->table;

	*study_at(table, row, model, BLOCKS) = (double)m->result.n_blocks;
	*study_at(table, row, model, SAMPLES) = (double)m->result.n_samples;
	*study_at(table, row, model, FILLED) = 100 * (double)m->result.n_samples / (double)m->result.n_lanes;
	*study_at(table, row, model, SIZE) = (double)m->result.n_bytes / 1e6;
	*study_at(table, row, model, WARP) = m->warp * 1e6;
	*study_at(table, row, model, CULLED) = 100 * m->culled;
	*study_at(table, row, model, MISSING) = m->missing;
	if (m->result.n_first_pass != 0)
		*study_at(table, row, model, FIRST_PASS) = (double)m->result.n_first_pass;
	*study_at(table, row, model, SECONDS) = seconds;
}

int study_select(struct study *study, int row, int model, struct greedy *greedy,
                 const struct greedy_select_options *options)
{
	double before = options->goes_on ? *study_at(&study->table, row - 1, model, SECONDS) : greedy->seconds_scan;
	struct greedy_result result;
	struct study_measure measure;
	int rc = greedy_select(greedy, options, &result, study->err);

	if (rc == PSR_OK)
		rc = study_measure(&measure, study, &study->model[model], greedy, &result);
	if (rc == PSR_OK)
		study_put(study, row, model, &measure, before + result.seconds);
	study_step(study, study->model[model].name);
	return rc;
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
	return study_table_init(&study->table, first, columns, N_COLUMNS, n_rows, study->n_models, study->err);
}

void study_finish(struct study *study, int base)
{
	study_relate(&study->table, SIZE, SIZE_RATIO, base);
	study_relate(&study->table, WARP, WARP_RATIO, base);
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
		study_finish(study, base);
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
		study_finish(study, 1);
	return rc;
}
