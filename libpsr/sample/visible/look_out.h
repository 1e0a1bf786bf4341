/* Looks from the surface outwards, for nooks and slots that show from few directions. */
#ifndef PSR_SAMPLE_VISIBLE_LOOK_OUT_H
#define PSR_SAMPLE_VISIBLE_LOOK_OUT_H

#include "sample/project/sampling.h"
#include "visible_set.h"

/* Tries a place for each 1.5 x 1.5 pixels of the surface that no view has met, if views saw a surface within about 12
 * pixels that faces like it. Adds the place when one of 64 rays from it gets outside. 192 more rays try places within
 * about 6 pixels of an added place. The same result with any number of threads. MEMORY. */
int look_out(struct visible_set *set, const struct sampling *sampling);

#endif
