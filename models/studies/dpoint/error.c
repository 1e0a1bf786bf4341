/* Differential points within an error: how many there are. */
#include "base/clock.h"
#include "models/studies/lib/study.h"
#include "sample/dpoint/of_mesh.h"
#include "study_dpoint.h"

enum { POINTS, BYTES, SECONDS, OFF, OVER, NORMAL_RMS, N_COLUMNS };

static const struct study_column columns[N_COLUMNS] = {
	{ "points", "points", 0 }, { "kB", "kilobytes", 0 }, { "s", "seconds", 1 }, { "off by", "off_by_pixels", 3 },
	{ "over", "points_over", 0 }, { "normal rms", "normal_rms_degrees", 2 },
};

static const double errors[] = { 0, 4, 2, 1, 0.5, 0.25 }; /* pixels; 0: no bound */
#define N_ERRORS (int)(sizeof errors / sizeof *errors)

static int measure(double value[N_COLUMNS], const struct study_model *model, double error, struct study *study)
{
	struct dpoint_build_options options;
	struct dpoint_build_report report;
	struct psr_model_info info = { .up = { 0, 1, 0 } };
	struct dpoint_set set;
	int rc;

	dpoint_build_options_default(&options, study->resolution);
	options.error = error;
	options.pool = study->pool;
	rc = dpoint_of_mesh(&set, &info, &report, model->mesh, &options, study->err);
	if (rc == PSR_OK) {
		value[POINTS] = set.n_points;
		value[BYTES] = (double)dpoint_set_bytes(&set) / 1e3;
		value[SECONDS] = report.seconds;
		value[OFF] = report.off_worst;
		value[OVER] = (double)report.n_over;
		value[NORMAL_RMS] = report.normal_rms / PSR_DEGREE;
	}
	dpoint_set_fini(&set);
	return rc;
}

int table_dpoint_error(struct study *study)
{
	const struct study_form form = { "model, error", columns, N_COLUMNS };
	int rc = study_table_init(&study->table, form, study->n_models * N_ERRORS, 1, study->err);

	study->total = study->n_models * N_ERRORS;
	for (int i = 0; i < study->total && rc == PSR_OK; i++) {
		const struct study_model *model = &study->model[i / N_ERRORS];
		const double error = errors[i % N_ERRORS];

		if (error > 0)
			study_label(&study->table, i, "%.20s %g", model->name, error);
		else
			study_label(&study->table, i, "%.20s, none", model->name);
		rc = measure(study_at(&study->table, i, 0, 0), model, error, study);
		study_step(study, model->name);
	}
	return rc;
}
