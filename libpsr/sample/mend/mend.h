/* Adds the samples that places lack: for thin primitives; in blocks that exist; in new blocks, the most wanted first.
 * */
#ifndef PSR_SAMPLE_MEND_MEND_H
#define PSR_SAMPLE_MEND_MEND_H

#include "sample/own/keep.h"
#include "sample/visible/places.h"

/* Covers places all over the surface, other ones in each round (0 or greater). MEMORY. */
int mend_surface(const struct keeper *keeper, const struct field *field, int round);

/* Covers one place. MEMORY. */
int mend_place(const struct keeper *keeper, const struct field *field, const struct place *place);

#endif
