/* Table 1 of [K]: the teapot's patches, before and after simplification. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "dpoint/group.h"
#include "models/shapes/teapot.h"
#include "models/studies/tables/tables.h"
#include "study_dpoint.h"

enum { POINTS, KEPT, BYTES, SECONDS, NORMAL_RMS, NORMAL_WORST, HEIGHT_WORST, OVERLAP, HOLES, N_COLUMNS };

static const struct study_column columns[N_COLUMNS] = {
	{ "points", "points", 0 }, { "kept %", "kept_percent", 2 }, { "kB", "kilobytes", 0 }, { "s", "seconds", 1 },
	{ "normal rms", "normal_rms_degrees", 2 }, { "worst", "normal_worst_degrees", 1 },
	{ "height worst", "height_worst", 4 }, { "overlap", "overlap", 2 }, { "holes %", "holes_percent", 2 },
};

enum way { ALL, THEIRS, OURS, FITTED };

/* side: candidates along a side of a patch: 70 make 156,800, as [K] has. cells: along a side of a candidate's part. */
struct row {
	const char *label;
	enum way way;
	float delta, degrees, height;
	int is_within_parts, bytes;
	uint32_t side, cells, sparse;
};

static const struct row rows[] = {
	{ "all points, 62 bytes", ALL, STUDY_DPOINT_DELTA, 170, 1, 1, 62, 70, 2, 1 },
	{ "[K] 4.2, within patches", THEIRS, STUDY_DPOINT_DELTA, 170, 1, 1, 62, 70, 2, 1 },
	{ "front, across", OURS, STUDY_DPOINT_DELTA, 170, 1, 0, 16, 70, 2, 1 },
	{ "fitted, 2 degrees", FITTED, STUDY_DPOINT_DELTA_FREE, 2, 0.002f, 0, 16, 70, 2, 1 },
	{ "the same in two turns", FITTED, STUDY_DPOINT_DELTA_FREE, 2, 0.002f, 0, 16, 70, 2, 6 },
	{ "fitted, 4 degrees", FITTED, STUDY_DPOINT_DELTA_FREE, 4, 0.002f, 0, 16, 70, 2, 1 },
	{ "380,192: 2 degrees, two turns", FITTED, STUDY_DPOINT_DELTA_FREE, 2, 0.002f, 0, 16, 109, 1, 12 },
};
#define N_ROWS (int)(sizeof rows / sizeof *rows)

static int sample_teapot(struct dpoint_surface *surface, const struct row *row)
{
	const struct dpoint_uniform uniform = { row->side, row->cells, STUDY_DPOINT_ORIGIN, 1 / STUDY_DPOINT_RADIUS,
		                                    .delta = row->delta,
		                                    .sine = row->way == FITTED ? dpoint_sine(STUDY_DPOINT_EPSILON) : 0 };

	return study_dpoint_teapot(surface, &uniform);
}

static int keep_all(struct dpoint_choice *choice, const struct dpoint_cover *cover)
{
	struct heap heap;
	struct tally tally;
	int rc = choice_init(choice, &heap, &tally, cover);

	if (rc == PSR_OK) {
		for (uint32_t i = 0; i < cover->n_candidates; i++) {
			choice->is_kept[i] = 1;
			tally_add(&tally, i, 1);
		}
		choice_finish(choice, &tally);
	}
	choice_fini(&heap, &tally);
	return rc;
}

static int choose(struct dpoint_choice *choice, enum way way, const struct dpoint_surface *surface,
                  const struct dpoint_cover *cover)
{
	return way == ALL ? keep_all(choice, cover) : way == THEIRS ? study_dpoint_prune(choice, surface, cover)
	                                                            : dpoint_choose(choice, cover);
}

static void put(double value[N_COLUMNS], const struct row *row, const struct dpoint_surface *surface,
                const struct dpoint_choice *choice, const struct dpoint_errors *errors)
{
	value[POINTS] = (double)choice->n_kept;
	value[KEPT] = 100 * (double)choice->n_kept / (row->side * row->side * TEAPOT_PATCHES);
	value[BYTES] = (double)choice->n_kept * row->bytes / 1e3;
	value[NORMAL_RMS] = errors->normal_rms / PSR_DEGREE;
	value[NORMAL_WORST] = errors->normal_worst / PSR_DEGREE;
	value[HEIGHT_WORST] = errors->height_worst;
	value[OVERLAP] = errors->overlap;
	value[HOLES] = 100 * (double)choice->n_holes / (double)surface->n_cells;
}

static int measure(double value[N_COLUMNS], const struct row *row, struct study *study)
{
	struct dpoint_cover_options options = STUDY_DPOINT_FITTED(row->degrees, row->height);
	struct dpoint_surface surface;
	struct dpoint_cover cover = { 0 };
	struct dpoint_choice choice = { 0 };
	struct dpoint_set set = { 0 };
	struct dpoint_errors errors;
	double start = clock_seconds();
	int rc;

	options.is_within_parts = row->is_within_parts;
	dpoint_surface_init(&surface);
	rc = sample_teapot(&surface, row);
	if (rc == PSR_OK && row->way == FITTED)
		rc = dpoint_simplify(&choice, &cover, &surface, &options, row->sparse, study->pool, NULL);
	else if (rc == PSR_OK)
		rc = dpoint_cover_init(&cover, &surface, &options, study->pool, NULL);
	if (rc == PSR_OK && row->way != FITTED)
		rc = choose(&choice, row->way, &surface, &cover);
	if (rc == PSR_OK && row->way == FITTED)
		rc = dpoint_set_make(&set, &(struct dpoint_grouping){ &surface, &choice, options.sine, NULL });
	value[SECONDS] = clock_seconds() - start;
	if (rc == PSR_OK)
		rc = dpoint_measure(&errors, &surface, &cover, &choice, study->pool);
	if (rc == PSR_OK)
		put(value, row, &surface, &choice, &errors);
	if (rc == PSR_OK && row->way == FITTED)
		value[BYTES] = (double)dpoint_set_bytes(&set) / 1e3;
	dpoint_set_fini(&set);
	dpoint_choice_fini(&choice);
	dpoint_cover_fini(&cover);
	dpoint_surface_fini(&surface);
	return rc == PSR_OK ? rc : psr_fail(study->err, rc, "no memory for the teapot's points");
}

int table_dpoint(struct study *study)
{
	const struct study_form form = { "way", columns, N_COLUMNS };
	int rc;

	if (study->n_models != 1 || strcmp(study->model[0].name, "teapot") != 0)
		return psr_fail(study->err, PSR_ERR_ARG, "this table is of the teapot's own patches; leave --models out");
	rc = study_table_init(&study->table, form, N_ROWS, 1, study->err);
	study->total = N_ROWS;
	for (int i = 0; i < N_ROWS && rc == PSR_OK; i++) {
		study_label(&study->table, i, "%s", rows[i].label);
		rc = measure(study_at(&study->table, i, 0, 0), &rows[i], study);
		study_step(study, rows[i].label);
	}
	return rc;
}
