/* Table 1 of [K]: points, bytes, preparation and frames of three models, before and after simplification. */
#include <string.h>
#include "base/clock.h"
#include "models/studies/tables/tables.h"
#include "study_dpoint.h"
#include "view.h"

#define SIDE 70      /* samples along a side of a patch: 156,800, as [K] has */

enum { POINTS, BYTES, SECONDS, DIFFUSE, SPECULAR, DB, HOLES, LEAKS, N_COLUMNS };

static const struct study_column columns[N_COLUMNS] = {
	{ "points", "points", 0 }, { "kB", "kilobytes", 0 }, { "s", "seconds", 1 },
	{ "diffuse", "diffuse_frames_per_second", 1 }, { "specular", "specular_frames_per_second", 1 },
	{ "dB", "db", 2 }, { "holes", "holes", 0 }, { "leaks", "leaks", 0 },
};

static int put_frames(double value[N_COLUMNS], struct dpoint_view *view, struct study_dpoint *made)
{
	struct dpoint_way way[2] = { { .model = NULL }, { .model = NULL } }; /* diffuse, specular */
	struct psr_errors errors;
	double fps[2], bright;
	int rc = PSR_OK;

	for (int k = 0; k < 2 && rc == PSR_OK; k++)
		rc = study_dpoint_model(&way[k].model, view->study, view->of, &made->surface, &made->choice, k);
	if (rc == PSR_OK)
		rc = dpoint_view_time(fps, view, way, 2);
	if (rc == PSR_OK)
		rc = dpoint_view_score(&errors, &bright, view, &way[1]);
	if (rc == PSR_OK) {
		value[BYTES] = (double)psr_model_bytes(way[1].model) / 1e3;
		value[DIFFUSE] = fps[0];
		value[SPECULAR] = fps[1];
		value[DB] = errors.psnr_inside;
		value[HOLES] = (double)errors.n_holes;
		value[LEAKS] = (double)errors.n_leaks;
	}
	for (int k = 0; k < 2; k++)
		psr_model_unref(way[k].model);
	return rc;
}

static int measure(double value[N_COLUMNS], struct dpoint_view *view, int is_simplified)
{
	const double start = clock_seconds();
	struct study_dpoint made;
	int rc = study_dpoint_make(&made, view->study, view->of, SIDE, is_simplified);

	value[SECONDS] = clock_seconds() - start;
	value[POINTS] = (double)made.choice.n_kept;
	if (rc == PSR_OK)
		rc = put_frames(value, view, &made);
	study_dpoint_fini(&made);
	return rc;
}

static int run_model(void *subject, struct study_model *of, int row)
{
	struct dpoint_view *view = subject;
	struct study *study = view->study;
	int rc = PSR_OK;

	/* The patches themselves, and not the generator's mesh, which has caps. */
	if (strcmp(of->name, "teapot") == 0) {
		study_model_fini(of);
		rc = study_model_make(of, "teapot", study_dpoint_make_teapot, study->err);
	}
	if (rc == PSR_OK)
		rc = dpoint_view_open(view, of, DPOINT_VIEW_WHOLE);
	for (int k = 0; k < 2 && rc == PSR_OK; k++) {
		study_label(&study->table, row + k, "%.20s, %s", of->name, k == 0 ? "all" : "simplified");
		rc = measure(study_at(&study->table, row + k, 0, 0), view, k);
		study_step(study, of->name);
	}
	return rc;
}

int table_dpoint_models(struct study *study)
{
	const struct dpoint_view_rows rows = { { "model", columns, N_COLUMNS }, 2, 2, run_model };
	struct dpoint_view view;

	return dpoint_view_table(&view, study, &rows, &view);
}
