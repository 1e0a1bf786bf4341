/* Pictures of a model as [K] 6 has them, 800x600, their truth by rays, and what frames cost and miss. */
#ifndef MODELS_STUDIES_DPOINT_VIEW_H
#define MODELS_STUDIES_DPOINT_VIEW_H

#include "measure/measure.h"
#include "models/studies/lib/study.h"

#define DPOINT_VIEW_WIDTH 800
#define DPOINT_VIEW_HEIGHT 600
#define DPOINT_VIEW_MOST_WAYS 12
#define DPOINT_VIEW_WHOLE 2.3 /* radii across which the whole model is in the picture */
#define DPOINT_VIEW_ROUGHNESS 0.25f

struct dpoint_view {
	struct study *study;
	const struct study_model *of;
	struct psr_source *source;
	struct psr_frame frame;
	struct psr_source_planes truth;
	double target[3];          /* the brightest place */
	struct psr_scene scene;    /* of one instance and one light, those below */
	struct psr_instance instance;
	struct psr_light light;
};

/* A way to show the model. */
struct dpoint_way {
	struct psr_model *model;
	int with_ewa;
	enum psr_smooth smooth;
	unsigned pass;
};

/* Needs study->renderer. dpoint_view_fini() is due even on failure. MEMORY. */
int dpoint_view_init(struct dpoint_view *view, struct study *study);
void dpoint_view_fini(struct dpoint_view *view);

/* A table of some rows a model. */
struct dpoint_view_rows {
	struct study_form form;
	int n, n_steps; /* a model: rows, study_step()s */
	int (*fill)(void *subject, struct study_model *of, int row); /* those of a model, from this one on */
};

/* Makes the study's table, its renderer and the view, fills in the rows of all its models, and ends renderer and view. */
int dpoint_view_table(struct dpoint_view *view, struct study *study, const struct dpoint_view_rows *rows, void *subject);

/* Shows another model, whose materials get DPOINT_VIEW_ROUGHNESS, and finds its brightest place in a picture `across`
 * radii high. */
int dpoint_view_open(struct dpoint_view *view, const struct study_model *of, double across);

/* Sets a picture `across` radii high: of the model's middle, or of its brightest place; and draws its truth. */
int dpoint_view_set(struct dpoint_view *view, double across, int is_close);

/* Times frames of n ways in turn; the median counts. */
int dpoint_view_time(double *fps, struct dpoint_view *view, const struct dpoint_way *way, int n);

/* Draws a frame into view->frame, and compares it. bright: decibels of the pixels that the truth has brighter than
 * three quarters of its brightest. */
int dpoint_view_score(struct psr_errors *errors, double *bright, struct dpoint_view *view,
                      const struct dpoint_way *way);

/* Draws a frame into view->frame. */
int dpoint_view_draw(struct dpoint_view *view, const struct dpoint_way *way);

#endif
