/* EWA splats: what they draw. ewa_words_by() and ewa_sums_by() know the order; variants bring parts of their own. */
#ifndef PSR_SIMD_LOOPS_EWA_H
#define PSR_SIMD_LOOPS_EWA_H

#include "simd/leaves_list.h"
#include "ewa_place.h"

/* ---- one splat: what is drawn of it ---- */

struct ewa_one {
	int32_t x, y, radius, core_radius;
	float z, zx, zy, least; /* z' in the middle of pixel (x, y), what a pixel to the right or down adds, the least */
	const uint8_t *weight;  /* of the first row, */
	int32_t next;           /* and how far the next row is */
	uint32_t core, id;
};

static inline void ewa_pick(struct ewa_one *one, const struct ewa_leaves *l, uint32_t i)
{
	const uint32_t size = (uint32_t)l->size[i], radius = ewa_size[size].radius, side = EWA_SIDE(radius);
	const uint32_t mask = (uint32_t)l->mask[i];

	one->x = l->x[i];
	one->y = l->y[i];
	one->radius = (int32_t)radius;
	one->core_radius = (int32_t)ewa_size[size].core_radius;
	one->z = l->z[i];
	one->zx = l->zx[i];
	one->zy = l->zy[i];
	one->least = l->least[i];
	one->weight = ewa_weight + ewa_size[size].first + mask * (side * side);
	one->next = (int32_t)side;
	if (l->is_flipped[i]) {
		one->weight += side * (side - 1);
		one->next = -one->next;
	}
	one->core = ewa_core[size * (EWA_SHAPES * EWA_SECTORS) + mask];
	one->id = l->id[i];
}

/* The part of a square around a pixel that is in the tile. */
struct ewa_part {
	int32_t x0, x1, y0, y1;
};

static inline int ewa_clip(struct ewa_part *part, const struct warp_target *t, int32_t x, int32_t y, int32_t radius)
{
	part->x0 = x - radius > t->x0 ? x - radius : t->x0;
	part->x1 = x + radius + 1 < t->x1 ? x + radius + 1 : t->x1;
	part->y0 = y - radius > t->y0 ? y - radius : t->y0;
	part->y1 = y + radius + 1 < t->y1 ? y + radius + 1 : t->y1;
	return part->x0 < part->x1 && part->y0 < part->y1;
}

/* Whether n columns from the tile's column `begin` on are in it: vectors draw masks where all that they touch are, and
 * pixel by pixel other ones. */
static inline int ewa_has_columns(const struct warp_target *t, int32_t begin, int32_t n)
{
	return begin >= 0 && begin + n <= t->x1 - t->x0;
}

/* The depth at an offset from the middle pixel. */
static inline float ewa_depth(const struct ewa_one *one, float dx, float dy)
{
	const float z = one->z + (dx * one->zx + dy * one->zy);

	return z > one->least ? z : one->least;
}

static inline void ewa_lower(uint64_t *at, float z, float near_z, uint32_t id)
{
	const uint64_t word = (uint64_t)psr_bits_from_float(z) << 32 | id;

	if (z > near_z && word < *at)
		*at = word;
}

/* Lowers the words of the pixels in a splat's core. */
typedef void ewa_draw_words_fn(const struct warp_target *t, const struct ewa_one *one, const struct ewa_part *part);
/* Adds a splat of this value to its pixels, but to those whose own word is nearer by more than is one surface. */
typedef void ewa_draw_sums_fn(const struct warp_target *t, const struct ewa_one *one, const struct ewa_part *part,
                              float same, const uint32_t value[EWA_LANES]);

static inline void ewa_draw_words(const struct warp_target *t, const struct ewa_one *one, const struct ewa_part *part)
{
	for (int32_t y = part->y0; y < part->y1; y++) {
		const int32_t dy = y - one->y;
		const uint8_t *weight = one->weight + (dy + one->radius) * one->next + one->radius - one->x;
		uint64_t *row = t->word + (size_t)(y - t->y0) * t->stride - t->x0;

		for (int32_t x = part->x0; x < part->x1; x++)
			if (weight[x] >= one->core)
				ewa_lower(&row[x], ewa_depth(one, (float)(x - one->x), (float)dy), t->near_z, one->id);
	}
}

/* Adds a leaf to a pixel unless the pixel's own is nearer by more than is one surface. */
static inline void ewa_add(struct ewa_sum *to, uint64_t word, float z, const uint32_t value[EWA_LANES], uint32_t weight)
{
	const int is_same = z <= psr_word_z(word);
	const uint32_t w = weight & (0u - (uint32_t)is_same);

	for (int k = 0; k < EWA_LANES; k++)
		to->lane[k] += w * value[k];
}

static inline void ewa_draw_sums(const struct warp_target *t, const struct ewa_one *one, const struct ewa_part *part,
                                 float same, const uint32_t value[EWA_LANES])
{
	uint32_t own[EWA_LANES];

	memcpy(own, value, sizeof own);
	for (int32_t y = part->y0; y < part->y1; y++) {
		const int32_t dy = y - one->y;
		const uint8_t *weight = one->weight + (dy + one->radius) * one->next + one->radius - one->x;
		const uint64_t *row = t->word + (size_t)(y - t->y0) * t->stride - t->x0;
		struct ewa_sum *sum = t->sum + (size_t)(y - t->y0) * t->sum_stride - t->x0;

		for (int32_t x = part->x0; x < part->x1; x++)
			ewa_add(&sum[x], row[x], ewa_depth(one, (float)(x - one->x), (float)dy) - same, own, weight[x]);
	}
}

/* ---- beyond the ten sizes ---- */

#define EWA_CORE_SQUARE 2.7725887f /* where a Gaussian has a quarter of its peak */

struct ewa_wide {
	float u, v, xx, xy, yy; /* q at an offset: xx dx^2 + xy dx dy + yy dy^2 */
	uint32_t peak;          /* of weights: those of narrow ones are lower as their pixels are not in them whole */
};

/* A pixel's mean of a Gaussian is much as its value in the middle of one that is wider by the box's own deviation, the
 * square root of 1 / 12, and as much lower. */
static inline void ewa_make_wide(struct ewa_wide *w, const struct ewa_leaves *l, uint32_t i, int32_t *radius)
{
	const float square = EWA_SIGMA * EWA_SIGMA, box = 1.0f / 12;
	const float xx = square * l->across[i], yy = square * l->down[i], xy = square * l->aslant[i];
	const float wide_x = xx + box, wide_y = yy + box, most = wide_x > wide_y ? wide_x : wide_y;
	const float exact = xx * yy - xy * xy, plain = psr_where(exact > 0, exact); /* edge-on it is less than roundings */
	const float area = plain + box * (xx + yy + box);
	const float reach = __builtin_sqrtf(EWA_MOST_SQUARE * most) + 1;

	w->u = l->u[i];
	w->v = l->v[i];
	w->xx = wide_y / area;
	w->yy = wide_x / area;
	w->xy = -2 * xy / area;
	w->peak = (uint32_t)(int32_t)(255 * __builtin_sqrtf(plain / area));
	*radius = (int32_t)(reach < PSR_MAX_SIDE ? reach : PSR_MAX_SIDE);
}

static inline float ewa_wide_square(const struct ewa_wide *w, int32_t x, int32_t y)
{
	const float dx = (float)x + 0.5f - w->u, dy = (float)y + 0.5f - w->v;

	return (w->xx * dx * dx + w->xy * dx * dy) + w->yy * dy * dy;
}

/* At least 1 in its reach: what is seen edge-on is there, too. */
static inline uint32_t ewa_wide_weight(const struct ewa_wide *w, float square)
{
	const uint32_t step = square > 0 ? (uint32_t)(int32_t)(square * EWA_STEPS) : 0;

	return (w->peak * ewa_bell[step] + 255) >> 8;
}

static inline void ewa_draw_wide(const struct warp_target *t, const struct ewa_leaves *l, uint32_t i, float same,
                                 const uint32_t value[EWA_LANES])
{
	struct ewa_one one = { .x = l->x[i], .y = l->y[i], .z = l->z[i], .zx = l->zx[i], .zy = l->zy[i],
		                   .least = l->least[i], .id = l->id[i] };
	struct ewa_wide wide;
	struct ewa_part part;

	ewa_make_wide(&wide, l, i, &one.radius);
	if (!ewa_clip(&part, t, one.x, one.y, one.radius))
		return;
	for (int32_t y = part.y0; y < part.y1; y++) {
		uint64_t *row = t->word + (size_t)(y - t->y0) * t->stride - t->x0;
		struct ewa_sum *sum = value != NULL ? t->sum + (size_t)(y - t->y0) * t->sum_stride - t->x0 : NULL;

		for (int32_t x = part.x0; x < part.x1; x++) {
			const float square = ewa_wide_square(&wide, x, y);
			const float z = ewa_depth(&one, (float)(x - one.x), (float)(y - one.y));

			if (!(square < EWA_MOST_SQUARE))
				continue;
			if (value != NULL)
				ewa_add(&sum[x], row[x], z - same, value, ewa_wide_weight(&wide, square));
			else if (square < EWA_CORE_SQUARE)
				ewa_lower(&row[x], z, t->near_z, one.id);
		}
	}
}

/* ---- kernels ---- */

/* Leaves of a batch by what is drawn of them: those with masks of more than a pixel; and of those of a single pixel
 * that pass, place in sums, weight and number. */
struct ewa_sorted {
	uint32_t n_masks, n_ones;
	uint32_t mask[EWA_ROOM], sum[EWA_ROOM], weight[EWA_ROOM], one[EWA_ROOM];
};

/* Sorts a batch: lists the words of leaves of a single pixel, or of more as it can, the other ones as masks, and
 * returns how many have their middle in the tile. There is room for a word of each leaf. */
typedef uint32_t ewa_sort_words_fn(struct words *words, struct ewa_sorted *sorted, const struct ewa_leaves *l,
                                   const struct warp_target *t);
/* Sorts a batch for sums. */
typedef void ewa_sort_sums_fn(struct ewa_sorted *sorted, const struct ewa_leaves *l, const struct warp_target *t);

static inline uint32_t ewa_sort_words(struct words *words, struct ewa_sorted *sorted, const struct ewa_leaves *l,
                                      const struct warp_target *t)
{
	uint32_t n_inside = 0, n_words = words->n, n_masks = 0;

	for (uint32_t i = 0; i < l->n; i++) {
		const uint32_t is_one = l->pixel[i] != UINT32_MAX;

		words->word[n_words] = (uint64_t)psr_bits_from_float(l->pixel_z[i]) << 32 | l->id[i];
		words->at[n_words] = l->pixel[i];
		n_inside += is_one | (uint32_t)l->has_mask[i] >> 1;
		n_words += is_one & (l->pixel_z[i] > t->near_z);
		sorted->mask[n_masks] = i;
		n_masks += (uint32_t)l->has_mask[i] & 1;
	}
	words->n = n_words;
	sorted->n_masks = n_masks;
	return n_inside;
}

static inline void ewa_sort_sums(struct ewa_sorted *sorted, const struct ewa_leaves *l, const struct warp_target *t)
{
	uint32_t n_ones = 0, n_masks = 0;

	for (uint32_t i = 0; i < l->n; i++) {
		const uint32_t is_one = l->pixel[i] != UINT32_MAX, pixel = is_one ? l->pixel[i] : 0;
		const float own = psr_float_from_bits((uint32_t)(t->word[pixel] >> 32));

		sorted->sum[n_ones] = (uint32_t)(l->y[i] - t->y0) * t->sum_stride + (uint32_t)(l->x[i] - t->x0);
		sorted->weight[n_ones] = ewa_weight[l->mask[i]];
		sorted->one[n_ones] = i;
		n_ones += is_one & (l->pixel_z[i] - l->same[i] <= own);
		sorted->mask[n_masks] = i;
		n_masks += (uint32_t)l->has_mask[i] & 1;
	}
	sorted->n_ones = n_ones;
	sorted->n_masks = n_masks;
}

struct ewa_parts {
	ewa_list_fn *list;
	ewa_sort_words_fn *sort_words;
	ewa_sort_sums_fn *sort_sums;
	ewa_put_normals_fn *put_normals;
	ewa_draw_words_fn *draw_words;
	ewa_draw_sums_fn *draw_sums;
};

/* The cubes of a run of entries on their way to a batch. */
struct ewa_reader {
	const struct warp_target *t;
	const struct bin_entry *entry;
	uint32_t n, at; /* entries, and the next one */
	struct warp_cube cubes[BLOCKS];
};

/* Fills a batch with the leaves of the next cubes, as many as there is room for. Returns 0 at the end. */
static inline __attribute__((always_inline)) int ewa_fill(struct ewa_leaves *l, struct ewa_reader *r, ewa_list_fn *list,
                                                          int with_looks)
{
	const struct warp_target *t = r->t;

	l->n = 0;
	for (; r->at < r->n; r->at++) {
		const uint32_t e = r->at;
		const struct warp_instance *in = &t->instance[r->entry[e].instance];
		const struct warp_cube *cube = &r->cubes[e % BLOCKS];

		if (e % BLOCKS == 0)
			next_cubes(r->cubes, t, r->entry, e, r->n);
		const uint32_t n = (uint32_t)__builtin_popcountll(cube->mask);
		if (l->n > 0 && (l->n + n > EWA_BATCH || in != l->in))
			return 1;
		l->in = in;
		list(l, t, &r->entry[e], cube);
		if (with_looks)
			ewa_put_colors(l, cube, n);
	}
	return l->n > 0;
}

static inline __attribute__((always_inline)) uint64_t ewa_words_by(struct ewa_parts parts, const struct warp_target *t,
                                                                   const struct bin_entry *entry, uint32_t n)
{
	struct ewa_reader reader = { .t = t, .entry = entry, .n = n };
	struct ewa_leaves l;
	struct ewa_sorted sorted;
	struct words words;
	struct ewa_one one;
	struct ewa_part part;
	uint64_t n_inside = 0;

	words.n = 0;
	while (ewa_fill(&l, &reader, parts.list, 0)) {
		ewa_place(&l, t);
		if (words.n > LIST - EWA_BATCH)
			lower_words(t->word, &words);
		n_inside += parts.sort_words(&words, &sorted, &l, t);
		for (uint32_t k = 0; k < sorted.n_masks; k++) {
			const uint32_t i = sorted.mask[k];

			if (l.size[i] == EWA_SIZES) {
				ewa_draw_wide(t, &l, i, 0, NULL);
				continue;
			}
			ewa_pick(&one, &l, i);
			if (ewa_clip(&part, t, one.x, one.y, one.core_radius))
				parts.draw_words(t, &one, &part);
		}
	}
	lower_words(t->word, &words);
	return n_inside;
}

static inline void ewa_add_one(const struct warp_target *t, const struct ewa_sorted *sorted, const struct ewa_leaves *l,
                               uint32_t i)
{
	uint32_t *to = t->sum[sorted->sum[i]].lane;
	const uint32_t *value = l->value[sorted->one[i]], w = sorted->weight[i];

	for (int k = 0; k < EWA_LANES; k++)
		to[k] += w * value[k];
}

/* Quarters take turns, as in warp_list.h: successive leaves often fall into one pixel. */
static inline void ewa_add_ones(const struct warp_target *t, const struct ewa_sorted *sorted,
                                const struct ewa_leaves *l)
{
	const uint32_t part = sorted->n_ones / 4;

	for (uint32_t i = 0; i < part; i++)
		for (uint32_t k = 0; k < 4; k++)
			ewa_add_one(t, sorted, l, i + k * part);
	for (uint32_t i = 4 * part; i < sorted->n_ones; i++)
		ewa_add_one(t, sorted, l, i);
}

static inline __attribute__((always_inline)) uint64_t ewa_sums_by(struct ewa_parts parts, const struct warp_target *t,
                                                                  const struct bin_entry *entry, uint32_t n)
{
	struct ewa_reader reader = { .t = t, .entry = entry, .n = n };
	struct ewa_leaves l;
	struct ewa_sorted sorted;
	struct ewa_one one;
	struct ewa_part part;
	uint64_t n_given = 0;

	while (ewa_fill(&l, &reader, parts.list, 1)) {
		ewa_place(&l, t);
		ewa_turn(&l);
		parts.put_normals(&l);
		parts.sort_sums(&sorted, &l, t);
		ewa_add_ones(t, &sorted, &l);
		n_given += l.n;
		for (uint32_t k = 0; k < sorted.n_masks; k++) {
			const uint32_t i = sorted.mask[k];

			if (l.size[i] == EWA_SIZES) {
				ewa_draw_wide(t, &l, i, l.same[i], l.value[i]);
				continue;
			}
			ewa_pick(&one, &l, i);
			if (ewa_clip(&part, t, one.x, one.y, one.radius))
				parts.draw_sums(t, &one, &part, l.same[i], l.value[i]);
		}
	}
	return n_given;
}

#endif
