#include "buffers.h"

#include <string.h>
#include "base/mem.h"
#include "zbuffer.h"

static uint32_t bricks_x(const struct plan *plan)
{
	return (plan->width + BRICK - 1) / BRICK;
}

/* Bytes of a row of offcuts. */
static uint32_t offcut_stride(const struct plan *plan)
{
	return plan->with_splats ? (plan->width + 7) / 8 : 0;
}

static size_t n_bands_most(const struct plan *plan)
{
	return (size_t)plan->tiles_x * plan->tiles_y * BANDS_MOST;
}

/* Points the arrays into their two pieces of memory. */
static void place(struct buffers *b, const struct plan *plan, size_t n_words)
{
	const size_t area = (size_t)plan->width * plan->height, rows = n_brick_rows(plan);
	struct psr_zstack *stack = &b->stack;

	b->warp = b->counters;
	b->band = (struct band *)(b->warp + n_bands_most(plan));
	b->shade = (struct shade_counts *)(b->band + n_bands_most(plan));
	b->gaps = (struct gaps_counts *)(b->shade + rows);
	b->is_clean = (uint8_t *)(b->gaps + rows);
	stack->word = b->pixels;
	b->weight = (uint16_t *)zbuffer_place_cells(stack, (float *)(stack->word + n_words));
	for (int k = 0; k < 3; k++)
		b->rgb[k] = b->weight + (size_t)(k + 1) * area;
	b->bricks = (uint8_t *)(b->rgb[2] + area);
	b->offcuts.bits = b->bricks + rows * bricks_x(plan);
	b->offcuts.stride = offcut_stride(plan);
}

int buffers_prepare(struct buffers *b, const struct plan *plan, uint32_t levels)
{
	const uint32_t w = plan->width, h = plan->height;
	const size_t area = (size_t)w * h, rows = n_brick_rows(plan), n_bricks = rows * bricks_x(plan);
	const size_t n_parts = (size_t)plan->parts_x * plan->parts_y;
	struct psr_zstack *stack = &b->stack;
	const size_t n_cells = zbuffer_measure(stack, w, h, levels & ~1u);

	stack->gap = warp_gap(w);
	stack->exponent = plan->exponent;
	stack->place_bits = plan->place_bits;
	const size_t n_words = (size_t)(w + stack->gap) * h;
	b->pixels = psr_grow_huge(b->pixels, &b->pixels_size,
	                          n_words * sizeof *stack->word + area * 4 * sizeof *b->weight + n_cells * sizeof(float)
	                              + n_bricks + (size_t)offcut_stride(plan) * h);
	b->counters = psr_grow_huge(b->counters, &b->counters_size,
	                            n_bands_most(plan) * (sizeof *b->band + sizeof *b->warp) + n_parts
	                                + rows * (sizeof *b->gaps + sizeof *b->shade));
	if (plan->with_ewa)
		b->sum = psr_grow_huge(b->sum, &b->sum_size, area * sizeof *b->sum);
	if (b->pixels == NULL || b->counters == NULL || (plan->with_ewa && b->sum == NULL))
		return PSR_ERR_MEMORY;
	place(b, plan, n_words);
	if (b->clean_pixels != b->pixels || b->clean_width != w || b->clean_height != h || b->clean_levels != stack->levels)
		memset(b->is_clean, 0, n_parts);
	b->clean_pixels = b->pixels;
	b->clean_width = w;
	b->clean_height = h;
	b->clean_levels = stack->levels;
	return PSR_OK;
}

void buffers_forget(struct buffers *b)
{
	b->clean_pixels = NULL;
}

void buffers_clear(struct buffers *b)
{
	psr_free_huge(b->pixels, b->pixels_size);
	psr_free_huge(b->counters, b->counters_size);
	psr_free_huge(b->sum, b->sum_size);
}
