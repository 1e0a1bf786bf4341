/* Counterparts of the thesis's pictures ([G] 4, 7, 8, 9): each technique off and on, beside the ray-traced truth. */
#ifndef MODELS_STUDIES_FIGURES_FIGURES_H
#define MODELS_STUDIES_FIGURES_FIGURES_H

#include <stdint.h>
#include "models/studies/lib/study.h"
#include "measure/measure.h"
#include "render/stages.h"

/* ---- scene.c: models, cameras, frames ---- */

struct figure_model {
	struct study_model source;
	struct psr_model *model;
	struct psr_truth *truth;
	double center[3], spacing; /* of the box; world units */
};

/* Loads the generator of this name, or, unless NULL, the shape that `make` makes; both are kept under the name. On
 * failure *model is zeroed, with nothing to free. */
int figure_model_load(struct figure_model *model, struct study *study, const char *name,
                      void (*make)(struct shape *), uint32_t resolution);
void figure_model_fini(struct figure_model *model); /* a zeroed one is fine */

/* A picture to draw. The scene points into it: copy it by figure_shot_copy(). */
struct figure_shot {
	struct psr_scene scene;
	struct render_settings settings;
	struct psr_instance instance;
	struct psr_light light[4];
};

/* Looks from `toward` (any length) at the middle of the model, a light over the left shoulder; `magnification` is the
 * number of pixels between samples of level 0 there. The picture is a square. */
void figure_shot_init(struct figure_shot *shot, const struct figure_model *model, const double toward[3],
                      double magnification, uint32_t side);
void figure_shot_copy(struct figure_shot *to, const struct figure_shot *from);

/* Six directions, far apart. */
#define FIGURE_VIEWS 6
extern const double figure_view[FIGURE_VIEWS][3];

#define FIGURE_PLANES (1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH) /* of a frame, to psr_frame_alloc() */

typedef int figure_draw_fn(struct psr_frame *frame, struct study *study, const struct figure_shot *shot);

figure_draw_fn figure_draw;         /* as it is */
figure_draw_fn figure_draw_no_gaps; /* level buffers are emptied after the warp, so that they cover no pixel */

/* ---- truth.c: the same by rays ---- */

struct figure_truth {
	uint32_t side, rays; /* rays * rays a pixel */
	uint8_t *rgb;
	uint16_t *n_met;     /* rays of the pixel that meet the object */
};

/* Light as frames have it, with shadow rays where a light casts shadows. */
int figure_truth_draw(struct figure_truth *truth, struct study *study, const struct figure_model *model,
                      const struct figure_shot *shot, uint32_t rays);
void figure_truth_fini(struct figure_truth *truth);

/* ---- score.c: frames against the truth ---- */

struct figure_score {
	uint64_t n_met, n_inside;     /* pixels that a ray meets; whose 3x3 neighbourhood all rays meet */
	uint64_t n_half, n_missing;   /* that half of the rays meet; of these not drawn */
	uint64_t n_holes, n_outside;  /* see psr_accuracy */
	uint64_t square, inside_square; /* sums over three channels, codes */
	uint64_t difference;          /* of the channel that differs most, inside */
};

int figure_score_add(struct figure_score *score, struct study *study, const struct figure_model *model,
                     const struct figure_shot *shot, const struct psr_frame *frame,
                     const struct figure_truth *truth);
/* Does the same with the colours alone. */
void figure_score_colors(struct figure_score *score, const struct psr_frame *frame,
                         const struct figure_truth *truth);
void figure_score_print_head(const char *first);
void figure_score_print(const char *label, const struct figure_score *score);
double figure_psnr(uint64_t square, uint64_t n_pixels);
int figure_difference(const uint8_t *a, const uint8_t *b); /* of the channel that differs most */

/* ---- sheet.c: pictures side by side ---- */

#define FIGURE_MOST_CELLS 32

/* A part of a picture, magnified by whole numbers. */
struct figure_part {
	uint32_t x, y, width, height, zoom;
};

struct figure_sheet {
	uint32_t columns, n_cells, width, height; /* of a cell */
	uint8_t *cell[FIGURE_MOST_CELLS];
};

/* Cells are added in rows; each is a copy of the part of a square picture. MEMORY. */
void figure_sheet_init(struct figure_sheet *sheet, uint32_t columns, const struct figure_part *part);
int figure_sheet_add(struct figure_sheet *sheet, const uint8_t *rgb, uint32_t side, const struct figure_part *part,
                     struct psr_error *err);

void figure_sheet_drop(struct figure_sheet *sheet, uint32_t n_cells); /* frees all but the first n_cells */

/* Writes NAME.png into the folder, if rc is OK, and drops all cells, in any case. Returns rc, or IO, MEMORY. */
int figure_sheet_finish(struct figure_sheet *sheet, const struct study *study, const char *name, int rc);

/* Moves the part to where `a` is further from the truth than `b`, by the most, in pixels that the object covers wholly;
 * returns by how much. */
uint64_t figure_part_find(struct figure_part *part, const uint8_t *a, const uint8_t *b,
                          const struct figure_truth *truth);

/* ---- compare.c: ways to draw, each against the truth ---- */

struct figure_way {
	const char *label;
	void (*change)(struct figure_shot *shot); /* before it is drawn; or NULL */
	figure_draw_fn *draw;                     /* NULL: figure_draw */
	const struct figure_model *model;         /* to draw in place of the model of the truth; or NULL */
};

void figure_make_smooth(struct figure_shot *shot); /* as programs draw */

#define FIGURE_MOST_WAYS 5
#define FIGURE_MOST_ROWS 3
#define FIGURE_FIND UINT32_MAX /* as part.x: where, in whichever view, the first way is worst beside the last one */

struct figure_look {
	double magnification;
	uint32_t side, rays;     /* of the picture; rays * rays a pixel */
	const double (*view)[3]; /* the first one is shown, unless a part is to be found */
	int n_views;
	void (*prepare)(struct figure_shot *shot, const struct figure_model *model); /* changes the shot; or NULL */
	int has_no_truth;        /* 1: the sheet leaves the truth out */
};

/* Prints the score of each way over all views, and adds their pictures to the sheet, then the truth. */
int figure_compare(struct study *study, struct figure_sheet *sheet, const struct figure_model *model,
                   const struct figure_look *look, const struct figure_part *part, const struct figure_way *way);

/* A sheet: a row for each model, a column for each way. */
struct figure_plan {
	const char *file, *head; /* head of the table; NULL: the model's name */
	struct figure_look look;
	uint32_t resolution;
	struct {
		const char *name;
		void (*make)(struct shape *); /* NULL: the generator of this name */
		struct figure_part part;
	} row[FIGURE_MOST_ROWS];
	struct figure_way way[FIGURE_MOST_WAYS + 1]; /* the last one has no label */
};
int figure_run(struct study *study, const struct figure_plan *plan);

/* ---- the figures ---- */

int figure_gaps(struct study *study);
int figure_fill(struct study *study);
int figure_threshold(struct study *study);
int figure_highlights(struct study *study);
int figure_shadows(struct study *study);
int figure_backs(struct study *study);
int figure_set(struct study *study);
int figure_edges(struct study *study);
int figure_interfaces(struct study *study);
int figure_thin(struct study *study);
int figure_stills(struct study *study);
int figure_dpoint_splats(struct study *study);
int figure_zoom(struct study *study);
extern const char figure_zoom_plot[];
/* Of the first model of study->names. */
int figure_octree_offsets(struct study *study);
int figure_octree_alias(struct study *study);
int figure_octree_levels(struct study *study);
int figure_octree_parts(struct study *study);

#endif
