/* strip_shadow: some samples, one map or two, of any levels, any numbers. shadow_sink: rows of any length. */
#include <math.h>
#include <stddef.h>
#include <string.h>
#include "tests/simd/lib/check.h"

/* Cells of a level or of its seam, some of which are empty. */
static const uint16_t *random_cells(struct check *c, uint32_t n)
{
	uint16_t *cells = check_in(c, n, sizeof *cells);
	for (uint32_t i = 0; i < n; i++)
		cells[i] = (uint16_t)(check_one_in(c, 4) ? SHADOW_EMPTY : check_below(c, SHADOW_EMPTY + 1));
	return cells;
}

static void random_map(struct check *c, struct shadow_map *map, uint32_t levels, int is_spoilt)
{
	const uint32_t width = 1 + check_below(c, 70), height = 1 + check_below(c, 70);
	memset(map, 0, sizeof *map);
	map->perspective = (int)check_below(c, 2);
	for (int a = 0; a < 3; a++) {
		for (int b = 0; b < 3; b++)
			map->turn[a][b] = check_plain_or_any(c, is_spoilt, -1, 1);
		map->move[a] = check_plain_or_any(c, is_spoilt, a == 2 ? 1 : -1, a == 2 ? 3 : 1);
	}
	map->scale = check_plain_or_any(c, is_spoilt, 0.5, 2);
	map->focal = (float)check_real(c, 0.2, 1) * (float)width;
	map->half_width = (float)width / 2;
	map->half_height = (float)height / 2;
	map->near_z = (float)check_real(c, 0.001, 0.1);
	map->slope_bias = check_plain_or_any(c, is_spoilt, 0, 1);
	map->texel_bias = check_plain_or_any(c, is_spoilt, 0, 2);
	map->slack = check_plain_or_any(c, is_spoilt, 0, 0.001);
	map->from = check_plain_or_any(c, is_spoilt, 0, 1);
	map->step = check_plain_or_any(c, is_spoilt, 0, 3.0 / SHADOW_EMPTY);
	map->levels = levels;
	for (int k = 0; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		const uint32_t cells_x = (width + (1u << k) - 1) >> k, cells_y = (height + (1u << k) - 1) >> k;
		const uint32_t n = (cells_x + 2) * (cells_y + 2);
		map->level[k].stride = cells_x + 2;
		map->level[k].most_x = (float)cells_x - 0.5f;
		map->level[k].most_y = (float)cells_y - 0.5f;
		if (levels >> k & 1)
			map->level[k].z = random_cells(c, n);
		if (k && levels >> k & 1 && levels >> (k - 1) & 1)
			map->level[k].seam = random_cells(c, n);
	}
}

static void shadow(struct check *c, uint32_t n, uint32_t n_maps, uint32_t levels, int is_spoilt)
{
	struct strip *strip = check_in(c, 1, sizeof *strip);
	struct shadow_light *light = check_in(c, 1, sizeof *light);
	float *reaches = check_out(c, n, sizeof *reaches);

	strip->n = n;
	for (float *value = strip->px; value < strip->vx; value++)
		*value = check_plain_or_any(c, is_spoilt, -1, 1);
	light->n_maps = n_maps;
	for (uint32_t f = 0; f < n_maps; f++)
		random_map(c, &light->map[f], levels, is_spoilt);
	check_units(c, n);
	while (check_next(c)) {
		const int is_lit = c->simd->strip_shadow(strip, light, reaches);
		if (c->is_bench)
			continue;
		if (!is_lit)
			memset(reaches, 0, n * sizeof *reaches);
		check_settle(reaches, n);
		check_result(c, (uint64_t)is_lit);
	}
}

static uint32_t some_samples(struct check *c)
{
	return STRIP_PADDING * (1 + check_below(c, STRIP / STRIP_PADDING));
}

/* One map of any levels, or two of a few: there are no more buffers. */
static void any_shadow(struct check *c, int is_spoilt)
{
	if (check_one_in(c, 2))
		shadow(c, some_samples(c), 1, 1 | (check_u32(c) & ((2u << PSR_MAX_DEPTH_LEVEL) - 1)), is_spoilt);
	else
		shadow(c, some_samples(c), 2, 1 | check_below(c, 16), is_spoilt);
}

static void random_shadow(struct check *c)
{
	any_shadow(c, 0);
}

static void spoilt_shadow(struct check *c)
{
	any_shadow(c, 1);
}

static void bench_one_level(struct check *c)
{
	shadow(c, STRIP, 1, 1, 0);
}

static void bench_two_levels(struct check *c)
{
	shadow(c, STRIP, 1, 3, 0);
}

static void sink(struct check *c, uint32_t n, int is_spoilt)
{
	const float from = check_plain_or_any(c, is_spoilt, 0, 1), step = check_plain_or_any(c, is_spoilt, 1e-6, 1e-4);
	float *row[3];
	uint16_t *to = check_out(c, n, sizeof *to);

	for (int j = 0; j < 3; j++) {
		row[j] = check_in(c, n, sizeof *row[j]);
		for (uint32_t i = 0; i < n; i++)
			row[j][i] = check_one_in(c, 4) ? INFINITY : check_plain_or_any(c, is_spoilt, 0.5, 3);
	}
	const struct shadow_rows rows = { row[0], row[1], row[2] };
	check_units(c, n);
	while (check_next(c))
		c->simd->shadow_sink(to, &rows, n, from, step);
}

static void random_sink(struct check *c)
{
	sink(c, 3 + check_below(c, 200), 0);
}

static void spoilt_sink(struct check *c)
{
	sink(c, 3 + check_below(c, 200), 1);
}

static void bench_sink(struct check *c)
{
	sink(c, 1024, 0);
}

int main(int argc, char **argv)
{
	static const struct check_test tests[] = {
		{ "strip_shadow: random maps", random_shadow, 1000, NULL },
		{ "strip_shadow: infinite, huge, denormal and no numbers", spoilt_shadow, 1000, NULL },
		{ "strip_shadow, a map of one level", bench_one_level, 0, "sample" },
		{ "strip_shadow, levels 0 and 1", bench_two_levels, 0, "sample" },
		{ "shadow_sink: random depths", random_sink, 1000, NULL },
		{ "shadow_sink: infinite, huge, denormal and no numbers", spoilt_sink, 1000, NULL },
		{ "shadow_sink", bench_sink, 0, "cell" },
	};
	return check_main(argc, argv, tests, sizeof tests / sizeof tests[0]);
}
