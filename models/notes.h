/* What psr-model build tells about a source beside the model that it made: what was left out, and what is drawn
 * otherwise than its materials ask. On stderr. */
#ifndef MODELS_NOTES_H
#define MODELS_NOTES_H

#include "psr/mesh.h"
#include "psr/model.h"

void notes_of_import(const struct psr_mesh *mesh);
void notes_of_blocks(const struct psr_model *model); /* which has blocks */
void notes_of_octree(const struct psr_mesh *mesh);
void notes_of_points(const struct psr_mesh *mesh);

#endif
