/* What views all around do not meet, looked at from the surface: nooks and slots show from a few directions only. */
#ifndef PSR_SAMPLE_VISIBLE_LOOK_OUT_H
#define PSR_SAMPLE_VISIBLE_LOOK_OUT_H

#include "sample/level.h"

/* Of places all over the surface, one for each 1.5 x 1.5 pixels, puts down as seen those that no view has met so far
 * and from which one of 64 rays gets outside, if something that faces like them was seen within 12 pixels or so; 192
 * rays more look out from those within 6 pixels or so of what these found. The same whatever the threads. MEMORY. */
int seen_look_out(struct level *level);

#endif
