/* Pull and push of rows ([G] 4.7), FILL_BLOCK coarser cells at a time. Plain loops of constant length, which the
 * compiler turns into vectors; compiled once for each ISA. */
#include <math.h>
#include <stddef.h>
#include <string.h>
#include "base/maths.h"
#include "simd.h"

/* Cells 2x and 2x + 1, the former in the lower half, as vectors take them: bytes are little-endian. */
static inline uint32_t pair_at(const uint16_t *values, uint32_t x)
{
	uint32_t pair;
	memcpy(&pair, values + 2 * x, sizeof pair);
	return pair;
}

/* value * share >> 8 of a share of 0..256, within 16 bits. */
static inline uint16_t part_of(uint16_t value, uint16_t share)
{
	const uint16_t all = (uint16_t)-(share >> 8), factor = (uint16_t)(share << 8);
	return (uint16_t)((value & all) | (uint16_t)((uint32_t)value * factor >> 16));
}

/* What n cells of a row, at most 2 * FILL_BLOCK, are copied to where there is not a whole block of them. */
struct block_row {
	uint16_t r[2 * FILL_BLOCK + 2], g[2 * FILL_BLOCK + 2], b[2 * FILL_BLOCK + 2], weight[2 * FILL_BLOCK + 2];
	float z[2 * FILL_BLOCK + 2];
};

static inline void copy_values(uint16_t *to, const uint16_t *from, uint32_t n, uint16_t outside)
{
	for (uint32_t i = 0; i < 2 * FILL_BLOCK + 2; i++)
		to[i] = outside;
	memcpy(to, from, n * sizeof *to);
}

/* ---- pull ---- */

/* What children add to a cell: a share in 256 of each, and the inverse of what the sum is divided by. */
struct pull_shares {
	uint16_t upper[2 * FILL_BLOCK], lower[2 * FILL_BLOCK];
	int32_t divisor[FILL_BLOCK];
	float inverse[FILL_BLOCK];
};

/* One channel of coarser cells: what children of weight above 0 add, and where that is more than a whole weight,
 * divided by it: sum * 256 / divisor, rounded down. The estimate is at most 1 below: sums are less than 2^18, thus
 * floats, quotients less than 2^16; `inverse` is up to 2^-20 too small and a product rounds by 2^-24, together less
 * than 2^-3. */
static inline void pull_channel(uint16_t *to, const uint16_t *upper, const uint16_t *lower,
                                const struct pull_shares *shares)
{
	uint16_t above[2 * FILL_BLOCK], below[2 * FILL_BLOCK];
	int32_t value[FILL_BLOCK];
	for (uint32_t x = 0; x < 2 * FILL_BLOCK; x++) {
		above[x] = part_of(upper[x], shares->upper[x]);
		below[x] = part_of(lower[x], shares->lower[x]);
	}
	for (uint32_t x = 0; x < FILL_BLOCK; x++) {
		const uint32_t two = pair_at(above, x), others = pair_at(below, x);
		const int32_t sum = (int32_t)((two & 0xffff) + (two >> 16) + (others & 0xffff) + (others >> 16));
		const int32_t by = shares->divisor[x];
		const int32_t quotient = (int32_t)((float)sum * shares->inverse[x]);
		value[x] = quotient + (256 * sum - quotient * by >= by);
	}
	for (uint32_t x = 0; x < FILL_BLOCK; x++)
		to[x] = (uint16_t)value[x];
}

/* FILL_BLOCK cells, from those whose depths and weights these are; returns the least weight. */
static inline int32_t pull_weights(uint16_t *weight, float *z, uint8_t *near, const float *upper_z,
                                   const float *lower_z, const uint16_t *upper, const uint16_t *lower, float scale,
                                   float offset)
{
	float depth[4][FILL_BLOCK], mean[FILL_BLOCK];
	int32_t sums[FILL_BLOCK], bits[FILL_BLOCK];
	int32_t least = GAPS_WHOLE;
	for (uint32_t x = 0; x < FILL_BLOCK; x++) {
		depth[0][x] = upper_z[2 * x];
		depth[1][x] = upper_z[2 * x + 1];
		depth[2][x] = lower_z[2 * x];
		depth[3][x] = lower_z[2 * x + 1];
	}
	for (uint32_t x = 0; x < FILL_BLOCK; x++) {
		const uint32_t two = pair_at(upper, x), others = pair_at(lower, x);
		const int32_t w[4] = { (int32_t)(two & 0xffff), (int32_t)(two >> 16), (int32_t)(others & 0xffff),
			                   (int32_t)(others >> 16) };
		float nearest = INFINITY, sum_z = 0;
		int32_t sum = 0, is_near = 0;
		for (int i = 0; i < 4; i++) { /* what is NaN is nearer than nothing */
			const float own = psr_choose(w[i] > 0, depth[i][x], INFINITY);
			nearest = own < nearest ? own : nearest;
		}
		const float limit = nearest * scale + offset;
		for (int i = 0; i < 4; i++) {
			const int32_t own = w[i] & -(depth[i][x] <= limit);
			sum_z += psr_where(own > 0, (float)own * depth[i][x]);
			sum += own;
			is_near |= (own > 0) << i;
		}
		mean[x] = psr_choose(sum > 0, sum_z / (float)sum, INFINITY);
		sums[x] = sum;
		bits[x] = is_near;
		least = sum < least ? sum : least;
	}
	for (uint32_t x = 0; x < FILL_BLOCK; x++)
		weight[x] = (uint16_t)(sums[x] < GAPS_WHOLE ? sums[x] : GAPS_WHOLE);
	for (uint32_t x = 0; x < FILL_BLOCK; x++)
		near[x] = (uint8_t)bits[x];
	memcpy(z, mean, sizeof mean);
	return least;
}

/* What children of weights `upper` and `lower` add to cells. */
static inline __attribute__((always_inline)) void find_shares(struct pull_shares *shares, const uint8_t *near,
                                                              const uint16_t *upper, const uint16_t *lower,
                                                              int is_picture)
{
	uint32_t above[FILL_BLOCK], below[FILL_BLOCK];
	for (uint32_t x = 0; x < FILL_BLOCK; x++) {
		const uint32_t bits = near[x], left = 0x0000ffff, right = 0xffff0000;
		const uint32_t two = (left & (0u - (bits & 1))) | (right & (0u - (bits >> 1 & 1)));
		const uint32_t others = (left & (0u - (bits >> 2 & 1))) | (right & (0u - (bits >> 3)));
		const uint32_t w = pair_at(upper, x) & two, v = pair_at(lower, x) & others;
		const int32_t sum = (int32_t)((w & 0xffff) + (w >> 16) + (v & 0xffff) + (v >> 16));
		const int32_t by = sum > GAPS_WHOLE ? sum : GAPS_WHOLE;
		above[x] = is_picture ? w : two & (GAPS_WHOLE | GAPS_WHOLE << 16);
		below[x] = is_picture ? v : others & (GAPS_WHOLE | GAPS_WHOLE << 16);
		shares->divisor[x] = by;
		shares->inverse[x] = (256 - 0x1p-12f) / (float)by;
	}
	memcpy(shares->upper, above, sizeof above);
	memcpy(shares->lower, below, sizeof below);
}

/* Cell x of a row, and those to the right of it. */
static inline struct fill_row row_from(struct fill_row row, ptrdiff_t x)
{
	return (struct fill_row){ row.r + x, row.g + x, row.b + x, row.weight + x, row.z + x, NULL };
}

/* Copies what a block needs of the last cells of a row: n weights and depths, and whole cells beyond them. */
static inline void copy_weights(struct block_row *to, const struct fill_row *from, uint32_t x, uint32_t n)
{
	copy_values(to->weight, from->weight + x, n, GAPS_WHOLE);
	memset(to->z, 0, sizeof to->z);
	memcpy(to->z, from->z + x, n * sizeof *to->z);
}

static inline uint16_t fill_pull_weights(const struct fill_row *to, const struct fill_row *upper,
                                         const struct fill_row *lower, uint32_t n, float scale, float offset)
{
	const struct fill_row out = *to, above = *upper, below = *lower;
	int32_t least = GAPS_WHOLE, some;
	uint32_t x = 0;
	for (; n - x >= FILL_BLOCK; x += FILL_BLOCK) {
		some = pull_weights(out.weight + x, out.z + x, out.near + x, above.z + 2 * x, below.z + 2 * x,
		                    above.weight + 2 * x, below.weight + 2 * x, scale, offset);
		least = some < least ? some : least;
	}
	if (x < n) {
		struct block_row rows[3];
		uint8_t near[FILL_BLOCK];
		copy_weights(&rows[1], &above, 2 * x, 2 * (n - x));
		copy_weights(&rows[2], &below, 2 * x, 2 * (n - x));
		some = pull_weights(rows[0].weight, rows[0].z, near, rows[1].z, rows[2].z, rows[1].weight, rows[2].weight,
		                    scale, offset);
		least = some < least ? some : least;
		memcpy(out.weight + x, rows[0].weight, (n - x) * sizeof *out.weight);
		memcpy(out.z + x, rows[0].z, (n - x) * sizeof *out.z);
		memcpy(out.near + x, near, n - x);
	}
	return (uint16_t)least;
}

static inline __attribute__((always_inline)) void pull_row(const struct fill_row *to, const struct fill_row *upper,
                                                           const struct fill_row *lower, uint32_t n, int is_picture)
{
	uint16_t *const out[3] = { to->r, to->g, to->b };
	const uint16_t *const above[3] = { upper->r, upper->g, upper->b }, *const below[3] = { lower->r, lower->g, lower->b };
	struct pull_shares shares;
	uint32_t x = 0;
	for (; n - x >= FILL_BLOCK; x += FILL_BLOCK) {
		find_shares(&shares, to->near + x, upper->weight + 2 * x, lower->weight + 2 * x, is_picture);
		for (int i = 0; i < 3; i++)
			pull_channel(out[i] + x, above[i] + 2 * x, below[i] + 2 * x, &shares);
	}
	if (x < n) {
		const uint32_t left = n - x;
		struct block_row rows[2];
		uint16_t values[FILL_BLOCK];
		uint8_t near[FILL_BLOCK] = { 0 };
		memcpy(near, to->near + x, left);
		copy_values(rows[0].weight, upper->weight + 2 * x, 2 * left, 0);
		copy_values(rows[1].weight, lower->weight + 2 * x, 2 * left, 0);
		find_shares(&shares, near, rows[0].weight, rows[1].weight, is_picture);
		for (int i = 0; i < 3; i++) {
			copy_values(rows[0].r, above[i] + 2 * x, 2 * left, 0);
			copy_values(rows[1].r, below[i] + 2 * x, 2 * left, 0);
			pull_channel(values, rows[0].r, rows[1].r, &shares);
			memcpy(out[i] + x, values, left * sizeof *values);
		}
	}
}

static inline void fill_pull_colors(const struct fill_row *to, const struct fill_row *upper,
                                    const struct fill_row *lower, uint32_t n, int is_picture)
{
	if (is_picture)
		pull_row(to, upper, lower, n, 1);
	else
		pull_row(to, upper, lower, n, 0);
}

/* ---- push ---- */

/* With whole cells beyond them. */
static inline struct fill_row copy_row(struct block_row *to, struct fill_row from, uint32_t n)
{
	copy_weights(to, &from, 0, n);
	copy_values(to->r, from.r, n, 0);
	copy_values(to->g, from.g, n, 0);
	copy_values(to->b, from.b, n, 0);
	return (struct fill_row){ to->r, to->g, to->b, to->weight, to->z, NULL };
}

static inline void copy_back(struct fill_row to, const struct block_row *from, uint32_t n)
{
	memcpy(to.z, from->z, n * sizeof *to.z);
	memcpy(to.weight, from->weight, n * sizeof *to.weight);
	memcpy(to.r, from->r, n * sizeof *to.r);
	memcpy(to.g, from->g, n * sizeof *to.g);
	memcpy(to.b, from->b, n * sizeof *to.b);
}

/* What finer cells take from their parents, from the parents' neighbors to their own side and from those above or
 * below: all or nothing of each, the parents' twice; and the inverse of the sum of these shares. */
struct push_shares {
	uint32_t own[FILL_BLOCK], side[FILL_BLOCK], beside[FILL_BLOCK];
	float inverse[FILL_BLOCK];
};

/* For cells on the side of their parents that `step` leads to. */
static inline void share_parents(struct push_shares *to, float *z, const float *own, const float *side,
                                 const float *beside, float scale, float offset)
{
	for (uint32_t x = 0; x < FILL_BLOCK; x++) {
		const float a = own[x], b = side[x], c = beside[x];
		float nearest = a < INFINITY ? a : INFINITY;
		nearest = b < nearest ? b : nearest;
		nearest = c < nearest ? c : nearest;
		const float limit = nearest * scale + offset;
		const int32_t ua = a <= limit, ub = b <= limit, uc = c <= limit, u = 2 * ua + ub + uc;
		to->own[x] = 0u - (uint32_t)ua;
		to->side[x] = 0u - (uint32_t)ub;
		to->beside[x] = 0u - (uint32_t)uc;
		to->inverse[x] = psr_choose(u == 1, 1.0f, psr_choose(u == 2, 0.5f, psr_choose(u == 3, 1.0f / 3, 0.25f)));
		z[x] = ((psr_where(ua, 2 * a) + psr_where(ub, b)) + psr_where(uc, c)) / (float)u;
	}
}

/* Sums are below 2^18 and quotients below 2^16, so that quotients are off by less than 1/100, and their fractions are
 * quarters or thirds: an eighth more never reaches the next whole number, and always the own one. */
static inline uint32_t interpolate(const struct push_shares *s, uint32_t x, uint32_t own, uint32_t side,
                                   uint32_t beside)
{
	const int32_t sum = (int32_t)(2 * (own & s->own[x]) + (side & s->side[x]) + (beside & s->beside[x]));
	return (uint32_t)(int32_t)((float)sum * s->inverse[x] + 0.125f);
}

/* Cells whose turn it is: of a share of 256 in `was` and of the rest from their parents. */
static inline void push_channel(uint16_t *to, const uint16_t *was, const uint16_t *weight, const uint16_t *turn,
                                const uint16_t *own, const uint16_t *beside, const struct push_shares *left,
                                const struct push_shares *right, int is_picture)
{
	uint32_t pair[FILL_BLOCK];
	uint16_t both[2 * FILL_BLOCK], value[2 * FILL_BLOCK];
	for (uint32_t x = 0; x < FILL_BLOCK; x++) {
		const uint32_t l = interpolate(left, x, own[x], *(own + x - 1), beside[x]);
		const uint32_t r = interpolate(right, x, own[x], own[x + 1], beside[x]);
		pair[x] = l | r << 16;
	}
	memcpy(both, pair, sizeof both);
	for (uint32_t x = 0; x < 2 * FILL_BLOCK; x++) {
		const uint16_t w = weight[x], rest = (uint16_t)(GAPS_WHOLE - w);
		value[x] = (uint16_t)((is_picture ? part_of(was[x], w) : was[x]) + (part_of(both[x], rest) & turn[x]));
	}
	memcpy(to, value, sizeof value);
}

/* Whose turn it is: cells that are not whole and whose parents are. Masks; returns whether there are any. */
static inline int find_turn(uint16_t *turn, const uint16_t *weight, const uint16_t *own, const uint16_t *beside)
{
	uint32_t ready[FILL_BLOCK];
	uint16_t any = 0;
	for (uint32_t x = 0; x < FILL_BLOCK; x++) {
		const uint32_t both = (own[x] == GAPS_WHOLE) & (beside[x] == GAPS_WHOLE);
		const uint32_t left = both & (*(own + x - 1) == GAPS_WHOLE), right = both & (own[x + 1] == GAPS_WHOLE);
		ready[x] = left * 0xffff | right * 0xffff0000;
	}
	memcpy(turn, ready, sizeof ready);
	for (uint32_t x = 0; x < 2 * FILL_BLOCK; x++) {
		turn[x] &= (uint16_t)-(weight[x] < GAPS_WHOLE);
		any |= turn[x];
	}
	return any != 0;
}

static inline int has_partial(const uint16_t *weight, uint32_t n)
{
	uint16_t rest = 0;
	for (uint32_t x = 0; x < n; x++)
		rest |= weight[x] ^ GAPS_WHOLE;
	return rest != 0;
}

/* Returns whether it is any cell's turn; then it is so for those that are not 0 in `turn`. */
static inline __attribute__((always_inline)) int push_block(struct fill_row to, uint16_t *turn, struct fill_row was,
                                                            struct fill_row own, struct fill_row beside, int is_picture,
                                                            float scale, float offset)
{
	struct push_shares left, right;
	float z[2][FILL_BLOCK], both[2 * FILL_BLOCK];
	uint16_t weight[2 * FILL_BLOCK];
	if (!find_turn(turn, was.weight, own.weight, beside.weight))
		return 0;
	share_parents(&left, z[0], own.z, own.z - 1, beside.z, scale, offset);
	share_parents(&right, z[1], own.z, own.z + 1, beside.z, scale, offset);
	for (uint32_t x = 0; x < FILL_BLOCK; x++) {
		both[2 * x] = z[0][x];
		both[2 * x + 1] = z[1][x];
	}
	push_channel(to.r, was.r, was.weight, turn, own.r, beside.r, &left, &right, is_picture);
	push_channel(to.g, was.g, was.weight, turn, own.g, beside.g, &left, &right, is_picture);
	push_channel(to.b, was.b, was.weight, turn, own.b, beside.b, &left, &right, is_picture);
	if (!is_picture) {
		for (uint32_t x = 0; x < 2 * FILL_BLOCK; x++)
			both[x] = psr_choose((was.weight[x] < GAPS_WHOLE / 2) & (turn[x] != 0), both[x], was.z[x]);
		for (uint32_t x = 0; x < 2 * FILL_BLOCK; x++)
			weight[x] = (uint16_t)((was.weight[x] & ~turn[x]) | (GAPS_WHOLE & turn[x]));
		memcpy(to.weight, weight, sizeof weight);
	}
	memcpy(to.z, both, sizeof both);
	return 1;
}

/* Blocks of a row, the last of which may be copies: what push_block takes. */
struct push_rows {
	struct fill_row to, was, own, beside;
	struct block_row copy[4];
};

static inline void copy_rows(struct push_rows *to, struct fill_row was, struct fill_row own, struct fill_row beside,
                             uint32_t n)
{
	to->was = copy_row(&to->copy[0], was, 2 * n);
	to->own = row_from(copy_row(&to->copy[1], row_from(own, -1), n + 2), 1);
	to->beside = copy_row(&to->copy[2], beside, n);
	to->to = (struct fill_row){ to->copy[3].r, to->copy[3].g, to->copy[3].b, to->copy[3].weight, to->copy[3].z,
		                      NULL };
}

static inline void fill_push(const struct fill_row *to, const struct fill_row *own, const struct fill_row *beside,
                             uint32_t n, float scale, float offset)
{
	const struct fill_row cells = *to, parents = *own, others = *beside;
	uint16_t turn[2 * FILL_BLOCK];
	uint32_t x = 0;
	for (; n - x >= FILL_BLOCK; x += FILL_BLOCK) {
		const struct fill_row was = row_from(cells, 2 * x);
		if (has_partial(was.weight, 2 * FILL_BLOCK))
			push_block(was, turn, was, row_from(parents, x), row_from(others, x), 0, scale, offset);
	}
	if (x < n && has_partial(cells.weight + 2 * x, 2 * (n - x))) {
		struct push_rows rows;
		copy_rows(&rows, row_from(cells, 2 * x), row_from(parents, x), row_from(others, x), n - x);
		if (push_block(rows.to, turn, rows.was, rows.own, rows.beside, 0, scale, offset))
			copy_back(row_from(cells, 2 * x), &rows.copy[3], 2 * (n - x));
	}
}

/* Lists the block's pixels whose turn it is, which become whole, `n_places` after those of blocks before; takes its bit
 * out where no other is left. Returns how many are listed now. */
static inline uint32_t list_block(struct fill_places *places, uint32_t n_places, uint32_t *left, uint32_t bit,
                                  const uint16_t *turn, uint16_t *weight, const struct block_row *row,
                                  uint32_t first, uint32_t n)
{
	uint16_t *at = places->at + n_places;
	uint32_t n_turn = 0, n_partial = 0;
	for (uint32_t x = 0; x < n; x++) {
		at[n_turn] = (uint16_t)x;
		n_turn += turn[x] & 1;
		n_partial += weight[x] < GAPS_WHOLE;
	}
	*left &= ~(n_turn == n_partial ? bit : 0);
	for (uint32_t i = 0; i < n_turn; i++) {
		const uint32_t x = at[i], to = n_places + i;
		places->at[to] = (uint16_t)(first + x);
		places->weight[to] = weight[x];
		places->r[to] = row->r[x];
		places->g[to] = row->g[x];
		places->b[to] = row->b[x];
		places->z[to] = row->z[x];
		places->n_filled += (weight[x] == 0) & (row->z[x] < INFINITY);
		places->n_moved += weight[x] < GAPS_WHOLE / 2;
		weight[x] = GAPS_WHOLE;
	}
	return n_places + n_turn;
}

static inline uint32_t fill_push_picture(struct fill_places *places, uint32_t *left, uint32_t bit,
                                         const struct fill_row *was, const struct fill_row *own,
                                         const struct fill_row *beside, uint32_t n, float scale, float offset)
{
	const struct fill_row in = *was, parents = *own, others = *beside;
	struct block_row row;
	const struct fill_row out = { row.r, row.g, row.b, NULL, row.z, NULL };
	uint16_t turn[2 * FILL_BLOCK];
	uint32_t n_places = 0;
	places->n_filled = places->n_moved = 0;
	for (uint32_t x = 0; x < n; x += FILL_BLOCK, left++) {
		const uint32_t n_block = n - x < FILL_BLOCK ? n - x : FILL_BLOCK;
		uint16_t *weight = in.weight + 2 * x;
		if (!(*left & bit))
			continue;
		if (!has_partial(weight, 2 * n_block)) {
			*left &= ~bit;
			continue;
		}
		int is_turn;
		if (n_block == FILL_BLOCK) {
			is_turn = push_block(out, turn, row_from(in, 2 * x), row_from(parents, x),
			                     row_from(others, x), 1, scale, offset);
		} else {
			struct push_rows rows;
			copy_rows(&rows, row_from(in, 2 * x), row_from(parents, x), row_from(others, x), n_block);
			is_turn = push_block(out, turn, rows.was, rows.own, rows.beside, 1, scale, offset);
		}
		if (is_turn)
			n_places = list_block(places, n_places, left, bit, turn, weight, &row, 2 * x, 2 * n_block);
	}
	return n_places;
}

static void fill_depths(float *z, const uint64_t *word, uint32_t n)
{
	for (uint32_t x = 0; x < n; x++)
		z[x] = psr_float_from_bits((uint32_t)(word[x] >> 32));
}
