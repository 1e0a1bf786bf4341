/* The tables, and code that several of them use. */
#ifndef MODELS_STUDIES_TABLES_TABLES_H
#define MODELS_STUDIES_TABLES_TABLES_H

#include "models/studies/greedy/greedy.h"
#include "models/studies/lib/study.h"

/* ---- select.c: selections of blocks, row by row ---- */

struct selection {
	const char *label;
	double degrees; /* tolerance angle; 0: 25 */
	enum greedy_lattice lattice;
	enum greedy_directions directions;
	int goes_on;    /* from the row before */
	int no_second_pass, is_one_test, not_facing, by_score, drops, strict;
	double depth;   /* 0: 1 */
	int side;       /* of blocks; 0: 8 */
};

/* How many of 10,000 trials a selection misses. MEMORY. */
int selection_missing(double *missing, const struct study *study, const struct study_model *model,
                      const struct greedy *greedy, const struct greedy_result *result);

/* The projections that a row selects from, instead of those in *greedy, which may be NULL. MEMORY. */
int selection_scan(struct greedy **greedy, struct study *study, int model, const struct selection *selection);

/* Makes a selection of psr's own model: its level 0, and the time that all of it took. */
int selection_of_model(struct greedy **out, struct greedy_result *result, double *seconds, const struct study *study,
                       const struct study_model *model);

/* A table of a selection a row and model. */
struct selections {
	struct study *study;
	struct greedy_warp **warp; /* by row and model; NULL: not measured yet */
};

/* selections_finish() follows in any case. MEMORY. */
int selections_start(struct selections *s, struct study *study, const char *first, int n_rows);

/* Selects and puts down rows 0..n-1 of a model. */
int selections_run(struct selections *s, int model, const struct selection *selection, int n);

/* Measures a selection and puts it down, which is a step of the study. */
int selections_put(struct selections *s, int row, int model, const struct greedy *greedy,
                   const struct greedy_result *result, double seconds);

/* If rc is OK, times the warping of all selections, and relates size and time to row `base`. Frees everything kept for
 * that. Returns rc, or the code of a failure. */
int selections_finish(struct selections *s, int base, int rc);

/* ---- culling.c ---- */

/* psr's own model, with masks of up to this level. */
struct cull_set;
int culling_set(struct cull_set **out, const struct study *study, const struct study_model *model, int finest);

/* ---- the tables ---- */

int table_tolerance(struct study *study);
int table_square(struct study *study);
int table_block_size(struct study *study);
int table_selection(struct study *study);
int table_models(struct study *study);
int table_masks(struct study *study);
int table_subdivision(struct study *study);
int table_culling(struct study *study);
int table_octree(struct study *study);
int table_octree_points(struct study *study);
int table_octree_prefixes(struct study *study);
int table_octree_splats(struct study *study);

#endif
