/* Finding slits: pixels that see between what is nearer on at least six of eight sides. */
#include "gaps_tile.h"

#define SLIT_RUN 32
#define SLIT_SIDES 6

/* A quick test: of the four neighbours on rows and columns two lie before a slit's pixel. */
static inline int32_t may_have_slits(const int32_t *weight, const struct gaps_target *t, const float *own)
{
	const float scale = t->scale[1], offset = t->offset[1];
	int32_t is_any = 0;

	for (int x = 0; x < SLIT_RUN; x++) {
		const float left = own[x - 1], right = own[x + 1], above = own[x - GAPS_STRIDE], below = own[x + GAPS_STRIDE];
		const float near_side = left < right ? left : right, far_side = left < right ? right : left;
		const float near_line = above < below ? above : below, far_line = above < below ? below : above;
		const float one_each = near_side < near_line ? near_line : near_side;
		const float pair = far_side < far_line ? far_side : far_line, second = one_each < pair ? one_each : pair;

		is_any |= (second * scale + offset < own[x]) & (weight[x] > 0);
	}
	return is_any;
}

static inline void count_before(int32_t *n_before, const struct gaps_target *t, const float *own)
{
	const float scale = t->scale[1], offset = t->offset[1];

	for (int x = 0; x < SLIT_RUN; x++) {
		int32_t n = 0;

		for (int v = -GAPS_STRIDE; v <= GAPS_STRIDE; v += GAPS_STRIDE)
			for (int u = -1; u <= 1; u++)
				n += own[x + v + u] * scale + offset < own[x];
		n_before[x] = n;
	}
}

/* Of SLIT_RUN pixels, at most n of which are of the piece; `at`: of the first in t->slit. */
static uint32_t list_slits(uint16_t *slit, const int32_t *weight, const struct gaps_target *t, const float *own,
                           uint32_t n, uint32_t at)
{
	int32_t n_before[SLIT_RUN];
	uint32_t n_slits = 0;

	count_before(n_before, t, own);
	for (uint32_t i = 0; i < SLIT_RUN && i < n; i++)
		if (n_before[i] >= SLIT_SIDES && weight[i] > 0)
			slit[n_slits++] = (uint16_t)(at + i);
	return n_slits;
}
