/* Pull and push of rows ([G] 4.7). Plain loops, which the compiler turns into vectors; compiled once for each ISA. */
#include <math.h>
#include "base/maths.h"
#include "simd/simd.h"

/* One channel of coarser cells: what children of weight above 0 add, a share in 256 of each, and where that is more than a
 * whole weight, divided by it: sum * 256 / divisor, rounded down. The estimate is at most 1 below: sums are less than 2^18, thus
 * floats, quotients less than 2^16; `inverse` is up to 2^-20 too small and a product rounds by 2^-24, together less than 2^-3. */
static inline void pull_channel(uint16_t *to, const uint16_t *upper, const uint16_t *lower, const uint16_t *share,
                                const uint16_t *divisor, const float *inverse, uint32_t n)
{
	for (uint32_t x = 0; x < n; x++) {
		const uint32_t a = (uint32_t)upper[2 * x] * share[x] >> 8;
		const uint32_t b = (uint32_t)upper[2 * x + 1] * share[FILL_WIDTH + x] >> 8;
		const uint32_t c = (uint32_t)lower[2 * x] * share[2 * FILL_WIDTH + x] >> 8;
		const uint32_t d = (uint32_t)lower[2 * x + 1] * share[3 * FILL_WIDTH + x] >> 8;
		const int32_t sum = (int32_t)(a + b + c + d), by = divisor[x];
		const int32_t quotient = (int32_t)((float)sum * inverse[x]);
		to[x] = (uint16_t)(quotient + (256 * sum - quotient * by >= by));
	}
}

/* The four children of each of n cells, apart. */
struct children {
	float z[4][FILL_WIDTH];
	int32_t weight[4][FILL_WIDTH];
};

static inline void load_children(struct children *to, int first, const struct fill_row *from, uint32_t n)
{
	const float *z = from->z;
	const uint16_t *weight = from->weight;
	for (uint32_t x = 0; x < n; x++) {
		to->z[first][x] = z[2 * x];
		to->z[first + 1][x] = z[2 * x + 1];
	}
	for (uint32_t x = 0; x < n; x++) {
		to->weight[first][x] = weight[2 * x];
		to->weight[first + 1][x] = weight[2 * x + 1];
	}
}

static uint16_t fill_pull(const struct fill_row *to, const struct fill_row *upper, const struct fill_row *lower, uint32_t n,
                          int is_picture, float scale, float offset)
{
	struct children child;
	uint16_t share[4 * FILL_WIDTH], divisor[FILL_WIDTH];
	float inverse[FILL_WIDTH];
	int32_t sum[FILL_WIDTH], least = GAPS_WHOLE;
	load_children(&child, 0, upper, n);
	load_children(&child, 2, lower, n);
	for (uint32_t x = 0; x < n; x++) {
		float nearest = INFINITY, z = 0;
		int32_t w = 0;
		for (int i = 0; i < 4; i++) { /* what is NaN is nearer than nothing */
			const float own = child.weight[i][x] ? child.z[i][x] : INFINITY;
			nearest = own < nearest ? own : nearest;
		}
		const float limit = nearest * scale + offset;
		for (int i = 0; i < 4; i++) {
			const int32_t is_near = child.z[i][x] <= limit, own = is_near ? child.weight[i][x] : 0;
			const float product = (float)own * child.z[i][x];
			z += own ? product : 0;
			w += own;
			child.weight[i][x] = own;
		}
		z /= (float)w;
		to->z[x] = w ? z : INFINITY;
		sum[x] = w;
		least = w < least ? w : least;
	}
	for (uint32_t x = 0; x < n; x++) {
		to->weight[x] = (uint16_t)(sum[x] < GAPS_WHOLE ? sum[x] : GAPS_WHOLE);
		divisor[x] = (uint16_t)(sum[x] > GAPS_WHOLE ? sum[x] : GAPS_WHOLE);
	}
	for (int i = 0; i < 4 && to->r; i++)
		for (uint32_t x = 0; x < n; x++)
			share[i * FILL_WIDTH + x] = (uint16_t)(child.weight[i][x] && !is_picture ? 256 : child.weight[i][x]);
	if (to->r) {
		for (uint32_t x = 0; x < n; x++)
			inverse[x] = (256 - 0x1p-12f) / (float)divisor[x];
		pull_channel(to->r, upper->r, lower->r, share, divisor, inverse, n);
		pull_channel(to->g, upper->g, lower->g, share, divisor, inverse, n);
		pull_channel(to->b, upper->b, lower->b, share, divisor, inverse, n);
	}
	return (uint16_t)least;
}

/* What a finer cell takes from its parent, from the parent's neighbour to its own side and from that above or below, and
 * the inverse of the sum. */
struct shares {
	int32_t own[2][FILL_WIDTH], side[2][FILL_WIDTH], beside[2][FILL_WIDTH];
	float inverse[2][FILL_WIDTH];
};

/* For cells on the side of their parents that `step` leads to. */
static inline void share_parents(struct shares *to, float *z, const struct fill_row *own, const struct fill_row *beside, uint32_t n,
                                 int right, float scale, float offset)
{
	const int32_t step = right ? 1 : -1;
	for (uint32_t x = 0; x < n; x++) {
		const float a = own->z[x], b = own->z[(int32_t)x + step], c = beside->z[x];
		float nearest = a < INFINITY ? a : INFINITY;
		nearest = b < nearest ? b : nearest;
		nearest = c < nearest ? c : nearest;
		const float limit = nearest * scale + offset;
		const int32_t ua = a <= limit ? 2 : 0, ub = b <= limit ? 1 : 0, uc = c <= limit ? 1 : 0, u = ua + ub + uc;
		to->own[right][x] = ua;
		to->side[right][x] = ub;
		to->beside[right][x] = uc;
		to->inverse[right][x] = u == 1 ? 1.0f : u == 2 ? 0.5f : u == 3 ? 1.0f / 3 : 0.25f;
		z[x] = (((ua ? 2 * a : 0) + (ub ? b : 0)) + (uc ? c : 0)) / (float)u;
	}
}

/* Sums are below 2^18 and quotients below 2^16, so that quotients are off by less than 1/100, and their fractions are quarters
 * or thirds: an eighth more never reaches the next whole number, and always the own one. */
static inline int32_t interpolate(const struct shares *s, int right, uint32_t x, int32_t own, int32_t side, int32_t beside)
{
	const int32_t sum = own * s->own[right][x] + side * s->side[right][x] + beside * s->beside[right][x];
	return (int32_t)((float)sum * s->inverse[right][x] + 0.125f);
}

/* Cells of a share of 256 in `was` and of the rest from their parents. */
static inline void push_channel(uint16_t *to, const uint16_t *was, const uint16_t *weight, const uint16_t *own,
                                const uint16_t *beside, const struct shares *s, uint32_t n, int is_picture)
{
	for (uint32_t x = 0; x < n; x++) {
		const int32_t wl = weight[2 * x], wr = weight[2 * x + 1], el = is_picture ? wl : 256, er = is_picture ? wr : 256;
		const int32_t l = interpolate(s, 0, x, own[x], own[(int32_t)x - 1], beside[x]);
		const int32_t r = interpolate(s, 1, x, own[x], own[x + 1], beside[x]);
		to[2 * x] = (uint16_t)((was[2 * x] * el >> 8) + (l * (GAPS_WHOLE - wl) >> 8));
		to[2 * x + 1] = (uint16_t)((was[2 * x + 1] * er >> 8) + (r * (GAPS_WHOLE - wr) >> 8));
	}
}

static void fill_push(const struct fill_row *to, const struct fill_row *own, const struct fill_row *beside, uint32_t n, float scale,
                      float offset)
{
	struct shares s;
	float z[2][FILL_WIDTH];
	share_parents(&s, z[0], own, beside, n, 0, scale, offset);
	share_parents(&s, z[1], own, beside, n, 1, scale, offset);
	for (uint32_t x = 0; x < n; x++) {
		to->z[2 * x] = to->weight[2 * x] < GAPS_WHOLE / 2 ? z[0][x] : to->z[2 * x];
		to->z[2 * x + 1] = to->weight[2 * x + 1] < GAPS_WHOLE / 2 ? z[1][x] : to->z[2 * x + 1];
	}
	push_channel(to->r, to->r, to->weight, own->r, beside->r, &s, n, 0);
	push_channel(to->g, to->g, to->weight, own->g, beside->g, &s, n, 0);
	push_channel(to->b, to->b, to->weight, own->b, beside->b, &s, n, 0);
}

static void fill_push_picture(const struct fill_row *to, const struct fill_row *was, const struct fill_row *own,
                              const struct fill_row *beside, uint32_t n, float scale, float offset)
{
	struct shares s;
	float z[2][FILL_WIDTH];
	share_parents(&s, z[0], own, beside, n, 0, scale, offset);
	share_parents(&s, z[1], own, beside, n, 1, scale, offset);
	for (uint32_t x = 0; x < n; x++) {
		to->z[2 * x] = z[0][x];
		to->z[2 * x + 1] = z[1][x];
	}
	push_channel(to->r, was->r, was->weight, own->r, beside->r, &s, n, 1);
	push_channel(to->g, was->g, was->weight, own->g, beside->g, &s, n, 1);
	push_channel(to->b, was->b, was->weight, own->b, beside->b, &s, n, 1);
}

static void fill_depths(float *z, const uint64_t *word, uint32_t n)
{
	for (uint32_t x = 0; x < n; x++)
		z[x] = psr_float_from_bits((uint32_t)(word[x] >> 32));
}
