/* Late warping: depths, texels, cells, their boxes and pixels, and colours, of random, spoilt and tiny pictures. */
#include <math.h>
#include <string.h>
#include "tests/simd/lib/check.h"

#define MOST_SIDE 40

static uint32_t up_to_cell(uint32_t n)
{
	return (n + REPROJECT_SIDE) / REPROJECT_SIDE * REPROJECT_SIDE;
}

/* Planes, steps between them and holes; or any values that depths() can give. */
static void random_source(struct check *c, struct reproject_source *source, int is_any)
{
	const float slope_x = (float)check_real(c, -0.01, 0.01), slope_y = (float)check_real(c, -0.01, 0.01);
	const int has_steps = check_one_in(c, 2), has_holes = check_one_in(c, 2);

	source->width = 1 + check_below(c, MOST_SIDE);
	source->height = 1 + check_below(c, MOST_SIDE);
	source->stride = up_to_cell(source->width);
	const size_t n = (size_t)source->stride * up_to_cell(source->height);
	source->d = check_in(c, n, sizeof *source->d);
	source->texel = check_out(c, n, sizeof *source->texel);
	source->surface = (struct reproject_limit){ .scale = (float)check_real(c, 0, 0.05) };
	source->plane = (struct reproject_limit){ .scale = (float)check_real(c, 0, 0.01), .offset = 1e-4f };
	memset(source->d, 0, n * sizeof *source->d);
	for (uint32_t y = 0; y < source->height; y++)
		for (uint32_t x = 0; x < source->width; x++) {
			const float plane = (1 + slope_x * (float)x) + slope_y * (float)y;
			const float step = has_steps && (x / 5 + y / 7) % 2 ? 0.2f : 0;
			const float any = fabsf(check_float(c));
			const float value = is_any && any >= 1 / REPROJECT_FAR && any <= REPROJECT_FAR ? any : plane + step;

			source->d[(size_t)y * source->stride + x] = has_holes && check_one_in(c, 9) ? 0 : value;
		}
}

static void depths(struct check *c, uint32_t n, int is_any)
{
	float *z = check_in(c, n, sizeof *z), *d = check_out(c, n, sizeof *d);
	const int is_inverse = check_one_in(c, 2);

	for (uint32_t i = 0; i < n; i++)
		z[i] = check_plain_or_any(c, is_any, 0.1, 10);
	check_units(c, n);
	while (check_next(c))
		c->simd->reproject_depths(d, z, n, is_inverse);
}

static void random_depths(struct check *c)
{
	depths(c, 1 + check_below(c, 100), 1);
}

static void random_texels(struct check *c)
{
	struct reproject_source source;

	random_source(c, &source, check_one_in(c, 4));
	const uint8_t *rgb = check_in(c, (size_t)source.width, 3);
	const uint32_t y = check_below(c, source.height);
	while (check_next(c))
		c->simd->reproject_texels(&source, rgb, y);
}

static void fit(struct check *c, int is_any)
{
	struct reproject_source source;

	random_source(c, &source, is_any);
	const size_t n_cells = (size_t)source.stride * REPROJECT_SIDE;
	const uint32_t y = check_below(c, source.height) / REPROJECT_SIDE * REPROJECT_SIDE;
	struct reproject_cell *cell = check_out(c, n_cells, sizeof *cell);
	check_units(c, (uint64_t)source.width * REPROJECT_SIDE);
	while (check_next(c)) {
		const uint32_t n = c->simd->reproject_fit(&source, y, cell);

		memset(cell + n, 0, (n_cells - n) * sizeof *cell);
		check_result(c, n);
	}
}

static void random_cells(struct check *c)
{
	fit(c, 0);
}

static void any_cells(struct check *c)
{
	fit(c, 1);
}

static void random_warp(struct check *c, struct reproject_warp *warp, int is_any)
{
	float *const column[4] = { warp->of_x, warp->of_y, warp->of_one, warp->of_d };

	warp->width = 1 + check_below(c, 3 * MOST_SIDE);
	warp->height = 1 + check_below(c, 3 * MOST_SIDE);
	warp->most_key = check_one_in(c, 3) ? 1 : INFINITY;
	for (int i = 0; i < 4; i++)
		for (int k = 0; k < 4; k++) {
			const double near_identity = (i == k && i < 2) || (i == 2 && k == 2) || (i == 3 && k == 3);

			const double off = k < 2 ? 0.2 : 0.02;

			column[i][k] = check_plain_or_any(c, is_any, near_identity - off, near_identity + off);
		}
}

static void random_list(struct check *c, struct reproject_cell *cell, uint32_t n, int is_any)
{
	for (uint32_t i = 0; i < n; i++) {
		const uint32_t log_side = check_below(c, 4), x = check_below(c, MOST_SIDE), y = check_below(c, MOST_SIDE);

		cell[i] = (struct reproject_cell){
			.d = check_plain_or_any(c, is_any, 0.5, 1.5), .dx = check_plain_or_any(c, is_any, -0.01, 0.01),
			.dy = check_plain_or_any(c, is_any, -0.01, 0.01), .place = x | y << 14 | log_side << 28,
		};
	}
}

static void boxes(struct check *c, uint32_t n, int is_any)
{
	struct reproject_cell *cell = check_in(c, n, sizeof *cell);
	struct reproject_box *box = check_out(c, n, sizeof *box);
	struct reproject_warp warp;

	random_list(c, cell, n, is_any);
	random_warp(c, &warp, is_any);
	check_units(c, n);
	while (check_next(c))
		c->simd->reproject_bound(box, &warp, cell, n);
}

static void random_boxes(struct check *c)
{
	boxes(c, 1 + check_below(c, 40), 0);
}

static void any_boxes(struct check *c)
{
	boxes(c, 1 + check_below(c, 40), 1);
}

static void tile_for(struct check *c, struct reproject_tile *tile, const struct reproject_warp *warp)
{
	tile->x0 = check_below(c, warp->width);
	tile->x1 = tile->x0 + 1 + check_below(c, warp->width - tile->x0);
	tile->y0 = check_below(c, warp->height);
	tile->y1 = tile->y0 + 1 + check_below(c, warp->height - tile->y0);
	tile->stride = up_to_cell(tile->x1 - tile->x0) + REPROJECT_SIDE;
	tile->bits = 2 + check_below(c, 6);
	const size_t n = (size_t)tile->stride * (tile->y1 - tile->y0);
	tile->key = check_out(c, n, sizeof *tile->key);
	tile->at = check_out(c, n, sizeof *tile->at);
	for (size_t i = 0; i < n; i++)
		tile->key[i] = check_one_in(c, 20) ? 1 : REPROJECT_EMPTY;
}

static void pixels(struct check *c, int is_any)
{
	const uint32_t n = 1 + check_below(c, REPROJECT_LIST);
	struct reproject_cell cell[REPROJECT_LIST], *list = check_in(c, n, sizeof *list);
	struct reproject_box box[REPROJECT_LIST], *boxes_of = check_in(c, n, sizeof *boxes_of);
	struct reproject_warp warp;
	struct reproject_tile tile;
	uint32_t n_seen = 0;

	random_list(c, cell, n, is_any);
	random_warp(c, &warp, is_any);
	simd_of(PSR_ISA_C)->reproject_bound(box, &warp, cell, n);
	tile_for(c, &tile, &warp);
	for (uint32_t i = 0; i < n; i++)
		if (box[i].x0 < box[i].x1) {
			list[n_seen] = cell[i];
			boxes_of[n_seen++] = box[i];
		}
	check_units(c, n);
	while (check_next(c))
		check_result(c, c->simd->reproject_cells(&tile, &warp, list, boxes_of, n_seen));
}

static void random_pixels(struct check *c)
{
	pixels(c, 0);
}

static void any_pixels(struct check *c)
{
	pixels(c, 1);
}

static void colors(struct check *c, uint32_t n)
{
	const uint8_t background[3] = { 1, 2, 3 };
	const uint32_t width = 1 + check_below(c, MOST_SIDE), height = 1 + check_below(c, MOST_SIDE);
	struct reproject_source source = { .width = width, .height = height };
	struct reproject_tile tile = { .bits = 2 + check_below(c, 6) };
	const uint32_t first = check_below(c, 4), n_keys = first + n + REPROJECT_SIDE - 1;
	const int is_full = check_one_in(c, 3), is_whole = check_one_in(c, 3);
	uint8_t *rgb = check_out(c, n, 3);

	source.stride = up_to_cell(source.width);
	source.texel = check_in(c, (size_t)source.stride * up_to_cell(source.height), sizeof *source.texel);
	tile.key = check_in(c, n_keys, sizeof *tile.key);
	tile.at = check_in(c, n_keys, sizeof *tile.at);
	for (uint32_t y = 0; y < source.height; y++)
		for (uint32_t x = 0; x < source.width; x++) {
			const int has_all = x + 1 < source.width && y + 1 < source.height && (is_whole || check_one_in(c, 2));

			source.texel[(size_t)y * source.stride + x] = (check_u32(c) & 0xffffff) | (has_all ? 1u << 24 : 0);
		}
	for (uint32_t i = 0; i < n_keys; i++) {
		tile.key[i] = is_full || check_one_in(c, 2) ? (float)check_real(c, -1, 1) : REPROJECT_EMPTY;
		tile.at[i] = check_below(c, source.width << tile.bits) | check_below(c, source.height << tile.bits) << 16;
	}
	check_units(c, n);
	while (check_next(c))
		c->simd->reproject_look(rgb, &source, &tile, first, n, background);
}

static void random_colors(struct check *c)
{
	colors(c, 1 + check_below(c, 60));
}

static void bench_depths(struct check *c)
{
	depths(c, 4096, 0);
}

static void bench_boxes(struct check *c)
{
	boxes(c, 4096, 0);
}

static void bench_colors(struct check *c)
{
	colors(c, 4096);
}

int main(int argc, char **argv)
{
	static const struct check_test tests[] = {
		{ "reproject_depths: any floats", random_depths, 500, NULL },
		{ "reproject_texels: random pictures", random_texels, 500, NULL },
		{ "reproject_fit: planes, steps and holes", random_cells, 1000, NULL },
		{ "reproject_fit: any depths", any_cells, 500, NULL },
		{ "reproject_bound: random cells and cameras", random_boxes, 1000, NULL },
		{ "reproject_bound: any cells and cameras", any_boxes, 1000, NULL },
		{ "reproject_cells: random cells and cameras", random_pixels, 1500, NULL },
		{ "reproject_cells: any cells and cameras", any_pixels, 1000, NULL },
		{ "reproject_look: random places", random_colors, 1500, NULL },
		{ "reproject_depths", bench_depths, 0, "pixel" },
		{ "reproject_fit", random_cells, 0, "pixel" },
		{ "reproject_bound", bench_boxes, 0, "cell" },
		{ "reproject_cells", random_pixels, 0, "cell" },
		{ "reproject_look", bench_colors, 0, "pixel" },
	};
	return check_main(argc, argv, tests, sizeof tests / sizeof tests[0]);
}
