/* The sparse fill against a dense one, on random pictures, for every ISA that the machine has. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/maths.h"
#include "base/random.h"
#include "render/fill.h"

static uint64_t seed;

static uint32_t draw(uint32_t n)
{
	return random_below(&seed, n);
}

/* ---- the dense fill: every cell of every level, one by one ---- */

struct cell {
	uint32_t rgb[3], weight; /* premultiplied */
	float z;
};

struct dense {
	struct cell *cell[FILL_LEVELS];
	uint32_t width[FILL_LEVELS], height[FILL_LEVELS];
	int top, deepest;
	float *own; /* depths of the picture's words */
};

static float limit_of(const struct plan *plan, int level, float nearest)
{
	const int k = level < PSR_MAX_DEPTH_LEVEL ? level : PSR_MAX_DEPTH_LEVEL;
	return nearest * plan->gap_scale[k] + plan->gap_offset[k];
}

static void pull_cell(struct dense *d, const struct plan *plan, int l, uint32_t x, uint32_t y)
{
	const struct cell *child[4];
	struct cell to = { { 0, 0, 0 }, 0, 0 };
	int n = 0;
	float nearest = INFINITY;
	for (uint32_t v = 2 * y; v <= 2 * y + 1 && v < d->height[l]; v++)
		for (uint32_t u = 2 * x; u <= 2 * x + 1 && u < d->width[l]; u++) {
			const struct cell *c = &d->cell[l][(size_t)v * d->width[l] + u];
			if (!c->weight)
				continue;
			child[n++] = c;
			nearest = c->z < nearest ? c->z : nearest;
		}
	for (int i = 0; i < n; i++) {
		if (child[i]->z > limit_of(plan, l + 1, nearest))
			continue;
		for (int k = 0; k < 3; k++)
			to.rgb[k] += child[i]->rgb[k];
		to.z += (float)child[i]->weight * child[i]->z;
		to.weight += child[i]->weight;
	}
	to.z = to.weight ? to.z / (float)to.weight : INFINITY;
	if (to.weight > WEIGHT_ONE) {
		for (int k = 0; k < 3; k++)
			to.rgb[k] = to.rgb[k] * WEIGHT_ONE / to.weight;
		to.weight = WEIGHT_ONE;
	}
	d->deepest = to.weight < WEIGHT_ONE / 2 ? l + 1 : d->deepest;
	d->cell[l + 1][(size_t)y * d->width[l + 1] + x] = to;
}

static void push_cell(struct dense *d, const struct plan *plan, int l, uint32_t x, uint32_t y)
{
	struct cell *to = &d->cell[l][(size_t)y * d->width[l] + x];
	const uint32_t nx = x & 1 ? x / 2 + 1 : x / 2 - 1, ny = y & 1 ? y / 2 + 1 : y / 2 - 1;
	const struct cell *row = d->cell[l + 1] + (size_t)(y / 2) * d->width[l + 1];
	const struct cell *from[3] = { &row[x / 2] };
	uint32_t n = 1, share[3] = { 2, 1, 1 }, rgb[3] = { 0, 0, 0 }, sum = 0;
	float nearest = INFINITY, z = 0;
	if (to->weight == WEIGHT_ONE)
		return;
	if (nx < d->width[l + 1])
		from[n++] = &row[nx];
	if (ny < d->height[l + 1])
		from[n++] = d->cell[l + 1] + (size_t)ny * d->width[l + 1] + x / 2;
	for (uint32_t i = 0; i < n; i++)
		nearest = from[i]->z < nearest ? from[i]->z : nearest;
	for (uint32_t i = 0; i < n; i++) {
		if (from[i]->z > limit_of(plan, l + 1, nearest))
			continue;
		for (int k = 0; k < 3; k++)
			rgb[k] += share[i] * from[i]->rgb[k];
		z += (float)share[i] * from[i]->z;
		sum += share[i];
	}
	for (int k = 0; k < 3; k++)
		to->rgb[k] += rgb[k] / sum * (WEIGHT_ONE - to->weight) / WEIGHT_ONE;
	if (to->weight < WEIGHT_ONE / 2)
		to->z = z / (float)sum;
}

static void dense_fill(struct dense *d, const struct plan *plan)
{
	for (int l = 0; l < d->top; l++)
		for (uint32_t y = 0; y < d->height[l + 1]; y++)
			for (uint32_t x = 0; x < d->width[l + 1]; x++)
				pull_cell(d, plan, l, x, y);
	struct cell *top = d->cell[d->top];
	for (int k = 0; k < 3; k++)
		top->rgb[k] = top->weight ? top->rgb[k] * WEIGHT_ONE / top->weight : plan->background[k];
	for (int l = d->top - 1; l >= 0; l--)
		for (uint32_t y = 0; y < d->height[l]; y++)
			for (uint32_t x = 0; x < d->width[l]; x++)
				push_cell(d, plan, l, x, y);
}

/* ---- what is beside a filled pixel, in double ---- */

struct beside {
	double distance, along; /* of the nearest; the least along the axis: */
	float z, other;         /* its depth; that of another one as near, but for rounding */
	double aside;
	int n;                  /* in the smallest square with any, and one pixel more: samples, */
	double along_there;     /* and the least along the axis */
};

#define ROUNDING 1e-4 /* pixels: places are floats below 2^11 pixels, 2^-13 each */

static double from_center(const struct plan *plan, int axis, uint32_t at)
{
	return (double)at + 0.5 - plan->center[axis];
}

static struct beside find_beside(const struct dense *d, const struct plan *plan, const uint16_t *weights, uint32_t x,
                                 uint32_t y, float depth)
{
	struct beside beside = { INFINITY, INFINITY, NAN, NAN, INFINITY, 0, INFINITY };
	const double z = (double)depth;
	int side = -1, first = FILL_NEAR;

	for (int reach = 0; reach <= FILL_NEAR && (side < 0 || reach <= side + 1); reach++) {
		beside.n = reach <= first + 1 ? 0 : beside.n;
		for (int v = (int)y - reach; v <= (int)y + reach; v++)
			for (int u = (int)x - reach; u <= (int)x + reach; u++) {
				if (u < 0 || v < 0 || u >= (int)d->width[0] || v >= (int)d->height[0])
					continue;
				const size_t at = (size_t)v * d->width[0] + (size_t)u;
				const double own = (double)d->own[at], wider = plan->perspective ? own / z : 1;
				const double dx = wider * from_center(plan, 0, (uint32_t)u) - from_center(plan, 0, x);
				const double dy = wider * from_center(plan, 1, (uint32_t)v) - from_center(plan, 1, y);
				const double along = (double)plan->focal * fabs(own - z) / (plan->perspective ? z : 1);
				const double aside = hypot(u - (double)x, v - (double)y);

				if (weights[at] == 0 || own == INFINITY)
					continue;
				side = side < 0 && along <= FILL_APART ? reach : side;
				first = reach < first ? reach : first;
				beside.distance = fmin(beside.distance, sqrt(dx * dx + dy * dy + along * along));
				if (reach > first + 1)
					continue;
				beside.n++;
				beside.along_there = fmin(beside.along_there, along);
				if (along > beside.along || (along == beside.along && aside >= beside.aside)) {
					const int is_other = d->own[at] != beside.z && along <= beside.along + ROUNDING;

					beside.other = is_other ? d->own[at] : beside.other;
					continue;
				}
				beside.other = beside.along - along <= ROUNDING ? beside.z : d->own[at];
				beside.along = along;
				beside.z = d->own[at];
				beside.aside = aside;
			}
	}
	beside.n = first < FILL_NEAR ? beside.n : 0;
	return beside;
}

static int is_among(const struct beside *beside, double rounding)
{
	return beside->n >= FILL_MANY && beside->along_there > FILL_APART + rounding;
}

/* Whether a filled pixel has the depth that it should. */
static int has_depth(const struct beside *beside, float cells, float depth)
{
	return (!is_among(beside, ROUNDING) && depth == cells)
	       || (is_among(beside, -ROUNDING) && (depth == beside->z || depth == beside->other));
}

/* ---- pictures ---- */

struct picture {
	struct psr_zstack stack;
	struct fill_picture fill;
	size_t area;
};

static uint8_t srgb[65536];

static struct plan plan_of(int perspective)
{
	struct plan plan = { .background = { 100, 20000, 65535 }, .perspective = perspective,
		                 .focal = draw(2) ? 20 : 400, .center = { 70, 40.5 } };
	for (int k = 0; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		const float t = 0.0125f * (float)(1 << k);
		plan.gap_scale[k] = perspective ? 1 + t : 1;
		plan.gap_offset[k] = perspective ? 0 : t;
	}
	return plan;
}

/* Surfaces at a few depths over the background; of `holes` in 256 pixels the weight is 0, of `partial` it is anything.
 * `whole` in 8 bricks are left alone. Wide pictures have nothing at all in the middle of their left half. */
static struct picture picture_make(uint32_t width, uint32_t height, uint32_t holes, uint32_t partial, uint32_t whole,
                                   const struct plan *plan)
{
	const size_t area = (size_t)width * height;
	const uint32_t bricks_x = (width + BRICK - 1) / BRICK, n_bricks = bricks_x * ((height + BRICK - 1) / BRICK);
	struct picture p = { .area = area, .stack = { .width = width, .height = height, .exponent = -3 } };
	uint8_t *bricks = calloc(n_bricks, 1), *is_left = calloc(n_bricks, 1);
	p.stack.word = malloc(area * 8);
	p.fill = (struct fill_picture){ .weight = malloc(area * 2),
		                            .bricks = bricks,
		                            .r = malloc(area * 2),
		                            .g = malloc(area * 2),
		                            .b = malloc(area * 2),
		                            .srgb = srgb,
		                            .rgb = malloc(3 * area),
		                            .depth = malloc(area * 4) };
	for (uint32_t i = 0; i < n_bricks; i++)
		is_left[i] = draw(8) < whole;
	for (uint32_t y = 0; y < height; y++)
		for (uint32_t x = 0; x < width; x++) {
			const size_t at = (size_t)y * width + x, brick = (size_t)(y / BRICK) * bricks_x + x / BRICK;
			const uint32_t surface = (x / 23 + y / 17 + draw(40) / 39) % 4;
			const uint32_t is_void = x > width / 4 - 80 && x < width / 4 + 80 && y > height / 4 && y < height / 2;
			const uint32_t kind = is_left[brick] ? 256 : draw(256), is_hole = kind < holes || (width > 1000 && is_void);
			const float z = 1 + 0.05f * (float)surface + 0.001f * (float)draw(100);
			p.stack.word[at] = surface == 3 ? PSR_WORD_EMPTY : (uint64_t)psr_bits_from_float(z) << 32 | (uint32_t)at;
			p.fill.weight[at] = (uint16_t)(is_hole ? 0 : kind < holes + partial ? draw(257) : WEIGHT_ONE);
			bricks[brick] |= p.fill.weight[at] < WEIGHT_ONE;
			p.fill.r[at] = surface == 3 ? plan->background[0] : (uint16_t)draw(65536);
			p.fill.g[at] = surface == 3 ? plan->background[1] : (uint16_t)(65535 - draw(2));
			p.fill.b[at] = surface == 3 ? plan->background[2] : (uint16_t)draw(3);
		}
	memset(p.fill.rgb, 0x5a, 3 * area);
	for (size_t i = 0; i < area; i++)
		p.fill.depth[i] = -1;
	free(is_left);
	return p;
}

static void picture_free(struct picture *p)
{
	free(p->stack.word);
	free(p->fill.weight);
	free((void *)p->fill.bricks);
	free(p->fill.r);
	free(p->fill.g);
	free(p->fill.b);
	free(p->fill.rgb);
	free(p->fill.depth);
}

static struct dense dense_make(const struct picture *p)
{
	struct dense d = { .width = { p->stack.width }, .height = { p->stack.height } };
	do {
		d.top++;
		d.width[d.top] = (d.width[d.top - 1] + 1) / 2;
		d.height[d.top] = (d.height[d.top - 1] + 1) / 2;
	} while (d.width[d.top] > 1 || d.height[d.top] > 1);
	for (int l = 0; l <= d.top; l++)
		d.cell[l] = calloc((size_t)d.width[l] * d.height[l], sizeof **d.cell);
	d.own = malloc(p->area * sizeof *d.own);
	for (size_t i = 0; i < p->area; i++) {
		const uint32_t w = p->fill.weight[i];
		d.cell[0][i] = (struct cell){ { p->fill.r[i] * w / WEIGHT_ONE, p->fill.g[i] * w / WEIGHT_ONE,
			                            p->fill.b[i] * w / WEIGHT_ONE },
			                          w,
			                          psr_float_from_bits((uint32_t)(p->stack.word[i] >> 32)) };
		d.own[i] = d.cell[0][i].z;
	}
	return d;
}

/* Colours that fill_wants does not ask for are garbage, and the result must not tell. */
static void spoil(const struct picture *p, const uint8_t *wants)
{
	for (uint32_t y = 0; y < p->stack.height; y++)
		for (uint32_t x = 0; x < p->stack.width; x++) {
			const size_t at = (size_t)y * p->stack.width + x;
			const size_t brick = (size_t)(y / BRICK) * ((p->stack.width + BRICK - 1) / BRICK) + x / BRICK;
			if (!wants[brick] || !p->fill.weight[at])
				p->fill.r[at] = p->fill.g[at] = p->fill.b[at] = (uint16_t)draw(65536);
		}
}

static void compare(uint32_t width, uint32_t height, uint32_t holes, uint32_t partial, uint32_t whole,
                    const struct simd *simd, struct fill *fill)
{
	const struct plan plan = plan_of((int)draw(2));
	struct picture p = picture_make(width, height, holes, partial, whole, &plan);
	struct dense d = dense_make(&p);
	struct psr_report report = { .error_px = 1.5 };
	uint64_t n_changed = 0, n_filled = 0, n_far = 0;
	double reach = 0;

	p.stack.levels = draw(3) ? 2 : 6; /* a third has cells of level 2, too */
	p.fill.stack = &p.stack;
	uint16_t *weights = malloc(p.area * sizeof *weights); /* as they are before the fill makes pixels whole */
	assert_non_null(weights);
	memcpy(weights, p.fill.weight, p.area * sizeof *weights);
	assert_int_equal(fill_begin(fill, simd, &plan, &p.fill), PSR_OK);
	for (uint32_t row = 0; row < (height + BRICK - 1) / BRICK; row++)
		fill_look(fill, row);
	spoil(&p, fill_wants(fill));
	dense_fill(&d, &plan);
	for (uint32_t row = 0; row < (height + BRICK - 1) / BRICK; row++)
		fill_pull(fill, row);
	fill_push(fill, NULL, &report);
	for (size_t i = 0; i < p.area; i++) {
		const struct cell *c = &d.cell[0][i];
		assert_int_equal(p.fill.weight[i], WEIGHT_ONE);
		if (weights[i] == WEIGHT_ONE) {
			assert_true(p.fill.rgb[3 * i] == 0x5a && p.fill.rgb[3 * i + 2] == 0x5a && p.fill.depth[i] == -1);
			continue;
		}
		for (size_t k = 0; k < 3; k++)
			if (p.fill.rgb[3 * i + k] != srgb[c->rgb[k]])
				fail_msg("%ux%u, pixel (%u, %u): colour %u is %u and should be %u", width, height,
				         (unsigned)(i % width), (unsigned)(i / width), (unsigned)k, p.fill.rgb[3 * i + k],
				         srgb[c->rgb[k]]);
		n_changed++;
		n_filled += weights[i] == 0 && c->z < INFINITY;
		if (weights[i] >= WEIGHT_ONE / 2 || c->z == INFINITY) {
			assert_true(p.fill.depth[i] == (weights[i] < WEIGHT_ONE / 2 ? INFINITY : -1));
			continue;
		}
		if (p.stack.levels >> FILL_CLOSE) {
			assert_true(ldexpf(p.fill.depth[i], -p.stack.exponent) == c->z);
			n_far++;
			continue;
		}
		const struct beside beside =
			find_beside(&d, &plan, weights, (uint32_t)(i % width), (uint32_t)(i / width), c->z);
		assert_true(has_depth(&beside, c->z, ldexpf(p.fill.depth[i], -p.stack.exponent)));
		n_far += beside.distance == INFINITY;
		if (beside.distance < INFINITY)
			reach = fmax(reach, is_among(&beside, 0) ? beside.aside : beside.distance);
	}
	reach = n_far ? fmax(reach, M_SQRT2 * (double)(2 << d.deepest)) : reach;
	free(weights);
	assert_int_equal(report.count[PSR_STAGE_FILL], n_changed);
	assert_int_equal(report.n_filled, n_filled);
	/* Where rounding decides for the other depth, both are as far. */
	reach += 1.5 + (plan.perspective ? 1.5 * reach / (double)plan.focal : 0);
	assert_true(fabs(report.error_px - reach) <= 2 * ROUNDING);
	for (int l = 0; l <= d.top; l++)
		free(d.cell[l]);
	free(d.own);
	picture_free(&p);
}

static void for_each_isa(void (*check)(const struct simd *simd, struct fill *fill))
{
	for (int isa = 0; isa < PSR_N_ISAS; isa++) {
		const struct simd *simd = simd_of((enum psr_isa)isa);
		struct fill fill = { .top = 0 };
		if (!simd)
			continue;
		seed = 12345;
		check(simd, &fill);
		fill_clear(&fill);
	}
}

static void check_sizes(const struct simd *simd, struct fill *fill)
{
	static const uint32_t size[][2] = { { 1, 1 },    { 1, 2 },    { 3, 1 },     { 16, 16 },  { 31, 33 },
		                                { 32, 32 },  { 64, 64 },  { 65, 1 },    { 1, 70 },   { 97, 55 },
		                                { 256, 40 }, { 257, 64 }, { 300, 131 }, { 511, 96 }, { 513, 33 } };
	for (size_t i = 0; i < sizeof size / sizeof *size; i++) {
		compare(size[i][0], size[i][1], 60, 60, 0, simd, fill);
		compare(size[i][0], size[i][1], 4, 4, 4, simd, fill);
		compare(size[i][0], size[i][1], 250, 4, 2, simd, fill);
	}
}

static void sparse_equals_dense_at_every_size(void **state)
{
	(void)state;
	for_each_isa(check_sizes);
}

static void check_densities(const struct simd *simd, struct fill *fill)
{
	static const uint32_t holes[] = { 0, 1, 16, 128, 240, 256 }, partial[] = { 0, 1, 16 };
	for (size_t i = 0; i < 18; i++)
		for (uint32_t whole = 0; whole < 8; whole += 3)
			compare(150 + draw(200), 60 + draw(120), holes[i / 3], partial[i % 3], whole, simd, fill);
}

static void check_voids(const struct simd *simd, struct fill *fill)
{
	const struct psr_zstack stack = { .width = 1300, .height = 610 };
	const struct plan plan = plan_of(1);
	compare(stack.width, stack.height, 1, 1, 6, simd, fill);
	compare(stack.width, stack.height, 1, 0, 8, simd, fill);
	compare(stack.height, stack.width, 1, 1, 7, simd, fill);
	/* Not all of the picture is pulled for the sake of one void. */
	struct picture p = picture_make(stack.width, stack.height, 1, 0, 8, &plan);
	uint32_t n_wanted = 0, n_bricks = ((stack.width + BRICK - 1) / BRICK) * ((stack.height + BRICK - 1) / BRICK);
	p.fill.stack = &p.stack;
	assert_int_equal(fill_begin(fill, simd, &plan, &p.fill), PSR_OK);
	for (uint32_t row = 0; row < (stack.height + BRICK - 1) / BRICK; row++)
		fill_look(fill, row);
	const uint8_t *wants = fill_wants(fill);
	for (uint32_t i = 0; i < n_bricks; i++)
		n_wanted += wants[i] > 0;
	assert_true(fill->is_coarse);
	assert_in_range(n_wanted, 1, n_bricks / 2);
	picture_free(&p);
}

static void a_void_is_filled_from_around_it(void **state)
{
	(void)state;
	for_each_isa(check_voids);
}

static void sparse_equals_dense_for_all_densities(void **state)
{
	(void)state;
	for_each_isa(check_densities);
}

static int setup(void **state)
{
	(void)state;
	for (int i = 0; i < 65536; i++)
		srgb[i] = (uint8_t)(i ^ i >> 8); /* sees every bit of a colour */
	return 0;
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(sparse_equals_dense_at_every_size),
		cmocka_unit_test(sparse_equals_dense_for_all_densities),
		cmocka_unit_test(a_void_is_filled_from_around_it),
	};
	return cmocka_run_group_tests(tests, setup, NULL);
}
