/* Bytes of differential points, and of blocks whose magnified picture is as good: of blocks that are ever finer. */
#include "model/tree.h"
#include "study_dpoint.h"
#include "view.h"

#define MAGNIFICATION 4
#define N_WAYS 4 /* points; blocks of as many pixels, of twice and of four times as many */

enum { KB, TIMES, DB, LESS, PASS_1, PASS_1_LESS, N_COLUMNS };

static const struct study_column columns[N_COLUMNS] = {
	[KB] = { "kB", "kilobytes", 0 }, [TIMES] = { "times", "times_points_kilobytes", 1 }, [DB] = { "dB", "db", 2 },
	[LESS] = { "less", "less_db", 2 }, [PASS_1] = { "pass 1", "pass_1_db", 2 },
	[PASS_1_LESS] = { "less", "pass_1_less_db", 2 },
};

static int build(struct psr_model **out, const struct study *study, const struct study_model *of, int way)
{
	return way == 0 ? study_dpoint_of_mesh(out, study, of) : study_dpoint_blocks(out, study, of, 1u << (way - 1));
}

static int score(double *db, struct dpoint_view *view, struct psr_model *model, unsigned pass)
{
	const struct dpoint_way way = { .model = model, .pass = pass };
	struct psr_errors errors;
	double bright;
	const int rc = dpoint_view_score(&errors, &bright, view, &way);

	*db = errors.psnr_inside;
	return rc;
}

static int put_row(double value[N_COLUMNS], struct dpoint_view *view, const struct study_model *of, int way)
{
	struct psr_model *model = NULL;
	int rc = build(&model, view->study, of, way);

	if (rc == PSR_OK)
		rc = score(&value[DB], view, model, 0);
	if (rc == PSR_OK)
		rc = score(&value[PASS_1], view, model, 1);
	if (rc == PSR_OK)
		value[KB] = (double)psr_model_bytes(model) / 1e3;
	psr_model_unref(model);
	return rc;
}

static int run_model(void *subject, struct study_model *of, int row)
{
	static const char *const name[N_WAYS] = { "points", "blocks", "2 times as fine", "4 times as fine" };
	struct dpoint_view *view = subject;
	struct study_table *table = &view->study->table;
	const double high = DPOINT_VIEW_HEIGHT * 2.0 / view->study->resolution, *points = study_at(table, row, 0, 0);
	int rc = dpoint_view_open(view, of, high);

	if (rc == PSR_OK)
		rc = dpoint_view_set(view, high / MAGNIFICATION, 1);
	for (int way = 0; way < N_WAYS && rc == PSR_OK; way++) {
		double *value = study_at(table, row + way, 0, 0);

		study_label(table, row + way, "%.20s, %s", of->name, name[way]);
		rc = put_row(value, view, of, way);
		study_step(view->study, of->name);
		if (way == 0)
			continue;
		value[TIMES] = value[KB] / points[KB];
		value[LESS] = points[DB] - value[DB];
		value[PASS_1_LESS] = points[PASS_1] - value[PASS_1];
	}
	return rc;
}

int table_dpoint_bytes(struct study *study)
{
	const struct dpoint_view_rows rows = { { "model, way", columns, N_COLUMNS }, N_WAYS, N_WAYS, run_model };
	struct dpoint_view view;

	return dpoint_view_table(&view, study, &rows, &view);
}
