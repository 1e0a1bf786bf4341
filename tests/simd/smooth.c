/* smooth: pieces of pictures, of several surfaces and none, at borders and within. */
#include <math.h>
#include <string.h>
#include "tests/simd/lib/check.h"

static void smooth(struct check *c, uint32_t width, uint32_t height, uint32_t x0, uint32_t n, uint32_t y0,
                   uint32_t rows, int is_any, int is_placed)
{
	const size_t area = (size_t)width * height;
	uint8_t *from = check_in(c, area, 3), *to = check_out(c, area, 3);
	float *depth = check_in(c, area, sizeof *depth);
	uint8_t *place = check_in(c, area, 1);
	const int is_flat = check_one_in(c, 3);
	for (size_t i = 0; i < area; i++) {
		const uint32_t kind = check_below(c, 4);
		const double z = kind == 0 ? check_real(c, 1, 1.02) : kind == 1 ? check_real(c, 1.1, 1.12) : 1;
		place[i] = (uint8_t)check_below(c, PSR_PLACE_NONE + 1);
		depth[i] = kind == 3 && !is_flat ? INFINITY : check_plain_or_any(c, is_any, z, z);
		if (is_flat)
			memset(from + 3 * i, (int)(i / 7 % 2) * 255, 3);
	}
	if (check_one_in(c, 4))
		for (size_t i = (size_t)y0 * width; i < (size_t)(y0 + 1) * width; i++)
			depth[i] = INFINITY;
	const struct smooth_target target = {
		.from = from, .to = to, .depth = depth, .width = width, .height = height,
		.place = is_placed ? place : NULL, .perspective = check_one_in(c, 2),
		.scale = check_one_in(c, 2) ? 1 : (float)check_real(c, 0.9, 1), .offset = (float)check_real(c, 0, 0.1),
	};
	check_units(c, (uint64_t)n * rows);
	while (check_next(c))
		check_result(c, c->simd->smooth(&target, x0, x0 + n, y0, y0 + rows));
}

static void a_piece(struct check *c, int is_any)
{
	const uint32_t n = 1 + check_below(c, SMOOTH_WIDTH), rows = 1 + check_below(c, GAPS_BRICK);
	const uint32_t x0 = check_below(c, 3), y0 = check_below(c, 3);
	const int is_placed = (int)check_below(c, 2);
	smooth(c, x0 + n + check_below(c, 3), y0 + rows + check_below(c, 3), x0, n, y0, rows, is_any, is_placed);
}

static void random_pieces(struct check *c)
{
	a_piece(c, 0);
}

static void any_depths(struct check *c)
{
	a_piece(c, 1);
}

static void bench_smooth(struct check *c)
{
	smooth(c, SMOOTH_WIDTH + 2, GAPS_BRICK + 2, 1, SMOOTH_WIDTH, 1, GAPS_BRICK, 0, 0);
}

static void bench_placed(struct check *c)
{
	smooth(c, SMOOTH_WIDTH + 2, GAPS_BRICK + 2, 1, SMOOTH_WIDTH, 1, GAPS_BRICK, 0, 1);
}

static void places(struct check *c, uint32_t n)
{
	uint64_t *word = check_in(c, n, sizeof *word);
	uint16_t *weight = check_in(c, n, sizeof *weight);
	uint8_t *place = check_out(c, n, 1);

	for (uint32_t i = 0; i < n; i++) {
		word[i] = check_one_in(c, 4) ? PSR_WORD_EMPTY : (word[i] & UINT64_C(0x7fffffffffffffff)) % PSR_WORD_EMPTY;
		weight[i] = (uint16_t)check_below(c, GAPS_WHOLE + 1);
	}
	check_units(c, n);
	while (check_next(c))
		c->simd->smooth_places(place, word, weight, n);
}

static void random_places(struct check *c)
{
	places(c, 1 + check_below(c, 600));
}

static void bench_places(struct check *c)
{
	places(c, 1024);
}

int main(int argc, char **argv)
{
	static const struct check_test tests[] = {
		{ "smooth: random pieces of pictures", random_pieces, 1500, NULL },
		{ "smooth: infinite, huge, denormal and no depths", any_depths, 500, NULL },
		{ "smooth_places: random rows", random_places, 500, NULL },
		{ "smooth", bench_smooth, 0, "pixel" },
		{ "smooth, with places", bench_placed, 0, "pixel" },
		{ "smooth_places", bench_places, 0, "pixel" },
	};
	return check_main(argc, argv, tests, sizeof tests / sizeof tests[0]);
}
