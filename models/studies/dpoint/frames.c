/* Frames of differential points beside those of blocks: time, bytes, and how far from the truth, where a highlight is. */
#include "model/points.h"
#include "model/tree.h"
#include "models/studies/tables/tables.h"
#include "study_dpoint.h"
#include "view.h"

#define N_SIZES 6

/* Pixels of the picture across a pixel that the models are for. */
static const double magnification[N_SIZES] = { 0.5, 1, 2, 4, 8, 16 };

enum { KB, KB_BLOCKS, FPS, FPS_BLOCKS, RATE, DB, DB_BLOCKS, BRIGHT, BRIGHT_BLOCKS, HOLES, LEAKS, WRONG_BLOCKS, N_COLUMNS };

static const struct study_column columns[N_COLUMNS] = {
	[KB] = { "kB", "kilobytes", 0 }, [KB_BLOCKS] = { "blocks", "blocks_kilobytes", 0 },
	[FPS] = { "fps", "frames_per_second", 0 }, [FPS_BLOCKS] = { "blocks", "blocks_frames_per_second", 0 },
	[RATE] = { "Mpt/s", "million_points_per_second", 1 }, [DB] = { "dB", "db", 2 },
	[DB_BLOCKS] = { "blocks", "blocks_db", 2 }, [BRIGHT] = { "bright", "bright_db", 2 },
	[BRIGHT_BLOCKS] = { "blocks", "blocks_bright_db", 2 }, [HOLES] = { "holes", "holes", 0 },
	[LEAKS] = { "leaks", "leaks_a_million", 0 }, [WRONG_BLOCKS] = { "blocks", "blocks_holes_and_leaks_a_million", 0 },
};

struct subject {
	struct dpoint_view view;
	struct dpoint_way way[2]; /* of points, of blocks */
	int row;
};

static double *value(const struct subject *s, int column)
{
	return study_at(&s->view.study->table, s->row, 0, column);
}

/* The picture is so high that a pixel is 2 / resolution radii of the model over the magnification. */
static double across(const struct subject *s, double times)
{
	return DPOINT_VIEW_HEIGHT * 2.0 / s->view.study->resolution / times;
}

static int put_times(struct subject *s)
{
	double fps[2];
	const int rc = dpoint_view_time(fps, &s->view, s->way, 2);

	*value(s, FPS) = fps[0];
	*value(s, FPS_BLOCKS) = fps[1];
	*value(s, RATE) = fps[0] * psr_model_point_set(s->way[0].model)->n_points * 1e-6;
	return rc;
}

static int put_errors(struct subject *s)
{
	for (int k = 0; k < 2; k++) {
		struct psr_errors errors;
		const int rc = dpoint_view_score(&errors, value(s, k ? BRIGHT_BLOCKS : BRIGHT), &s->view, &s->way[k]);

		if (rc != PSR_OK)
			return rc;
		*value(s, k ? DB_BLOCKS : DB) = errors.psnr_inside;
		if (k == 0) {
			*value(s, HOLES) = (double)errors.n_holes;
			*value(s, LEAKS) = 1e6 * (double)errors.n_leaks / (double)errors.n_inside;
		} else {
			*value(s, WRONG_BLOCKS) = 1e6 * (double)(errors.n_holes + errors.n_leaks) / (double)errors.n_inside;
		}
	}
	return PSR_OK;
}

/* The materials are changed before models are made of them. */
static int run_model(void *subject, struct study_model *model, int row)
{
	struct subject *s = subject;
	struct study *study = s->view.study;
	int rc = dpoint_view_open(&s->view, model, across(s, 1));

	s->row = row;
	if (rc == PSR_OK)
		rc = study_dpoint_of_mesh(&s->way[0].model, study, model);
	if (rc == PSR_OK)
		rc = study_build(&s->way[1].model, NULL, study, model);
	for (int i = 0; i < N_SIZES && rc == PSR_OK; i++, s->row++) {
		study_label(&study->table, s->row, "%.20s %g", model->name, magnification[i]);
		rc = dpoint_view_set(&s->view, across(s, magnification[i]), magnification[i] > 1);
		if (rc == PSR_OK)
			rc = put_times(s);
		if (rc == PSR_OK)
			rc = put_errors(s);
		*value(s, KB) = (double)psr_model_bytes(s->way[0].model) / 1e3;
		*value(s, KB_BLOCKS) = (double)psr_model_bytes(s->way[1].model) / 1e3;
		study_step(study, model->name);
	}
	for (int k = 0; k < 2; k++) {
		psr_model_unref(s->way[k].model);
		s->way[k].model = NULL;
	}
	return rc;
}

int table_dpoint_frames(struct study *study)
{
	const struct dpoint_view_rows rows = { { "model, size", columns, N_COLUMNS }, N_SIZES, N_SIZES, run_model };
	struct subject s = { .row = 0 };

	return dpoint_view_table(&s.view, study, &rows, &s);
}
