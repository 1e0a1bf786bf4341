/* Which blocks to keep: the first, greedy pass of [G] 5.2. */
#ifndef PSR_SAMPLE_SELECT_H
#define PSR_SAMPLE_SELECT_H

#include <stddef.h>
#include <stdint.h>
#include "lattice.h"
#include "psr/error.h"
#include "psr/pool.h"
#include "ray.h"

struct selected_block {
	uint16_t projection;
	uint8_t two_sided;    /* has a sample of a surface that is seen from both sides */
	uint32_t block;       /* in its lattice */
	uint64_t mask;        /* samples that it keeps; never 0 */
	size_t first;         /* of its attributes */
};

struct selection {
	struct selected_block *block; /* in the order in which they were chosen */
	size_t n_blocks, capacity;
	uint64_t *attr;               /* words of psr/model.h */
	size_t n_samples, attr_capacity;
};

struct select_input {
	const struct psr_mesh *mesh;
	const struct ray_scene *scene;
	const struct psr_projection *projection; /* MOST_PROJECTIONS */
	struct lattice *lattice; /* as many: N_PROJECTIONS are traced, the others empty until they are needed */
	double ds;                     /* a pixel at the target resolution, inner units */
	float cosine;                  /* of the tolerance angle */
	struct psr_pool *pool;
	void (*on_progress)(uint64_t done, uint64_t total, void *userdata); /* may be NULL */
	void *userdata;
};

/* Twice through the projections: in the first sweep only samples that a projection sees within the tolerance angle can
 * choose a block, so that as much as possible comes from where it is sampled best; in the second every sample that is
 * still missed does, but if it is seen at over 60 degrees, an outline, only where nothing of its surface is there
 * within half a pixel more. Then each of the scouts looks at a part of its view, and is a projection like the others if
 * it finds a sample that is missed. Chosen blocks keep all of their samples. MEMORY; selection_fini() either way. */
int select_blocks(struct selection *selection, const struct select_input *input);
void selection_fini(struct selection *selection);

#endif
