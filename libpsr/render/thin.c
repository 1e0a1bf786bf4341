#include "base/maths.h"
#include "splat.h"
#include "thin.h"

/* The share of a sample's veil that it hangs before its pixel, if samples are a pixel apart; and before each pixel of
 * its disc or square, which is wider. An opacity counts all that is near a sample, and a part of that has samples of
 * its own. Measured: a pine tree and a tree in passes 0 to 4, at magnifications 0.25 to 1. */
#define POINT_SHARE 0.32f
#define WIDE_SHARE 0.5f
/* Pixels between samples that are points. Those further apart are wider: discs in refinement, squares in pass 0, where
 * discs would take twenty times as long. Gaps of a pixel in a needle let the light through that the points beside them
 * keep back too much. */
#define MOST_APART 2
#define WIDE_LEVEL 2

/* Blocks drawn between two questions whether the frame is to end, and the pixels of a sample of each. */
#define RUN 256
#define RUN_PIXELS 4096

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

void thin_tabulate(float bits[PSR_OPAQUE + 1])
{
	for (int i = 0; i < PSR_OPAQUE; i++)
		bits[i] = 65536 * (float)halvings((double)(PSR_OPAQUE - i) / PSR_OPAQUE);
	bits[PSR_OPAQUE] = 4 * VEIL_MOST; /* times the shares above, more than VEIL_MOST */
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

/* Finds the square of pixels that each sample of a block stands for. */
static void find_square(struct veil_entry *out, const struct sheer_drawing *d, const struct bin_entry *entry)
{
	const float apart = pixels_apart(d, entry);
	const int32_t most = (1 << entry->level) + 2; /* blocks are binned for that reach */

	*out = (struct veil_entry){ .slot = entry->slot, .instance = entry->instance, .side = 1, .area = WIDE_SHARE };
	if (entry->level < WIDE_LEVEL)
		out->area = POINT_SHARE * (apart < MOST_APART ? apart * apart : MOST_APART * MOST_APART);
	else if (apart > 1)
		out->side = (uint16_t)(apart < (float)most ? (int32_t)(apart + 0.5f) : most);
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
	sheer_show(l, area, y, x, n_found);
	for (uint32_t i = 0; i < n_found; i++) {
		const size_t at = first + l->pixels.x[i];
		const uint16_t color[3] = { l->strip.r[i], l->strip.g[i], l->strip.b[i] };
		const float through = through_veil(l->veil[at]);

		for (int c = 0; c < 3; c++)
			l->light[c][at] = (1 - through) * sheer_light(d->plan, color[c]);
		l->through[at] = through;
		l->front[at] = l->word[at];
		l->first[at] = psr_word_z(l->word[at]);
	}
}

static void hang_veils(const struct veil_layer *layer, const struct sheer_drawing *d, const struct warp_target *target,
                       const struct sheer_entries *entries)
{
	struct veil_entry run[RUN];
	uint32_t n = 0, n_pixels = 0;

	for (uint32_t e = entries->begin; e < entries->end && !(e % 8 == 0 && plan_is_cancelled(d->plan)); e++) {
		const struct bin_entry *entry = &d->bins->entry[e];

		if (entry->level >= WIDE_LEVEL && d->plan->with_splats) {
			splat_veil(d->simd, d->plan, entry, target, layer, WIDE_SHARE);
			continue;
		}
		find_square(&run[n], d, entry);
		n_pixels += (uint32_t)run[n].side * run[n].side;
		n++;
		if (n == RUN || n_pixels >= RUN_PIXELS) {
			d->simd->veil(target, layer, run, n);
			n = n_pixels = 0;
		}
	}
	d->simd->veil(target, layer, run, n);
}

void thin_draw(struct sheer_tile *l, const struct sheer_drawing *d, const struct sheer_area *area,
               const struct warp_target *target, const struct sheer_entries *entries)
{
	const size_t first = sheer_place(area, area->low_y);
	const struct veil_layer layer = { l->before + first, l->word + first, l->veil + first, d->sheer->bits };

	for (uint32_t y = area->low_y; y < area->high_y; y++)
		for (size_t at = sheer_place(area, y), x = 0; x < area->width; at++, x++) {
			l->word[at] = PSR_WORD_EMPTY;
			l->veil[at] = 0;
		}
	hang_veils(&layer, d, target, entries);
	for (uint32_t y = area->low_y; y < area->high_y; y++)
		for (uint32_t x = 0; x < area->width && !plan_is_cancelled(d->plan); x += STRIP)
			light_strip(l, d, area, x, y);
}
