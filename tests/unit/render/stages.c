/* Gaps and fill by themselves, on stacks and pictures made by hand. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include "base/maths.h"
#include "base/random.h"
#include "render/fill.h"
#include "render/gaps.h"

#define SIDE 16

/* A plan for pictures of SIDE x SIDE, orthographic, one unit a pixel: thresholds are 3 units at level 1, 6 at level
 * 2. */
static struct plan flat_plan(void)
{
	struct plan plan = { .width = SIDE, .height = SIDE, .focal = 1, .background = { 100, 200, 300 } };
	for (int k = 0; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		plan.gap_scale[k] = 1;
		plan.gap_offset[k] = 1.5f * (float)(1 << k);
	}
	return plan;
}

struct stack {
	struct psr_zstack stack;
	uint64_t word[SIDE * SIDE];
	float level[3][(SIDE / 2 + 2) * (SIDE / 2 + 2)];
};

/* Every pixel at depth 100, levels 1 and 2 empty. */
static void stack_init(struct stack *s)
{
	s->stack = (struct psr_zstack){ .width = SIDE, .height = SIDE, .word = s->word, .levels = 6 };
	for (int i = 0; i < SIDE * SIDE; i++)
		s->word[i] = (uint64_t)psr_bits_from_float(100) << 32 | (uint32_t)i;
	for (int k = 1; k <= 2; k++) {
		s->stack.level[k].z = s->level[k];
		s->stack.level[k].width = s->stack.level[k].height = (SIDE >> k) + 2;
		for (uint32_t i = 0; i < s->stack.level[k].width * s->stack.level[k].height; i++)
			s->level[k][i] = INFINITY;
	}
}

static void set_cell(struct stack *s, int k, uint32_t x, uint32_t y, float z)
{
	s->level[k][(y + 1) * s->stack.level[k].width + x + 1] = z;
}

static uint16_t weight_at(const struct stack *s, uint32_t x, uint32_t y)
{
	struct plan plan = flat_plan();
	uint16_t weight[SIDE * SIDE];
	uint8_t brick;
	gaps_rows(simd_get(), &plan, &s->stack, 0, SIDE, &(struct gaps_map){ weight, &brick });
	return weight[y * SIDE + x];
}

/* [G] figure 4.7: one of four vertices in front. Cell (2, 2) of level 1 is the pixels 4..5. */
static void coverage_is_bilinear(void **state)
{
	(void)state;
	struct stack s;
	stack_init(&s);
	set_cell(&s, 1, 2, 2, 50);
	assert_int_equal(weight_at(&s, 4, 4), WEIGHT_ONE - WEIGHT_ONE * 9 / 16);
	assert_int_equal(weight_at(&s, 5, 5), WEIGHT_ONE - WEIGHT_ONE * 9 / 16);
	assert_int_equal(weight_at(&s, 6, 4), WEIGHT_ONE - WEIGHT_ONE * 3 / 16);
	assert_int_equal(weight_at(&s, 3, 5), WEIGHT_ONE - WEIGHT_ONE * 3 / 16);
	assert_int_equal(weight_at(&s, 3, 3), WEIGHT_ONE - WEIGHT_ONE * 1 / 16);
	assert_int_equal(weight_at(&s, 2, 4), WEIGHT_ONE);
	assert_int_equal(weight_at(&s, 4, 7), WEIGHT_ONE);
}

static void surrounded_pixels_are_holes_at_the_border_too(void **state)
{
	(void)state;
	struct stack s;
	stack_init(&s);
	for (uint32_t i = 0; i < s.stack.level[2].width * s.stack.level[2].height; i++)
		s.level[2][i] = 50;
	for (uint32_t y = 0; y < SIDE; y++)
		for (uint32_t x = 0; x < SIDE; x++)
			assert_int_equal(weight_at(&s, x, y), 0);
}

static void what_is_within_the_threshold_stays(void **state)
{
	(void)state;
	struct stack s;
	stack_init(&s);
	set_cell(&s, 1, 2, 2, 97.5f);
	assert_int_equal(weight_at(&s, 4, 4), WEIGHT_ONE);
	set_cell(&s, 1, 2, 2, 96.5f);
	assert_int_equal(weight_at(&s, 4, 4), WEIGHT_ONE * 7 / 16);
	stack_init(&s);
	set_cell(&s, 2, 1, 1, 94.5f); /* coarser cells forgive more */
	assert_int_equal(weight_at(&s, 6, 6), WEIGHT_ONE);
	set_cell(&s, 2, 1, 1, 93.5f);
	assert_true(weight_at(&s, 6, 6) < WEIGHT_ONE);
}

static void empty_pixels_before_a_surface_are_holes(void **state)
{
	(void)state;
	struct stack s;
	stack_init(&s);
	for (uint32_t x = 3; x < 6; x++)
		s.word[4 * SIDE + x] = PSR_WORD_EMPTY;
	assert_int_equal(weight_at(&s, 4, 4), WEIGHT_ONE); /* nothing covers it: background */
	set_cell(&s, 1, 2, 2, 100);
	assert_int_equal(weight_at(&s, 4, 4), WEIGHT_ONE * 7 / 16);
	assert_int_equal(weight_at(&s, 5, 5), WEIGHT_ONE); /* the surface itself */
}

static void levels_are_not_summed(void **state)
{
	(void)state;
	struct stack s;
	stack_init(&s);
	set_cell(&s, 1, 2, 2, 50);
	uint16_t fine = weight_at(&s, 4, 4);
	stack_init(&s);
	set_cell(&s, 2, 1, 1, 50);
	uint16_t coarse = weight_at(&s, 4, 4);
	set_cell(&s, 1, 2, 2, 50);
	assert_int_equal(weight_at(&s, 4, 4), fine < coarse ? fine : coarse);
}

/* [G] 9.1.2: a surface whose left half is in level 1 and whose right half is in level 2 covers all that is behind
 * it. */
static void a_seam_between_levels_is_closed(void **state)
{
	(void)state;
	struct stack s;
	stack_init(&s);
	for (uint32_t y = 0; y < SIDE / 2; y++)
		for (uint32_t x = 0; x < SIDE / 4; x++)
			set_cell(&s, 1, x, y, 50);
	for (uint32_t y = 0; y < SIDE / 4; y++)
		for (uint32_t x = SIDE / 8; x < SIDE / 4; x++)
			set_cell(&s, 2, x, y, 51);
	for (uint32_t x = 2; x < SIDE - 2; x++)
		assert_int_equal(weight_at(&s, x, SIDE / 2), 0);
	/* The edge of a surface that is in both levels is where the coarser one has it. */
	stack_init(&s);
	set_cell(&s, 2, 1, 1, 50);
	uint16_t coarse = weight_at(&s, 8, 6);
	for (uint32_t x = 2; x < 4; x++)
		for (uint32_t y = 2; y < 4; y++)
			set_cell(&s, 1, x, y, 50);
	assert_int_equal(weight_at(&s, 8, 6), coarse);
}

struct picture {
	uint16_t grey[SIDE * SIDE], weight[SIDE * SIDE]; /* what is painted */
	float z[SIDE * SIDE];
	uint16_t r[SIDE * SIDE], g[SIDE * SIDE], b[SIDE * SIDE];
	uint64_t word[SIDE * SIDE];
	/* What the fill makes of it, where it fills: high bytes and low bytes of colours, depths. */
	uint8_t high[3 * SIDE * SIDE], low[3 * SIDE * SIDE];
	float depth[SIDE * SIDE];
};

static uint8_t high_byte[65536], low_byte[65536];

static void paint(struct picture *p, uint32_t x, uint32_t y, uint16_t grey, uint16_t weight, float z)
{
	p->grey[y * SIDE + x] = grey;
	p->weight[y * SIDE + x] = weight;
	p->z[y * SIDE + x] = z;
}

static struct psr_report fill_once(struct picture *p, const uint8_t *table, uint8_t *rgb)
{
	struct plan plan = flat_plan();
	const struct psr_zstack stack = { .width = SIDE, .height = SIDE, .word = p->word };
	const uint8_t brick = 1;
	uint16_t weight[SIDE * SIDE]; /* that become whole */
	const struct fill_picture picture = { &stack, weight, &brick, p->r, p->g, p->b, table, rgb, p->depth };
	struct fill fill = { .top = 0 };
	struct psr_report report = { .n_filled = 0 };
	memcpy(weight, p->weight, sizeof weight);
	for (int i = 0; i < SIDE * SIDE; i++) {
		p->r[i] = p->g[i] = p->b[i] = p->grey[i];
		p->word[i] = (uint64_t)psr_bits_from_float(p->z[i]) << 32 | 0xffffffff;
	}
	assert_int_equal(fill_begin(&fill, simd_get(), &plan, &picture), PSR_OK);
	fill_look(&fill, 0);
	assert_true(*fill_wants(&fill) > 0);
	fill_pull(&fill, 0);
	fill_push(&fill, NULL, &report);
	fill_clear(&fill);
	return report;
}

static struct psr_report fill_picture(struct picture *p)
{
	for (uint32_t i = 0; i < 65536; i++) {
		high_byte[i] = (uint8_t)(i >> 8);
		low_byte[i] = (uint8_t)i;
	}
	for (int i = 0; i < SIDE * SIDE; i++) {
		p->depth[i] = p->z[i];
		for (int k = 0; k < 3; k++) {
			p->high[3 * i + k] = (uint8_t)(p->grey[i] >> 8);
			p->low[3 * i + k] = (uint8_t)p->grey[i];
		}
	}
	fill_once(p, high_byte, p->high);
	return fill_once(p, low_byte, p->low);
}

static uint32_t color_at(const struct picture *p, uint32_t x, uint32_t y, uint32_t k)
{
	const uint32_t i = 3 * (y * SIDE + x) + k;
	return (uint32_t)p->high[i] << 8 | p->low[i];
}

static void one_color_with_holes_is_that_color(void **state)
{
	(void)state;
	uint64_t seed = 5;
	uint32_t holes = 0;
	struct picture p;
	for (uint32_t i = 0; i < SIDE * SIDE; i++) {
		const int is_hole = (int)random_below(&seed, 2);
		holes += (uint32_t)is_hole;
		paint(&p, i % SIDE, i / SIDE, is_hole ? 1 : 54321, is_hole ? 0 : WEIGHT_ONE, is_hole ? 900 : 100);
	}
	struct psr_report report = fill_picture(&p);
	for (uint32_t i = 0; i < SIDE * SIDE; i++) {
		assert_int_equal(color_at(&p, i, 0, 0), 54321);
		assert_true(p.depth[i] == 100);
	}
	assert_int_equal(report.n_filled, holes);
	assert_int_equal(report.count[PSR_STAGE_FILL], holes);
}

/* [G] 4.7 by hand: the hole (5, 5) has the parent (2, 2), of whose four pixels three are left, and the
 * neighbours (3, 2) and (2, 3). */
static void a_hole_gets_a_half_a_quarter_and_a_quarter(void **state)
{
	(void)state;
	struct picture p;
	for (uint32_t i = 0; i < SIDE * SIDE; i++)
		paint(&p, i % SIDE, i / SIDE, (uint16_t)(1000 * (i % SIDE) + 100 * (i / SIDE)), WEIGHT_ONE, 100);
	uint32_t parent = (4400 + 5400 + 4500) / 3, right = (6400 + 7400 + 6500 + 7500) / 4,
			 below = (4600 + 5600 + 4700 + 5700) / 4;
	paint(&p, 5, 5, 0, 0, 500);
	fill_picture(&p);
	assert_int_equal(color_at(&p, 5, 5, 0), (2 * parent + right + below) / 4);
	/* Half a weight keeps half of its own colour. */
	paint(&p, 5, 5, 9000, WEIGHT_ONE / 2, 100);
	fill_picture(&p);
	parent = (4400 + 5400 + 4500 + 9000 / 2) * 2 / 7;
	assert_in_range(color_at(&p, 5, 5, 0), 4500 + (2 * parent + right + below) / 8 - 2,
	                4500 + (2 * parent + right + below) / 8 + 2);
}

static void a_hole_takes_the_near_surface_not_the_far_one(void **state)
{
	(void)state;
	struct picture p;
	for (uint32_t y = 0; y < SIDE; y++)
		for (uint32_t x = 0; x < SIDE; x++) {
			int near = x < 8;
			paint(&p, x, y, near ? 40000 : 100, WEIGHT_ONE, near ? 100 : INFINITY);
		}
	for (uint32_t y = 0; y < SIDE; y++)
		paint(&p, 7, y, 100, 0, INFINITY);
	struct psr_report report = fill_picture(&p);
	for (uint32_t y = 0; y < SIDE; y++) {
		assert_int_equal(color_at(&p, 7, y, 1), 40000);
		assert_true(p.depth[y * SIDE + 7] == 100);
		assert_int_equal(color_at(&p, 8, y, 1), 100);
	}
	assert_int_equal(report.n_filled, SIDE);
}

static void nothing_at_all_is_background(void **state)
{
	(void)state;
	struct picture p;
	for (uint32_t i = 0; i < SIDE * SIDE; i++)
		paint(&p, i % SIDE, i / SIDE, 7, 0, INFINITY);
	fill_picture(&p);
	for (uint32_t i = 0; i < SIDE * SIDE; i++) {
		assert_int_equal(color_at(&p, i, 0, 0), 100);
		assert_int_equal(color_at(&p, i, 0, 2), 300);
		assert_true(isinf(p.depth[i]));
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(coverage_is_bilinear),
		cmocka_unit_test(surrounded_pixels_are_holes_at_the_border_too),
		cmocka_unit_test(what_is_within_the_threshold_stays),
		cmocka_unit_test(empty_pixels_before_a_surface_are_holes),
		cmocka_unit_test(levels_are_not_summed),
		cmocka_unit_test(a_seam_between_levels_is_closed),
		cmocka_unit_test(one_color_with_holes_is_that_color),
		cmocka_unit_test(a_hole_gets_a_half_a_quarter_and_a_quarter),
		cmocka_unit_test(a_hole_takes_the_near_surface_not_the_far_one),
		cmocka_unit_test(nothing_at_all_is_background),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
