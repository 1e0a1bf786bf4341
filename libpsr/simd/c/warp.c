#include "base/maths.h"
#include "psr/render.h"
#include "simd/block.h"
#include "simd/cube.h"
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

	warp_normal(n, normal);
	for (int k = 0; k < 3; k++)
		d[k] = (u * in->du[k] + v * in->dv[k]) + in->d0[k];
	const float g = (n[0] * d[0] + n[1] * d[1]) + n[2] * d[2];
	const float length2 = (d[0] * d[0] + d[1] * d[1]) + d[2] * d[2];
	return g > 0 && g * g > (BACK_SINE * BACK_SINE * 511 * 511) * length2;
}

static inline int inside(int32_t u, int32_t v, int32_t x0, int32_t y0, int32_t x1, int32_t y1)
{
	return u >= x0 && u < x1 && v >= y0 && v < y1;
}

/* A sample that is warped: x', y' and z', and where that is in the picture. */
struct place {
	float x, y, z, u, v;
	int32_t pixel_u, pixel_v;
};

static inline void find_pixel(struct place *p, const struct warp_target *t)
{
	const float inverse = t->perspective ? 1.0f / p->z : 1.0f;

	p->u = clamp_pixel(p->x * inverse);
	p->v = clamp_pixel(p->y * inverse);
	p->pixel_u = psr_floor_int(p->u);
	p->pixel_v = psr_floor_int(p->v);
}

/* Where in its pixel a sample is that lies in the picture. */
static inline uint32_t quarters(const struct place *p)
{
	const float right = p->u - (float)p->pixel_u, down = p->v - (float)p->pixel_v;

	return (uint32_t)(int32_t)(right * 4) | (uint32_t)(int32_t)(down * 4) << 2;
}

/* Returns whether it is in the tile. */
static inline int lower(const struct warp_target *t, unsigned level, const struct place *p, uint32_t id)
{
	const struct warp_cells *cells = &t->cells[level];

	if (level && inside(p->pixel_u, p->pixel_v, cells->x0, cells->y0, cells->x1, cells->y1)) {
		const size_t cx = (size_t)((p->pixel_u >> level) + 1), cy = (size_t)((p->pixel_v >> level) + 1);
		float *at = &cells->z[cy * cells->stride + cx];

		*at = p->z < *at ? p->z : *at;
	}
	if (!inside(p->pixel_u, p->pixel_v, t->x0, t->y0, t->x1, t->y1))
		return 0;
	const uint32_t low = t->place_bits ? id << t->place_bits | quarters(p) : id;
	const uint64_t word = (uint64_t)psr_bits_from_float(p->z) << 32 | low;
	uint64_t *at = &t->word[(size_t)(p->pixel_v - t->y0) * t->stride + (size_t)(p->pixel_u - t->x0)];
	*at = word < *at ? word : *at;
	return 1;
}

static uint64_t warp_one(const struct warp_target *t, const struct bin_entry *entry)
{
	const struct warp_instance *in = &t->instance[entry->instance];
	struct warp_block b;
	struct warp_terms terms;
	uint64_t n_inside = 0;

	warp_block_make(&b, in, entry->slot);
	warp_terms_make(&terms, &b);
	for (uint64_t left = b.mask; left; left &= left - 1, b.depth++, b.attr++) {
		const uint32_t sample = (uint32_t)__builtin_ctzll(left), r = sample >> 3, c = sample & 7;
		const float depth = (float)*b.depth;
		struct place p = { .x = warp_axis(&terms, &b, 0, r, c, depth), .y = warp_axis(&terms, &b, 1, r, c, depth),
			               .z = warp_axis(&terms, &b, 2, r, c, depth) };

		find_pixel(&p, t);
		if (!(p.z > t->near_z)
		    || (entry->is_mixed && faces_away(in, t->direction[PSR_ATTR_NORMAL(*b.attr)], p.u, p.v)))
			continue;
		n_inside += (uint64_t)lower(t, entry->level, &p, b.id + sample);
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

static uint64_t warp_cube(const struct warp_target *t, const struct bin_entry *entry, uint32_t slot)
{
	const struct warp_instance *in = &t->instance[entry->instance];
	struct warp_cube cube;
	uint64_t n_inside = 0;
	uint32_t k = 0;

	warp_cube_make(&cube, in, slot);
	const int with_offsets = entry->is_wide && cube.offset != NULL;
	const struct warp_octants *octants = cube.octants;
	for (uint64_t left = cube.mask; left; left &= left - 1, k++) {
		const uint32_t lane = (uint32_t)__builtin_ctzll(left);
		float at[3];

		for (int a = 0; a < 3; a++)
			at[a] = (float)(cube.origin[a] + octants->row[a][lane >> 3]) + octants->col[a][lane & 7];
		if (with_offsets) {
			float n[3];

			warp_normal(n, t->direction[cube.normal[k]]);
			for (int a = 0; a < 3; a++)
				at[a] += warp_offset(octants, a, n, (float)(2 * cube.offset[k] - WARP_OFFSET_MIDDLE));
		}
		struct place p = { .x = at[0], .y = at[1], .z = at[2] };
		find_pixel(&p, t);
		if (!(p.z > t->near_z)
		    || (entry->is_mixed && faces_away(in, t->direction[cube.normal[k]], p.u, p.v)))
			continue;
		n_inside += (uint64_t)lower(t, entry->level, &p, cube.id + lane);
	}
	return n_inside;
}

uint64_t warp_leaves_c(const struct warp_target *target, const struct bin_entry *entry, uint32_t n)
{
	uint64_t n_inside = 0;

	for (uint32_t e = 0; e < n; e++)
		for (uint64_t left = target->cubes != NULL ? target->cubes[entry[e].hit] : 1; left; left &= left - 1)
			n_inside += warp_cube(target, &entry[e], entry[e].slot + (uint32_t)__builtin_ctzll(left));
	return n_inside;
}
