/* A highlight, magnified: points beside blocks that get as much time, as finer models or more sub-pixels. */
#include <limits.h>
#include <math.h>
#include "model/points.h"
#include "model/tree.h"
#include "models/studies/tables/tables.h"
#include "study_dpoint.h"
#include "view.h"

#define MAGNIFICATION 8
#define AS_LONG 1.1 /* times as long is no longer: clocks are not better than that */

enum { KB, FPS, DB, GAIN, BRIGHT, BRIGHT_GAIN, N_COLUMNS };

static const struct study_column columns[N_COLUMNS] = {
	[KB] = { "kB", "kilobytes", 0 }, [FPS] = { "fps", "frames_per_second", 0 }, [DB] = { "dB", "db", 2 },
	[GAIN] = { "points'", "gain_db", 2 }, [BRIGHT] = { "bright", "bright_db", 2 },
	[BRIGHT_GAIN] = { "points'", "bright_gain_db", 2 },
};

static const struct setting {
	const char *name;
	int finer; /* how many times the study's resolution; 0: points */
	enum psr_smooth smooth;
	unsigned pass;
} setting[] = {
	{ "points", 0, PSR_SMOOTH_NONE, 0 },
	{ "points, edges", 0, PSR_SMOOTH_EDGES, 0 },
	{ "points, pass 1", 0, PSR_SMOOTH_NONE, 1 },
	{ "blocks", 1, PSR_SMOOTH_NONE, 0 },
	{ "blocks, edges", 1, PSR_SMOOTH_EDGES, 0 },
	{ "blocks, pass 1", 1, PSR_SMOOTH_NONE, 1 },
	{ "2 times as fine", 2, PSR_SMOOTH_NONE, 0 },
	{ "4 times as fine", 4, PSR_SMOOTH_NONE, 0 },
	{ "4 times, edges", 4, PSR_SMOOTH_EDGES, 0 },
	{ "4 times, pass 1", 4, PSR_SMOOTH_NONE, 1 },
};
#define N_SETTINGS ((int)(sizeof setting / sizeof *setting))
#define N_ROWS (N_SETTINGS + 2)
#define N_FINER 3 /* 1, 2 and 4 times */

struct subject {
	struct dpoint_view view;
	struct psr_model *points, *blocks[N_FINER];
	int row;
};

static double *value(const struct subject *s, int i, int column)
{
	return study_at(&s->view.study->table, s->row + i, 0, column);
}

static struct dpoint_way way_of(const struct subject *s, int i)
{
	return (struct dpoint_way){ .model = setting[i].finer == 0 ? s->points : s->blocks[setting[i].finer / 2],
		                        .smooth = setting[i].smooth, .pass = setting[i].pass };
}

static int measure(struct subject *s)
{
	struct dpoint_way way[N_SETTINGS];
	double fps[N_SETTINGS];
	int rc;

	for (int i = 0; i < N_SETTINGS; i++)
		way[i] = way_of(s, i);
	rc = dpoint_view_time(fps, &s->view, way, N_SETTINGS);
	for (int i = 0; i < N_SETTINGS && rc == PSR_OK; i++) {
		struct psr_errors errors;

		rc = dpoint_view_score(&errors, value(s, i, BRIGHT), &s->view, &way[i]);
		*value(s, i, KB) = (double)psr_model_bytes(way[i].model) / 1e3;
		*value(s, i, FPS) = fps[i];
		*value(s, i, DB) = errors.psnr_inside;
	}
	return rc;
}

/* A last row: of the settings of blocks, at most so many times as fine, what is best of those that take no longer than
 * points do. */
static void compare(struct subject *s, int row, int finer)
{
	const double least = *value(s, 0, FPS) / AS_LONG;

	for (int column = DB; column <= BRIGHT; column += BRIGHT - DB) {
		double best = -INFINITY;

		for (int i = 0; i < N_SETTINGS; i++) {
			*value(s, i, column + 1) = i > 0 ? *value(s, 0, column) - *value(s, i, column) : NAN;
			if (setting[i].finer > 0 && setting[i].finer <= finer && *value(s, i, FPS) >= least)
				best = fmax(best, *value(s, i, column));
		}
		*value(s, row, column) = best;
		*value(s, row, column + 1) = *value(s, 0, column) - best;
	}
	*value(s, row, FPS) = *value(s, 0, FPS);
}

static int build(struct subject *s, const struct study_model *of)
{
	int rc = study_dpoint_of_mesh(&s->points, s->view.study, of);

	for (int i = 0; i < N_FINER && rc == PSR_OK; i++) {
		rc = study_dpoint_blocks(&s->blocks[i], s->view.study, of, 1u << i);
		study_step(s->view.study, of->name);
	}
	return rc;
}

static int run_model(void *subject, struct study_model *of, int row)
{
	struct subject *s = subject;
	struct study *study = s->view.study;
	const double pixel = 2.0 / study->resolution, high = DPOINT_VIEW_HEIGHT * pixel;
	int rc = dpoint_view_open(&s->view, of, high);

	s->row = row;
	for (int i = 0; i < N_ROWS; i++)
		study_label(&study->table, s->row + i, "%.20s, %s", of->name,
		            i < N_SETTINGS ? setting[i].name : i == N_SETTINGS ? "best as fine" : "best of all");
	if (rc == PSR_OK)
		rc = build(s, of);
	if (rc == PSR_OK)
		rc = dpoint_view_set(&s->view, high / MAGNIFICATION, 1);
	if (rc == PSR_OK)
		rc = measure(s);
	if (rc == PSR_OK) {
		compare(s, N_SETTINGS, 1);
		compare(s, N_SETTINGS + 1, INT_MAX);
	}
	psr_model_unref(s->points);
	s->points = NULL;
	for (int i = 0; i < N_FINER; i++) {
		psr_model_unref(s->blocks[i]);
		s->blocks[i] = NULL;
	}
	return rc;
}

int table_dpoint_equal(struct study *study)
{
	const struct dpoint_view_rows rows = { { "model, way", columns, N_COLUMNS }, N_ROWS, N_FINER, run_model };
	struct subject s = { .row = 0 };

	return dpoint_view_table(&s.view, study, &rows, &s);
}
