/* What the files of `make bench-truth` share: builds of psr under measurement, the pictures that it compares, and the
 * table. */
#ifndef TESTS_BENCH_TRUTH_H
#define TESTS_BENCH_TRUTH_H

#include <limits.h>
#include <stdint.h>
#include <sys/types.h>
#include "measure/measure.h"
#include "psr/frame.h"

/* ---- truth_build.c: the programs of a build ---- */

#define TRUTH_BUILDS 4

struct truth_build {
	const char *programs;    /* folder of psr, psrd and psr-model */
	char folder[PATH_MAX];   /* of the models that it built */
	uint64_t key;            /* of these very programs */
	pid_t daemon;            /* 0: none runs */
	char socket[108];
};

void truth_build_init(struct truth_build *build, const char *programs, const char *work);

/* Makes FOLDER/NAME-RESOLUTION.psr unless there is one that is newer than the modeller. is_calibrated: with the ladder
 * of its settings. */
void truth_build_model(const struct truth_build *build, const char *name, const char *source, uint32_t resolution,
                       int is_calibrated);

void truth_build_start(struct truth_build *build); /* a daemon for its folder */
void truth_build_stop(struct truth_build *build);

/* Draws a picture by `psr shot` with these options (NULL at the end): colour and depth, for psr_frame_free(). */
struct truth_shot {
	const char *name;        /* of the model */
	uint32_t resolution;
	const struct psr_scene *scene;
	uint32_t side;
	const char *const *options;
};
void truth_build_shot(const struct truth_build *build, const struct truth_shot *shot, struct psr_frame *frame);

/* ---- truth_rows.c: the pictures ---- */

struct truth_row {
	const char *name, *what;
	uint32_t resolution, side; /* of the model; of the picture */
	double magnification;      /* pixels between samples of the finest level */
	unsigned n_views, rays;    /* rays along the side of a pixel */
	int has_shadows, has_lamps;
	const char *options[8];    /* of psr shot */
	const char *models;        /* names between blanks; NULL: all */
};
extern const struct truth_row truth_rows[];
extern const unsigned truth_n_rows;

/* A model's source. */
struct truth_subject {
	const char *name;
	struct psr_mesh *mesh;
	struct psr_source *source;
	double center[3], radius;
};

/* Draws a row's pictures by rays and by all builds whose `is_known` is 0, and fills their results. */
struct truth_result {
	int is_known;
	struct psr_errors errors; /* over all views: counts are sums, decibels those of the mean square, the rest means */
};
void truth_row_run(const struct truth_row *row, const struct truth_subject *subject, struct truth_build *build,
                   unsigned n_builds, struct truth_result *result);

/* ---- truth_table.c ---- */

void truth_table_open(const char *path); /* results of earlier runs */
int truth_table_find(struct truth_result *result, const struct truth_build *build, const char *model,
                     const struct truth_row *row);
void truth_table_add(const struct truth_result *result, const struct truth_build *build, const char *model,
                     const struct truth_row *row);
void truth_table_head(void);
void truth_table_print(const struct truth_result *result, unsigned n_builds, const char *model,
                       const struct truth_row *row);
void truth_table_sum_up(const struct truth_build *build, unsigned n_builds);

#endif
