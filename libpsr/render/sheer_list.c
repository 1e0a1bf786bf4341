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
	const uint32_t capacity = list->capacity < UINT32_MAX / 2 ? 2 * list->capacity + 65536 : 0;
	struct sheer_word *grown = capacity ? realloc(list->word, capacity * sizeof *grown) : NULL;

	list->failed |= grown == NULL;
	if (grown == NULL)
		return PSR_ERR_MEMORY;
	list->word = grown;
	list->capacity = capacity;
	return PSR_OK;
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

static void list_points(const struct plan *plan, const struct bin_entry *entry, const struct warp_target *target,
                        struct sheer_list *list)
{
	const struct warp_instance *in = &plan->warp[entry->instance];
	const float (*normals)[3] = psr_direction_table();
	const float rim = splat_rim(&plan->instance[entry->instance], entry->slot - in->first_slot);
	struct warp_terms terms;
	struct warp_block b;

	warp_block_make(&b, in, entry->slot);
	warp_terms_make(&terms, &b);
	for (uint64_t left = b.mask; left; left &= left - 1, b.depth++, b.attr++) {
		const uint32_t sample = (uint32_t)__builtin_ctzll(left), r = sample >> 3, c = sample & 7;
		const float *n = normals[PSR_ATTR_NORMAL(*b.attr)], depth = (float)*b.depth;
		const float z = warp_axis(&terms, &b, 2, r, c, depth), inverse = plan->perspective ? 1 / z : 1;
		const float u = warp_axis(&terms, &b, 0, r, c, depth) * inverse;
		const float v = warp_axis(&terms, &b, 1, r, c, depth) * inverse;
		float d[3];

		if (!(z > plan->near_z && u >= (float)target->x0 && u < (float)target->x1 && v >= (float)target->y0
		      && v < (float)target->y1))
			continue;
		for (int k = 0; k < 3; k++)
			d[k] = (u * in->du[k] + v * in->dv[k]) + in->d0[k];
		if (entry->is_mixed && faces_away(-v3f_dot(n, d), d))
			continue;
		const float center_z = center_depth(plan, in, n, (const float[3]){ u, v, z }, MOST_OFF * rim);
		const uint32_t at = (uint32_t)((int32_t)v - target->y0) * target->stride + (uint32_t)((int32_t)u - target->x0);
		if (center_z > plan->near_z && center_z - 0.5f * rim < list->before[at])
			sheer_add(list, at, (uint64_t)psr_bits_from_float(center_z) << 32 | (b.id + sample));
	}
}

void sheer_list_blocks(struct sheer_list *list, const struct plan *plan, const struct bin_entry *entry, uint32_t n,
                       const struct warp_target *target)
{
	for (uint32_t e = 0; e < n; e++)
		if (entry[e].level || plan->with_splats)
			splat_list(plan, &entry[e], target, list);
		else
			list_points(plan, &entry[e], target, list);
}
