/* Lists the words of sheer blocks by pixel. */
#include <stdlib.h>
#include "base/maths.h"
#include "base/vec.h"
#include "block.h"
#include "sheer.h"
#include "splat.h"
#include "simd/block.h"

/* At most so many steps of the lattice between the depths of a pixel's centre and its sample: a normal may not be the
 * surface's own. */
#define MOST_OFF 4.0f

int sheer_grow(struct sheer_list *list)
{
	const uint32_t more = 2 * list->capacity + 65536, capacity = more < SHEER_LIST_MOST ? more : SHEER_LIST_MOST;
	struct sheer_word *grown = realloc(list->word, capacity * sizeof *grown);

	list->failed |= grown == NULL;
	if (grown == NULL)
		return PSR_ERR_MEMORY;
	list->word = grown;
	list->capacity = capacity;
	return PSR_OK;
}

void sheer_replace(struct sheer_list *list, uint32_t at, uint64_t word)
{
	struct sheer_word *farthest = &list->word[list->last[at]];

	for (uint32_t i = farthest->former; i != SHEER_END; i = list->word[i].former)
		if (list->word[i].word > farthest->word)
			farthest = &list->word[i];
	if (word < farthest->word)
		farthest->word = word;
}

/* Finds z' where the line of sight through a pixel's centre meets the plane of a sample at pixel (at[0], at[1]) and
 * depth at[2], at most `most` from it. On a steep surface two samples' planes differ by less than their depths. */
static float center_depth(const struct plan *plan, const struct warp_instance *in, const float inner[3],
                          const float at[3], float most)
{
	const float focal = plan->view.focal, u = at[0], v = at[1], z = at[2];
	const float across = (psr_floor_int(u) + 0.5f - u) / focal, down = (psr_floor_int(v) + 0.5f - v) / focal;
	const float x = (u - plan->view.half_width) / focal, y = (v - plan->view.half_height) / focal;
	float n[3], off;

	for (int k = 0; k < 3; k++)
		n[k] = (in->turn[k][0] * inner[0] + in->turn[k][1] * inner[1]) + in->turn[k][2] * inner[2];
	const float aside = n[0] * across + n[1] * down;
	off = plan->perspective ? -z * aside / (((n[0] * x + n[1] * y) + n[2]) + aside) : -aside / n[2];
	off = off > -most ? off : -most; /* NaN, too */
	return z + (off < most ? off : most);
}

/* The samples of a block that may show in the tile. */
struct points {
	uint32_t n, sample[PSR_BLOCK_SAMPLES], at[PSR_BLOCK_SAMPLES];
	float place[PSR_BLOCK_SAMPLES][3]; /* pixel and z' */
	const float *normal[PSR_BLOCK_SAMPLES];
};

/* Finds a block's samples in the tile that lie before the opaque surface or at most `most` behind it. Asks for their
 * normals, which are far apart in memory. */
static void find_points(struct points *points, const struct warp_block *b, const struct plan *plan,
                        const struct warp_target *target, const float *before, float most)
{
	const float (*normals)[3] = psr_direction_table();
	const uint16_t *depths = b->depth;
	const uint64_t *attr = b->attr;
	struct warp_terms terms;

	points->n = 0;
	warp_terms_make(&terms, b);
	for (uint64_t left = b->mask; left; left &= left - 1, depths++, attr++) {
		const uint32_t sample = (uint32_t)__builtin_ctzll(left), r = sample >> 3, c = sample & 7, i = points->n;
		const float depth = (float)*depths, z = warp_axis(&terms, b, 2, r, c, depth);
		const float inverse = plan->perspective ? 1 / z : 1;
		const float u = warp_axis(&terms, b, 0, r, c, depth) * inverse;
		const float v = warp_axis(&terms, b, 1, r, c, depth) * inverse;

		if (!(z > plan->near_z && u >= (float)target->x0 && u < (float)target->x1 && v >= (float)target->y0
		      && v < (float)target->y1))
			continue;
		points->sample[i] = sample;
		points->at[i] = (uint32_t)((int32_t)v - target->y0) * target->stride + (uint32_t)((int32_t)u - target->x0);
		points->normal[i] = normals[PSR_ATTR_NORMAL(*attr)];
		v3f_set(points->place[i], u, v, z);
		__builtin_prefetch(points->normal[i]);
		points->n += z - most < before[points->at[i]];
	}
}

static void list_points(const struct plan *plan, const struct bin_entry *entry, const struct warp_target *target,
                        struct sheer_list *list)
{
	const struct warp_instance *in = &plan->warp[entry->instance];
	const float rim = splat_rim(&plan->instance[entry->instance], entry->slot - in->first_slot);
	struct points points;
	struct warp_block b;

	warp_block_make(&b, in, entry->slot);
	find_points(&points, &b, plan, target, list->before, (MOST_OFF + 1) * rim);
	for (uint32_t i = 0; i < points.n; i++) {
		const float *place = points.place[i], *n = points.normal[i];
		float d[3];

		for (int k = 0; entry->is_mixed && k < 3; k++)
			d[k] = (place[0] * in->du[k] + place[1] * in->dv[k]) + in->d0[k];
		if (entry->is_mixed && faces_away(-v3f_dot(n, d), d))
			continue;
		const float z = center_depth(plan, in, n, place, MOST_OFF * rim);
		if (z > plan->near_z && z - 0.5f * rim < list->before[points.at[i]])
			sheer_add(list, points.at[i], (uint64_t)psr_bits_from_float(z) << 32 | (b.id + points.sample[i]));
	}
}

void sheer_list_blocks(struct sheer_list *list, const struct simd *simd, const struct plan *plan,
                       const struct bin_entry *entry, uint32_t n, const struct warp_target *target)
{
	for (uint32_t e = 0; e < n && !plan_is_cancelled(plan); e++)
		if (entry[e].level || plan->with_splats)
			splat_list(simd, plan, &entry[e], target, list);
		else
			list_points(plan, &entry[e], target, list);
}
