#include "render/render.h"

/* Writes the colours of a strip into its row, and the background where no sample is. Pixels of weight 0 stay as they are. */
static void write_strip(const struct plan *plan, const struct strip *strip, const uint64_t *word, uint32_t n, size_t first,
                        uint16_t *const rgb[3])
{
	for (uint32_t i = 0; i < strip->n; i++) {
		const size_t at = first + strip->x[i];
		rgb[0][at] = strip->r[i];
		rgb[1][at] = strip->g[i];
		rgb[2][at] = strip->b[i];
	}
	if (strip->n < n)
		for (int k = 0; k < 3; k++)
			for (uint32_t x = 0; x < n; x++)
				if (word[x] == PSR_WORD_EMPTY)
					rgb[k][first + x] = plan->background[k];
}

void shade_row(const struct simd *simd, const struct plan *plan, struct strip *strip, const uint64_t *word, const uint16_t *weight,
               uint32_t y, uint16_t *const rgb[3], struct shade_counts *counts)
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
		write_strip(plan, strip, word + x, n, (size_t)y * plan->width + x, rgb);
	}
}
