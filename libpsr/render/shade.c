#include <string.h>
#include "render/render.h"

/* Writes the colours of a strip into its row, and the background where no sample is. Pixels of weight 0 stay as they are. */
static void write_strip(const struct plan *plan, const struct strip *strip, const uint64_t *word, uint32_t n, uint16_t *rgb)
{
	for (uint32_t i = 0; i < strip->n; i++) {
		uint16_t *to = rgb + 3 * (size_t)strip->x[i];
		to[0] = strip->r[i];
		to[1] = strip->g[i];
		to[2] = strip->b[i];
	}
	if (strip->n < n)
		for (uint32_t x = 0; x < n; x++)
			if (word[x] == PSR_WORD_EMPTY)
				memcpy(rgb + 3 * (size_t)x, plan->background, sizeof plan->background);
}

void shade_row(const struct simd *simd, const struct plan *plan, struct strip *strip, const uint64_t *word, const uint16_t *weight,
               uint32_t y, uint16_t *rgb, struct shade_counts *counts)
{
	strip->y = y;
	for (uint32_t x = 0; x < plan->width; x += STRIP) {
		const uint32_t n = plan->width - x < STRIP ? plan->width - x : STRIP;
		strip->x0 = x;
		simd->strip_list(strip, word + x, weight + x, n);
		if (strip->n) {
			simd->strip_resolve(strip, &plan->view, plan->ambient);
			for (uint32_t l = 0; l < plan->n_lights; l++)
				simd->strip_light(strip, &plan->light[l], NULL);
			simd->strip_color(strip);
			counts->n_pixels += strip->n;
			counts->n_specular += strip_is_specular(strip) ? strip->n : 0;
		}
		write_strip(plan, strip, word + x, n, rgb + 3 * (size_t)x);
	}
}
