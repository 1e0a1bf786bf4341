/* Ownership. [G] 5.2 adds blocks wherever projections, taken one after the other, still show a hole. Here the
 * projection that faces a place best owns it, and a block keeps the hits that its projection owns. */
#ifndef PSR_SAMPLE_OWN_OWNER_H
#define PSR_SAMPLE_OWN_OWNER_H

#include "field.h"
#include "sample/project/sheet.h"
#include "sample/visible/visible_set.h"

/* Bits of a patch's hits. */
struct owned {
	uint64_t mask;   /* owned, and to be kept */
	uint64_t hidden; /* owned at first, but no view can see them */
};

struct ownership {
	struct owned *patch[N_PROJECTIONS]; /* n_patches of each projection's sheets */
};

/* Returns the projection that owns a place that faces n. */
unsigned owner_of(const struct sampling *sampling, const struct field *field, const float p[3], const float n[3]);

/* Finds the owners of all hits, makes the field on the way, and adds seen places to the visible set and to `sides`
 * (enum side). MEMORY; call ownership_fini() even then. */
struct owner_finds {
	struct field *field; /* initialised */
	struct visible_set *visible;
	uint8_t *sides;
};
int owner_mark(struct ownership *ownership, const struct owner_finds *finds, const struct sampling *sampling,
               const struct sheets *sheets);
void ownership_fini(struct ownership *ownership);

/* merge.c: gives the hits of patches that own less than a quarter of a block to other patches with the same surface.
 * Drops single hits that remain. */
void owner_merge(struct ownership *ownership, const struct sampling *sampling, const struct sheets *sheets,
                 const struct field *field);

#endif
