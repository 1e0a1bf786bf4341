#include <string.h>
#include "render/render.h"

static inline uint32_t pixel_of(const uint8_t *srgb, uint16_t r, uint16_t g, uint16_t b)
{
	return (uint32_t)srgb[r] | (uint32_t)srgb[g] << 8 | (uint32_t)srgb[b] << 16;
}

/* Three bytes a pixel, from the lowest of each; four are written where another pixel follows. */
static void write_pixels(uint8_t *to, const uint32_t *pixel, uint32_t n)
{
	for (uint32_t i = 0; i + 1 < n; i++)
		memcpy(to + 3 * (size_t)i, &pixel[i], 4);
	memcpy(to + 3 * (size_t)(n - 1), &pixel[n - 1], 3);
}

/* Pixels without a sample get the background, those of weight 0 too: they are filled later. */
static void write_strip(const struct plan *plan, const struct shade_target *target, const struct strip *strip, uint32_t n)
{
	const size_t first = (size_t)strip->y * plan->width + strip->x0;
	const uint16_t *background = plan->background;
	uint32_t pixel[STRIP];
	if (target->rgb) {
		const uint32_t empty = pixel_of(target->srgb, background[0], background[1], background[2]);
		for (uint32_t x = 0; x < n; x++)
			pixel[x] = empty;
		for (uint32_t i = 0; i < strip->n; i++)
			pixel[strip->x[i]] = pixel_of(target->srgb, strip->r[i], strip->g[i], strip->b[i]);
		write_pixels(target->rgb + 3 * first, pixel, n);
	}
	int is_wanted = 0;
	for (uint32_t b = strip->x0 / BRICK; target->wants && b <= (strip->x0 + n - 1) / BRICK; b++)
		is_wanted |= target->wants[(size_t)(strip->y / BRICK) * ((plan->width + BRICK - 1) / BRICK) + b];
	if (!is_wanted)
		return;
	for (uint32_t x = 0; x < n; x++) {
		target->r[first + x] = background[0];
		target->g[first + x] = background[1];
		target->b[first + x] = background[2];
	}
	for (uint32_t i = 0; i < strip->n; i++) {
		const size_t at = first + strip->x[i];
		target->r[at] = strip->r[i];
		target->g[at] = strip->g[i];
		target->b[at] = strip->b[i];
	}
}

void shade_row(const struct simd *simd, const struct plan *plan, const struct shade_target *target, const uint64_t *word,
               const uint16_t *weight, uint32_t y, struct shade_counts *counts)
{
	struct strip strip;
	strip.y = y;
	for (uint32_t x = 0; x < plan->width; x += STRIP) {
		const uint32_t n = plan->width - x < STRIP ? plan->width - x : STRIP;
		strip.x0 = x;
		simd->strip_list(&strip, word + x, weight + x, n);
		if (strip.n) {
			simd->strip_resolve(&strip, &plan->view, plan->ambient);
			for (uint32_t l = 0; l < plan->n_lights; l++)
				simd->strip_light(&strip, &plan->light[l], NULL);
			simd->strip_color(&strip);
			counts->n_pixels += strip.n;
			counts->n_specular += strip_is_specular(&strip) ? strip.n : 0;
		}
		write_strip(plan, target, &strip, n);
	}
}
