/* average_light, average_around, average_depth and holes: rows of any width, passes
 * of any number, levels of any kind. */
#include <math.h>
#include <string.h>
#include "base/maths.h"
#include "tests/simd/lib/check.h"

static void average(struct check *c, uint32_t n, unsigned pass, int is_light)
{
	const uint32_t side = 1u << pass, stride = (n << pass) + check_below(c, 20);
	const size_t area = (size_t)stride * (side - 1) + (n << pass);
	uint16_t *root = check_in(c, area, sizeof *root), *light = check_out(c, n, sizeof *light);
	float *from = check_in(c, area, sizeof *from), *depth = check_out(c, n, sizeof *depth);

	if (check_one_in(c, 3))
		memset(root, 0xff, area * sizeof *root);
	for (size_t i = 0; i < area; i++)
		from[i] = check_one_in(c, 3) ? INFINITY : (float)check_real(c, 0, 9);
	check_units(c, (uint64_t)n << 2 * pass);
	while (check_next(c))
		if (is_light)
			c->simd->average_light(light, root, stride, n, pass);
		else
			c->simd->average_depth(depth, from, stride, n, pass);
}

static void random_averages(struct check *c)
{
	const unsigned pass = 1 + check_below(c, 4);

	average(c, 1 + check_below(c, AVERAGE_MOST >> pass), pass, check_one_in(c, 2));
}

static void random_around(struct check *c)
{
	const uint32_t n = 1 + check_below(c, AVERAGE_MOST / 2), stride = 2 * n + 2;
	const int is_first = check_one_in(c, 2), is_last = check_one_in(c, 2);
	uint16_t *root = check_in(c, 4 * (size_t)stride, sizeof *root), *light = check_out(c, n, sizeof *light);
	const uint16_t *row[4];

	if (check_one_in(c, 3))
		memset(root, 0xff, 4 * (size_t)stride * sizeof *root);
	for (int k = 0; k < 4; k++)
		row[k] = root + (size_t)k * stride + 1 + (k == 0 ? -is_first : k == 3 ? is_last : 0);
	while (check_next(c))
		c->simd->average_around(light, row, n, is_first, is_last);
}

static void holes(struct check *c, uint32_t width, uint32_t x, uint32_t n)
{
	uint64_t *row = check_in(c, width, sizeof *row);
	struct hole_cells *cells = check_in(c, PSR_MAX_DEPTH_LEVEL + 1, sizeof *cells);
	struct hole_row *to = check_out(c, 1, sizeof *to);
	const uint32_t levels = check_u32(c) & check_u32(c);
	const float scale = (float)check_real(c, 1, 1.1), offset = (float)check_real(c, 0, 0.1);

	for (uint32_t i = 0; i < width; i++)
		row[i] = check_one_in(c, 2) ? PSR_WORD_EMPTY : (uint64_t)psr_bits_from_float((float)check_real(c, 1, 3)) << 32;
	for (int k = 0; k <= PSR_MAX_DEPTH_LEVEL; k++)
		for (uint32_t i = 0; i < HOLES_CELLS; i++) {
			cells[k].limit[i] = check_one_in(c, 4) ? NAN : (float)check_real(c, 1, 3);
			cells[k].is_near[i] = (uint8_t)check_below(c, 2);
		}
	check_units(c, n);
	while (check_next(c))
		c->simd->holes(to, cells, levels, row, width, x, n, scale, offset);
}

static void random_holes(struct check *c)
{
	const uint32_t x = check_below(c, 3) * TILE_WIDTH, n = 1 + check_below(c, TILE_WIDTH);

	holes(c, x + n + (n == TILE_WIDTH ? check_below(c, 12) : 0), x, n);
}

static void bench_light(struct check *c)
{
	average(c, 256, 3, 1);
}

static void bench_holes(struct check *c)
{
	holes(c, 3 * TILE_WIDTH, TILE_WIDTH, TILE_WIDTH);
}

int main(int argc, char **argv)
{
	static const struct check_test tests[] = {
		{ "average: random rows and passes", random_averages, 600, NULL },
		{ "average_around: random rows and borders", random_around, 600, NULL },
		{ "holes: random rows, levels and borders", random_holes, 1000, NULL },
		{ "average_light, pass 3", bench_light, 0, "sub-pixel" },
		{ "holes", bench_holes, 0, "pixel" },
	};

	return check_main(argc, argv, tests, sizeof tests / sizeof tests[0]);
}
