/* Which sides of each primitive were seen at some place, or found hidden at some place. */
#ifndef PSR_SAMPLE_VISIBLE_SIDES_H
#define PSR_SAMPLE_VISIBLE_SIDES_H

#include <stdint.h>
#include "sample/project/sampling.h"

enum side { SIDE_FRONT_SEEN = 1, SIDE_BACK_SEEN = 2, SIDE_FRONT_HIDDEN = 4, SIDE_BACK_HIDDEN = 8 };
#define SIDES_SEEN (SIDE_FRONT_SEEN | SIDE_BACK_SEEN)

/* sides: by primitive. From any thread. */
static inline void sides_note(uint8_t *sides, uint32_t surface, int is_seen)
{
	enum side side = (surface & SURFACE_BACK) != 0 ? (is_seen ? SIDE_BACK_SEEN : SIDE_BACK_HIDDEN)
	                                               : (is_seen ? SIDE_FRONT_SEEN : SIDE_FRONT_HIDDEN);

	__atomic_fetch_or(&sides[surface & ~SURFACE_BACK], (uint8_t)side, __ATOMIC_RELAXED);
}

#endif
