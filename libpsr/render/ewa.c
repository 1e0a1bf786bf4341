#include "ewa.h"

#include <string.h>
#include "base/maths.h"
#include "sheer.h"

#define RUN 64 /* cubes added up between two questions */
/* Cubes that can add less to a pixel's weight than what is left from EWA_MOST_WEIGHT on. */
#define MOST_UNHELD ((UINT32_MAX - EWA_MOST_WEIGHT) / (255 * PSR_BLOCK_SAMPLES) - RUN)

static void clear_sums(const struct warp_target *t)
{
	for (int32_t y = t->y0; y < t->y1; y++)
		memset(t->sum + (size_t)(y - t->y0) * t->sum_stride, 0, (size_t)(t->x1 - t->x0) * sizeof *t->sum);
}

/* Keeps weights from growing beyond what they hold. */
static void hold_weights(const struct warp_target *t)
{
	for (int32_t y = 0; y < t->y1 - t->y0; y++)
		for (int32_t x = 0; x < t->x1 - t->x0; x++) {
			uint32_t *weight = &t->sum[(size_t)y * t->sum_stride + (size_t)x].lane[EWA_WEIGHT];

			*weight = *weight < EWA_MOST_WEIGHT ? *weight : EWA_MOST_WEIGHT;
		}
}

/* Whether all pixels that a cube's splats reach are nearer by more than is one surface. */
static int is_hidden(const uint32_t far[FAR_CELLS], const struct warp_target *t, const struct cull_hit *hit, float same)
{
	const int32_t x0 = (hit->x0 > t->x0 ? hit->x0 - t->x0 : 0) / FAR_SIDE;
	const int32_t y0 = (hit->y0 > t->y0 ? hit->y0 - t->y0 : 0) / FAR_SIDE;
	const int32_t x1 = ((hit->x1 < t->x1 ? hit->x1 : t->x1 - 1) - t->x0) / FAR_SIDE;
	const int32_t y1 = ((hit->y1 < t->y1 ? hit->y1 : t->y1 - 1) - t->y0) / FAR_SIDE;
	const float near = hit->near - same;

	if (!(near > 0))
		return 0;
	for (int32_t y = y0; y <= y1; y++)
		for (int32_t x = x0; x <= x1; x++)
			if (far[y * (TILE_WIDTH / FAR_SIDE) + x] >= psr_bits_from_float(near))
				return 0;
	return 1;
}

/* EWA_SAME edges of a cube's leaves, as they are drawn. */
static float same_of(const struct plan *plan, const struct bin_entry *entry)
{
	const struct warp_cubes *cubes = plan->warp[entry->instance].cubes;
	const uint32_t cube = entry->slot - plan->warp[entry->instance].first_slot;
	const float edge = (float)cubes->model->level[0].edge * (float)(1u << psr_blocks_level(&cubes->model->groups, cube));

	return 1.001f * EWA_SAME * edge * cubes->ewa.depth; /* rounded otherwise than the kernel does */
}

void ewa_tile(const struct simd *simd, const struct plan *plan, const struct bins *bins, const struct warp_into *into,
              uint32_t tile)
{
	const uint32_t begin = bins->tile_begin[tile], end = bins->thin_begin[tile];
	const int skips = (plan->cull_tests & PSR_CULL_OCCLUSION) != 0;
	struct bin_entry some[RUN];
	struct warp_target target;
	uint32_t far[FAR_CELLS], n = 0, n_unheld = 0;

	warp_target_make(&target, plan, into->stack, tile, into->own);
	target.sum = into->sum + (size_t)target.y0 * plan->width + target.x0;
	target.sum_stride = plan->width;
	clear_sums(&target);
	if (skips)
		simd->warp_far(&target, far);
	for (uint32_t e = begin; e < end && !(n == 0 && plan_is_cancelled(plan)); e++) {
		const struct bin_entry *entry = &bins->entry[e];

		if (plan->warp[entry->instance].cubes == NULL
		    || (skips && is_hidden(far, &target, &bins->hit[entry->hit], same_of(plan, entry))))
			continue;
		some[n++] = *entry;
		if (n == RUN) {
			simd->ewa_sums(&target, some, n);
			n_unheld += n;
			n = 0;
			if (n_unheld >= MOST_UNHELD) {
				hold_weights(&target);
				n_unheld = 0;
			}
		}
	}
	simd->ewa_sums(&target, some, n);
}
