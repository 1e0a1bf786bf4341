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

/* All children around an octant, itself in the middle: 3x3x3 of the neighbourhood's 4x4x4; a plane of them. */
#define WINDOW 0x77707770777u
#define PLANE 0x777u

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

/* ---- a node that is not sparse ---- */

ALWAYS unsigned code_bit(struct coding *node, struct codes_model *model, struct coder *coder, unsigned j,
                         unsigned so_far, int is_decoding, unsigned bit)
{
	const unsigned corner = octree_corner(j), of_half = j < 4 ? so_far : so_far >> 4;
	const uint64_t window = node->around.known >> corner, behind = node->around.behind >> corner;
	const unsigned near_ones = gather_near(behind >> 21), far_ones = gather_far(behind);
	uint32_t *const p[CONTEXTS] = { node->d[j] + of_half, &node->e[j], &model->a[node->faces << 8 | 1u << j | so_far],
		                            node->b[j] + of_half, &model->f[j << 14 | near_ones << 7 | far_ones] };
	int16_t *const part[OWN_PARTS] = { &model->of_own[j][so_far], &model->of_window[j][0][window & PLANE],
		                               &model->of_window[j][1][window >> 16 & PLANE], &model->of_near[j][near_ones],
		                               &model->of_far[j][far_ones] };
	const unsigned set = model->set_by_d[*p[0] & 1023] + model->set_by_e[*p[1] & 1023] + 2 * j + (so_far != 0);
	int32_t sum = node->sum[j], share;
	words logit;

#pragma GCC unroll 8
	for (int i = 0; i < OWN_PARTS; i++)
		sum += *part[i];
	sum = held(sum >> 4);
	logit = (words){ model->logit[*p[0] >> 20], model->logit[*p[1] >> 20], model->logit[*p[2] >> 20],
		             model->logit[*p[3] >> 20], model->logit[*p[4] >> 20], 256, (int16_t)sum, 0 };
	share = share_of(model, logit, set);
	bit = coder_bit(coder, is_decoding, (uint32_t)share, bit);
	node->step[j] = part_step(model, sum, bit);
#pragma GCC unroll 8
	for (int i = 0; i < OWN_PARTS; i++)
		*part[i] = word_held(*part[i] + node->step[j]);
	learn_weights(model, logit, set, share, bit);
#pragma GCC unroll 8
	for (int i = 0; i < CONTEXTS; i++)
		*p[i] = learn(model, *p[i], bit);
	node->around.known |= (uint64_t)bit << (corner + 21);
	node->around.behind |= (uint64_t)bit << (corner + 42);
	return bit;
}

ALWAYS void code_dense(struct codes_job *job, uint32_t at, const struct octree_near *near, int is_decoding)
{
	uint8_t *const code = &job->levels->at[job->level].code[at];
	struct coder coder = *job->coder; /* in registers */
	struct coding node;
	unsigned so_far = 0;

	begin_node(&node, job, near, 0);
	node.faces = faces_of(near->there);
#pragma GCC unroll 8
	for (unsigned j = 0; j < 8; j++) {
		if (j == 7 && so_far == 0) { /* no code is 0 */
			so_far = 128;
			break;
		}
		if (j == 4)
			find_slots(node.b, node.d, job->model, &node.around, 4, 0);
		so_far |= code_bit(&node, job->model, &coder, j, so_far, is_decoding, is_decoding ? 0 : *code >> j & 1) << j;
	}
	end_node(&node);
	*job->coder = coder;
	if (is_decoding)
		*code = (uint8_t)so_far;
}

/* ---- a sparse node ---- */

/* What the bit of an octant is foretold by; [1]: if the bit before it is 1. */
struct guess {
	uint32_t d[2], e; /* probabilities */
	unsigned set[2];
	int32_t share[2];
	words logit;      /* d's is missing */
};

ALWAYS words with_d(const struct guess *guess, const struct codes_model *model, unsigned which)
{
	words logit = guess->logit;

	logit[0] = model->logit[guess->d[which] >> 20];
	return logit;
}

ALWAYS void guess_octant(struct guess *guess, const struct codes_model *model, const struct coding *node, unsigned j)
{
	guess->e = node->e[j];
	guess->logit = (words){ 0, model->logit[guess->e >> 20], 0, 0, 0, 256, node->sum[j], 0 };
	guess->set[0] = guess->set[1] = model->set_by_e[guess->e & 1023] + 2 * j;
}

ALWAYS void guess_d(struct guess *guess, const struct codes_model *model, const struct coding *node, unsigned j,
                    unsigned so_far, unsigned which)
{
	guess->d[which] = node->d[j][j < 4 ? so_far : so_far >> 4];
	guess->set[which] += model->set_by_d[guess->d[which] & 1023] + (so_far != 0);
}

ALWAYS void guess_bit(struct guess *guess, const struct codes_model *model, const struct coding *node, unsigned j,
                      unsigned so_far, unsigned which)
{
	guess_octant(guess, model, node, j);
	guess_d(guess, model, node, j, so_far, which);
	guess->share[which] = share_of(model, with_d(guess, model, which), guess->set[which]);
}

ALWAYS void guess_both(struct guess *guess, const struct codes_model *model, const struct coding *node, unsigned j,
                       unsigned so_far)
{
	int32_t x[2];

	guess_octant(guess, model, node, j);
	guess_d(guess, model, node, j, so_far, 0);
	guess_d(guess, model, node, j, so_far | 1u << (j - 1), 1);
	words_weigh_both(x, with_d(guess, model, 0), model->weight[guess->set[0]], with_d(guess, model, 1),
	                 model->weight[guess->set[1]]);
	guess->share[0] = model->share[2048 + x[0]];
	guess->share[1] = model->share[2048 + x[1]];
}

/* To wait for a bit takes longer than to find what the next one is foretold by for both: so does decoding. */
ALWAYS void code_sparse(struct codes_job *job, uint32_t at, const struct octree_near *near, int is_decoding)
{
	struct codes_model *model = job->model;
	uint8_t *const code = &job->levels->at[job->level].code[at];
	struct coder coder = *job->coder; /* in registers */
	unsigned so_far = 0, bit = 0;
	const uint32_t *learnt = NULL; /* of the octant before, with which one may share its place */
	struct guess guess[8];
	struct coding node;

	begin_node(&node, job, near, 1);
#pragma GCC unroll 8
	for (unsigned j = 0; j < 8; j++) {
		const int is_both = is_decoding && j % 4 != 0;
		const unsigned which = is_both ? bit : 0;
		uint32_t *d;
		int32_t share;

		if (j == 7 && so_far == 0) { /* no code is 0 */
			so_far = 128;
			break;
		}
		if (j == 4) {
			node.around.known |= octree_cube_of(so_far, OCTREE_SELF);
			find_slots(node.b, node.d, model, &node.around, 4, 1);
		}
		d = node.d[j] + (j < 4 ? so_far : so_far >> 4);
		if (!is_both || d == learnt)
			guess_bit(&guess[j], model, &node, j, so_far, which);
		share = guess[j].share[0];
		if (is_both) /* without waiting for memory */
			share ^= (share ^ guess[j].share[1]) & -(int32_t)bit;
		if (is_decoding && j % 4 != 3)
			guess_both(&guess[j + 1], model, &node, j + 1, so_far);
		bit = coder_bit(&coder, is_decoding, (uint32_t)share, is_decoding ? 0 : *code >> j & 1);
		so_far |= bit << j;
		node.step[j] = part_step(model, node.sum[j], bit);
		learn_weights(model, with_d(&guess[j], model, which), guess[j].set[which], guess[j].share[which], bit);
		*d = learn(model, guess[j].d[which], bit);
		node.e[j] = learn(model, guess[j].e, bit);
		learnt = d;
	}
	end_node(&node);
	*job->coder = coder;
	if (is_decoding)
		*code = (uint8_t)so_far;
}

/* ---- a level ---- */

static void pack_dense(uint32_t node, uint64_t path, const struct octree_near *near, void *userdata)
{
	(void)path;
	code_dense(userdata, node, near, 0);
}

static void pack_sparse(uint32_t node, uint64_t path, const struct octree_near *near, void *userdata)
{
	(void)path;
	code_sparse(userdata, node, near, 0);
}

static void unpack_dense(uint32_t node, uint64_t path, const struct octree_near *near, void *userdata)
{
	(void)path;
	if (!((struct codes_job *)userdata)->coder->has_failed)
		code_dense(userdata, node, near, 1);
}

static void unpack_sparse(uint32_t node, uint64_t path, const struct octree_near *near, void *userdata)
{
	(void)path;
	if (!((struct codes_job *)userdata)->coder->has_failed)
		code_sparse(userdata, node, near, 1);
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
