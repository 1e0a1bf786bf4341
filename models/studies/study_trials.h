/* Adequacy ([G] 4.2) of any set of samples: what `psr-model info` prints of a model, for the selections of `psr-model
 * study` that no model can hold. */
#ifndef MODELS_STUDY_TRIALS_H
#define MODELS_STUDY_TRIALS_H

#include "psr/error.h"
#include "psr/mesh.h"
#include "models/studies/greedy/greedy.h"

/* Random places of a mesh's surface that are seen from random directions, weighted by projected area; the same for
 * the same mesh. Around each a pixel of a randomly turned grid (sample/mend/adequacy.h). */
struct study_trials;

/* n_views directions with as many places each that n_a_view of them are seen, if a thousandth of what is tried is.
 * scene: of the mesh. MEMORY, ARG for a mesh without an area. */
int study_trials_create(struct study_trials **out, const struct psr_mesh *mesh, const struct ray_scene *scene,
                        int n_views, int n_a_view, struct psr_error *err);
void study_trials_destroy(struct study_trials *trials); /* NULL is fine */

/* A trial is missing if no sample that faces its view falls into its pixel, of side ds, in front of or behind the
 * place by no more than its surface may rise or fall within the pixel. pool may be NULL. MEMORY. */
int study_trials_run(const struct study_trials *trials, const struct greedy_point *point, size_t n_points, double ds,
                     struct psr_pool *pool, uint64_t *n_trials, uint64_t *n_missing);

#endif
