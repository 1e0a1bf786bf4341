#include <string.h>
#include "codes.h"
#include "codes_model.h"

/* Each bit of a code by contexts, each with a probability of its own, and by a sum of what parts of what is around the
 * octant add. Their logits are weighed, and the weights learn, too. Integers alone. */
#define CONTEXTS 5
#define SPARSE_CONTEXTS 2
#define OWN_PARTS 5    /* of one octant */
#define LEARN 6        /* of weights, in 2^-21 */
#define PART_LEARN 102 /* of the parts of sums, in 2^-12 */
#define SPARSE 3       /* fewer nodes for each of the level above: they have two contexts, and no parts of one octant */
#define FEW_NODES 4096 /* of a level teach too little for the next one to forget it */

#define ALWAYS static inline __attribute__((always_inline))

/* What follows is of a constant neighbour or octant, in loops that the compiler unrolls. */
ALWAYS int step_of(unsigned k, int axis)
{
	return (int)(axis == 0 ? k % 3 : axis == 1 ? k / 3 % 3 : k / 9) - 1;
}

/* The octants of neighbour k that touch the node. */
ALWAYS unsigned side_of(unsigned k)
{
	const int x = step_of(k, 0), y = step_of(k, 1), z = step_of(k, 2);

	return (x < 0 ? 0xaau : x > 0 ? 0x55u : 0xffu) & (y < 0 ? 0xccu : y > 0 ? 0x33u : 0xffu) &
	       (z < 0 ? 0xf0u : z > 0 ? 0x0fu : 0xffu);
}

/* Where neighbour k's children are in the node's neighbourhood; bits that leave it do not touch. */
ALWAYS uint64_t shift_to(uint64_t spread, unsigned k)
{
	const int up = 21 + 2 * (step_of(k, 0) + 4 * step_of(k, 1) + 16 * step_of(k, 2));

	return up >= 0 ? spread << up : spread >> -up;
}

/* Where octant j's window begins. */
ALWAYS unsigned corner_of(unsigned j)
{
	return (j & 1) + 4 * (j >> 1 & 1) + 16 * (j >> 2);
}

/* Which neighbours of its parent octant j touches, with the parent itself. */
ALWAYS uint32_t touched_by(unsigned j, uint32_t there)
{
	return there >> ((j & 1) + 3 * (j >> 1 & 1) + 9 * (j >> 2)) & 0x361b;
}

/* Which of the node's six faces have a neighbour. */
ALWAYS unsigned faces_of(uint32_t there)
{
	return (there >> 4 & 1) | (there >> 9 & 2) | (there >> 10 & 4) | (there >> 11 & 8) | (there >> 12 & 16) |
	       (there >> 17 & 32);
}

/* Eight bits of 64, one after the other: those at 0 and 1 of each axis of a neighbourhood, or at 0 and 2. */
ALWAYS unsigned gather_near(uint64_t x)
{
	const uint64_t at = x & 0x00330033, planes = (at | at >> 2) & 0x000f000f;

	return (unsigned)(planes | planes >> 12) & 255;
}

ALWAYS unsigned gather_far(uint64_t x)
{
	const uint64_t at = x & 0x50500000505u, rows = (at | at >> 1) & 0x30300000303u;
	const uint64_t planes = (rows | rows >> 6) & 0xf0000000fu;

	return (unsigned)(planes | planes >> 28) & 255;
}

/* ---- a bit ---- */

/* What a probability was wrong by goes into it by 1 / (count + 2), and the count goes up. Modulo 2^32. */
ALWAYS void learn(const struct codes_model *model, uint32_t *p, unsigned bit)
{
	const uint32_t was = *p, count = was & 1023;
	const int32_t wrong = (int32_t)(bit << 22) - (int32_t)(was >> 10);

	*p = was + (((uint32_t)(wrong >> 4) * model->part[count]) & ~1023u) + model->more[count];
}

ALWAYS int32_t held(int32_t x)
{
	return x < -2047 ? -2047 : x > 2047 ? 2047 : x;
}

/* What a bit is foretold by. The last contexts and all parts are there where nodes are not sparse. */
struct bases {
	uint32_t *p[CONTEXTS];
	int16_t *part[OWN_PARTS];
	int32_t sum;
	unsigned set; /* of weights */
	words logit;
	int32_t share; /* of a 1, in 65536ths */
};

ALWAYS void mix(struct bases *bases, const struct codes_model *model, int is_sparse)
{
	bases->logit = (words){ model->logit[*bases->p[0] >> 20],
		                    model->logit[*bases->p[1] >> 20],
		                    is_sparse ? 0 : model->logit[*bases->p[2] >> 20],
		                    is_sparse ? 0 : model->logit[*bases->p[3] >> 20],
		                    is_sparse ? 0 : model->logit[*bases->p[4] >> 20],
		                    256,
		                    (int16_t)bases->sum,
		                    0 };
	bases->share = model->share[2048 + held(words_weigh(bases->logit, model->weight[bases->set]) >> 13)];
}

/* Returns what the parts of this octant change by. */
ALWAYS int16_t learn_bit(struct codes_model *model, const struct bases *bases, int is_sparse, unsigned bit)
{
	const int32_t one = (int32_t)(bit << 16);
	const int16_t step = (int16_t)(((one - model->share[2048 + bases->sum]) * PART_LEARN + 32768) >> 16);
	words *weight = &model->weight[bases->set];

#pragma GCC unroll 8
	for (int i = 0; i < OWN_PARTS; i++)
		if (!is_sparse)
			*bases->part[i] = word_held(*bases->part[i] + step);
	*weight = words_learn(*weight, bases->logit, (int16_t)(((one - bases->share) * LEARN + 128) >> 8));
#pragma GCC unroll 8
	for (int i = 0; i < CONTEXTS; i++)
		if (!is_sparse || i < SPARSE_CONTEXTS)
			learn(model, bases->p[i], bit);
	return step;
}

static inline uint32_t scatter(uint64_t x, int bits)
{
	return (uint32_t)(x * 0x9e3779b97f4a7c15u >> (64 - bits));
}

/* ---- a node ---- */

/* All children around an octant, itself in the middle: 3x3x3 of the neighbourhood's 4x4x4; a plane of them. */
#define WINDOW 0x77707770777u
#define PLANE 0x777u

/* What is known of a node before its code. */
struct around {
	uint32_t there;              /* which neighbours there are, and itself */
	uint64_t known;              /* children of neighbours that come earlier, and own ones so far */
	uint64_t behind;             /* the same, of a cube whose far end are its own */
	unsigned code[OCTREE_NEAR];  /* of neighbours that come earlier */
	int row;                     /* how far above the leaves */
};

ALWAYS void look_around(struct around *around, const struct codes_model *model, const uint8_t *codes, uint32_t node,
                        const struct octree_near *near, int is_sparse)
{
	*around = (struct around){ .row = around->row };
#pragma GCC unroll 27
	for (unsigned k = 0; k < OCTREE_NEAR; k++) {
		const int x = step_of(k, 0), y = step_of(k, 1), z = step_of(k, 2);
		const uint32_t at = near->at[k], earlier = -(uint32_t)(at < node); /* all bits, or none: no branch */

		around->there |= (uint32_t)(at != OCTREE_NONE) << k;
		if (x >= 0 && y >= 0 && z >= 0) /* it comes later */
			continue;
		around->code[k] = codes[at & earlier] & earlier;
		around->known |= shift_to(model->spread[around->code[k] & side_of(k)], k);
		if (x <= 0 && y <= 0 && z <= 0 && !is_sparse)
			around->behind |= model->spread[around->code[k]] << (2 * (x + 1) + 8 * (y + 1) + 32 * (z + 1));
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
		const uint64_t window = around->known >> corner_of(j) & WINDOW;
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

/* A node whose code is under way. */
struct coding {
	struct around around;
	uint32_t faces, *b[8], *d[8], *e;
	int16_t sum[8];
};

/* Finds what octant j is foretold by, after so much of the code. */
ALWAYS void foretell(struct bases *bases, struct codes_model *model, const struct coding *node, unsigned j,
                     unsigned so_far, int is_sparse)
{
	const unsigned corner = corner_of(j), of_half = j < 4 ? so_far : so_far >> 4;
	const uint64_t window = node->around.known >> corner, behind = node->around.behind >> corner;

	bases->p[0] = node->d[j] + of_half;
	bases->p[1] = &node->e[j];
	bases->set = model->set_by_d[*bases->p[0] & 1023] + model->set_by_e[*bases->p[1] & 1023] + 2 * j + (so_far != 0);
	bases->sum = node->sum[j];
	if (!is_sparse) {
		const unsigned near_ones = gather_near(behind >> 21), far_ones = gather_far(behind);

		bases->p[2] = &model->a[node->faces << 8 | 1u << j | so_far];
		bases->p[3] = node->b[j] + of_half;
		bases->p[4] = &model->f[j << 14 | near_ones << 7 | far_ones];
		bases->part[0] = &model->of_own[j][so_far];
		bases->part[1] = &model->of_window[j][0][window & PLANE];
		bases->part[2] = &model->of_window[j][1][window >> 16 & PLANE];
		bases->part[3] = &model->of_near[j][near_ones];
		bases->part[4] = &model->of_far[j][far_ones];
#pragma GCC unroll 8
		for (int i = 0; i < OWN_PARTS; i++)
			bases->sum += *bases->part[i];
		bases->sum = held(bases->sum >> 4);
	}
	mix(bases, model, is_sparse);
}

ALWAYS void code_node(struct codes_job *job, uint32_t at, const struct octree_near *near, int is_decoding,
                      int is_sparse)
{
	struct codes_model *model = job->model;
	const struct octree_level *level = &job->levels->at[job->level];
	const unsigned code = is_decoding ? 0 : level->code[at];
	const int up = job->levels->height - 1 - job->level;
	/* To wait for a bit takes longer than to find what the next one is foretold by for both. */
	const int is_both = is_decoding && is_sparse;
	struct coding node = { .around.row = up < 3 ? up : 3 };
	words *part[PLANES + CODES], sums = { 0 };
	int16_t step[8] = { 0 };
	struct bases bases[8][2];
	struct coder coder = *job->coder; /* in registers */
	unsigned so_far = 0, bit = 0;
	const uint32_t *learnt = NULL; /* of the octant before, with which one may share its place */

	look_around(&node.around, model, level->code, at, near, is_sparse);
	node.e = &model->e[scatter((uint64_t)node.around.there * 0x100000001b3u, E_BITS - 3) << 3];
	__builtin_prefetch(node.e, 1);
	find_slots(node.b, node.d, model, &node.around, 0, is_sparse);
	find_parts(part, model, &node.around);
#pragma GCC unroll 21
	for (int i = 0; i < PLANES + CODES; i++)
		sums = words_add(sums, *part[i]);
	if (is_sparse)
		sums >>= 4;
	memcpy(node.sum, &sums, sizeof sums);
	node.faces = faces_of(node.around.there);
#pragma GCC unroll 8
	for (unsigned j = 0; j < 8; j++) {
		const int is_foretold = is_both && j % 4 != 0;
		struct bases *now = &bases[j][is_foretold ? bit : 0];
		int32_t share;

		if (j == 7 && so_far == 0) { /* no code is 0 */
			so_far = 128;
			break;
		}
		if (j == 4)
			find_slots(node.b, node.d, model, &node.around, 4, is_sparse);
		if (!is_foretold || now->p[0] == learnt)
			foretell(now, model, &node, j, so_far, is_sparse);
		share = bases[j][0].share;
		if (is_foretold) /* without waiting for memory */
			share ^= (share ^ bases[j][1].share) & -(int32_t)bit;
		if (is_both && j % 4 != 3) {
			foretell(&bases[j + 1][0], model, &node, j + 1, so_far, is_sparse);
			foretell(&bases[j + 1][1], model, &node, j + 1, so_far | 1u << j, is_sparse);
		}
		bit = coder_bit(&coder, is_decoding, (uint32_t)share, code >> j & 1);
		so_far |= bit << j;
		step[j] = learn_bit(model, now, is_sparse, bit);
		learnt = now->p[0];
		node.around.known |= (uint64_t)bit << (corner_of(j) + 21);
		node.around.behind |= (uint64_t)bit << (corner_of(j) + 42);
	}
	memcpy(&sums, step, sizeof sums);
#pragma GCC unroll 21
	for (int i = 0; i < PLANES + CODES; i++)
		*part[i] = words_add(*part[i], sums);
	*job->coder = coder;
	if (is_decoding)
		level->code[at] = (uint8_t)so_far;
}

/* ---- a level ---- */

static void pack_dense(uint32_t node, uint64_t path, const struct octree_near *near, void *userdata)
{
	(void)path;
	code_node(userdata, node, near, 0, 0);
}

static void pack_sparse(uint32_t node, uint64_t path, const struct octree_near *near, void *userdata)
{
	(void)path;
	code_node(userdata, node, near, 0, 1);
}

static void unpack_dense(uint32_t node, uint64_t path, const struct octree_near *near, void *userdata)
{
	(void)path;
	if (!((struct codes_job *)userdata)->coder->has_failed)
		code_node(userdata, node, near, 1, 0);
}

static void unpack_sparse(uint32_t node, uint64_t path, const struct octree_near *near, void *userdata)
{
	(void)path;
	if (!((struct codes_job *)userdata)->coder->has_failed)
		code_node(userdata, node, near, 1, 1);
}

void codes_mixed_level(struct codes_job *job, int is_decoding)
{
	const uint32_t n = codes_count(job), n_above = job->level > 0 ? job->levels->at[job->level - 1].n : 0;
	const int is_sparse = n < SPARSE * (uint64_t)n_above;

	if (n_above >= FEW_NODES)
		codes_model_forget(job->model, is_sparse);
	if (!is_decoding) {
		octree_levels_walk(job->levels, job->level, is_sparse ? pack_sparse : pack_dense, job);
		return;
	}
	codes_begin_level(job, n);
	if (job->rc == PSR_OK)
		octree_levels_walk(job->levels, job->level, is_sparse ? unpack_sparse : unpack_dense, job);
	codes_end_level(job, n);
}
