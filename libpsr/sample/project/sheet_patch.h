/* Makes patches from the hits of a lattice block. */
#ifndef PSR_SAMPLE_PROJECT_SHEET_PATCH_H
#define PSR_SAMPLE_PROJECT_SHEET_PATCH_H

#include "sheet.h"

#define SHEET_LAYERS 24 /* hits of a ray that are looked at */
#define SHEET_HITS (PSR_BLOCK_SAMPLES * SHEET_LAYERS)

struct block_hit {
	float z;
	uint32_t surface;
	uint8_t at, two_sided, is_first;
	uint16_t parent; /* union-find: hits of a connected sheet have one root */
};

struct block_hits {
	struct block_hit hit[SHEET_HITS];
	uint16_t first_of[PSR_BLOCK_SAMPLES + 1]; /* hits are by lattice point */
	int n;
};

/* Patches of a row of lattice blocks; one thread makes them. */
struct patch_row {
	uint32_t n, capacity;
	uint64_t n_rays, n_hits;
	struct patch *patch;
	struct sheet_sample (*sample)[PSR_BLOCK_SAMPLES];
	int failed;
};

/* Puts the hits of a block into patches at the end of a row: a connected sheet into one patch, shallow sheets
 * together. Destroys h->hit[].parent. step: the lattice's. MEMORY. */
int patch_row_add(struct patch_row *row, struct block_hits *h, int col, int block_row, float step);

#endif
