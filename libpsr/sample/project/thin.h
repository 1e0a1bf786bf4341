/* Thin primitives, as of needles and leaves: another face of the same plain material is at most 0.6 pixels behind
 * them. A sample there stands for both sides. */
#ifndef PSR_SAMPLE_PROJECT_THIN_H
#define PSR_SAMPLE_PROJECT_THIN_H

#include <stdint.h>

enum thin {
	THIN = 1,
	THIN_NARROW = 2, /* and narrower than half a pixel: its sides are all tested, as none stands for the others when
	                  * seen from aside */
	THIN_BEHIND = 4, /* and not narrow: the places of its other side are tested */
};

struct sampling;

/* Fills thin[] by primitive with enum thin, or 0. finer: the next finer level's, whose thin primitives are thin here;
 * or NULL. */
void thin_mark(uint8_t *thin, const struct sampling *sampling, const uint8_t *finer);

/* Returns the opacity of a sample at p with this normal: the share that surfaces cover of a disc about p as wide as a
 * pixel, of PSR_OPAQUE. At least 1. Nearly whole discs, as inside of a leaf, are PSR_OPAQUE. */
uint8_t thin_opacity(const struct sampling *sampling, const float p[3], const float n[3]);

#endif
