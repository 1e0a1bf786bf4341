/* Adequacy ([G] 4.2) of any set of samples. `psr-model info` prints it of a model; selections here are no models. */
#ifndef MODELS_STUDIES_LIB_TRIALS_H
#define MODELS_STUDIES_LIB_TRIALS_H

#include "base/vec.h"
#include "psr/error.h"
#include "psr/mesh.h"
#include "base/pool.h"
#include "ray/ray.h"

/* A sample, in inner units (psr/model.h). */
struct trials_sample {
	float position[3];
	uint16_t normal; /* psr/direction.h */
	uint8_t two_sided;
};

/* A place in the frame of a view: z grows towards the viewer. */
struct trials_seen {
	float x, y, z;
};

static inline struct trials_seen trials_project(const float axis[3][3], const float p[3])
{
	return (struct trials_seen){ v3f_dot(axis[0], p), v3f_dot(axis[1], p), v3f_dot(axis[2], p) };
}

/* Random places of a mesh's surface that are seen from random directions, weighted by projected area; the same for
 * the same mesh. Around each a pixel of a randomly turned grid (sample/mend/adequacy.h). */
struct trials;

/* Makes n_views directions, each with places: n_a_view of them are seen if a thousandth of all are. scene: of the mesh.
 * MEMORY, ARG for a mesh without an area. */
int trials_create(struct trials **out, const struct psr_mesh *mesh, const struct ray_scene *scene, int n_views,
                  int n_a_view, struct psr_error *err);
void trials_destroy(struct trials *trials); /* NULL is fine */

/* A trial is missing if no sample that faces its view falls into its pixel, of side ds, in front of or behind the
 * place by no more than its surface may rise or fall within the pixel. pool may be NULL. MEMORY. */
struct trials_count {
	uint64_t n_trials, n_missing;
};
int trials_run(struct trials_count *count, const struct trials *trials, const struct trials_sample *sample,
               size_t n_samples, double ds, struct psr_pool *pool);

/* Distance behind a sample, along the view, within which another one of its pixel may be of the same surface: a
 * surface at an angle a to the view falls by tan a a pixel, and two points of a pixel are up to 1.42 pixels apart. */
float trials_depth_tolerance(float cosine, double ds);

#endif
