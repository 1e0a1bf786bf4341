/* Tests places all over the surface. */
#ifndef PSR_SAMPLE_MEND_DICE_H
#define PSR_SAMPLE_MEND_DICE_H

#include "sample/own/keep.h"
#include "sample/visible/places.h"

/* Dices all primitives, as [G] 9.2.1 and [Cook87] do, though only to test what is there: lists the places, a third of a
 * pixel apart, that are seen and not covered, those on what is thin first: *n_thin of them. They are others in each
 * round, 0 or greater. free() places->place. MEMORY. */
int dice(struct places *places, size_t *n_thin, const struct keeper *keeper, const struct field *field, int round);

#endif
