/* Random scenes that a test takes apart and puts together in another way. Include after cmocka.h. */
#ifndef TESTS_HARD_WORLD_H
#define TESTS_HARD_WORLD_H

#include "blocks.h"

#define HARD_BLOCKS 300

/* A model of random blocks, one- and two-sided, of random colours and gloss, each sample at a depth of its own; and a
 * scene with one instance of it and two lights with shadows. Some blocks need depth buffers. Not to be copied: the
 * scene points into it. */
struct hard_world {
	struct psr_projection projection[8];
	struct hard_block *block; /* HARD_BLOCKS */
	struct psr_model *model;
	struct psr_instance instance;
	struct psr_light light[2];
	struct psr_scene scene;
};

void hard_world_make(struct hard_world *w, uint64_t *seed);
void hard_world_clear(struct hard_world *w);

/* A model of other blocks in the same projections, which the caller owns. */
struct psr_model *hard_world_model(const struct hard_world *w, const struct hard_block *block, uint32_t n);

#endif
