/* Counterparts of the thesis's pictures ([G] 4, 7, 8, 9): each technique off and on, beside the ray-traced truth. */
#ifndef MODELS_FIGURES_H
#define MODELS_FIGURES_H

#include <stdint.h>
#include "psr/error.h"
#include "measure/measure.h"
#include "render/stages.h"
#include "surface/surface.h"
#include "models/shapes/shape.h"
#include "study.h"

struct figures {
	struct study study;  /* of which resolution, keep, pool, n_threads and err are used */
	const char *out;     /* folder of the pictures */
	struct psr_renderer *renderer;
	struct psr_error *err;
};

/* ---- figure_scene.c: models, cameras, frames ---- */

struct figure_model {
	struct study_model source;
	struct psr_model *model;
	struct psr_truth *truth;
	struct surface surface;
	double center[3], spacing; /* of the box; world units */
};

/* The generator of this name, or, unless NULL, a shape that `make` makes, which is kept under the name. */
int figure_model_load(struct figure_model *model, struct figures *figures, const char *name,
                      void (*make)(struct shape *), uint32_t resolution);
void figure_model_fini(struct figure_model *model);

/* What is drawn. The scene points into it: it must not move. */
struct figure_shot {
	struct psr_scene scene;
	struct render_settings settings;
	struct psr_instance instance;
	struct psr_light light[4];
};

/* Looks from `toward` (any length) at the middle of the model, a light over the left shoulder; `magnification` is the
 * number of pixels between samples of level 0 there. */
void figure_shot_init(struct figure_shot *shot, const struct figure_model *model, const double toward[3],
                      double magnification, uint32_t width, uint32_t height);

/* Six directions that have little in common. */
#define FIGURE_VIEWS 6
extern const double figure_view[FIGURE_VIEWS][3];

struct figure_frame {
	uint32_t width, height;
	uint8_t *rgb;
	float *depth;
	uint8_t *weight; /* NULL unless the caller has set it, who frees it */
	struct psr_report report;
};
int figure_frame_init(struct figure_frame *frame, uint32_t width, uint32_t height, struct psr_error *err);
void figure_frame_fini(struct figure_frame *frame);

typedef int figure_draw_fn(struct figure_frame *frame, struct figures *figures, const struct figure_shot *shot);

figure_draw_fn figure_draw;         /* as it is */
figure_draw_fn figure_draw_no_gaps; /* level buffers are emptied after the warp, so that they cover no pixel */

/* ---- figure_truth.c: the same by rays ---- */

struct figure_truth {
	uint32_t width, height, side; /* side * side rays a pixel */
	uint8_t *rgb;
	uint16_t *n_met;              /* rays of the pixel that meet the object */
};

/* Phong's light as frames have it, with shadow rays where a light casts shadows. */
int figure_truth_draw(struct figure_truth *truth, struct figures *figures, const struct figure_model *model,
                      const struct figure_shot *shot, uint32_t side);
void figure_truth_fini(struct figure_truth *truth);

/* ---- figure_score.c: frames against the truth ---- */

struct figure_score {
	uint64_t n_met, n_inside;     /* pixels that a ray meets; whose 3x3 neighbourhood all rays meet */
	uint64_t n_half, n_missing;   /* that half of the rays meet; of these not drawn */
	uint64_t n_holes, n_outside;  /* see psr_accuracy */
	uint64_t square, inside_square; /* sums over three channels, codes */
	uint64_t difference;          /* of the channel that differs most, inside */
};

int figure_score_add(struct figure_score *score, struct figures *figures, const struct figure_model *model,
                     const struct figure_shot *shot, const struct figure_frame *frame,
                     const struct figure_truth *truth);
/* The same of the colours alone. */
void figure_score_colors(struct figure_score *score, const struct figure_frame *frame,
                         const struct figure_truth *truth);
void figure_score_print_head(const char *first);
void figure_score_print(const char *label, const struct figure_score *score);
double figure_psnr(uint64_t square, uint64_t n_pixels);

/* ---- figure_sheet.c: pictures side by side ---- */

#define FIGURE_MOST_CELLS 32

/* A part of a picture, magnified by whole numbers. */
struct figure_part {
	uint32_t x, y, width, height, zoom;
};

struct figure_sheet {
	uint32_t columns, n_cells, width, height; /* of a cell */
	uint8_t *cell[FIGURE_MOST_CELLS];
};

/* Cells are added in rows; each is a copy of the part. MEMORY. */
void figure_sheet_init(struct figure_sheet *sheet, uint32_t columns, const struct figure_part *part);
int figure_sheet_add(struct figure_sheet *sheet, const uint8_t *rgb, uint32_t stride, const struct figure_part *part,
                     struct psr_error *err);

void figure_sheet_drop(struct figure_sheet *sheet, uint32_t n_cells); /* frees all but the first n_cells */

/* Writes NAME.png into the folder and drops all cells, in any case. IO, MEMORY. */
int figure_sheet_write(struct figure_sheet *sheet, const struct figures *figures, const char *name);

/* Moves the part to where `a` is further from the truth than `b`, by the most, in pixels that the object covers wholly;
 * returns by how much. */
uint64_t figure_part_find(struct figure_part *part, const uint8_t *a, const uint8_t *b,
                          const struct figure_truth *truth);

/* ---- figure_compare.c: ways to draw, each against the truth ---- */

struct figure_way {
	const char *label;
	figure_draw_fn *draw;
	const struct figure_model *model; /* what is drawn, if that is not what the truth is of; or NULL */
};

#define FIGURE_MOST_WAYS 5
#define FIGURE_FIND UINT32_MAX /* as part.x: where, in whichever view, the first way is worst beside the last one */

struct figure_look {
	double magnification;
	uint32_t width, height, rays; /* rays * rays a pixel */
	const double (*view)[3];      /* the first one is shown, unless a part is to be found */
	int n_views;
	struct figure_part part;
	void (*prepare)(struct figure_shot *shot, const struct figure_model *model); /* changes the shot; or NULL */
};

/* Prints the score of each way, over all views, and adds what they show to the sheet, the truth as the last one. */
int figure_compare(struct figures *figures, struct figure_sheet *sheet, const struct figure_model *model,
                   const struct figure_look *look, const struct figure_way *way, int n_ways);

/* ---- the figures ---- */

int figure_run_gaps(struct figures *figures);
int figure_run_fill(struct figures *figures);
int figure_run_threshold(struct figures *figures);
int figure_run_highlights(struct figures *figures);
int figure_run_shadows(struct figures *figures);
int figure_run_backs(struct figures *figures);
int figure_run_set(struct figures *figures);
int figure_run_edges(struct figures *figures);
int figure_run_interfaces(struct figures *figures);
int figure_run_thin(struct figures *figures);
int figure_run_stills(struct figures *figures);
int figure_run_zoom(struct figures *figures);

#endif
