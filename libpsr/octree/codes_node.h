/* A node of codes_mixed.c: what is known of it before its code, and the sums that parts of that add to. */
#ifndef PSR_OCTREE_CODES_NODE_H
#define PSR_OCTREE_CODES_NODE_H

#include <string.h>
#include "codes.h"
#include "codes_model.h"

#define LEARN 6        /* of weights, in 2^-21 */
#define PART_LEARN 102 /* of the parts of sums, in 2^-12 */

#define ALWAYS static inline __attribute__((always_inline))

/* ---- a bit ---- */

/* By 1 / (count + 2). */
ALWAYS uint32_t learn(const struct codes_model *model, uint32_t was, unsigned bit)
{
	return coder_learn(was, model->part, model->more[coder_count(was)], bit);
}

ALWAYS int32_t held(int32_t x)
{
	return x < -2047 ? -2047 : x > 2047 ? 2047 : x;
}

ALWAYS int32_t share_of(const struct codes_model *model, words logit, unsigned set)
{
	return model->share[2048 + held(words_weigh(logit, model->weight[set]) >> 13)];
}

ALWAYS void learn_weights(struct codes_model *model, words logit, unsigned set, int32_t share, unsigned bit)
{
	words *weight = &model->weight[set];

	*weight = words_learn(*weight, logit, (int16_t)((((int32_t)(bit << 16) - share) * LEARN + 128) >> 8));
}

/* Returns what the parts of a sum change by. */
ALWAYS int16_t part_step(const struct codes_model *model, int32_t sum, unsigned bit)
{
	return (int16_t)((((int32_t)(bit << 16) - model->share[2048 + sum]) * PART_LEARN + 32768) >> 16);
}

static inline uint32_t scatter(uint64_t x, int bits)
{
	return (uint32_t)(x * 0x9e3779b97f4a7c15u >> (64 - bits));
}

/* ---- a node ---- */

/* Which neighbours of its parent octant j touches, with the parent itself. */
ALWAYS uint32_t touched_by(unsigned j, uint32_t there)
{
	return there >> ((j & 1) + 3 * (j >> 1 & 1) + 9 * (j >> 2)) & 0x361b;
}

/* All children around an octant, itself in the middle: 3x3x3 of the neighbourhood's 4x4x4. */
#define WINDOW 0x77707770777u

/* What is known of a node before its code. */
struct around {
	uint32_t there;              /* which neighbours there are, and itself */
	uint64_t known;              /* children of neighbours that come earlier, and own ones so far */
	uint64_t behind;             /* the same, of a cube whose far end are its own */
	uint8_t code[OCTREE_NEAR];   /* of neighbours that come earlier; 0 of others */
	int row;                     /* how far above the leaves */
};

#define BEHIND 0x161bu /* neighbours that are not ahead along any axis */

ALWAYS void look_around(struct around *around, const uint8_t *codes, const struct octree_near *near, int is_sparse)
{
	around->there = near->there;
	for (uint32_t left = near->before; left != 0; left &= left - 1) {
		const unsigned k = (unsigned)__builtin_ctz(left), code = codes[octree_near_at(near, k)];

		around->code[k] = (uint8_t)code;
		around->known |= octree_cube_of(code, k);
		if (!is_sparse)
			around->behind |= octree_cube[code] << (octree_turn[k] + 21) % 64 & -(uint64_t)(BEHIND >> k & 1);
	}
}

/* Finds the parts of all octants at once. */
ALWAYS void find_parts(words *part[PLANES + CODES], struct codes_model *model, const struct around *around)
{
	static const uint8_t with[CODES] = { 4, 10, 12, 1, 3, 5, 7, 9, 11, 15, 19, 21 };
	const uint32_t there = around->there;
	const uint32_t columns = model->across[there & 511] | model->across[there >> 9 & 511] << 3 |
	                         model->across[there >> 18] << 6;

#pragma GCC unroll 3
	for (int i = 0; i < 3; i++) {
		const uint32_t rows = there >> 3 * i & 0x1c0e07;

		part[i] = &model->of_plane[i][there >> 9 * i & 511];
		part[3 + i] = &model->of_plane[3 + i][(rows | rows >> 6 | rows >> 12) & 511];
		part[6 + i] = &model->of_plane[6 + i][columns >> 10 * i & 511];
	}
#pragma GCC unroll 12
	for (int i = 0; i < CODES; i++)
		part[PLANES + i] = &model->of_code[i][around->code[with[i]]];
}

/* Finds where the probabilities of four octants stand in b and d, by all that is known before the first one's bit, and
 * fetches them: there are 8 beside each other, by the bits of those of the four that come before. */
ALWAYS void find_slots(uint32_t *b[8], uint32_t *d[8], struct codes_model *model, const struct around *around,
                       unsigned first, int is_sparse)
{
#pragma GCC unroll 4
	for (unsigned j = first; j < first + 4; j++) {
		const uint64_t window = around->known >> octree_corner(j) & WINDOW;
		const uint64_t key = window << 3 | j;
		const uint64_t more = (uint64_t)touched_by(j, around->there) << 50 ^ (uint64_t)around->row << 48;

		d[j] = &model->d[scatter(key * 0x100000001b3u ^ more, D_BITS - (j & 3)) << (j & 3)];
		__builtin_prefetch(d[j], 1);
		if (is_sparse)
			continue;
		b[j] = &model->b[scatter(key, B_BITS - (j & 3)) << (j & 3)];
		__builtin_prefetch(b[j], 1);
	}
}

/* A node whose code is under way. faces, b: where nodes are not sparse. */
struct coding {
	struct around around;
	uint32_t faces, *b[8], *d[8], *e;
	words *part[PLANES + CODES];
	int16_t sum[8];
	int16_t step[8]; /* what the parts of all octants change by */
};

ALWAYS void begin_node(struct coding *node, struct codes_job *job, const struct octree_near *near, int is_sparse)
{
	struct codes_model *model = job->model;
	const int up = job->levels->height - 1 - job->level;
	words sums = { 0 };

	*node = (struct coding){ .around.row = up < 3 ? up : 3 };
	look_around(&node->around, job->levels->at[job->level].code, near, is_sparse);
	node->e = &model->e[scatter((uint64_t)node->around.there * 0x100000001b3u, E_BITS - 3) << 3];
	__builtin_prefetch(node->e, 1);
	find_slots(node->b, node->d, model, &node->around, 0, is_sparse);
	find_parts(node->part, model, &node->around);
#pragma GCC unroll 21
	for (int i = 0; i < PLANES + CODES; i++)
		sums = words_add(sums, *node->part[i]);
	if (is_sparse)
		sums >>= 4;
	memcpy(node->sum, &sums, sizeof sums);
}

ALWAYS void end_node(const struct coding *node)
{
	words step;

	memcpy(&step, node->step, sizeof step);
#pragma GCC unroll 21
	for (int i = 0; i < PLANES + CODES; i++)
		*node->part[i] = words_add(*node->part[i], step);
}

/* Visit nodes of the job, `userdata`, as octree_levels_walk() calls them: of levels that are dense, or sparse. */
void codes_dense_pack(uint32_t node, uint64_t path, const struct octree_near *near, void *userdata);
void codes_dense_unpack(uint32_t node, uint64_t path, const struct octree_near *near, void *userdata);
void codes_sparse_pack(uint32_t node, uint64_t path, const struct octree_near *near, void *userdata);
void codes_sparse_unpack(uint32_t node, uint64_t path, const struct octree_near *near, void *userdata);

#endif
