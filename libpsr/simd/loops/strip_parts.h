/* Parts of the strip kernels that all variants share. */
#ifndef PSR_SIMD_STRIP_PARTS_H
#define PSR_SIMD_STRIP_PARTS_H

#include <string.h>
#include "base/srgb.h"
#include "simd/strip.h"

/* For functions whose callers pass constant flags: each case becomes a loop of its own. */
#define CONSTANT_FLAGS inline __attribute__((always_inline))

static inline uint32_t strip_whole(uint32_t n)
{
	return (n + STRIP_PADDING - 1) / STRIP_PADDING * STRIP_PADDING;
}

static inline void repeat_last(struct strip_pixels *p)
{
	for (uint32_t i = p->n; i < strip_whole(p->n); i++) {
		p->x[i] = p->x[p->n - 1];
		p->id[i] = p->id[p->n - 1];
		p->at[i] = p->at[p->n - 1];
		if (p->at[i] == NULL) {
			p->tree[i] = p->tree[p->n - 1];
			p->leaf[i] = p->leaf[p->n - 1];
		}
		p->two_sided[i] = p->two_sided[p->n - 1];
		if (p->has_cones)
			p->cone[i] = p->cone[p->n - 1];
	}
}

/* Surface normals are shading's, where any are asked for. */
static inline void strip_copy_normals(struct strip *strip, const struct strip_view *view, uint32_t first, uint32_t end)
{
	if (!(view->needs & (STRIP_POSITION | STRIP_TWO_SIDED)))
		return;
	memcpy(strip->gx + first, strip->nx + first, (end - first) * sizeof *strip->nx);
	memcpy(strip->gy + first, strip->ny + first, (end - first) * sizeof *strip->ny);
	memcpy(strip->gz + first, strip->nz + first, (end - first) * sizeof *strip->nz);
}

/* *all and *common: all attributes or-ed, and and-ed. */
static CONSTANT_FLAGS void read_all(uint64_t *all, uint64_t *common, struct strip *strip, const struct strip_view *view,
                                    int has_leaves, int has_normals)
{
	const struct strip_pixels *p = strip->pixels;
	const uint32_t n = strip_whole(p->n);
	uint64_t some = 0, each = ~UINT64_C(0);

	for (uint32_t i = 0; i < n; i++) {
		const uint64_t attr = has_leaves && p->at[i] == NULL ? psr_cubes_attr(p->tree[i], p->leaf[i]) : *p->at[i];

		strip->attr[i] = attr;
		if (has_normals)
			strip->normal_word[i] = view->direction_word[PSR_ATTR_NORMAL(attr)];
		some |= attr;
		each &= attr;
	}
	*all = some;
	*common = each;
}

static inline void read_attributes(uint64_t *all, uint64_t *common, struct strip *strip, const struct strip_view *view)
{
	if (strip->pixels->has_leaves)
		read_all(all, common, strip, view, 1, 1);
	else if (!strip->pixels->only_points)
		read_all(all, common, strip, view, 0, 1);
	else
		read_all(all, common, strip, view, 0, 0);
	strip->n = strip_whole(strip->pixels->n);
	strip->is_specular = PSR_ATTR_GLOSS(*all) || view->needs & STRIP_SPECULAR;
}

/* is_one: the whole strip has one colour, a frequent case. */
static CONSTANT_FLAGS void read_base(struct strip *strip, int is_one)
{
	const uint64_t first = strip->attr[0];

	for (uint32_t i = 0; i < strip->n; i++) {
		const uint32_t base = PSR_ATTR_BASE(is_one ? first : strip->attr[i]);

		strip->dr[i] = psr_srgb_to_linear[base & 0xff];
		strip->dg[i] = psr_srgb_to_linear[base >> 8 & 0xff];
		strip->db[i] = psr_srgb_to_linear[base >> 16];
	}
}

static inline const struct warp_instance *instance_of(const struct strip_view *view, uint32_t slot)
{
	uint32_t low = 0, high = view->n_instances;

	while (high - low > 1) {
		const uint32_t middle = (low + high) / 2;

		if (view->instance[middle].first_slot <= slot)
			low = middle;
		else
			high = middle;
	}
	return &view->instance[low];
}

/* Returns the instance of sample `first`; *end: the end of the run of samples of that instance, at most n. */
static inline const struct warp_instance *instance_run(uint32_t *end, const struct strip_pixels *p,
                                                       const struct strip_view *view, uint32_t first, uint32_t n)
{
	const struct warp_instance *in = instance_of(view, p->id[first] / PSR_BLOCK_SAMPLES);
	uint32_t i = view->n_instances > 1 ? first + 1 : n;

	while (i < n && p->id[i] / PSR_BLOCK_SAMPLES - in->first_slot < in->blocks->n_blocks)
		i++;
	*end = i;
	return in;
}

static inline void turn_normals(struct strip *strip, const float m[3][3], uint32_t first, uint32_t end)
{
	for (uint32_t i = first; i < end; i++) {
		const uint64_t word = strip->normal_word[i];
		const float x = (float)(int16_t)word, y = (float)(int16_t)(word >> 16), z = (float)(int16_t)(word >> 32);

		strip->nx[i] = ((m[0][0] * x + m[0][1] * y) + m[0][2] * z) * (1 / 32767.0f);
		strip->ny[i] = ((m[1][0] * x + m[1][1] * y) + m[1][2] * z) * (1 / 32767.0f);
		strip->nz[i] = ((m[2][0] * x + m[2][1] * y) + m[2][2] * z) * (1 / 32767.0f);
	}
}

static inline uint32_t pixel_of(const uint8_t *srgb, uint16_t r, uint16_t g, uint16_t b)
{
	return (uint32_t)srgb[r] | (uint32_t)srgb[g] << 8 | (uint32_t)srgb[b] << 16;
}

#endif
