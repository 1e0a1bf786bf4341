/* What all stages of a frame share. pipeline.c knows their order. */
#ifndef PSR_RENDER_RENDER_H
#define PSR_RENDER_RENDER_H

#include <stdint.h>
#include <time.h>
#include "psr/pool.h"
#include "psr/render.h"
#include "simd/simd.h"

static inline uint64_t now_ns(void)
{
	struct timespec t;
	clock_gettime(CLOCK_MONOTONIC, &t);
	return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

#define WEIGHT_ONE GAPS_WHOLE /* weights are 0..256 */
#define BRICK GAPS_BRICK      /* pixels a side; bricks are numbered by row, the border cuts some off */

/* Validates what psr_render and psr_warp take. ARG, LIMIT. */
int settings_validate(const struct psr_settings *settings, struct psr_error *err);

/* Reports that an effect ran, with its count, or why it did not. */
void effect_note(struct psr_report *report, enum psr_effect effect, enum psr_why why, uint64_t count);

/* For tests: replaces the kernels. */
void renderer_use(struct psr_renderer *renderer, const struct simd *simd);

#endif
