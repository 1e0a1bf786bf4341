/* [K]'s own simplification, its teapot, and the tables of ours beside them. */
#ifndef MODELS_STUDIES_DPOINT_STUDY_DPOINT_H
#define MODELS_STUDIES_DPOINT_STUDY_DPOINT_H

#include "dpoint/choice.h"
#include "dpoint/sample.h"
#include "models/studies/lib/study.h"

/* Prunes the most redundant candidate whose cells are all covered by others, until none is left. A candidate is
 * the more redundant, the more its neighbours are like it in curvatures and directions. MEMORY; dpoint_choice_fini() even
 * then. */
int study_dpoint_prune(struct dpoint_choice *choice, const struct dpoint_surface *surface,
                       const struct dpoint_cover *cover);

/* [K] does not say its epsilon and delta. These are the least epsilon, of two digits, whose rectangles leave less than
 * a thousandth of the patches uncovered, and the delta at which [K]'s order keeps as much as [K] does, 16.4 %. Fitted
 * rectangles end by themselves. */
#define STUDY_DPOINT_EPSILON 0.004
#define STUDY_DPOINT_DELTA 0.0127f
#define STUDY_DPOINT_DELTA_FREE 0.125f /* of a class: groups have no other */

#define STUDY_DPOINT_RESOLUTION 512 /* of models */

/* Slack is half a step of a group's box of 0.6. */
#define STUDY_DPOINT_FITTED(degrees, most_height) { \
	.sine = dpoint_sine(STUDY_DPOINT_EPSILON), .slack = 2e-5f, .angle = (float)((degrees) * PSR_DEGREE), \
	.height = (most_height), .overhang = 5e-4f, .graze = 0.5f * dpoint_graze(STUDY_DPOINT_RESOLUTION), \
}

/* ---- teapot.c ---- */

/* The sphere around the teapot: the place and the length of an inner unit. */
#define STUDY_DPOINT_ORIGIN { 0.2, 1.575, 0 }
#define STUDY_DPOINT_RADIUS 3.75

/* Samples each of the teapot's patches, whose number is the part; like->part does not count. MEMORY. */
int study_dpoint_teapot(struct dpoint_surface *surface, const struct dpoint_uniform *like);

/* The same patches as a fine mesh, without the generator's caps. */
void study_dpoint_make_teapot(struct shape *shape);

/* ---- make.c ---- */

struct study_dpoint {
	struct dpoint_surface surface;
	struct dpoint_cover cover;
	struct dpoint_choice choice;
};

/* Samples the model, "teapot" as patches with `side` samples along a side, others as meshes, and keeps all, with
 * STUDY_DPOINT_DELTA, or simplifies them. study_dpoint_fini() is due even on failure. */
int study_dpoint_make(struct study_dpoint *made, const struct study *study, const struct study_model *of, uint32_t side,
                      int is_simplified);
void study_dpoint_fini(struct study_dpoint *made);

/* Samples the teapot's patches as squares on the tangent plane, with one normal each. wide: half of a side over the
 * radius of the ball that reaches to the neighbours of a sample ([K] 6); up to a fifth more. MEMORY. */
int study_dpoint_flat(struct dpoint_surface *surface, const struct study_model *of, uint32_t side, float wide);

/* Keeps all of n candidates. MEMORY; dpoint_choice_fini() even then. */
int study_dpoint_keep_all(struct dpoint_choice *choice, size_t n);

/* Makes a material that scatters all light, and mirrors none. */
void study_dpoint_dull(struct psr_material *material);

/* Makes a model of what was chosen, in units of the mesh, with the look of its first material, dull unless it is
 * specular. It paints the candidates. */
int study_dpoint_model(struct psr_model **out, struct study *study, const struct study_model *of,
                       struct dpoint_surface *surface, const struct dpoint_choice *choice, int is_specular);

/* Makes a model of the mesh's differential points as psr-model build does. */
int study_dpoint_of_mesh(struct psr_model **out, const struct study *study, const struct study_model *of);

/* Makes a model of the mesh's blocks, of so many times the study's resolution. */
int study_dpoint_blocks(struct psr_model **out, const struct study *study, const struct study_model *of, uint32_t times);

int table_dpoint(struct study *study);
int table_dpoint_holes(struct study *study);
int table_dpoint_meshes(struct study *study);
int table_dpoint_error(struct study *study);
int table_dpoint_frames(struct study *study);

/* A magnified picture, with blocks that are as good. */
int table_dpoint_bytes(struct study *study);

/* A magnified highlight, with blocks of as much time. */
int table_dpoint_equal(struct study *study);
int table_dpoint_models(struct study *study);

#endif
