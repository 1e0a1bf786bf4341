/* Shared by the tables (../tables) and figures (../figures) of the thesis's studies ([G] 4 to 9). */
#ifndef MODELS_STUDIES_LIB_STUDY_H
#define MODELS_STUDIES_LIB_STUDY_H

#include <stdint.h>
#include <stdio.h>
#include "models/shapes/shape.h"
#include "psr/error.h"
#include "psr/mesh.h"
#include "model/blocks.h"
#include "base/pool.h"
#include "psr/render.h"
#include "ray/ray.h"
#include "trials.h"

/* ---- table.c ---- */

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

struct study_form {
	const char *first;
	const struct study_column *column;
	int n_columns;
};

/* Every value is NAN, every label empty. MEMORY. */
int study_table_init(struct study_table *table, struct study_form form, int n_rows, int n_models,
                     struct psr_error *err);
void study_table_fini(struct study_table *table);
double *study_at(const struct study_table *table, int row, int model, int column);

/* printf() into the row's label. */
void study_label(const struct study_table *table, int row, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

/* Mean over the models that have a value; NAN if none has. */
double study_mean(const struct study_table *table, int row, int column);

/* Makes a column from another: the mean of each model's value as a ratio to its own in row `base`. */
void study_relate(const struct study_table *table, int from, int to, int base);

void study_table_print(const struct study_table *table, FILE *to);

/* ---- model.c ---- */

/* A mesh, and everything computed from it. */
struct study_model {
	char name[64];
	struct psr_mesh *mesh;
	double origin[3], scale;
	struct ray_scene *scene;
	struct trials *trials;
	int is_scanned; /* octrees are made from points that a scanner would find, and not from the mesh */
};

/* A generator's name (psr-model make), "terrain", or a file, which has a dot or a slash in its name; scan:NAME is a
 * scan of one of these. */
int study_model_load(struct study_model *model, const char *name, struct psr_error *err);
/* The shape that `make` makes. */
int study_model_make(struct study_model *model, const char *name, void (*make)(struct shape *), struct psr_error *err);
void study_model_fini(struct study_model *model);

/* ---- a study under way ---- */

struct study {
	const struct study_kind *kind;
	uint32_t resolution;
	const char *keep; /* folder of built models, for other studies to read; NULL: none */
	const char *out;  /* folder of a figure's pictures */
	const char *names; /* of the models, with commas between them; NULL: the standard set */
	struct psr_pool *pool;
	struct psr_renderer *renderer; /* figures only */
	int n_threads, n_models;
	struct study_model *model;     /* tables only */
	struct study_table table;
	int done, total, has_bar;
	struct psr_error *err;
};

struct study_kind {
	const char *name, *figure, *what; /* "figure 5.5"; of other papers "[B] table 1" */
	int (*run)(struct study *study);  /* fills the table; a figure prints its own, and writes pictures */
	const char *models; /* default of --models: a list with commas; NULL: the standard set, and a figure takes none */
	/* A table's: */
	const char *note;   /* printed below the table; may be NULL */
	/* A gnuplot program after `set terminal` and `set output`; NULL: nothing to plot. Reads $table: number of the row,
	 * label, and the means of the table's columns. */
	const char *plot;
};

/* table.c: one step of `total` is done. */
void study_step(struct study *study, const char *what);

/* model.c: psr's own model (psr/build.h) of this mesh. With study->keep it may be a kept one, unless `seconds`, the
 * time to build it, is not NULL. */
int study_build(struct psr_model **out, double *seconds, const struct study *study, const struct study_model *model);

/* plot.c: writes a picture of the table, .png or .svg by the name's end, through gnuplot. ARG, NOT_FOUND (no gnuplot),
 * IO. */
int study_plot(const struct study *study, const char *path, struct psr_error *err);

#endif
