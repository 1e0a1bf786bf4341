/* Discs of samples in a picture, for the splats of blocks and of leaves. */
#ifndef PSR_RENDER_SPLAT_DISC_H
#define PSR_RENDER_SPLAT_DISC_H

#include "base/maths.h"
#include "base/vec.h"
#include "sheer.h"
#include "splat.h"
#include "splat_cut.h"

/* Steps by which a disc's rim counts as further away, so that a pixel shows the disc whose centre is nearest to it.
 * Measured. */
#define RIM_DEPTH 1.0f
/* The level from which a block's discs cover so many pixels that each disc asks whether the frame is to end. */
#define LONG_DRAWN 4
/* Offcuts reach so many radii: a crack between two cut discs may be a little wider than what was cut off. Measured. */
#define OFFCUT_REACH 1.25f

struct splat_target {
	const struct plan *plan;
	uint64_t *word;
	uint32_t stride;
	int32_t x0, y0, x1, y1;
	struct sheer_list *list; /* takes the discs instead of words, or NULL */
	const struct veil_layer *veils; /* does, or NULL, */
	float area;                     /* with so many times an opacity's veil */
	const struct splat_offcuts *offcuts;
	unsigned cut_below; /* as of splat_into */
};

/* Where a picture's discs go. */
enum way { WORDS, LIST, VEILS };

/* An ellipse in the picture: centre, two conjugate radii, how depth rises along them and to the rim, and the greatest
 * reach in pixels. */
struct splat {
	float at[3], radius[2][3], rim, most;
	uint32_t id, veil;
	int is_cut;
	struct splat_cut cut;
};

static inline void lower(const struct splat_target *t, int32_t x, int32_t y, float z, uint32_t id)
{
	const uint64_t word = (uint64_t)psr_bits_from_float(z) << 32 | id;
	uint64_t *at = &t->word[(size_t)(y - t->y0) * t->stride + (size_t)(x - t->x0)];

	*at = word < *at ? word : *at;
}

/* NaN gives high. */
static inline int32_t within(float x, int32_t low, int32_t high)
{
	return x <= (float)low ? low : x < (float)high ? (int32_t)x : high;
}

/* Shrinks a disc that reaches further than blocks are binned for. */
static void limit_reach(struct splat *s)
{
	const float *a = s->radius[0], *b = s->radius[1];
	const float x = __builtin_fabsf(a[0]) + __builtin_fabsf(b[0]), y = __builtin_fabsf(a[1]) + __builtin_fabsf(b[1]);
	const float extent = x > y ? x : y;

	if (extent > s->most)
		for (int i = 0; i < 2; i++)
			v3f_scale(s->radius[i], s->radius[i], s->most / extent);
}

/* Lists a pixel of a disc unless an opaque surface is nearer than its plane by half of a rim's depth: a sheer surface
 * on an opaque one stays visible. */
static inline void list_place(const struct splat_target *t, const struct splat *s, int32_t x, int32_t y, float z,
                              float square)
{
	const uint32_t at = (uint32_t)(y - t->y0) * t->stride + (uint32_t)(x - t->x0);

	if (z - (square + 0.5f) * s->rim < t->list->before[at])
		sheer_add(t->list, at, (uint64_t)psr_bits_from_float(z) << 32 | s->id);
}

/* Draws a pixel of a cut disc, or marks one of its offcut. */
static inline void draw_cut(const struct splat_target *t, const struct splat *s, const int32_t at[2],
                            const float place[2], float z)
{
	const int32_t x = at[0], y = at[1];

	if (splat_is_cut_off(&s->cut, place))
		t->offcuts->bits[(size_t)y * t->offcuts->stride + (size_t)x / 8] |= (uint8_t)(1 << x % 8);
	else if (place[0] * place[0] + place[1] * place[1] <= 1)
		lower(t, x, y, z, s->id);
}

/* Draws the pixels whose centres are in the ellipse. It may miss the pixel of the disc's own centre: discs meet their
 * neighbours', and that pixel would widen every edge. */
static inline __attribute__((always_inline)) void draw_splat(const struct splat_target *t, const struct splat *s,
                                                             enum way way)
{
	const int is_cut = way == WORDS && s->is_cut;
	const float u = s->at[0], v = s->at[1], *a = s->radius[0], *b = s->radius[1], reach = is_cut ? OFFCUT_REACH : 1;
	const float extent_x = reach * (__builtin_fabsf(a[0]) + __builtin_fabsf(b[0])),
				extent_y = reach * (__builtin_fabsf(a[1]) + __builtin_fabsf(b[1]));
	const float area = a[0] * b[1] - a[1] * b[0];

	if (!(area < 0 || area > 0))
		return;
	const float p_x = b[1] / area, p_y = -b[0] / area, q_x = -a[1] / area, q_y = a[0] / area;
	const int32_t x0 = within(u - extent_x, t->x0, t->x1), x1 = within(u + extent_x + 1, t->x0, t->x1);
	const int32_t y0 = within(v - extent_y, t->y0, t->y1), y1 = within(v + extent_y + 1, t->y0, t->y1);
	for (int32_t y = y0; y < y1; y++)
		for (int32_t x = x0; x < x1; x++) {
			const float dx = (float)x + 0.5f - u, dy = (float)y + 0.5f - v;
			const float p = dx * p_x + dy * p_y, q = dx * q_x + dy * q_y, square = p * p + q * q;
			const float z = (s->at[2] + (p * a[2] + q * b[2])) + square * s->rim;

			if (!(square <= reach * reach && z > t->plan->near_z))
				continue;
			if (way == LIST)
				list_place(t, s, x, y, z, square);
			else if (way == VEILS)
				veil_add(t->veils, (uint32_t)(y - t->y0) * t->stride + (uint32_t)(x - t->x0),
				         (uint64_t)psr_bits_from_float(z) << 32 | s->id, s->veil);
			else if (is_cut)
				draw_cut(t, s, (const int32_t[2]){ x, y }, (const float[2]){ p, q }, z);
			else
				lower(t, x, y, z, s->id);
		}
}

/* Draws the discs of a cube's leaves (splat_cubes.c). */
void splat_cube(const struct splat_target *t, const struct bin_entry *entry);

#endif
