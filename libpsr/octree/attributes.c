#include <stdlib.h>
#include "attributes.h"
#include "base/direction.h"

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

static struct odds *odds_make(int is_older)
{
	struct odds *odds = malloc(sizeof *odds);

	for (size_t i = 0; odds != NULL && i < sizeof *odds / sizeof(uint32_t); i++)
		((uint32_t *)odds)[i] = is_older ? CODER_EVEN : (uint32_t)1 << 31;
	return odds;
}

/* What a probability was wrong by goes into it by 1 / (count + 1.6), and the count goes up. Modulo 2^32. */
static inline __attribute__((always_inline)) unsigned code_counted(struct job *job, int is_decoding, uint32_t *p,
                                                                   unsigned bit)
{
	const uint32_t was = *p, count = was & 1023, share = was >> 16;
	int32_t wrong;

	bit = coder_bit(job->coder, is_decoding, share > 0 ? share : 1, bit);
	wrong = (int32_t)(bit << 22) - (int32_t)(was >> 10);
	*p = was + (((uint32_t)(wrong >> 4) * job->part[count]) & ~1023u) + (count < LEARNT);
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
static unsigned code_bits(struct job *job, uint32_t *p, int n_bits, unsigned value)
{
	unsigned node = 1;

	for (int i = n_bits - 1; i >= 0; i--)
		node = node << 1 | code_bit(job, &p[node], 4, value >> i & 1);
	return node - (1u << n_bits);
}

static int log2_floor(uint64_t x)
{
	return x == 0 ? 0 : 63 - __builtin_clzll(x);
}

static unsigned count_of(const struct job *job)
{
	return job->n < COUNTS - 1 ? job->n : COUNTS - 1;
}

static void find_near(struct job *job, const struct octree_near *near)
{
	job->n = 0;
	job->weight = 0;
	for (uint32_t left = near->before; left != 0; left &= left - 1) {
		const int k = __builtin_ctz(left), x = k % 3 - 1, y = k / 3 % 3 - 1, z = k / 9 - 1;
		const int weight = 4 - x * x - y * y - z * z;

		job->near[job->n++] = (struct near_leaf){ octree_near_at(near, (unsigned)k), weight, { x, y, z } };
		job->weight += weight;
	}
}

/* ---- normals ---- */

static void unit_of(const struct job *job, uint16_t normal, int v[3])
{
	const uint64_t word = job->unit[normal];

	for (int c = 0; c < 3; c++)
		v[c] = (int16_t)(word >> 16 * c);
}

/* Sorts the children of a triangle, or the octants, by how near they are to a direction, greatest scores first. The
 * middle of a child is that of its innermost triangle, almost. */
static void rank_children(unsigned order[8], int64_t score[8], const struct job *job, int depth, unsigned parent,
                          const int64_t sum[3])
{
	const unsigned n = depth == 0 ? 8 : 4;

	for (unsigned j = 0; j < n; j++) {
		unsigned at = j;
		int64_t s;
		int v[3];

		unit_of(job, (uint16_t)((parent * 4 + j) << 2 * (DEPTHS - 1 - depth)), v);
		s = sum[0] * v[0] + sum[1] * v[1] + sum[2] * v[2];
		for (; at > 0 && score[at - 1] < s; at--) {
			score[at] = score[at - 1];
			order[at] = order[at - 1];
		}
		score[at] = s;
		order[at] = j;
	}
}

static unsigned rank_of(const unsigned order[8], unsigned child)
{
	unsigned rank = 0;

	while (order[rank] != child)
		rank++;
	return rank;
}

/* Differences of scores by which margins are told. A direction on the border of two children has none; in the middle of
 * one, half the square of the angle between both. Times 4^depth that is much the same at all depths. */
struct steps {
	int64_t first[MARGINS - 1], second[SECONDS - 1];
};

static void find_steps(struct steps *steps, const struct job *job)
{
	static const int first[MARGINS - 1] = { 50, 100, 200, 300, 450, 650, 900 }, second[SECONDS - 1] = { 150, 400, 800 };
	/* Without neighbours no margin is reached: nothing is known. */
	const int64_t unit = job->weight > 0 ? (int64_t)job->weight * UNIT * UNIT / 1024 : INT64_MAX / 1024;

	for (int i = 0; i < MARGINS - 1; i++)
		steps->first[i] = first[i] * unit;
	for (int i = 0; i < SECONDS - 1; i++)
		steps->second[i] = second[i] * unit;
}

static uint32_t *find_odds(const struct job *job, const struct steps *steps, int depth, int spread, unsigned is_first,
                           const int64_t score[8])
{
	const int64_t first = (score[0] - score[1]) << 2 * depth, second = (score[1] - score[2]) << 2 * depth;
	unsigned margin = 0, next = 0;

	if (job->is_older)
		return job->odds->normal[depth][spread][count_of(job)][is_first][0];
	for (int i = 0; i < MARGINS - 1; i++)
		margin += first >= steps->first[i];
	for (int i = 0; i < SECONDS - 1; i++)
		next += second >= steps->second[i];
	return job->odds->normal[depth][spread][next][is_first][margin];
}

static uint16_t code_nested(struct job *job, uint16_t normal, const int64_t sum[3])
{
	const uint64_t full = (uint64_t)job->weight * UNIT * (uint64_t)job->weight * UNIT;
	const uint64_t square = (uint64_t)(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
	const uint64_t lost = full > square ? full - square : 1;
	const int log = log2_floor(full / lost), spread = log < SPREADS ? log : SPREADS - 1;
	unsigned index = 0, is_first = 1;
	struct steps steps;

	find_steps(&steps, job);
	for (int depth = 0; depth < DEPTHS; depth++) {
		const int n_bits = depth == 0 ? 3 : 2;
		const unsigned child = normal >> 2 * (DEPTHS - 1 - depth) & ((1u << n_bits) - 1);
		unsigned order[8], rank;
		int64_t score[8];

		rank_children(order, score, job, depth, index, sum);
		rank = code_bits(job, find_odds(job, &steps, depth, spread, is_first, score), n_bits,
		                 job->is_decoding ? 0 : rank_of(order, child));
		index = index << n_bits | order[rank];
		is_first &= rank == 0;
	}
	return (uint16_t)index;
}

static void code_normal(struct job *job, uint32_t leaf, uint64_t path)
{
	uint16_t *const normal = job->attributes.normal;
	const uint16_t before = leaf > 0 ? normal[leaf - 1] : 0;
	const int parting = log2_floor(path ^ job->last_path) / 3;
	int64_t sum[3] = { 0, 0, 0 };
	int is_agreed = 1;

	for (unsigned i = 0; i < job->n; i++) {
		int v[3];

		unit_of(job, normal[job->near[i].at], v);
		is_agreed &= normal[job->near[i].at] == before;
		for (int c = 0; c < 3; c++)
			sum[c] += (int64_t)job->near[i].weight * v[c];
	}
	/* Leaves of a flat face have one normal. */
	job->was_same = (int)code_bit(job, &job->odds->same[parting < 7 ? parting : 7][job->was_same][is_agreed], 5,
	                              normal[leaf] == before);
	if (!job->is_decoding && !job->was_same)
		code_nested(job, normal[leaf], sum);
	else if (job->is_decoding)
		normal[leaf] = job->was_same ? before : code_nested(job, 0, sum);
}

/* ---- offsets ---- */

/* By how far apart offsets are that neighbours foretell. */
static unsigned range_of(const struct job *job, int64_t least, int64_t most)
{
	const int64_t range = (most - least) * 4 / STEP;

	if (job->is_older)
		return count_of(job);
	return job->n < 2 ? job->n : range < 1 ? 2 : range < 3 ? 3 : range < 6 ? 4 : range < 10 ? 5 : 6;
}

/* The plane through a neighbour's point, across the leaf's normal, tells where the leaf's point is. */
static void code_offset(struct job *job, uint32_t leaf)
{
	const uint16_t *const normal = job->attributes.normal;
	uint8_t *const offset = job->attributes.offset;
	int64_t sum = 0, least = INT64_MAX, most = INT64_MIN;
	int v[3] = { 0, 0, 0 }, bin = BINS / 2;

	if (normal != NULL)
		unit_of(job, normal[leaf], v);
	for (unsigned i = 0; i < job->n; i++) {
		const struct near_leaf *near = &job->near[i];
		int64_t along = UNIT, up = (2 * offset[near->at] - (OCTREE_OFFSETS - 1)) * (STEP / 2);

		if (normal != NULL) {
			int of[3];

			unit_of(job, normal[near->at], of);
			along = ((int64_t)of[0] * v[0] + (int64_t)of[1] * v[1] + (int64_t)of[2] * v[2]) / UNIT;
		}
		up = up * along / UNIT + near->place[0] * v[0] + near->place[1] * v[1] + near->place[2] * v[2];
		sum += near->weight * up;
		least = up < least ? up : least;
		most = up > most ? up : most;
	}
	if (job->n > 0)
		bin += (int)(sum * 4 / ((int64_t)job->weight * STEP));
	bin = bin < 0 ? 0 : bin >= BINS ? BINS - 1 : bin;
	const unsigned range = job->n > 0 ? range_of(job, least, most) : 0;
	const unsigned step = code_bits(job, job->odds->offset[bin][range], 2, job->is_decoding ? 0 : offset[leaf]);
	if (job->is_decoding)
		offset[leaf] = (uint8_t)step;
}

/* ---- colours ---- */

static void code_color(struct job *job, uint32_t leaf)
{
	static const int order[3] = { 1, 0, 2 }; /* green tells most of the others */
	uint8_t(*const color)[3] = job->attributes.color;
	int foretold[3] = { 128, 128, 128 }, error = 0, least = 255, most = 0, spread;

	for (int c = 0; c < 3; c++) {
		int sum = 0;

		for (unsigned i = 0; i < job->n; i++)
			sum += job->near[i].weight * color[job->near[i].at][c];
		if (job->n > 0)
			foretold[c] = (sum + job->weight / 2) / job->weight;
		else if (leaf > 0)
			foretold[c] = color[leaf - 1][c];
	}
	for (unsigned i = 0; i < job->n; i++) {
		const int green = color[job->near[i].at][1];

		least = green < least ? green : least;
		most = green > most ? green : most;
	}
	spread = job->n < 2 ? 7 : log2_floor((uint64_t)(most - least + 1));
	for (int k = 0; k < 3; k++) {
		const int c = order[k], middle = foretold[c] + error;
		const uint8_t from = (uint8_t)(middle < 0 ? 0 : middle > 255 ? 255 : middle);
		const uint8_t step = job->is_decoding ? 0 : (uint8_t)(color[leaf][c] - from + 128);
		const unsigned coded = code_bits(job, job->odds->color[k][spread < 8 ? spread : 7], 8, step);

		if (job->is_decoding)
			color[leaf][c] = (uint8_t)(coded + from - 128);
		if (k == 0)
			error = color[leaf][1] - foretold[1];
	}
}

/* ---- materials ---- */

static uint32_t get_material(const struct job *job, uint32_t leaf)
{
	return octree_get_material(job->attributes.material[leaf]);
}

/* Codes each part by how far it is from the mean of the neighbours', round its end. */
static uint32_t code_parts(struct job *job, uint32_t material, uint32_t before)
{
	static const struct {
		int at, n_bits;
	} parts[PARTS] = { { 0, 5 }, { 5, 5 }, { 10, 6 }, { 16, 8 } };
	uint32_t coded = 0;

	for (int k = 0; k < PARTS; k++) {
		const uint32_t most = (1u << parts[k].n_bits) - 1, middle = most / 2 + 1;
		uint32_t sum = 0, low = most, high = 0, from = before >> parts[k].at & most, step;

		for (unsigned i = 0; i < job->n; i++) {
			const uint32_t value = get_material(job, job->near[i].at) >> parts[k].at & most;

			sum += (uint32_t)job->near[i].weight * value;
			low = value < low ? value : low;
			high = value > high ? value : high;
		}
		if (job->n > 0)
			from = (sum + (uint32_t)job->weight / 2) / (uint32_t)job->weight;
		const int spread = job->n < 2 ? 7 : log2_floor(high - low + 1);
		step = ((material >> parts[k].at) - from + middle) & most;
		step = code_bits(job, job->odds->material[k][spread < 8 ? spread : 7], parts[k].n_bits, step);
		coded |= ((step + from - middle) & most) << parts[k].at;
	}
	return coded;
}

/* Most parts of things have one material: that of the nearest leaf is tried first. */
static void code_material(struct job *job, uint32_t leaf)
{
	uint32_t before = leaf > 0 ? get_material(job, leaf - 1) : 0;
	uint32_t material = job->is_decoding ? 0 : get_material(job, leaf);
	int nearest = 0, is_agreed = 1;

	for (unsigned i = 0; i < job->n; i++)
		if (job->near[i].weight > nearest) {
			nearest = job->near[i].weight;
			before = get_material(job, job->near[i].at);
		}
	for (unsigned i = 0; i < job->n; i++)
		is_agreed &= get_material(job, job->near[i].at) == before;
	job->was_same = (int)code_bit(job, &job->odds->same_material[count_of(job)][job->was_same][is_agreed], 5,
	                              material == before);
	material = job->was_same ? before : code_parts(job, material, before);
	if (job->is_decoding)
		octree_put_material(job->attributes.material[leaf], material);
}

/* ---- all ---- */

static void visit_normal(uint32_t leaf, uint64_t path, const struct octree_near *near, void *userdata)
{
	struct job *job = userdata;

	find_near(job, near);
	code_normal(job, leaf, path);
	job->last_path = path;
}

static void visit_offset(uint32_t leaf, uint64_t path, const struct octree_near *near, void *userdata)
{
	(void)path;
	find_near(userdata, near);
	code_offset(userdata, leaf);
}

static void visit_color(uint32_t leaf, uint64_t path, const struct octree_near *near, void *userdata)
{
	(void)path;
	find_near(userdata, near);
	code_color(userdata, leaf);
}

static void visit_material(uint32_t leaf, uint64_t path, const struct octree_near *near, void *userdata)
{
	(void)path;
	find_near(userdata, near);
	code_material(userdata, leaf);
}

static int code_stream(struct job *job, const struct octree_levels *levels, enum octree_stream stream)
{
	static void (*const visits[OCTREE_STREAMS])(uint32_t, uint64_t, const struct octree_near *, void *) = {
		[OCTREE_NORMAL_STREAM] = visit_normal,
		[OCTREE_OFFSET_STREAM] = visit_offset,
		[OCTREE_COLOR_STREAM] = visit_color,
		[OCTREE_MATERIAL_STREAM] = visit_material,
	};

	job->unit = psr_direction_words();
	job->odds = odds_make(job->is_older);
	if (job->odds == NULL)
		return PSR_ERR_MEMORY;
	for (uint32_t n = 0; n <= LEARNT; n++)
		job->part[n] = (5 << 14) / (5 * n + 8);
	octree_levels_walk(levels, levels->height, visits[stream], job);
	free(job->odds);
	return PSR_OK;
}

int octree_attributes_pack(struct coder *coder, const struct octree_levels *levels,
                           const struct octree_attributes *attributes, enum octree_stream stream)
{
	struct job job = { .coder = coder, .attributes = *attributes };

	return code_stream(&job, levels, stream);
}

int octree_attributes_unpack(struct octree_attributes *attributes, struct coder *coder,
                             const struct octree_levels *levels, enum octree_stream stream, int is_older)
{
	struct job job = { .coder = coder, .attributes = *attributes, .is_decoding = 1, .is_older = is_older };

	return code_stream(&job, levels, stream);
}
