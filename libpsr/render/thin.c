#include "base/maths.h"
#include "simd/block.h"
#include "splat.h"
#include "thin.h"

/* The share of a sample's veil that it hangs before its pixel, if samples are a pixel apart; and before each pixel of
 * its disc, which is wider. An opacity counts all that is near a sample, and a part of that has samples of its own.
 * Measured: a pine tree and a tree in passes 0 to 4, at magnifications 0.25 to 1. */
#define POINT_SHARE 0.32f
#define DISC_SHARE 0.5f
/* Pixels between samples that are points. Those further apart are wider: discs in refinement, squares in pass 0, where
 * discs would take twenty times as long. Gaps of a pixel in a needle let the light through that the points beside them
 * keep back too much. */
#define MOST_APART 2
#define WIDE_LEVEL 2

uint32_t thin_end(const struct plan *plan, const struct bins *bins, uint32_t begin, uint32_t end)
{
	while (begin < end) {
		const struct bin_entry entry = bins->entry[begin];
		const struct plan_instance *in = &plan->instance[entry.instance];

		if (psr_blocks_traits(in->cull.blocks, entry.slot - in->first_slot) & PSR_BLOCK_THIN) {
			begin++;
			continue;
		}
		bins->entry[begin] = bins->entry[--end];
		bins->entry[end] = entry;
	}
	return end;
}

/* Returns how many times 1 is halved to give x, 0 < x <= 1, to 2^-20. */
static double halvings(double x)
{
	double n = 0;

	for (; x < 1; x *= 2)
		n++;
	for (double bit = 0.5; bit > 0x1p-21; bit /= 2) {
		x *= x;
		if (x >= 2) {
			x /= 2;
			n -= bit;
		}
	}
	return n;
}

static void tabulate(float bits[PSR_OPAQUE + 1], float share)
{
	for (int i = 0; i < PSR_OPAQUE; i++)
		bits[i] = 65536 * share * (float)halvings((double)(PSR_OPAQUE - i) / PSR_OPAQUE);
	bits[PSR_OPAQUE] = THIN_MOST_VEIL;
}

/* Returns the share of the light that comes through a veil. Taylor's series is 2e-5 off at most. */
static float through_veil(uint32_t veil)
{
	const float t = (float)(veil & 0xffff) * (1.0f / 65536) * 0.69314718f;
	const float part = 1 - t * (1 - t / 2 * (1 - t / 3 * (1 - t / 4 * (1 - t / 5 * (1 - t / 6)))));

	return part * psr_float_from_bits((127 - (veil >> 16)) << 23);
}

/* Returns the distance between a block's samples, in pixels, where they are nearest to the eye. */
static float pixels_apart(const struct sheer_drawing *d, const struct bin_entry *entry)
{
	const struct plan_instance *in = &d->plan->instance[entry->instance];
	const float step = splat_rim(in, entry->slot - in->first_slot) * d->plan->focal;

	return d->plan->perspective ? step / d->bins->hit[entry->hit].near : step;
}

/* The square of pixels that a block's samples stand for. */
struct spot {
	int32_t side;
	float area; /* the veil of each of its pixels, in those of a point or disc a pixel wide */
};

static void find_spot(struct spot *spot, const struct sheer_drawing *d, const struct bin_entry *entry)
{
	const float apart = pixels_apart(d, entry);
	const int32_t most = (1 << entry->level) + 2; /* blocks are binned for that reach */

	if (entry->level < WIDE_LEVEL) {
		*spot = (struct spot){ 1, apart < MOST_APART ? apart * apart : MOST_APART * MOST_APART };
		return;
	}
	const int32_t side = apart < (float)most ? (int32_t)(apart + 0.5f) : most;
	*spot = (struct spot){ side > 1 ? side : 1, 1 };
}

/* Hangs a veil before the pixels x .. x + side - 1 and y .. y + side - 1, as far as they are in the tile. */
static inline void add_spot(const struct thin_layer *layer, const struct warp_target *t, int32_t x, int32_t y,
                            int32_t side, uint64_t word, uint32_t veil)
{
	const int32_t x0 = x > t->x0 ? x : t->x0, x1 = x + side < t->x1 ? x + side : t->x1;
	const int32_t y0 = y > t->y0 ? y : t->y0, y1 = y + side < t->y1 ? y + side : t->y1;

	for (int32_t row = y0; row < y1; row++)
		for (int32_t column = x0; column < x1; column++)
			thin_add(layer, (uint32_t)(row - t->y0) * t->stride + (uint32_t)(column - t->x0), word, veil);
}

static void add_spots(const struct thin_layer *layer, const struct sheer_drawing *d, const struct bin_entry *entry,
                      const struct warp_target *target)
{
	const struct plan *plan = d->plan;
	const struct warp_instance *in = &plan->warp[entry->instance];
	struct warp_terms terms;
	struct warp_block b;
	struct spot spot;

	find_spot(&spot, d, entry);
	/* Of the square's corner from its sample, and of the tile's pixels from the corners that reach it. */
	const float half = 0.5f * (float)(spot.side - 1), area = spot.area, near_z = plan->near_z;
	const float x0 = (float)(target->x0 - spot.side + 1), x1 = (float)target->x1;
	const float y0 = (float)(target->y0 - spot.side + 1), y1 = (float)target->y1;
	const int perspective = plan->perspective;

	warp_block_make(&b, in, entry->slot);
	warp_terms_make(&terms, &b);
	const uint8_t *opacity = in->blocks->opacity + (b.attr - in->blocks->attr);
	for (uint64_t left = b.mask; left; left &= left - 1, b.depth++, opacity++) {
		const uint32_t sample = (uint32_t)__builtin_ctzll(left), r = sample >> 3, c = sample & 7;
		const float depth = (float)*b.depth, z = warp_axis(&terms, &b, 2, r, c, depth);
		const float inverse = perspective ? 1 / z : 1;
		const float x = warp_axis(&terms, &b, 0, r, c, depth) * inverse - half;
		const float y = warp_axis(&terms, &b, 1, r, c, depth) * inverse - half;

		if (!(z > near_z && x >= x0 && x < x1 && y >= y0 && y < y1))
			continue;
		const uint64_t word = (uint64_t)psr_bits_from_float(z) << 32 | (b.id + sample);
		const uint32_t veil = (uint32_t)(layer->bits[*opacity] * area);
		add_spot(layer, target, psr_floor_int(x), psr_floor_int(y), spot.side, word, veil);
	}
}

/* Lights the nearest samples. */
static void light_strip(struct sheer_tile *l, const struct sheer_drawing *d, const struct sheer_area *area, uint32_t x,
                        uint32_t y)
{
	const uint32_t n = area->width - x < STRIP ? area->width - x : STRIP;
	const size_t first = sheer_place(area, y) + x;

	l->pixels.x0 = area->x0 + x;
	l->pixels.y = y;
	const uint32_t n_found = shade_part(d->simd, d->plan, l->word + first, n, &l->pixels, &l->strip);
	for (uint32_t i = 0; i < n_found; i++) {
		const size_t at = first + l->pixels.x[i];
		const uint16_t color[3] = { l->strip.r[i], l->strip.g[i], l->strip.b[i] };
		const float through = through_veil(l->veil[at]);

		for (int c = 0; c < 3; c++)
			l->light[c][at] = (1 - through) * ((float)color[c] * (1.0f / 65535));
		l->through[at] = through;
		l->front[at] = l->word[at];
		l->first[at] = psr_float_from_bits((uint32_t)(l->word[at] >> 32));
	}
}

void thin_draw(struct sheer_tile *l, const struct sheer_drawing *d, const struct sheer_area *area,
               const struct warp_target *target, const struct sheer_entries *entries)
{
	const size_t first = sheer_place(area, area->low_y);
	float bits[2][PSR_OPAQUE + 1];
	struct thin_layer layer = { l->before + first, l->word + first, l->veil + first, NULL };

	tabulate(bits[0], POINT_SHARE);
	tabulate(bits[1], DISC_SHARE);
	for (uint32_t y = area->low_y; y < area->high_y; y++)
		for (size_t at = sheer_place(area, y), x = 0; x < area->width; at++, x++) {
			l->word[at] = PSR_WORD_EMPTY;
			l->veil[at] = 0;
		}
	for (uint32_t e = entries->begin; e < entries->end && !(e % 8 == 0 && plan_is_cancelled(d->plan)); e++) {
		const struct bin_entry *entry = &d->bins->entry[e];
		const int is_wide = entry->level >= WIDE_LEVEL;

		layer.bits = bits[is_wide];
		if (is_wide && d->plan->with_splats)
			splat_veil(d->plan, entry, target, &layer);
		else
			add_spots(&layer, d, entry, target);
	}
	for (uint32_t y = area->low_y; y < area->high_y; y++)
		for (uint32_t x = 0; x < area->width && !plan_is_cancelled(d->plan); x += STRIP)
			light_strip(l, d, area, x, y);
}
