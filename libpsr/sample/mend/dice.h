/* Tests places all over the surface. */
#ifndef PSR_SAMPLE_MEND_DICE_H
#define PSR_SAMPLE_MEND_DICE_H

#include "sample/own/keep.h"
#include "sample/visible/places.h"

/* Dices all primitives ([G] 9.2.1, [Cook87]) into places a third of a pixel apart, at different places in each round (0
 * or greater), and lists the places that views see and no sample covers: first *n_thin on thin primitives. free()
 * places->place. MEMORY. */
int dice(struct places *places, size_t *n_thin, const struct keeper *keeper, const struct field *field, int round);

#endif
