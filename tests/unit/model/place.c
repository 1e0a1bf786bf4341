#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "base/vec.h"
#include "base/direction.h"
#include "model/blocks.h"

struct one {
	struct psr_projection projection;
	int16_t x, y, z;
	uint8_t number, flags;
	struct psr_blocks blocks;
};

static uint64_t seed = 0x243f6a8885a308d3u;

static double random_between(double low, double high)
{
	seed ^= seed << 13;
	seed ^= seed >> 7;
	seed ^= seed << 17;
	return low + (high - low) * (double)(seed >> 11) * 0x1p-53;
}

/* A block with the middle of its sphere at x, y, z in the space of a random projection. */
static void make(struct one *one, double spacing, unsigned level, double n[3], const double p[3])
{
	double frame[3][3], center[3];

	v3d_normalize(n, n);
	psr_direction_basis(n, frame);
	m3d_apply_transposed(center, (const double(*)[3])frame, p);
	*one = (struct one){ .projection.spacing = (float)spacing, .x = (int16_t)rint(center[0] * 0x1p14),
		                 .y = (int16_t)rint(center[1] * 0x1p14), .z = (int16_t)rint(center[2] * 0x1p14) };
	for (int k = 0; k < 9; k++)
		one->projection.axis[k / 3][k % 3] = (float)frame[k / 3][k % 3];
	one->flags = (uint8_t)(level | 5 << 3);
	one->blocks = (struct psr_blocks){ .projection = &one->projection, .sphere_x = &one->x, .sphere_y = &one->y,
		                               .sphere_z = &one->z, .block_projection = &one->number, .flags = &one->flags };
}

/* Rounding the center to 2^-14 moves it by 0.87 of that; an axis of single precision, of components off by 2^-25 each,
 * by less than 2^-23 where it is within 2. */
#define OFF (0.87 * 0x1p-14 + 0x1p-23)

static void spheres_tell_windows_of_any_column_and_even_row(void **state)
{
	const double finest = 2.0 / 8192 / 2; /* of resolution 8192 and a tolerance of 60 degrees */

	(void)state;
	for (int i = 0; i < 20000; i++) {
		unsigned level = (unsigned)(i % 8);
		double spacing = finest * exp2(random_between(0, 10)), step = spacing * (1u << level);
		double pitch = step * sqrt(0.75), n[3], p[3];
		int col = (int)(random_between(-1.1, 1.1) / step), row = 2 * (int)(random_between(-0.55, 0.55) / pitch);
		struct psr_place place;
		struct one one;

		for (int k = 0; k < 3; k++)
			n[k] = random_between(-1, 1);
		p[0] = (col + 3.75) * step + random_between(-1, 1) * (step / 2 - OFF);
		p[1] = (row + 3.5) * pitch + random_between(-1, 1) * (pitch - OFF);
		p[2] = random_between(-1.1, 1.1);
		if (v3d_length(p) > 1.9)
			continue;
		make(&one, spacing, level, n, p);
		psr_blocks_place(&one.blocks, 0, &place);
		assert_true(place.col == (double)col * (1u << level) && place.row == (double)row * (1u << level));
		assert_true(fabs(place.z - p[2]) <= OFF);
	}
}

static void depths_are_told_from_that_of_the_center(void **state)
{
	struct psr_place place;
	struct one one;

	(void)state;
	make(&one, 0.25, 0, (double[3]){ 0, 0, 1 }, (double[3]){ 0, 0, -0.5 });
	psr_blocks_place(&one.blocks, 0, &place);
	assert_true(place.step == 0x1p-19f); /* 14 and 5 */
	assert_true(psr_place_depth(&place, 32768) == -0.5f);
	assert_true(psr_place_depth(&place, 0) == -0.5625f);
	assert_true(psr_place_depth(&place, 65535) == -0.4375f - 0x1p-19f);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(spheres_tell_windows_of_any_column_and_even_row),
		cmocka_unit_test(depths_are_told_from_that_of_the_center),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
