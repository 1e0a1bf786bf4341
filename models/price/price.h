/* What accuracy costs: settings measured on views of one source, and what is told about them. */
#ifndef MODELS_PRICE_PRICE_H
#define MODELS_PRICE_PRICE_H

#include <stdio.h>
#include "measure/ladder.h"
#include "psr/mesh.h"

struct price_options {
	const char *source, *out; /* out: a folder, made if it is missing; NULL: tables on standard output alone */
	uint32_t n_views;         /* 1..PRICE_MOST_VIEWS */
	uint32_t size[2];         /* pixels, 32..4096 */
	uint32_t resolution;      /* of the usual model, 32..4096 */
	uint32_t n_rounds;
	uint64_t seed;
};
#define PRICE_MOST_VIEWS 64
#define PRICE_PATH 4096

/* ---- settings.c: the ladder ---- */

#define PRICE_MOST_SETTINGS 80
#define PRICE_MOST_MODELS 12
#define PRICE_MOST_CODERS 8
#define PRICE_NAME 32

struct price_setting {
	char name[PRICE_NAME]; /* "spacing 2"; the first one is "usual" */
	const char *knob;      /* which knob it turns: "spacing" */
	int is_exact;          /* has to draw the usual picture, byte by byte */
	int is_choice;         /* something that a request or a plan could choose; not: fewer bits, threads, coders */
};

struct price_set {
	uint32_t n, n_models, n_coders;
	struct price_setting setting[PRICE_MOST_SETTINGS];
	struct ladder_rung rung[PRICE_MOST_SETTINGS];
	struct psr_model *model[PRICE_MOST_MODELS]; /* the first one is the usual one */
	struct ladder_coder coder[PRICE_MOST_CODERS];
};

/* Tells people on standard error how far it is. */
void price_tell(const char *what, uint32_t done, uint32_t total);

/* Builds the models, and lists the settings. Call price_set_fini() in any case. Errors as of psr_model_build(). */
int price_set_make(struct price_set *set, const struct psr_mesh *mesh, const struct price_options *options,
                   struct psr_error *err);
void price_set_fini(struct price_set *set);

/* ---- bits.c: models of coarser words, made in memory: files have none ---- */

/* Copy a model with normals of n_bits of 15, odd, or depths of n_bits of 16. The caller owns it. Errors as of
 * psr_model_create(). */
int price_normal_bits(struct psr_model **out, const struct psr_model *model, unsigned n_bits, struct psr_error *err);
int price_depth_bits(struct psr_model **out, const struct psr_model *model, unsigned n_bits, struct psr_error *err);

/* ---- jpeg.c ---- */

/* A coder as psrd's, but of the whole picture as one file. chroma: 1 full, 2 half of the width and height. MEMORY. */
int price_jpeg_open(struct ladder_coder *coder, int quality, int chroma, struct psr_error *err);
void price_jpeg_close(struct ladder_coder *coder); /* a zeroed one is fine */

/* ---- price.c: all of it ---- */

struct price {
	const struct price_options *options;
	const char *title;        /* the source's name without its folders */
	struct price_set set;
	struct ladder *ladder;
	struct ladder_view *view; /* options->n_views, with their truth */
	struct ladder_row *row;   /* view by view, set.n each */
	/* By setting, over all views, and over those of a kind; NAN where there are none. */
	struct ladder_point point[PRICE_MOST_SETTINGS], of_kind[LADDER_N_KINDS][PRICE_MOST_SETTINGS];
	double ratio[PRICE_MOST_SETTINGS][3];               /* of times to the usual setting's in the same rounds: median and
	                                                     * quartiles, each the mean over all views */
	double bytes[PRICE_MOST_SETTINGS];                  /* that its coder makes; 0 without one */
	uint8_t is_same[PRICE_MOST_SETTINGS];               /* all its pictures are the usual setting's */
	/* The settings of the set that are choices; of those that draw the usual picture only the ones of which three in
	 * four frames are faster. */
	uint32_t n_choices, choice[PRICE_MOST_SETTINGS];
	uint8_t is_unbeaten[PRICE_MOST_SETTINGS];           /* a choice that no other choice beats */
	uint32_t n_unbeaten, unbeaten[PRICE_MOST_SETTINGS]; /* these, the fastest first */
	int has_plot;                                       /* plot.svg and plot.png are there */
};

/* Measures the settings on views of the source, prints tables, and writes the folder if there is one. Errors of import
 * and build, IO; INTERNAL: a setting that has to draw the usual picture drew another one, and all is written. */
int price_run(const struct price_options *options, struct psr_error *err);

/* ---- judge.c: rows become points ---- */

/* Fills in all that follows from options->n_views, view[].kind, set and row. */
void price_judge(struct price *price);

/* Return the number of the best choice within a time, and of the cheapest within an error; set.n if there is none. */
uint32_t price_best_within(const struct price *price, double ms);
uint32_t price_cheapest_within(const struct price *price, double rmse);

/* Calls `row` for times, each 1.41 times the one before, from the fastest unbeaten choice's on, and for errors, each
 * 2 dB below the one before, where the choice is another one than before. */
struct price_rows {
	void (*row)(double bound, uint32_t setting, void *userdata);
	void *userdata;
};
void price_equal_times(const struct price *price, const struct price_rows *rows);  /* bound: ms */
void price_equal_errors(const struct price *price, const struct price_rows *rows); /* bound: dB */

/* ---- what is told ---- */

void price_print(FILE *to, const struct price *price);                   /* text.c: the tables */
void price_print_db(FILE *to, double rmse);                              /* seven letters */
int price_write_csv(const struct price *price, struct psr_error *err);   /* record.c: a line a view and setting */
int price_write_json(const struct price *price, struct psr_error *err);
int price_write_plots(struct price *price, struct psr_error *err);       /* plot.c; without gnuplot has_plot is 0 */

/* pictures.c: a row for the first view of each kind, a column for the fastest unbeaten choice, the usual setting, some
 * between, and the best. */
#define PRICE_MOST_COLUMNS 5
#define PRICE_TIMES 4 /* differences are shown so many times as large */

struct price_pictures {
	uint32_t n_rows, n_columns;
	uint32_t view[LADDER_N_KINDS], setting[PRICE_MOST_COLUMNS];
	/* 3 * width * height, sRGB; the difference to the truth in the channel that differs most, as grey. */
	uint8_t *rgb[LADDER_N_KINDS][PRICE_MOST_COLUMNS], *difference[LADDER_N_KINDS][PRICE_MOST_COLUMNS];
};

/* Call price_pictures_fini() in any case. */
int price_pictures_make(struct price_pictures *pictures, const struct price *price, struct psr_error *err);
void price_pictures_fini(struct price_pictures *pictures);

/* strip.png: truth and pictures in a line, differences in the line below. */
int price_write_strip(const struct price *price, const struct price_pictures *pictures, struct psr_error *err);

/* page.c: index.html, which needs no other file. */
int price_write_page(const struct price *price, const struct price_pictures *pictures, struct psr_error *err);

/* Opens a file of the folder, whose path goes to `path`. */
struct outfile;
int price_open(struct outfile *file, char path[PRICE_PATH], const struct price *price, const char *name,
               struct psr_error *err);

#endif
