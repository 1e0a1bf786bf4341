/* One orthographic projection of the object, sampled on its equilateral lattice ([G] 4.4, 5.1; psr/model.h). */
#ifndef PSR_SAMPLE_LATTICE_H
#define PSR_SAMPLE_LATTICE_H

#include <stdint.h>
#include "psr/model.h"
#include "psr/pool.h"
#include "ray.h"

#define LATTICE_BACK 0x80000000u /* in a sample's surface: met from the back */

struct lattice_sample {
	float z;
	uint32_t surface; /* primitive, and LATTICE_BACK */
};

/* Blocks with a valid sample, by rows of the lattice, then by columns. */
struct lattice {
	struct psr_projection projection;
	uint32_t n_blocks;
	uint64_t n_rays;
	int16_t *col, *row;                                   /* in blocks */
	uint64_t *mask;
	struct lattice_sample (*sample)[PSR_BLOCK_SAMPLES];
};

/* Traces the whole unit sphere, or of each `stride` rows and columns of blocks only one. On failure nothing is kept.
 * MEMORY. */
int lattice_trace(struct lattice *lattice, const struct ray_scene *scene, const struct psr_projection *projection,
                  int stride, struct psr_pool *pool);
void lattice_fini(struct lattice *lattice);

/* Projection space x and y of a block's sample. */
void lattice_position(const struct psr_projection *projection, int col, int row, unsigned sample, double *x, double *y);

/* The ray that looks for a sample, from outside of the unit sphere: z = LATTICE_START - t. */
#define LATTICE_START 2.0
void lattice_ray(const struct psr_projection *projection, double x, double y, struct ray *ray);

#endif
