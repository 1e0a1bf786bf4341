/* What the streams of attributes share: a leaf's earlier neighbours, and probabilities. */
#ifndef PSR_OCTREE_ATTRIBUTES_JOB_H
#define PSR_OCTREE_ATTRIBUTES_JOB_H

#include "attributes.h"

#define DEPTHS 7     /* of a normal: the octant, then six times one of four */
#define SPREADS 16
#define COUNTS 4     /* of earlier neighbours: 0, 1, 2, more */
#define MARGINS 8    /* how clearly the first child is nearest */
#define SECONDS 4    /* how clearly the second one is next */
#define UNIT 32767
#define STEP 14188   /* of offsets, in UNITs of a leaf's edge: sqrt(3) / OCTREE_OFFSETS */
#define BINS 24      /* of foretold offsets */
#define RANGES 7     /* of what neighbours foretell: there is none, one; five widths */
#define PARTS 4      /* of a material: what is metal, reflectance, shut, roughness */
#define LEARNT 63    /* a probability's speed of learning goes down to 1 in this many */

_Static_assert(OCTREE_OFFSETS == 4, "two bits an offset");

struct near_leaf {
	uint32_t at;
	int weight, place[3];
};

/* Probabilities of 22 bits above counts of 10; of older packings, as coder_adaptive() has them. */
struct odds {
	uint32_t same[8][2][2];
	uint32_t normal[DEPTHS][SPREADS][SECONDS][2][MARGINS][8];
	uint32_t offset[BINS][RANGES][4];
	uint32_t color[3][8][256];
	uint32_t same_material[COUNTS][2][2];
	uint32_t material[PARTS][8][256];
};

_Static_assert(SECONDS >= COUNTS && RANGES >= COUNTS, "older packings have counts there");

struct job {
	struct coder *coder;
	struct octree_attributes attributes;
	struct odds *odds;
	const uint64_t *unit; /* psr_direction_words() */
	uint64_t last_path;
	struct near_leaf near[OCTREE_NEAR]; /* earlier ones around the leaf */
	unsigned n;
	int weight, is_decoding, is_older, was_same;
	uint32_t part[LEARNT + 1]; /* 1 / (count + 1.6), in 2^-14 */
};

/* Learns by 1 / (count + 1.6). */
static inline __attribute__((always_inline)) unsigned code_counted(struct job *job, int is_decoding, uint32_t *p,
                                                                   unsigned bit)
{
	const uint32_t share = *p >> 16;

	bit = coder_bit(job->coder, is_decoding, share > 0 ? share : 1, bit);
	*p = coder_learn(*p, job->part, coder_count(*p) < LEARNT, bit);
	return bit;
}

/* rate: of older packings. */
static inline __attribute__((always_inline)) unsigned code_bit(struct job *job, uint32_t *p, unsigned rate,
                                                               unsigned bit)
{
	if (!job->is_older)
		return job->is_decoding ? code_counted(job, 1, p, 0) : code_counted(job, 0, p, bit);
	uint16_t older = (uint16_t)*p;

	bit = job->is_decoding ? coder_adaptive(job->coder, 1, &older, rate, 0)
	                       : coder_adaptive(job->coder, 0, &older, rate, bit);
	*p = older;
	return bit;
}

/* Codes a value of n_bits, the highest bit first. */
static inline unsigned code_bits(struct job *job, uint32_t *p, int n_bits, unsigned value)
{
	unsigned node = 1;

	for (int i = n_bits - 1; i >= 0; i--)
		node = node << 1 | code_bit(job, &p[node], 4, value >> i & 1);
	return node - (1u << n_bits);
}

static inline int log2_floor(uint64_t x)
{
	return x == 0 ? 0 : 63 - __builtin_clzll(x);
}

static inline unsigned count_of(const struct job *job)
{
	return job->n < COUNTS - 1 ? job->n : COUNTS - 1;
}

static inline void unit_of(const struct job *job, uint16_t normal, int v[3])
{
	const uint64_t word = job->unit[normal];

	for (int c = 0; c < 3; c++)
		v[c] = (int16_t)(word >> 16 * c);
}

/* Codes a leaf's normal (decision 0105, 0167). */
void attributes_code_normal(struct job *job, uint32_t leaf, uint64_t path);

#endif
