/* Covers needles, wires and leaves once for all of their sides, by as few samples as possible. */
#ifndef PSR_SAMPLE_THIN_COVER_H
#define PSR_SAMPLE_THIN_COVER_H

#include "sample/own/keep.h"
#include "sample/visible/places.h"

/* Covers places on thin primitives; uncovered ones stay. The same samples whatever the number of threads. MEMORY. */
int thin_cover(const struct keeper *keeper, struct place *place, size_t *n);

#endif
