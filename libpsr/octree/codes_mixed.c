#include <string.h>
#include "codes.h"
#ifdef __SSE2__ /* as every x86-64 has; the compiler finds no sums of products by itself */
#include <emmintrin.h>
#endif

/* Each bit of a code by five contexts, each with a probability of its own, and where codes are hard to foretell by a
 * sum of what each neighbour adds. Their logits are weighed, and the weights learn, too. Integers alone. */
#define CONTEXTS 5
#define A_BITS 14
#define B_BITS 16
#define C_BITS 15
#define D_BITS 19
#define E_BITS 16
#define COUNTS 127     /* a probability's speed of learning goes down to 1 in this many */
#define KEPT_COUNT 2   /* at most, from level to level: what was learnt counts for little on the next */
#define WEIGHT_SETS (9 << 6)
#define LEARN 6        /* of weights, in 2^-21 */
#define SUM_LEARN 5    /* of the parts of a sum, in halves */
#define MOST_PART (1 << 27) /* so that 16 of them add up in 32 bits */
#define EASY (65536 * 3 / 20) /* bits of a level were wrong by so much in the mean: the next needs no sums */

/* Four numbers or eight, which the compiler has a register for on any machine that has some. */
typedef int32_t lanes __attribute__((vector_size(16)));
typedef int16_t words __attribute__((vector_size(16)));
#define AROUND 16 /* fours of what is around an octant */

#define ALWAYS static inline __attribute__((always_inline))

struct model {
	/* Probabilities of 22 bits above counts of 10. */
	uint32_t a[1 << A_BITS], b[1 << B_BITS], c[1 << C_BITS], d[1 << D_BITS], e[1 << E_BITS];
	words weight[WEIGHT_SETS]; /* in 2^-13: of the contexts' logits, a constant, the sum, nothing */
	struct sum {
		lanes part[AROUND];    /* by bits of struct around; in 2^-24 */
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
		model->weight[s] = (words){ 2125, 2125, 2125, 2125, 2125, 0, 2125, 0 };
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

#define FOUR(x) { -((x) & 1), -((x) >> 1 & 1), -((x) >> 2 & 1), -((x) >> 3) }
static const lanes four[16] = { FOUR(0), FOUR(1), FOUR(2), FOUR(3), FOUR(4), FOUR(5), FOUR(6), FOUR(7),
	                            FOUR(8), FOUR(9), FOUR(10), FOUR(11), FOUR(12), FOUR(13), FOUR(14), FOUR(15) };

/* What is around an octant: which neighbours its node has, and itself, a constant; and known children, 3x3x3 of the
 * neighbourhood's 4x4x4, itself in the middle. By fours: 28 bits and the nine rows of children. */
struct around {
	uint32_t there;
	uint64_t window;
};

ALWAYS lanes four_of(const struct around *around, int i)
{
	const int row = i - 7, at = 4 * (row % 3) + 16 * (row / 3);

	return four[i < 7 ? around->there >> 4 * i & 15 : (unsigned)(around->window >> at) & 7];
}

ALWAYS int32_t sum_parts(const struct sum *sum, const struct around *around)
{
	lanes x = { 0, 0, 0, 0 };

#pragma GCC unroll 16
	for (int i = 0; i < AROUND; i++)
		x += sum->part[i] & four_of(around, i);
	return held(((int64_t)x[0] + x[1] + x[2] + x[3]) >> 16, 2047);
}

static void hold_parts(struct sum *sum)
{
	for (int i = 0; i < AROUND; i++)
		for (int k = 0; k < 4; k++)
			sum->part[i][k] = held(sum->part[i][k], MOST_PART - 1);
}

ALWAYS void learn_parts(struct sum *sum, const struct around *around, int32_t wrong)
{
	const int32_t step = wrong * SUM_LEARN / 2;
	const lanes steps = { step, step, step, step };
	lanes over = { 0, 0, 0, 0 };

#pragma GCC unroll 16
	for (int i = 0; i < AROUND; i++) {
		const lanes next = sum->part[i] + (steps & four_of(around, i));

		over |= (next + MOST_PART) & -(2 * MOST_PART);
		sum->part[i] = next;
	}
	if ((over[0] | over[1] | over[2] | over[3]) != 0)
		hold_parts(sum);
}

/* Logits are below 2^11, and so their sum of products below 2^30. */
ALWAYS int32_t weigh(words logit, words weight)
{
#ifdef __SSE2__
	const lanes x = (lanes)_mm_madd_epi16((__m128i)logit, (__m128i)weight);

	return (x[0] + x[1]) + (x[2] + x[3]);
#else
	int32_t x = 0;

	for (int i = 0; i < 8; i++)
		x += logit[i] * weight[i];
	return x;
#endif
}

/* By LEARN * wrong / 2^21 of each logit, and within -4..4. */
ALWAYS void learn_weights(words *weight, words logit, int32_t wrong)
{
	const int16_t step = (int16_t)((wrong * LEARN + 128) >> 8);
#ifdef __SSE2__
	const __m128i x = _mm_mulhi_epi16(_mm_slli_epi16((__m128i)logit, 4), _mm_set1_epi16(step));

	*weight = (words)_mm_adds_epi16((__m128i)*weight, _mm_srai_epi16(_mm_add_epi16(x, _mm_set1_epi16(1)), 1));
#else
	for (int i = 0; i < 8; i++) {
		const int32_t x = (*weight)[i] + (((logit[i] * 16 * step >> 16) + 1) >> 1);

		(*weight)[i] = (int16_t)(x < INT16_MIN ? INT16_MIN : x > INT16_MAX ? INT16_MAX : x);
	}
#endif
}

ALWAYS unsigned mix_bit(struct model *model, struct coder *coder, int is_decoding, uint32_t *const p[CONTEXTS],
                        struct sum *sum, const struct around *around, unsigned set, unsigned bit)
{
	const int32_t of_sum = sum != NULL ? sum_parts(sum, around) : 0;
	const words logit = { model->logit[*p[0] >> 20], model->logit[*p[1] >> 20], model->logit[*p[2] >> 20],
		                  model->logit[*p[3] >> 20], model->logit[*p[4] >> 20], 256, (int16_t)of_sum, 0 };
	const uint32_t share = model->share[2048 + held(weigh(logit, model->weight[set]) >> 13, 2047)];
	int32_t wrong;

	bit = coder_bit(coder, is_decoding, share, bit);
	wrong = (int32_t)(bit << 16) - (int32_t)share;
	model->wrong += (uint64_t)(wrong < 0 ? -wrong : wrong);
	if (sum != NULL)
		learn_parts(sum, around, (int32_t)(bit << 16) - (int32_t)model->share[2048 + of_sum]);
	learn_weights(&model->weight[set], logit, wrong);
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

/* Finds where the probabilities of four octants stand in b and d, by all that is known before the first one's bit, and
 * fetches them: there are 8 beside each other, by the bits of those of the four that come before. */
ALWAYS void find_slots(uint32_t *b[8], uint32_t *d[8], struct model *model, uint64_t known, uint32_t there, int row,
                       unsigned first)
{
#pragma GCC unroll 4
	for (unsigned j = first; j < first + 4; j++) {
		const uint64_t window = known >> ((j & 1) + 4 * (j >> 1 & 1) + 16 * (j >> 2)) & WINDOW;
		const uint64_t key = window << 3 | j;

		b[j] = &model->b[scatter(key, B_BITS - (j & 3)) << (j & 3)];
		d[j] = &model->d[scatter(key * 0x100000001b3u ^ (uint64_t)touched_by(j, there) << 57 ^ (uint64_t)row << 55,
		                         D_BITS - (j & 3)) << (j & 3)];
		__builtin_prefetch(b[j], 1);
		__builtin_prefetch(d[j], 1);
	}
}

ALWAYS void code_node(struct codes_job *job, uint32_t node, const struct octree_near *near, int is_decoding,
                      int has_sums)
{
	struct model *model = job->model;
	const struct octree_level *level = &job->levels->at[job->level];
	const unsigned code = is_decoding ? 0 : level->code[node];
	const int up = job->levels->height - 1 - job->level, row = up < 3 ? up : 3;
	uint32_t there = 0, faces, *b[8], *d[8], *e;
	uint64_t known = 0; /* children of neighbours that come earlier, and own ones so far */
	struct coder coder = *job->coder; /* in registers */
	unsigned so_far = 0;

#pragma GCC unroll 27
	for (unsigned k = 0; k < OCTREE_NEAR; k++) {
		const uint32_t at = near->at[k];

		there |= (uint32_t)(at != OCTREE_NONE) << k;
		if (at < node)
			known |= shift_to(model->spread[level->code[at] & side_of(k)], k);
	}
	faces = (there >> 4 & 1) | (there >> 10 & 1) << 1 | (there >> 12 & 1) << 2 | (there >> 14 & 1) << 3 |
	        (there >> 16 & 1) << 4 | (there >> 22 & 1) << 5;
	e = &model->e[scatter((uint64_t)there * 0x100000001b3u, E_BITS - 3) << 3];
	__builtin_prefetch(e, 1);
	find_slots(b, d, model, known, there, row, 0);
#pragma GCC unroll 8
	for (unsigned j = 0; j < 8; j++) {
		const unsigned corner = (j & 1) + 4 * (j >> 1 & 1) + 16 * (j >> 2), begun = 1u << j | so_far;
		const struct around around = { there, known >> corner & WINDOW };
		const uint32_t touched = touched_by(j, there);
		uint32_t *p[CONTEXTS];
		unsigned bit, set;

		if (j == 4)
			find_slots(b, d, model, known, there, row, 4);
		if (j == 7 && so_far == 0) { /* no code is 0 */
			so_far = 128;
			break;
		}
		p[0] = &model->a[faces << 8 | begun];
		p[1] = b[j] + (j < 4 ? so_far : so_far >> 4);
		p[2] = &model->c[touched << 8 | begun];
		p[3] = d[j] + (j < 4 ? so_far : so_far >> 4);
		p[4] = &e[j];
		set = (3 * known_of(*p[3]) + known_of(*p[4])) << 6 | (unsigned)row << 4 | j << 1 | (so_far != 0);
		bit = mix_bit(model, &coder, is_decoding, p, has_sums ? &model->sum[row][j] : NULL, &around, set,
		              code >> j & 1);
		so_far |= bit << j;
		known |= (uint64_t)bit << (corner + 21);
	}
	*job->coder = coder;
	if (is_decoding)
		codes_keep(job, &coder, (uint8_t)so_far);
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
