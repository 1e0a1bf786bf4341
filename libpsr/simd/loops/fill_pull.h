/* Pull ([G] 4.7): coarser cells from finer ones. */
#include "fill_rows.h"

/* How children add up to cells: shares in 256, the divisor of the sum, and (256 - 2^-12) / divisor. */
struct pull_shares {
	uint16_t upper[2 * FILL_BLOCK], lower[2 * FILL_BLOCK];
	int32_t divisor[FILL_BLOCK];
	float inverse[FILL_BLOCK];
};

/* One channel of coarser cells: sum * 256 / divisor, rounded down; the divisor is the sum of weights where that exceeds
 * a whole one. The estimate is at most 1 too low: sums are below 2^18, thus exact floats, and quotients below 2^16;
 * `inverse` is up to 2^-20 too small and a product rounds by 2^-24, together less than 2^-3. */
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

/* The weights and depths of a row from its cell x on. */
static inline struct fill_row depths_from(const struct fill_row *row, uint32_t x)
{
	return (struct fill_row){ .weight = row->weight + x, .z = row->z + x };
}

/* Pulls weights and depths of FILL_BLOCK cells; returns the least weight. */
static inline int32_t pull_weights(struct fill_row to, struct fill_row above, struct fill_row below, float scale,
                                   float offset)
{
	const float *upper_z = above.z, *lower_z = below.z;
	const uint16_t *upper = above.weight, *lower = below.weight;
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

		for (int i = 0; i < 4; i++) { /* NaN fails the comparison */
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
		to.weight[x] = (uint16_t)(sums[x] < GAPS_WHOLE ? sums[x] : GAPS_WHOLE);
	for (uint32_t x = 0; x < FILL_BLOCK; x++)
		to.near[x] = (uint8_t)bits[x];
	memcpy(to.z, mean, sizeof mean);
	return least;
}

/* is_picture: colours are not premultiplied yet, so that shares are weights; else all or nothing. */
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

static inline uint16_t fill_pull_weights(const struct fill_row *to, const struct fill_row *upper,
                                         const struct fill_row *lower, uint32_t n, float scale, float offset)
{
	const struct fill_row out = *to, above = *upper, below = *lower;
	int32_t least = GAPS_WHOLE, some;
	uint32_t x = 0;

	for (; n - x >= FILL_BLOCK; x += FILL_BLOCK) {
		const struct fill_row cells = { .weight = out.weight + x, .z = out.z + x, .near = out.near + x };

		some = pull_weights(cells, depths_from(&above, 2 * x), depths_from(&below, 2 * x), scale, offset);
		least = some < least ? some : least;
	}
	if (x < n) {
		struct block_row rows[3];
		uint8_t near[FILL_BLOCK];
		const struct fill_row cells = { .weight = rows[0].weight, .z = rows[0].z, .near = near };
		const struct fill_row upper_copy = { .weight = rows[1].weight, .z = rows[1].z };
		const struct fill_row lower_copy = { .weight = rows[2].weight, .z = rows[2].z };

		copy_weights(&rows[1], &above, 2 * x, 2 * (n - x));
		copy_weights(&rows[2], &below, 2 * x, 2 * (n - x));
		some = pull_weights(cells, upper_copy, lower_copy, scale, offset);
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
	const uint16_t *const above[3] = { upper->r, upper->g, upper->b };
	const uint16_t *const below[3] = { lower->r, lower->g, lower->b };
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

static void fill_depths(float *z, const uint64_t *word, uint32_t n)
{
	for (uint32_t x = 0; x < n; x++)
		z[x] = psr_float_from_bits((uint32_t)(word[x] >> 32));
}
