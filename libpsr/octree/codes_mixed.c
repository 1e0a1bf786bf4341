#include <string.h>
#include "codes.h"

/* Each bit of a code by five contexts, each with a probability of its own, and where codes are hard to foretell by a
 * sum of what each neighbour adds. Their logits are weighed, and the weights learn, too. Integers alone. */
#define CONTEXTS 5
#define INPUTS (CONTEXTS + 2) /* their logits, a constant, and the sum */
#define A_BITS 14
#define B_BITS 16
#define C_BITS 15
#define D_BITS 18
#define E_BITS 16
#define COUNTS 127     /* a probability's speed of learning goes down to 1 in this many */
#define KEPT_COUNT 2   /* at most, from level to level: what was learnt counts for little on the next */
#define WEIGHT_SETS (9 << 6)
#define LEARN 10       /* of weights */
#define SUM_LEARN 5    /* of the parts of a sum, in halves */
#define MOST_PART (1 << 28)
#define EASY (65536 * 3 / 20) /* bits of a level were wrong by so much in the mean: the next needs no sums */

#define ALWAYS static inline __attribute__((always_inline))

struct model {
	/* Probabilities of 22 bits above counts of 10. */
	uint32_t a[1 << A_BITS], b[1 << B_BITS], c[1 << C_BITS], d[1 << D_BITS], e[1 << E_BITS];
	int32_t weight[WEIGHT_SETS][INPUTS];
	struct sum {
		int32_t of_node[OCTREE_NEAR], of_child[43]; /* by bits of struct around; in 2^-24 */
	} sum[4][8];               /* by row and octant */
	uint64_t wrong;            /* what the bits of this level were wrong by, in 65536ths */
	int16_t logit[4096];       /* ln(p / (1 - p)) * 256, p in 4096ths */
	uint16_t share[4096];      /* the inverse, of logits + 2048, in 65536ths */
	uint32_t part[COUNTS + 1]; /* 1 / (count + 2), in 65536ths */
	/* A node's neighbourhood is a cube of 4x4x4 children, bit x + 4 y + 16 z: its own are in the middle. */
	uint64_t spread[256];      /* a code's bits at 0 and 1 of each axis */
};

/* exp(-x / 256) in units of 2^-30, x 0..2048, by repeated multiplication with exp(-1/256) = 1069556082 * 2^-30. */
static void make_shares(struct model *model)
{
	uint64_t power = (uint64_t)1 << 30;

	for (int x = 0; x <= 2047; x++) {
		/* 1 / (1 + exp(-x)) */
		const uint64_t share = ((uint64_t)65536 << 30) / (((uint64_t)1 << 30) + power);

		model->share[2048 + x] = (uint16_t)(share > 65504 ? 65504 : share);
		model->share[2048 - x] = (uint16_t)(65536 - model->share[2048 + x]);
		power = power * 1069556082 >> 30;
	}
	model->share[0] = model->share[1];
	for (int p = 0, x = 1; p < 4096; p++) {
		while (x < 4095 && model->share[x] < 16 * p + 8)
			x++;
		model->logit[p] = (int16_t)(x - 2048);
	}
}

static void make_places(struct model *model)
{
	for (unsigned code = 0; code < 256; code++) {
		model->spread[code] = 0;
		for (unsigned j = 0; j < 8; j++)
			if (code >> j & 1)
				model->spread[code] |= (uint64_t)1 << ((j & 1) + 4 * (j >> 1 & 1) + 16 * (j >> 2));
	}
}

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

/* Which neighbours of its parent octant j touches, faces first. */
ALWAYS uint32_t touched_by(unsigned j, uint32_t there)
{
	const int x = OCTREE_SELF + ((j & 1) ? 1 : -1), y = (j & 2) ? 3 : -3, z = (j & 4) ? 9 : -9;

	return (there >> x & 1) | (there >> (OCTREE_SELF + y) & 1) << 1 | (there >> (OCTREE_SELF + z) & 1) << 2 |
	       (there >> (x + y) & 1) << 3 | (there >> (OCTREE_SELF + y + z) & 1) << 4 | (there >> (x + z) & 1) << 5 |
	       (there >> (x + y + z) & 1) << 6;
}

static void fill(uint32_t *p, size_t n)
{
	for (size_t i = 0; i < n; i++)
		p[i] = (uint32_t)1 << 31;
}

void *codes_mixed_model(void)
{
	struct model *model = malloc(sizeof *model);

	if (model == NULL)
		return NULL;
	fill(model->a, 1 << A_BITS);
	fill(model->b, 1 << B_BITS);
	fill(model->c, 1 << C_BITS);
	fill(model->d, 1 << D_BITS);
	fill(model->e, 1 << E_BITS);
	for (int s = 0; s < WEIGHT_SETS; s++)
		for (int i = 0; i < INPUTS; i++)
			model->weight[s][i] = i != CONTEXTS ? 17000 : 0;
	memset(model->sum, 0, sizeof model->sum);
	model->wrong = 0;
	for (uint32_t n = 0; n <= COUNTS; n++)
		model->part[n] = 65536 / (n + 2);
	make_shares(model);
	make_places(model);
	return model;
}

ALWAYS void learn(const struct model *model, uint32_t *p, unsigned bit)
{
	const uint32_t count = *p & 1023;
	const int64_t wrong = (int64_t)(bit << 22) - (int64_t)(*p >> 10);
	const int64_t next = (int64_t)(*p >> 10) + (wrong * model->part[count] >> 16);
	const uint32_t kept = next > (1 << 22) - 1 ? (1 << 22) - 1 : (uint32_t)next;

	*p = kept << 10 | (count + (count < COUNTS));
}

ALWAYS int32_t held(int64_t x, int32_t most)
{
	return (int32_t)(x < -most ? -most : x > most ? most : x);
}

/* What is around an octant. */
struct around {
	uint32_t there;  /* which neighbours its node has, and itself: a constant */
	uint64_t window; /* known children: 3x3x3 of the neighbourhood's 4x4x4, itself in the middle */
};

static int32_t sum_parts(const struct sum *sum, const struct around *around)
{
	int64_t x = 0;

	for (uint32_t left = around->there; left != 0; left &= left - 1)
		x += sum->of_node[__builtin_ctz(left)];
	for (uint64_t left = around->window; left != 0; left &= left - 1)
		x += sum->of_child[__builtin_ctzll(left)];
	return held(x >> 16, 2047);
}

static void learn_parts(struct sum *sum, const struct around *around, int32_t wrong)
{
	const int32_t step = wrong * SUM_LEARN / 2;

	for (uint32_t left = around->there; left != 0; left &= left - 1)
		sum->of_node[__builtin_ctz(left)] = held(sum->of_node[__builtin_ctz(left)] + step, MOST_PART);
	for (uint64_t left = around->window; left != 0; left &= left - 1)
		sum->of_child[__builtin_ctzll(left)] = held(sum->of_child[__builtin_ctzll(left)] + step, MOST_PART);
}

ALWAYS unsigned mix_bit(struct model *model, struct coder *coder, int is_decoding, uint32_t *const p[CONTEXTS],
                        struct sum *sum, const struct around *around, unsigned set, unsigned bit)
{
	const int n_inputs = sum != NULL ? INPUTS : INPUTS - 1;
	int32_t *weight = model->weight[set], logit[INPUTS], wrong;
	int64_t mean = 0;
	uint32_t share;

#pragma GCC unroll 8
	for (int i = 0; i < CONTEXTS; i++)
		logit[i] = model->logit[*p[i] >> 20];
	logit[CONTEXTS] = 256;
	logit[CONTEXTS + 1] = sum != NULL ? sum_parts(sum, around) : 0;
#pragma GCC unroll 8
	for (int i = 0; i < n_inputs; i++)
		mean += (int64_t)logit[i] * weight[i];
	share = model->share[2048 + held(mean >> 16, 2047)];
	bit = coder_bit(coder, is_decoding, share, bit);
	wrong = (int32_t)(bit << 16) - (int32_t)share;
	model->wrong += (uint64_t)(wrong < 0 ? -wrong : wrong);
	if (sum != NULL)
		learn_parts(sum, around, (int32_t)(bit << 16) - (int32_t)model->share[2048 + logit[CONTEXTS + 1]]);
#pragma GCC unroll 8
	for (int i = 0; i < n_inputs; i++)
		weight[i] = held(weight[i] + (((int64_t)logit[i] * wrong * LEARN + (1 << 17)) >> 18), 1 << 20);
#pragma GCC unroll 8
	for (int i = 0; i < CONTEXTS; i++)
		learn(model, p[i], bit);
	return bit;
}

static inline uint32_t scatter(uint64_t x, int bits)
{
	return (uint32_t)(x * 0x9e3779b97f4a7c15u >> (64 - bits));
}

/* How much this level has shown of a context: nothing, a little, more. */
ALWAYS unsigned known_of(uint32_t p)
{
	return (p & 1023) <= KEPT_COUNT ? 0u : (p & 1023) < 15 ? 1 : 2;
}

/* All children around an octant, itself in the middle: 3x3x3 of the neighbourhood's 4x4x4. */
#define WINDOW 0x77707770777u

ALWAYS void code_node(struct codes_job *job, uint32_t node, const struct octree_near *near, int is_decoding,
                      int has_sums)
{
	struct model *model = job->model;
	const struct octree_level *level = &job->levels->at[job->level];
	const unsigned code = is_decoding ? 0 : level->code[node];
	const int up = job->levels->height - 1 - job->level, row = up < 3 ? up : 3;
	uint32_t there = 0, faces;
	uint64_t known = 0; /* children of neighbours that come earlier, and own ones so far */
	unsigned so_far = 0;
	struct around around = { 0, 0 };

#pragma GCC unroll 27
	for (unsigned k = 0; k < OCTREE_NEAR; k++) {
		const uint32_t at = near->at[k];

		there |= (uint32_t)(at != OCTREE_NONE) << k;
		if (at < node)
			known |= shift_to(model->spread[level->code[at] & side_of(k)], k);
	}
	faces = (there >> 4 & 1) | (there >> 10 & 1) << 1 | (there >> 12 & 1) << 2 | (there >> 14 & 1) << 3 |
	        (there >> 16 & 1) << 4 | (there >> 22 & 1) << 5;
	around.there = there;
#pragma GCC unroll 8
	for (unsigned j = 0; j < 8; j++) {
		const unsigned corner = (j & 1) + 4 * (j >> 1 & 1) + 16 * (j >> 2), begun = 1u << j | so_far;
		const uint64_t window = known >> corner & WINDOW;
		const uint32_t touched = touched_by(j, there);
		uint32_t *p[CONTEXTS];
		unsigned bit, set;

		around.window = window;
		if (j == 7 && so_far == 0) { /* no code is 0 */
			so_far = 128;
			break;
		}
		p[0] = &model->a[begun << 6 | faces];
		p[1] = &model->b[scatter(window << 3 | j, B_BITS)];
		p[2] = &model->c[begun << 7 | touched];
		p[3] = &model->d[scatter((window << 3 | j) * 0x100000001b3u ^ (uint64_t)touched << 57 ^ (uint64_t)row << 55,
		                         D_BITS)];
		p[4] = &model->e[scatter(((uint64_t)there << 3 | j) * 0x100000001b3u, E_BITS)];
		set = (3 * known_of(*p[3]) + known_of(*p[4])) << 6 | (unsigned)row << 4 | j << 1 | (so_far != 0);
		bit = mix_bit(model, job->coder, is_decoding, p, has_sums ? &model->sum[row][j] : NULL, &around, set,
		              code >> j & 1);
		so_far |= bit << j;
		known |= (uint64_t)bit << (corner + 21);
	}
	if (is_decoding)
		codes_keep(job, job->coder, (uint8_t)so_far);
}

static void pack_node(uint32_t node, uint64_t path, const struct octree_near *near, void *userdata)
{
	(void)path;
	code_node(userdata, node, near, 0, 0);
}

static void pack_node_by_sums(uint32_t node, uint64_t path, const struct octree_near *near, void *userdata)
{
	(void)path;
	code_node(userdata, node, near, 0, 1);
}

static void unpack_node(uint32_t node, uint64_t path, const struct octree_near *near, void *userdata)
{
	struct codes_job *job = userdata;

	(void)path;
	if (job->rc == PSR_OK)
		code_node(job, node, near, 1, 0);
}

static void unpack_node_by_sums(uint32_t node, uint64_t path, const struct octree_near *near, void *userdata)
{
	struct codes_job *job = userdata;

	(void)path;
	if (job->rc == PSR_OK)
		code_node(job, node, near, 1, 1);
}

static void forget(uint32_t *p, size_t n)
{
	for (size_t i = 0; i < n; i++)
		if ((p[i] & 1023) > KEPT_COUNT)
			p[i] = (p[i] & ~1023u) | KEPT_COUNT;
}

void codes_mixed_level(struct codes_job *job, int is_decoding)
{
	struct model *model = job->model;
	const uint64_t n_nodes = job->level > 0 ? job->levels->at[job->level - 1].n : 0;
	const int has_sums = model->wrong > 8 * EASY * n_nodes;

	forget(model->a, 1 << A_BITS);
	forget(model->b, 1 << B_BITS);
	forget(model->c, 1 << C_BITS);
	forget(model->d, 1 << D_BITS);
	forget(model->e, 1 << E_BITS);
	model->wrong = 0;
	if (is_decoding)
		octree_levels_walk(job->levels, job->level, has_sums ? unpack_node_by_sums : unpack_node, job);
	else
		octree_levels_walk(job->levels, job->level, has_sums ? pack_node_by_sums : pack_node, job);
}
