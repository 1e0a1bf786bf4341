/* gaps: pieces of pictures of all sizes with every set of level buffers; surfaces with holes, pinholes and any
 * numbers. */
#include <math.h>
#include <string.h>
#include "base/maths.h"
#include "tests/simd/lib/check.h"

enum numbers { NOISE, SURFACE, SMOOTH, SPOILT };

static float random_depth(struct check *c, enum numbers numbers)
{
	if (numbers == SPOILT && check_one_in(c, 5))
		return fabsf(check_float(c));
	if (check_one_in(c, numbers == SMOOTH ? 3000 : numbers == SURFACE ? 30 : 4))
		return check_one_in(c, 2) ? INFINITY : (float)check_real(c, 0.6, 1);
	return (float)check_real(c, 0.5, numbers == SURFACE || numbers == SMOOTH ? 0.501 : 0.6);
}

static void piece(struct check *c, uint32_t width, uint32_t height, uint32_t levels, enum numbers numbers)
{
	const size_t area = (size_t)width * height;
	struct psr_zstack *stack = check_in(c, 1, sizeof *stack);
	float *scale = check_in(c, PSR_MAX_DEPTH_LEVEL + 1, sizeof *scale);
	float *offset = check_in(c, PSR_MAX_DEPTH_LEVEL + 1, sizeof *offset);
	const float threshold = (float)check_real(c, 0, 0.01);

	memset(stack, 0, sizeof *stack);
	stack->width = width;
	stack->height = height;
	stack->levels = levels & 0xfe;
	stack->gap = check_one_in(c, 2) ? check_below(c, 20) : 0;
	const size_t n_words = (size_t)(width + stack->gap) * height;
	stack->word = check_in(c, n_words, sizeof *stack->word);
	for (size_t i = 0; i < n_words; i++)
		stack->word[i] = (uint64_t)psr_bits_from_float(random_depth(c, numbers)) << 32 | check_u32(c);
	for (int k = 0; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		scale[k] = 1 + (check_one_in(c, 2) ? threshold * (float)(1 << k) : 0);
		offset[k] = check_one_in(c, 2) ? threshold * (float)(1 << k) : 0;
		const uint32_t side = 1u << k, w = (width + side - 1) / side + 2, h = (height + side - 1) / side + 2;
		stack->level[k].width = w;
		stack->level[k].height = h;
		if (!(stack->levels >> k & 1))
			continue;
		stack->level[k].z = check_in(c, (size_t)w * h, sizeof(float));
		const int is_empty = check_one_in(c, 4);
		for (size_t i = 0; i < (size_t)w * h; i++)
			stack->level[k].z[i] = is_empty && !check_one_in(c, 20) ? INFINITY : random_depth(c, numbers);
	}
	const uint32_t x0 = GAPS_WIDTH * check_below(c, (width + GAPS_WIDTH - 1) / GAPS_WIDTH);
	const uint32_t y0 = GAPS_BRICK * check_below(c, (height + GAPS_BRICK - 1) / GAPS_BRICK);
	const uint32_t x1 = x0 + GAPS_WIDTH < width ? x0 + GAPS_WIDTH : width;
	const uint32_t y1 = y0 + GAPS_BRICK < height ? y0 + GAPS_BRICK : height;
	const enum psr_gap_method method = numbers == SMOOTH ? PSR_GAPS_CLOSED : (enum psr_gap_method)check_below(c, 3);
	uint16_t *weight = check_out(c, area, sizeof *weight), *slit = check_out(c, GAPS_WIDTH * GAPS_BRICK, sizeof *slit);
	const int with_slits = numbers == SMOOTH ? levels == 0 : check_one_in(c, 2);
	const struct gaps_target target = { stack, scale, offset, weight, method, with_slits ? slit : NULL };
	uint8_t *marks = check_out(c, GAPS_WIDTH / GAPS_BRICK, 1);
	check_units(c, (uint64_t)(x1 - x0) * (y1 - y0));
	while (check_next(c)) {
		const struct gaps_counts counts = c->simd->gaps(&target, x0, x1, y0, y1, marks);
		check_result(c, (uint64_t)counts.n_slits << 50 | (uint64_t)counts.n_marked << 40
		                    | (uint64_t)counts.n_pinholes << 20 | counts.n_partial);
	}
}

static uint32_t random_side(struct check *c)
{
	return check_one_in(c, 4) ? 1 + check_below(c, 4) : 1 + check_below(c, 2 * GAPS_WIDTH);
}

static void noise(struct check *c)
{
	piece(c, random_side(c), random_side(c), check_u32(c) & check_u32(c), NOISE);
}

static void surface(struct check *c)
{
	piece(c, random_side(c), random_side(c), check_u32(c) & check_u32(c), SURFACE);
}

static void spoilt_numbers(struct check *c)
{
	piece(c, random_side(c), random_side(c), check_u32(c) & check_u32(c), SPOILT);
}

static void bench_guard(struct check *c)
{
	piece(c, GAPS_WIDTH, GAPS_BRICK, 0, SMOOTH);
}

static void bench_levels(struct check *c)
{
	piece(c, GAPS_WIDTH, GAPS_BRICK, 1 << 1 | 1 << 2, SMOOTH);
}

int main(int argc, char **argv)
{
	static const struct check_test tests[] = {
		{ "gaps: noise", noise, 600, NULL },
		{ "gaps: a surface with holes and pinholes", surface, 600, NULL },
		{ "gaps: infinite, huge, denormal and no numbers", spoilt_numbers, 600, NULL },
		{ "gaps, the guard and slits alone", bench_guard, 0, "pixel" },
		{ "gaps, depth levels 1 and 2", bench_levels, 0, "pixel" },
	};
	return check_main(argc, argv, tests, sizeof tests / sizeof tests[0]);
}
