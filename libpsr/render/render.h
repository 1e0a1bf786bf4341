/* What all stages of a frame share. pipeline.c knows their order. */
#ifndef PSR_RENDER_RENDER_H
#define PSR_RENDER_RENDER_H

#include <stdint.h>
#include "base/pool.h"
#include "simd/simd.h"
#include "stages.h"

#define WEIGHT_ONE GAPS_WHOLE /* weights are 0..256 */
#define BRICK GAPS_BRICK      /* pixels a side; bricks are numbered by row, the border cuts some off */

/* ARG, LIMIT. */
int settings_validate(const struct render_settings *settings, struct psr_error *err);

/* Fails with CANCELLED. */
int render_cancelled(struct psr_error *err);

/* Reports that an effect ran, with its count, or why it did not. */
void effect_note(struct psr_report *report, enum psr_effect effect, enum psr_why why, uint64_t count);

/* Counts the instances of a scene by what they are drawn as. */
void representations_note(struct psr_report *report, const struct psr_scene *scene);
/* Adds the report of a window of a refined picture, whose side has 2^pass times as many pixels. */
void frame_report_add(struct psr_report *sum, const struct psr_report *one, unsigned pass);

/* For tests: replaces the kernels. */
void renderer_use(struct psr_renderer *renderer, const struct simd *simd);

#endif
