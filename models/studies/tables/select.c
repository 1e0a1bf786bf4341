#include <math.h>
#include <stdlib.h>
#include "base/maths.h"
#include "base/mem.h"
#include "tables.h"

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

int selection_missing(double *missing, const struct study *study, const struct study_model *model,
                      const struct greedy *greedy, const struct greedy_result *result)
{
	struct trials_sample *sample = psr_alloc_array(result->n_samples, sizeof *sample);
	struct trials_count count = { 0, 0 };
	int rc = PSR_ERR_MEMORY;

	if (sample != NULL) {
		greedy_samples(greedy, sample);
		rc = trials_run(&count, model->trials, sample, result->n_samples, greedy->ds, study->pool);
	}
	psr_free(sample);
	*missing = count.n_trials != 0 ? 1e4 * (double)count.n_missing / (double)count.n_trials : 0;
	return rc == PSR_OK ? rc : psr_fail(study->err, rc, "no memory to measure adequacy");
}

int selection_of_model(struct greedy **out, struct greedy_result *result, double *seconds, const struct study *study,
                       const struct study_model *model)
{
	struct psr_model *built = NULL;
	int rc = study_build(&built, seconds, study, model);

	if (rc != PSR_OK)
		return rc;
	rc = greedy_take_model(out, psr_model_blocks(built), study->resolution, result, study->err);
	psr_model_unref(built);
	return rc;
}

int selections_start(struct selections *s, struct study *study, const char *first, int n_rows)
{
	study->total = n_rows * study->n_models;
	*s = (struct selections){ study, calloc((size_t)study->total, sizeof *s->warp) };
	if (s->warp == NULL)
		return psr_fail(study->err, PSR_ERR_MEMORY, "no memory for %d rows", n_rows);
	return study_table_init(&study->table, (struct study_form){ first, columns, N_COLUMNS }, n_rows, study->n_models,
	                        study->err);
}

int selections_put(struct selections *s, int row, int model, const struct greedy *greedy,
                   const struct greedy_result *result, double seconds)
{
	struct study *study = s->study;
	double *value = study_at(&study->table, row, model, 0);
	int rc = selection_missing(&value[MISSING], study, &study->model[model], greedy, result);

	if (rc == PSR_OK)
		rc = greedy_warp_create(&s->warp[row * study->n_models + model], greedy, study->err);
	value[BLOCKS] = (double)result->n_blocks;
	value[SAMPLES] = (double)result->n_samples;
	value[FILLED] = 100 * (double)result->n_samples / (double)result->n_lanes;
	value[SIZE] = (double)result->n_bytes / 1e6;
	if (result->n_first_pass != 0)
		value[FIRST_PASS] = (double)result->n_first_pass;
	value[SECONDS] = seconds;
	study_step(study, study->model[model].name);
	return rc;
}

int selection_scan(struct greedy **greedy, struct study *study, int model, const struct selection *selection)
{
	const struct greedy_scan_options options = { study->resolution,
		                                         (selection->degrees > 0 ? selection->degrees : 25) * PSR_DEGREE,
		                                         selection->lattice, selection->directions };

	greedy_destroy(*greedy);
	*greedy = NULL;
	return greedy_create(greedy, &study->model[model], &options, study->pool, study->err);
}

static int is_same_scan(const struct selection *a, const struct selection *b)
{
	return a->degrees == b->degrees && a->lattice == b->lattice && a->directions == b->directions;
}

static void take_options(struct greedy_select_options *options, const struct selection *selection)
{
	greedy_select_default(options);
	options->goes_on = selection->goes_on;
	options->second_pass = !selection->no_second_pass;
	options->is_facing = !selection->not_facing;
	options->by_score = selection->by_score;
	options->drops_samples = selection->drops;
	options->is_strict_first = options->forgives_outlines = selection->strict;
	if (selection->depth > 0)
		options->depth_tolerance = selection->depth;
	if (selection->is_one_test)
		options->n_rotations = options->n_shifts = 1;
	if (selection->side != 0)
		options->side = selection->side;
}

int selections_run(struct selections *s, int model, const struct selection *selection, int n)
{
	struct study *study = s->study;
	struct greedy *greedy = NULL;
	double seconds = 0;
	int rc = PSR_OK;

	for (int i = 0; rc == PSR_OK && i < n; i++) {
		struct greedy_select_options options;
		struct greedy_result result;

		study_label(&study->table, i, "%s", selection[i].label);
		if (i == 0 || !is_same_scan(&selection[i], &selection[i - 1]))
			rc = selection_scan(&greedy, study, model, &selection[i]);
		take_options(&options, &selection[i]);
		if (rc == PSR_OK)
			rc = greedy_select(greedy, &options, &result, study->err);
		if (rc != PSR_OK)
			break;
		seconds = (options.goes_on ? seconds : greedy->seconds_scan) + result.seconds;
		rc = selections_put(s, i, model, greedy, &result, seconds);
	}
	greedy_destroy(greedy);
	return rc;
}

/* Goes through all rows of a model, several times: a machine's speed drifts. */
static int time_warps(struct selections *s)
{
	const struct study_table *table = &s->study->table;
	const int n_models = table->n_models;

	for (int i = 0; i < N_ROUNDS * table->n_rows * n_models; i++) {
		int row = i % table->n_rows, model = i / table->n_rows % n_models;
		double *value = study_at(table, row, model, 0);
		struct greedy_warp_time time;
		int rc = greedy_warp_run(s->warp[row * n_models + model], N_FRAMES, &time, s->study->err);

		if (rc != PSR_OK)
			return rc;
		value[WARP] = fmin(value[WARP], 1e6 * time.seconds); /* NAN at first */
		value[CULLED] = 100 * time.culled;
	}
	return PSR_OK;
}

int selections_finish(struct selections *s, int base, int rc)
{
	if (rc == PSR_OK)
		rc = time_warps(s);
	for (int i = 0; s->warp != NULL && i < s->study->total; i++)
		greedy_warp_destroy(s->warp[i]);
	free(s->warp);
	if (rc == PSR_OK) {
		study_relate(&s->study->table, SIZE, SIZE_RATIO, base);
		study_relate(&s->study->table, WARP, WARP_RATIO, base);
	}
	return rc;
}

/* ---- figures 5.5 to 5.7 ---- */

static int run(struct study *study, const char *first, const struct selection *selection, int n, int base)
{
	struct selections s;
	int rc = selections_start(&s, study, first, n);

	for (int m = 0; rc == PSR_OK && m < study->n_models; m++)
		rc = selections_run(&s, m, selection, n);
	return selections_finish(&s, base, rc);
}

int table_tolerance(struct study *study)
{
#define ANGLE(angle) { #angle, .degrees = angle }
	static const struct selection row[] = { ANGLE(5), ANGLE(10), ANGLE(15), ANGLE(20), ANGLE(25), ANGLE(30), ANGLE(35),
		                                    ANGLE(40), ANGLE(45), ANGLE(50) };
#undef ANGLE

	return run(study, "degrees", row, 10, 4);
}

int table_square(struct study *study)
{
#define SQUARE(angle) { #angle, .degrees = angle, .lattice = GREEDY_SQUARE }
	static const struct selection row[] = {
		SQUARE(20), SQUARE(25), SQUARE(30), SQUARE(35), SQUARE(40), SQUARE(44), SQUARE(45), SQUARE(46), SQUARE(50),
		SQUARE(55), { "25 (equilateral)", .degrees = 25 },
	};
#undef SQUARE

	return run(study, "degrees", row, 11, 10);
}

int table_block_size(struct study *study)
{
	static const struct selection row[] = {
		{ "4x4", .side = 4 }, { "8x8", .side = 8 }, { "16x16", .side = 16 }, { "32x32", .side = 32 },
	};

	return run(study, "block", row, 4, 1);
}
