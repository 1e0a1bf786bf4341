/* Looks from the surface outwards, for nooks and slots that show from few directions. */
#ifndef PSR_SAMPLE_VISIBLE_LOOK_OUT_H
#define PSR_SAMPLE_VISIBLE_LOOK_OUT_H

#include "sample/project/sampling.h"
#include "visible_set.h"

/* Tries a place for each 1.5 x 1.5 pixels of the surface that no view has met, if something within about 12 pixels
 * that faces like it was seen: it is added when one of 64 rays from it gets outside. 192 more rays try those within
 * about 6 pixels of what was added. The same whatever the threads. MEMORY. */
int look_out(struct visible_set *set, const struct sampling *sampling);

#endif
