/* The thesis's studies ([G] 5.3, 6.5, 8) as commands: `psr-model study NAME`. */
#ifndef MODELS_STUDY_H
#define MODELS_STUDY_H

#include <stdint.h>
#include <stdio.h>
#include "psr/error.h"
#include "psr/mesh.h"
#include "base/pool.h"
#include "models/studies/greedy/greedy.h"
#include "models/studies/greedy/warp.h"
#include "ray/ray.h"
#include "models/shapes/shape.h"
#include "study_trials.h"

/* ---- study_table.c: what a study found ---- */

#define STUDY_MOST_COLUMNS 16

struct study_column {
	const char *name, *key; /* heading; key in JSON */
	int decimals;
};

/* Values by row, model and column; NAN where there is none. */
struct study_table {
	const char *first; /* heading of the labels */
	const struct study_column *column;
	int n_columns, n_rows, n_models;
	char (*label)[64];
	double *value;
};

/* Every value is NAN, every label empty. MEMORY. */
int study_table_init(struct study_table *table, const char *first, const struct study_column *column, int n_columns,
                     int n_rows, int n_models, struct psr_error *err);
void study_table_fini(struct study_table *table);
double *study_at(const struct study_table *table, int row, int model, int column);

/* Mean over the models that have a value; NAN if none has. */
double study_mean(const struct study_table *table, int row, int column);

/* Makes a column from another: the mean of each model's value as a ratio to its own in row `base`. */
void study_relate(const struct study_table *table, int from, int to, int base);

void study_table_print(const struct study_table *table, FILE *to);

/* ---- study_model.c: what is studied ---- */

struct study_model {
	char name[64];
	struct psr_mesh *mesh;
	double origin[3], scale;
	struct ray_scene *scene;
	struct study_trials *trials;
};

/* A generator's name (psr-model make), or a file, which has a dot or a slash in its name. */
int study_model_load(struct study_model *model, const char *name, struct psr_error *err);
/* The shape that `make` makes. */
int study_model_make(struct study_model *model, const char *name, void (*make)(struct shape *), struct psr_error *err);
void study_model_fini(struct study_model *model);

/* ---- study.c ---- */

struct study {
	const struct study_kind *kind;
	uint32_t resolution;
	const char *keep; /* folder of models that are built, for other studies to take; NULL: none */
	struct psr_pool *pool;
	int n_threads, n_models;
	struct study_model *model;
	struct study_table table;
	struct greedy_warp **warp; /* study_select.c: n_warps, by row and model; NULL: not measured yet */
	int n_warps;
	int done, total, has_bar;
	struct psr_error *err;
};

struct study_kind {
	const char *name, *figure, *what; /* "figure 5.5" */
	const char *models;               /* unless others are named: a list with commas; NULL: the standard set */
	int (*run)(struct study *study);  /* makes the table */
	/* A gnuplot program after `set terminal` and `set output`; NULL: this study has no plot. Reads $table, with the
	 * means of the table's rows: number of the row, label, values. */
	const char *plot;
	const char *note;                 /* printed below the table; may be NULL */
};
extern const struct study_kind study_kinds[];
extern const int n_study_kinds;

/* Which of n names it is; ARG, with all of them in the sentence, if it is none. what: "study". */
int study_find_name(const char *what, const char *name, int n, const char *(*name_of)(int), struct psr_error *err);

/* One step of `total` is done. */
void study_step(struct study *study, const char *what);

/* study_model.c: psr's own model (psr/build.h) of this mesh. Where the study keeps models it may be one that was kept,
 * unless the time to build it is asked for; seconds: or NULL. */
int study_built(struct psr_model **out, double *seconds, const struct study *study, const struct study_model *model);

/* What its level 0 has, and the time that all of it took. */
int study_build(struct greedy **out, struct greedy_result *result, double *seconds, const struct study *study,
                const struct study_model *model);

/* ---- study_plot.c ---- */

/* Writes a picture of the table, .png or .svg by the name's end, through gnuplot. ARG, NOT_FOUND (no gnuplot), IO. */
int study_plot(const struct study *study, const char *path, struct psr_error *err);

/* ---- study_select.c: selections of blocks, row by row ---- */

/* How many of 10,000 trials a selection misses. MEMORY. */
int study_missing(double *missing, const struct study *study, const struct study_model *model,
                  const struct greedy *greedy, const struct greedy_result *result);

/* A table for a selection a row and model. Each is measured and put down, which is a step of the study; the time to
 * warp them is measured at the end, with what was kept of them to do so, and with the ratios to row `base`. MEMORY. */
int study_start(struct study *study, const char *first, int n_rows);
int study_put(struct study *study, int row, int model, const struct greedy *greedy, const struct greedy_result *result,
              double seconds);
int study_finish(struct study *study, int base);
void study_drop(struct study *study); /* what was kept; also without study_finish */

/* Projections at a tolerance angle in degrees; greedy_destroy() it. */
int study_scan(struct greedy **out, struct study *study, int model, double degrees, enum greedy_lattice lattice,
               enum greedy_directions directions);

/* Selects and puts down. options->goes_on: from the row before. */
int study_select(struct study *study, int row, int model, struct greedy *greedy,
                 const struct greedy_select_options *options);

int study_run_tolerance(struct study *study);
int study_run_square(struct study *study);
int study_run_block_size(struct study *study);

/* ---- study_tried.c, study_cull.c, study_models.c ---- */

int study_run_selection(struct study *study);
int study_run_models(struct study *study);
int study_run_masks(struct study *study);
int study_run_subdivision(struct study *study);
int study_run_culling(struct study *study);

#endif
