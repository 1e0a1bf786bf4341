/* Whether the surface is where a rectangle's S_p is. */
#ifndef PSR_DPOINT_BACKING_H
#define PSR_DPOINT_BACKING_H

#include "rectangle.h"

/* Returns whether S_p is the surface at u, v: a cell that suits is there. *last is the leaf that was found last, for
 * whichever rectangle, or 0: whoever asks often asks for places beside each other. */
int is_backed(size_t *last, const struct looking *l, const struct rectangle *r, float u, float v);

#endif
