/* Where discs are cut, and which of their offcuts are closed again. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include "base/direction.h"
#include "base/maths.h"
#include "base/random.h"
#include "render/splat.h"
#include "render/splat_cut.h"

#define HIGH 0.866025403784438647 /* of a row, in steps */

/* The place of a sample in its block's lattice, in steps. */
static void place_of(double p[2], int sample)
{
	p[0] = sample % 8 + 0.5 * (sample / 8 % 2);
	p[1] = sample / 8 * HIGH;
}

/* The sample one step away in a direction of the lattice; -1: beyond the block. */
static int neighbor(int sample, double x, double y)
{
	double from[2], to[2];

	place_of(from, sample);
	for (int other = 0; other < 64; other++) {
		place_of(to, other);
		if (fabs(to[0] - from[0] - x) < 0.1 && fabs(to[1] - from[1] - y) < 0.1)
			return other;
	}
	return -1;
}

static const double line[3][2] = { { 1, 0 }, { 0.5, HIGH }, { -0.5, HIGH } };

static int lacks(uint64_t mask, int sample, double x, double y)
{
	const int other = neighbor(sample, x, y);

	return (mask >> sample & 1) && other >= 0 && !(mask >> other & 1);
}

static void ends_are_where_a_block_lacks_a_neighbor(void **state)
{
	uint64_t random = 1, mask = 1;

	(void)state;
	for (int trial = 0; trial < 200; trial++) {
		struct splat_ends ends;
		uint64_t any = 0;

		splat_find_ends(&ends, mask);
		for (int s = 0; s < 64; s++)
			for (int i = 0; i < 3; i++) {
				const int next = lacks(mask, s, line[i][0], line[i][1]);
				const int last = lacks(mask, s, -line[i][0], -line[i][1]);

				assert_int_equal(ends.next[i] >> s & 1, next);
				assert_int_equal(ends.last[i] >> s & 1, last);
				any |= (uint64_t)(next | last) << s;
			}
		assert_true(ends.any == any);
		mask = trial == 0 ? UINT64_MAX : random_next(&random);
	}
}

/* Each cut is a line across the way to the missing neighbour, whatever the disc's two radii are. */
static void a_cut_is_across_the_way_to_the_missing_sample(void **state)
{
	static const float radius[2] = { 0.6f, 0.3f };

	(void)state;
	for (int i = 0; i < 6; i++) {
		const double turn = i < 3 ? 1 : -1, x = turn * line[i % 3][0], y = turn * line[i % 3][1];
		const int sample = 27, missing = neighbor(sample, x, y);
		struct splat_ends ends;
		struct splat_cut cut;

		splat_find_ends(&ends, ~(UINT64_C(1) << missing));
		assert_true(ends.any >> sample & 1);
		splat_cut_make(&cut, &ends, sample, radius);
		for (int side = -4; side <= 4; side++)
			for (int off = -1; off <= 1; off += 2) {
				const double along = (double)SPLAT_CUT + off * 0.01, across = side * 0.1;
				const double px = along * x - across * y, py = along * y + across * x; /* steps */

				const float place[2] = { (float)(px / 0.6), (float)(py / 0.3) }; /* in radii */

				assert_int_equal(splat_is_cut_off(&cut, place), off > 0);
			}
		assert_false(splat_is_cut_off(&cut, (const float[2]){ (float)-x, (float)-y }));
	}
}

/* ---- seams ---- */

enum { WIDTH = 64, HEIGHT = 32, LEFT = 20, TOP = 12 };

/* An empty offcut in a surface of depth 2. */
struct seam {
	int level;           /* of its cells */
	uint32_t width;      /* of the offcut, from LEFT on, */
	uint32_t n_rows;     /* from TOP on; the rows above and below are of the surface as far as the offcut goes */
	float right;         /* the depth beyond */
	int is_inside, is_marked;
};

/* How many of its pixels are closed. Every second cell has samples, so no pixel is covered by all cells around it, and
 * level 4's threshold lets nothing be one surface in eight directions: only offcuts are closed. */
static uint32_t n_closed(const struct seam *seam)
{
	const struct psr_run run = { 0, 0 };
	const float toward[3] = { 0, 0, -1 };
	const uint64_t mask = 1, attr = psr_direction_encode(toward);
	const uint16_t offset = 0;
	const struct psr_blocks blocks = { .n_blocks = 1, .run = &run, .mask = &mask, .attr_offset = &offset,
		                               .attr = &attr };
	struct plan_instance instance = { .cull = { .blocks = &blocks },
		                              .turn = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } } };
	const struct plan plan = { .gap_scale = { [1] = 1.03f, [2] = 1.06f, [3] = 1.12f }, .n_instances = 1,
		                       .instance = &instance };
	static float cell[WIDTH * HEIGHT];
	static uint64_t word[WIDTH * HEIGHT];
	static uint16_t weight[WIDTH * HEIGHT];
	uint8_t bricks[WIDTH / BRICK * HEIGHT / BRICK], bits[WIDTH / 8 * HEIGHT] = { 0 };
	uint8_t is_inside[WIDTH / 16 * HEIGHT / 16];
	const struct gaps_map map = { weight, bricks };
	struct psr_zstack stack = { .width = WIDTH, .height = HEIGHT, .word = word, .levels = 1u << seam->level };
	const struct inside inside = { is_inside, WIDTH / 16, 0, 0, 4 };
	const struct splat_picture picture = { simd_get(), &plan, &stack, &inside, { bits, WIDTH / 8 } };

	const uint32_t cells_x = (WIDTH >> seam->level) + 2, cells_y = (HEIGHT >> seam->level) + 2;

	stack.level[seam->level].z = cell;
	stack.level[seam->level].width = cells_x;
	stack.level[seam->level].height = cells_y;
	for (uint32_t i = 0; i < cells_x * cells_y; i++)
		cell[i] = (i % cells_x + i / cells_x) % 2 ? INFINITY : 2;
	memset(is_inside, seam->is_inside, sizeof is_inside);
	for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
		const uint32_t x = i % WIDTH, y = i / WIDTH;
		const int is_hole = x - LEFT < seam->width && y - TOP < seam->n_rows;
		const float z = x < LEFT + seam->width ? 2 : seam->right;

		word[i] = is_hole || z == INFINITY ? PSR_WORD_EMPTY : (uint64_t)psr_bits_from_float(z) << 32;
		weight[i] = WEIGHT_ONE;
		if (is_hole && seam->is_marked)
			bits[i / 8] |= (uint8_t)(1 << x % 8);
	}
	return splat_close(&picture, 0, HEIGHT, &map);
}

static void an_offcut_between_places_of_one_surface_is_closed(void **state)
{
	struct seam seam = { .level = 3, .width = 4, .n_rows = 4, .right = 2, .is_marked = 1 };

	(void)state;
	assert_int_equal(n_closed(&seam), 16);
	seam.is_marked = 0;
	assert_int_equal(n_closed(&seam), 0);
}

/* At the end of a surface there is nothing on the other side, or another surface. Near the rows above and below, which
 * go on, slanted lines find them: in triangles as high as the offcut is wide. */
static void an_offcut_where_the_surface_ends_stays_open(void **state)
{
	struct seam seam = { .level = 3, .width = 4, .n_rows = 12, .right = INFINITY, .is_marked = 1 };
	const uint32_t n_beside = 2 * (4 + 3 + 2 + 1);

	(void)state;
	assert_in_range(n_closed(&seam), 0, n_beside);
	seam.right = 2.3f; /* beyond level 3's threshold, 2.24 */
	assert_in_range(n_closed(&seam), 0, n_beside);
	seam.right = 2.2f;
	assert_int_equal(n_closed(&seam), 4 * 12);
}

/* The last pixel of a row that is short of the rows beside it may be of an edge that samples draw as zigzag. What is
 * well inside of the plain frame's object is no edge. */
static void the_mouth_of_a_notch_stays_open_at_an_edge(void **state)
{
	struct seam seam = { .width = 6, .n_rows = 1, .right = INFINITY, .is_marked = 1 };

	(void)state;
	for (seam.level = 2; seam.level <= 3; seam.level++)
		for (seam.is_inside = 0; seam.is_inside <= 1; seam.is_inside++)
			assert_int_equal(n_closed(&seam), seam.is_inside ? 6 : 5);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(ends_are_where_a_block_lacks_a_neighbor),
		cmocka_unit_test(a_cut_is_across_the_way_to_the_missing_sample),
		cmocka_unit_test(an_offcut_between_places_of_one_surface_is_closed),
		cmocka_unit_test(an_offcut_where_the_surface_ends_stays_open),
		cmocka_unit_test(the_mouth_of_a_notch_stays_open_at_an_edge),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
