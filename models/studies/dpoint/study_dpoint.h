/* [K]'s own simplification, and the table of ours beside it. */
#ifndef MODELS_STUDIES_DPOINT_STUDY_DPOINT_H
#define MODELS_STUDIES_DPOINT_STUDY_DPOINT_H

#include "dpoint/choice.h"

/* Prunes the most redundant candidate whose cells are all covered by others, until none is left. A candidate is
 * the more redundant, the more its neighbours are like it in curvatures and directions. MEMORY; dpoint_choice_fini() even
 * then. */
int study_dpoint_prune(struct dpoint_choice *choice, const struct dpoint_surface *surface,
                       const struct dpoint_cover *cover);

struct study;
int table_dpoint(struct study *study);
int table_dpoint_meshes(struct study *study);
int table_dpoint_error(struct study *study);
int table_dpoint_frames(struct study *study);

#endif
