/* Keeps samples: the one way in for all steps. */
#ifndef PSR_SAMPLE_OWN_KEEP_H
#define PSR_SAMPLE_OWN_KEEP_H

#include "kept.h"
#include "owner.h"

struct keeper {
	const struct sampling *sampling;
	const struct visible_set *visible;
	const uint8_t *sides;      /* enum side */
	const struct kept *finer;  /* of the level with half of this ds, for blending attributes; NULL */
	struct sheets *sheets;     /* of all projections: their hits are marked; */
	struct kept *kept;         /* and grows */
};

/* Keeps all owned hits; one hit, unless it is kept; hits that are not kept, or only marked. MEMORY. */
int keep_owned(const struct keeper *keeper, const struct ownership *ownership);
int keep_sample(const struct keeper *keeper, struct sample_ref ref);
int keep_samples(const struct keeper *keeper, const struct sample_ref *ref, uint32_t n);

/* Adds a hit at a lattice point, and keeps it; does nothing beyond the lattice. MEMORY. */
int keep_moved(const struct keeper *keeper, unsigned projection, struct lattice_point at, float z, uint32_t surface);

/* Returns whether a sample of a face with this normal counts in views of its back, too. A thin sheet's sample does. */
int keep_is_two_sided(const struct keeper *keeper, uint32_t prim, const float p[3], const float n[3]);

/* Asks that again of all kept samples, after more was seen. */
void keep_look_again(const struct keeper *keeper);

#endif
