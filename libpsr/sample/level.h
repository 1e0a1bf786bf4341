/* The order of the steps that make one level of a model. Each folder of sample/ is a step: it writes what stands in
 * brackets, reads what the steps above wrote, and includes nothing of those below (tests/e2e/rooms.sh).
 *
 *   project    finds what is thin (thin) and traces 32 projections (sheets)               [G] 4.4, 5.1
 *   visible    finds which parts of the surface can be seen (visible, sides)
 *   own        gives each place to a projection (field, ownership), keeps samples (kept)  [G] 5.2
 *   thin       keeps samples of needles and leaves
 *   mend       finds places that kept samples miss, and keeps samples for them            [G] 4.2, 4.3
 *   levels     makes blocks of all levels, cut into groups (struct draft)
 *   pack       makes cones, masks, and the arrays of a model                              [G] 6.3, 6.4
 *
 * level.c alone knows the order up to mend, build.c that of the rest. */
#ifndef PSR_SAMPLE_LEVEL_H
#define PSR_SAMPLE_LEVEL_H

#include "sample/mend/adequacy.h"
#include "sample/own/keep.h"

/* The steps' results. One module writes each; the others get it const, or call that module. */
struct level {
	struct sampling sampling;
	uint8_t *thin;
	struct sheets sheets[N_PROJECTIONS];
	struct visible_set visible;
	uint8_t *sides;
	struct field field;
	struct ownership ownership;
	struct kept kept;
	const struct level *finer; /* with half of this one's ds; NULL: this is the finest */
	uint64_t n_rays, n_patches;
	double seconds_rays;
};

/* Set `finer`, and all of `sampling` but `thin`, before the call. Functions that return int can fail with MEMORY; call
 * level_fini() even then. */
struct level_progress {
	void (*on_step)(unsigned done, unsigned total, void *userdata);
	void *userdata;
};
int level_make(struct level *level, const struct level_progress *progress); /* all steps; progress may be NULL */

/* The steps of level_make() one by one: own finds hits, and who sees and owns them; merge merges small patches; keep
 * keeps the owned hits; mend adds missing samples. */
int level_own(struct level *level, const struct level_progress *progress);
void level_merge(struct level *level);
int level_keep(struct level *level);
int level_mend(struct level *level);

/* Measures adequacy and adds missing samples, until less than a 15,000th is missing or rounds stop helping. *out: the
 * last round's result, with another seed, without places. MEMORY. */
int level_reach(struct adequacy *out, struct level *level);

/* Frees everything that the next coarser level does not read. */
void level_trim(struct level *level);
void level_fini(struct level *level);

#endif
