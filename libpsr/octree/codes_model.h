/* What codes_mixed.c learns, and the tables that it learns by. */
#ifndef PSR_OCTREE_CODES_MODEL_H
#define PSR_OCTREE_CODES_MODEL_H

#include "words.h"

/* Bits of the places that a context has. */
#define A_BITS 14
#define B_BITS 17
#define D_BITS 19
#define E_BITS 17
#define F_BITS 17
#define COUNTS 127     /* a probability's speed of learning goes down to 1 in this many */
#define KEPT_COUNT 2   /* at most, from level to level: what was learnt counts for little on the next */
#define WEIGHT_SETS (9 << 4)
#define PLANES 9       /* of three by three neighbours: three across each axis */
#define CODES 12       /* neighbours whose codes are parts: those at faces and edges that may come earlier */
#define LINE 64        /* of the cache: tables of a power of two beside each other would share its places */

struct codes_model {
	/* Probabilities of 22 bits above counts of 10, by: siblings and the node's faces; known children around; these and
	 * the seven nodes that the octant touches; the node's neighbours; two children behind, each of seven ways. */
	uint32_t a[1 << A_BITS], b[1 << B_BITS], d[1 << D_BITS], e[1 << E_BITS], f[1 << F_BITS];
	words weight[WEIGHT_SETS]; /* in 2^-13: of the contexts' logits, a constant, the sum, nothing */
	/* Parts of sums, in 2^-12: of all octants, by what is known of the node from the beginning; of one. */
	words of_plane[PLANES][512 + LINE / sizeof(words)], of_code[CODES][256 + LINE / sizeof(words)];
	int16_t of_own[8][256], of_window[8][2][2048 + LINE / 2], of_near[8][128 + LINE / 2], of_far[8][128 + LINE / 2];
	int16_t logit[4096];       /* ln(p / (1 - p)) * 256, p in 4096ths */
	uint16_t share[4096];      /* the inverse, of logits + 2048, in 65536ths */
	/* By a count: 1 / (count + 2), in 2^-14; what it goes up by; which weights to use, of two contexts. */
	uint32_t part[COUNTS + 1];
	uint8_t more[COUNTS + 1], set_by_d[COUNTS + 1], set_by_e[COUNTS + 1];
	uint32_t across[512];      /* a plane's columns: 3 bits at 0, 10 and 20 each */
};

/* Lets probabilities learn as fast as at first, or nearly: at the beginning of a level. */
void codes_model_forget(struct codes_model *model, int is_sparse);

#endif
