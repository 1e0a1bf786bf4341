/* Needles, wires and leaves: what is thin is sampled once for all of its sides, by as few samples as can be. */
#ifndef PSR_SAMPLE_THIN_COVER_H
#define PSR_SAMPLE_THIN_COVER_H

#include <stddef.h>
#include "sample/level.h"

/* Marks primitives that are thin and narrower than half a pixel, too: SIDE_NARROW. All sides of these are tested, as
 * none stands for the others when seen from aside. After thin_mark(). */
void thin_mark_narrow(struct level *level);

/* Covers n places on thin primitives; those that nothing covers stay, in front. The same samples whatever the number of
 * threads. MEMORY. */
int thin_cover(struct level *level, struct surface_spot *spot, size_t *n);

#endif
