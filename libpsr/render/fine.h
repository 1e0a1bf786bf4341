/* Where fine pictures, the means of 2x2 smooth sub-pixels, are worth their time. */
#ifndef PSR_RENDER_FINE_H
#define PSR_RENDER_FINE_H

#include "stages.h"
#include "survey.h"

/* Sets *is_worth to whether a fine picture of the scene is nearer to the truth than a smooth one: its samples are near
 * enough. The caller owns *surveyor, NULL before the first call. ARG and so on of invalid scenes and settings; MEMORY. */
int fine_is_worth(int *is_worth, struct surveyor **surveyor, const struct psr_scene *scene,
                  const struct render_settings *settings, struct psr_error *err);

/* Pixels between samples of level 0, in the root mean square of a view, up to which fine_is_worth() says so; of a scene
 * without splats. */
double fine_most_apart(const struct psr_scene *scene);

#endif
