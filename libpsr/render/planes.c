#include "planes.h"

#include <string.h>
#include "cull.h"

#define FILLED UINT16_MAX /* marks pixels until planes_bound_filled() */

static void put_words(const struct simd *simd, const struct plan *plan, uint64_t *to, const uint64_t *word, uint32_t n)
{
	float z[STRIP];

	simd->depth_row(z, word, n, plan->exponent);
	for (uint32_t x = 0; x < n; x++) {
		uint32_t bits;

		memcpy(&bits, &z[x], sizeof bits);
		const uint32_t low = (uint32_t)word[x];

		to[x] = (uint64_t)bits << 32 | (word[x] == PSR_WORD_EMPTY ? low : low >> plan->place_bits);
	}
}

static void put_weights(uint8_t *to, const uint16_t *weight, uint32_t n)
{
	for (uint32_t x = 0; x < n; x++)
		to[x] = (uint8_t)((weight[x] * 255u + WEIGHT_ONE / 2) / WEIGHT_ONE);
}

/* Quantises a component of a unit vector, up to rounding. */
static int16_t to_steps(float n)
{
	const float scaled = n * 32767, clamped = scaled < -32767 ? -32767 : scaled > 32767 ? 32767 : scaled;

	return (int16_t)(clamped + (clamped < 0 ? -0.5f : 0.5f));
}

static void put_normals(const struct simd *simd, const struct plan *plan, int16_t *to, struct strip_pixels *pixels)
{
	struct strip_view view = plan->view;
	struct strip strip;

	view.lit = NULL; /* with a table of light, strip_resolve skips normals */
	strip.pixels = pixels;
	simd->strip_find(pixels, &view);
	simd->strip_read(&strip, &view);
	strip.is_specular = 0; /* normals alone are wanted */
	simd->strip_resolve(&strip, &view, plan->ambient);
	for (uint32_t i = 0; i < pixels->n; i++)
		for (int a = 0; a < 3; a++) {
			const float right = (float)plan->axes[0][a], down = (float)plan->axes[1][a],
						forward = (float)plan->axes[2][a];
			const float world = (right * strip.nx[i] + down * strip.ny[i]) + forward * strip.nz[i];

			to[3 * pixels->x[i] + a] = to_steps(world);
		}
}

static void put_instances(const struct plan *plan, uint32_t *to, const struct strip_pixels *pixels)
{
	for (uint32_t i = 0; i < pixels->n; i++)
		to[pixels->x[i]] = plan_find_instance(plan, pixels->id[i] / PSR_BLOCK_SAMPLES);
}

/* Runs the cull again for one block, so that frames without this plane keep nothing for it. */
static void describe(uint8_t to[3], const struct simd *simd, const struct plan *plan, uint32_t slot)
{
	const struct plan_instance *in = &plan->instance[plan_find_instance(plan, slot)];
	const struct psr_blocks *b = in->cull.blocks;
	const uint32_t block = slot - in->first_slot;
	struct cull_batch batch;

	simd->cull(&batch, &in->cull, block, 1);
	to[0] = in->cull.cubes != NULL ? (uint8_t)(psr_cubes_level(in->cull.cubes, block) - in->cull.cubes->level)
	                               : (uint8_t)psr_blocks_level(b, block);
	to[1] = batch.level[0] > PSR_MAX_DEPTH_LEVEL ? PSR_MAX_DEPTH_LEVEL : batch.level[0];
	to[2] = b->flags[block] & PSR_BLOCK_TWO_SIDED ? PSR_FACING_TWO_SIDED
	        : batch.is_mixed[0] ? PSR_FACING_MIXED : PSR_FACING_EYE;
}

static void put_blocks(const struct simd *simd, const struct plan *plan, uint8_t *to, const struct strip_pixels *pixels)
{
	uint8_t last[3] = { 0, 0, 0 };

	for (uint32_t i = 0; i < pixels->n; i++) {
		const uint32_t slot = pixels->id[i] / PSR_BLOCK_SAMPLES;

		if (i == 0 || slot != pixels->id[i - 1] / PSR_BLOCK_SAMPLES)
			describe(last, simd, plan, slot);
		memcpy(to + 3 * pixels->x[i], last, 3);
	}
}

/* Rounds up. */
static uint16_t to_bound(float pixels)
{
	const float steps = pixels * PSR_BOUND_ONE;

	if (!(steps < FILLED))
		return FILLED;
	const uint16_t whole = (uint16_t)steps;
	return (uint16_t)(whole + ((float)whole < steps));
}

static uint16_t bound_of(const struct simd *simd, const struct plan *plan, uint32_t slot)
{
	const struct plan_instance *in = &plan->instance[plan_find_instance(plan, slot)];
	const uint32_t block = slot - in->first_slot;
	struct cull_batch batch;

	simd->cull(&batch, &in->cull, block, 1);
	return to_bound(cull_place_error(plan, in, psr_blocks_traits(in->cull.blocks, block), batch.apart[0],
	                                 batch.depth_error[0]));
}

static void put_bounds(const struct simd *simd, const struct plan *plan, uint16_t *to,
                       const struct strip_pixels *pixels)
{
	uint16_t last = 0;

	for (uint32_t i = 0; i < pixels->n; i++) {
		const uint32_t slot = pixels->id[i] / PSR_BLOCK_SAMPLES;

		if (i == 0 || slot != pixels->id[i - 1] / PSR_BLOCK_SAMPLES)
			last = bound_of(simd, plan, slot);
		to[pixels->x[i]] = last;
	}
}

/* Covered by more than half, a pixel takes its depth from nearer cells. */
static void mark_filled(uint16_t *to, const uint16_t *weight, uint32_t n)
{
	for (uint32_t x = 0; x < n; x++)
		if (weight[x] < WEIGHT_ONE / 2)
			to[x] = FILLED;
}

void planes_bound_filled(const struct psr_frame *frame)
{
	const uint16_t bound = to_bound((float)frame->report.error_px * (1 + 0x1p-20f));

	for (size_t i = 0; i < (size_t)frame->width * frame->height; i++)
		if (frame->bound[i] == FILLED)
			frame->bound[i] = bound;
}

/* Pixels without a sample. */
static void clear_samples(const struct psr_frame *frame, size_t first, uint32_t n)
{
	if (frame->normal != NULL)
		memset(frame->normal + 3 * first, 0, 3 * n * sizeof *frame->normal);
	if (frame->id != NULL)
		memset(frame->id + first, 0xff, n * sizeof *frame->id);
	if (frame->block != NULL)
		memset(frame->block + 3 * first, 0xff, 3 * n);
	if (frame->bound != NULL)
		memset(frame->bound + first, 0, n * sizeof *frame->bound);
}

static void put_samples(const struct simd *simd, const struct plan *plan, const struct psr_frame *frame, size_t first,
                        struct strip_pixels *pixels)
{
	if (pixels->n && frame->normal != NULL)
		put_normals(simd, plan, frame->normal + 3 * first, pixels);
	if (pixels->n && frame->id != NULL)
		put_instances(plan, frame->id + first, pixels);
	if (pixels->n && frame->block != NULL)
		put_blocks(simd, plan, frame->block + 3 * first, pixels);
	if (pixels->n && frame->bound != NULL)
		put_bounds(simd, plan, frame->bound + first, pixels);
}

void planes_row(const struct simd *simd, const struct plan *plan, const struct psr_frame *frame, const uint64_t *word,
                const uint16_t *weight, uint32_t y)
{
	const size_t row = (size_t)y * plan->width;
	struct strip_pixels pixels;

	pixels.y = y;
	for (uint32_t x = 0; x < plan->width; x += STRIP) {
		const uint32_t n = plan->width - x < STRIP ? plan->width - x : STRIP;
		const size_t first = row + x;

		if (frame->words != NULL)
			put_words(simd, plan, frame->words + first, word + x, n);
		if (frame->weight != NULL)
			put_weights(frame->weight + first, weight + x, n);
		if (frame->normal == NULL && frame->id == NULL && frame->block == NULL && frame->bound == NULL)
			continue;
		pixels.x0 = x;
		simd->strip_list(&pixels, word + x, weight + x, n, plan->place_bits);
		clear_samples(frame, first, n);
		put_samples(simd, plan, frame, first, &pixels);
		if (frame->bound != NULL)
			mark_filled(frame->bound + first, weight + x, n);
	}
}

void planes_over(const struct simd *simd, const struct plan *plan, const struct psr_frame *frame, const uint64_t *word,
                 const struct planes_part *part)
{
	const size_t first = (size_t)part->y * plan->width + part->x;
	struct strip_pixels pixels = { .x0 = part->x, .y = part->y };

	simd->strip_list(&pixels, word, NULL, part->n, 0);
	put_samples(simd, plan, frame, first, &pixels);
	for (uint32_t i = 0; frame->weight != NULL && i < pixels.n; i++)
		frame->weight[first + pixels.x[i]] = UINT8_MAX;
}
