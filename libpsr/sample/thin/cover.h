/* Needles, wires and leaves: what is thin is sampled once for all of its sides, by as few samples as can be. */
#ifndef PSR_SAMPLE_THIN_COVER_H
#define PSR_SAMPLE_THIN_COVER_H

#include "sample/own/keep.h"
#include "sample/visible/places.h"

/* Covers places on thin primitives; those that nothing covers stay. The same samples whatever the number of threads.
 * MEMORY. */
int thin_cover(const struct keeper *keeper, struct place *place, size_t *n);

#endif
