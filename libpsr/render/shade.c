#include <time.h>
#include "render/render.h"

#define TIMED_EVERY 16 /* strips: clocks cost, too */

static uint64_t now_ns(void)
{
	struct timespec t;
	clock_gettime(CLOCK_MONOTONIC, &t);
	return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

/* Whether any of the bricks of a part of row y is wanted in linear light. Pixels of weight 0 are filled later, whatever they
 * get here. */
static int is_wanted(const struct plan *plan, const uint8_t *wants, uint32_t x, uint32_t y, uint32_t n)
{
	const uint8_t *row = wants + (size_t)(y / BRICK) * ((plan->width + BRICK - 1) / BRICK);
	for (uint32_t b = x / BRICK; b <= (x + n - 1) / BRICK; b++)
		if (row[b])
			return 1;
	return 0;
}

void shade_row(const struct simd *simd, const struct plan *plan, const struct shade_target *target, const uint64_t *word,
               const uint16_t *weight, uint32_t y, struct shade_counts *counts)
{
	struct strip_target part = { plan->width, target->rgb, target->srgb, NULL, NULL, NULL,
		                         { plan->background[0], plan->background[1], plan->background[2] } };
	struct strip strip;
	strip.y = y;
	for (uint32_t x = 0; x < plan->width; x += STRIP) {
		const uint32_t n = plan->width - x < STRIP ? plan->width - x : STRIP;
		const int keeps_linear = target->wants && is_wanted(plan, target->wants, x, y, n);
		strip.x0 = x;
		simd->strip_list(&strip, word + x, weight + x, n);
		const int is_timed = (x / STRIP + y) % TIMED_EVERY == 0;
		uint64_t start = is_timed ? now_ns() : 0, middle = start;
		if (strip.n) {
			simd->strip_resolve(&strip, &plan->view, plan->ambient);
			middle = is_timed ? now_ns() : 0;
			for (uint32_t l = 0; l < plan->n_lights; l++)
				simd->strip_light(&strip, &plan->light[l], NULL);
			simd->strip_color(&strip);
			counts->n_pixels += strip.n;
			counts->n_specular += strip_is_specular(&strip) ? strip.n : 0;
		}
		part.r = keeps_linear ? target->r : NULL;
		part.g = keeps_linear ? target->g : NULL;
		part.b = keeps_linear ? target->b : NULL;
		simd->strip_write(&strip, &part, n);
		if (is_timed) {
			counts->resolve_ns += middle - start;
			counts->shade_ns += now_ns() - middle;
		}
	}
}
