#include "base/maths.h"
#include "psr/render.h"
#include "simd/block.h"
#include "simd/kernels.h"

/* Bounds u to an int outside of every picture; NaN becomes such an int, too. */
static inline float clamp_pixel(float u)
{
	const float far = 2.0f * PSR_MAX_SIDE;

	u = u > -far ? u : -far;
	return u < far ? u : far;
}

static inline int faces_away(const struct warp_instance *in, uint32_t normal, float u, float v)
{
	float n[3], d[3];

	for (int k = 0; k < 3; k++) {
		n[k] = (float)((int32_t)(normal << (22 - 10 * k)) >> 22);
		d[k] = (u * in->du[k] + v * in->dv[k]) + in->d0[k];
	}
	const float g = (n[0] * d[0] + n[1] * d[1]) + n[2] * d[2];
	const float length2 = (d[0] * d[0] + d[1] * d[1]) + d[2] * d[2];
	return g > 0 && g * g > (BACK_SINE * BACK_SINE * 511 * 511) * length2;
}

static inline int inside(int32_t u, int32_t v, int32_t x0, int32_t y0, int32_t x1, int32_t y1)
{
	return u >= x0 && u < x1 && v >= y0 && v < y1;
}

static uint64_t warp_one(const struct warp_target *t, const struct bin_entry *entry)
{
	const struct warp_instance *in = &t->instance[entry->instance];
	const struct warp_cells *cells = entry->level ? &t->cells[entry->level] : NULL;
	struct warp_block b;
	struct warp_terms terms;
	uint64_t n_inside = 0;

	warp_block_make(&b, in, entry->slot);
	warp_terms_make(&terms, &b);
	for (uint64_t left = b.mask; left; left &= left - 1, b.depth++, b.attr++) {
		const uint32_t sample = (uint32_t)__builtin_ctzll(left), r = sample >> 3, c = sample & 7;
		const float depth = (float)*b.depth;
		const float x1 = warp_axis(&terms, &b, 0, r, c, depth), y1 = warp_axis(&terms, &b, 1, r, c, depth);
		const float z1 = warp_axis(&terms, &b, 2, r, c, depth);
		const float inverse = t->perspective ? 1.0f / z1 : 1.0f;
		const float u = clamp_pixel(x1 * inverse), v = clamp_pixel(y1 * inverse);
		const int32_t pixel_u = psr_floor_int(u), pixel_v = psr_floor_int(v);

		if (!(z1 > t->near_z) || (entry->is_mixed && faces_away(in, t->direction[PSR_ATTR_NORMAL(*b.attr)], u, v)))
			continue;
		if (inside(pixel_u, pixel_v, t->x0, t->y0, t->x1, t->y1)) {
			const uint64_t word = (uint64_t)psr_bits_from_float(z1) << 32 | (b.id + sample);
			uint64_t *at = &t->word[(size_t)(pixel_v - t->y0) * t->stride + (size_t)(pixel_u - t->x0)];

			*at = word < *at ? word : *at;
			n_inside++;
		}
		if (cells && inside(pixel_u, pixel_v, cells->x0, cells->y0, cells->x1, cells->y1)) {
			const size_t cx = (size_t)((pixel_u >> entry->level) + 1), cy = (size_t)((pixel_v >> entry->level) + 1);
			float *at = &cells->z[cy * cells->stride + cx];

			*at = z1 < *at ? z1 : *at;
		}
	}
	return n_inside;
}

uint64_t warp_c(const struct warp_target *target, const struct bin_entry *entry, uint32_t n)
{
	uint64_t n_inside = 0;

	for (uint32_t e = 0; e < n; e++)
		n_inside += warp_one(target, &entry[e]);
	return n_inside;
}
