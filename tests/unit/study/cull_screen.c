#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "base/vec.h"
#include "models/studies/cull.h"
#include "base/direction.h"
#include "tests/unit/sample/meshes.h"

static uint64_t (*masks)[SCREEN_WORDS];

static int make(void **state)
{
	(void)state;
	masks = calloc(SCREEN_NODES, sizeof *masks);
	return masks == NULL;
}

static int drop(void **state)
{
	(void)state;
	free(masks);
	return 0;
}

static int has(int node, unsigned triangle)
{
	return (int)(masks[node][triangle >> 6] >> (triangle & 63) & 1);
}

/* Number of the triangle, or -1 for a direction at the rim of one, where the float that is encoded may fall on either
 * side. */
static int triangle_of(const double v[3], int level)
{
	int found = -1;

	for (int i = 0; i < 6; i++) {
		float w[3] = { (float)v[0], (float)v[1], (float)v[2] };
		int t;

		w[i / 2] += i % 2 != 0 ? 1e-5f : -1e-5f;
		t = psr_direction_encode(w) >> 2 * (6 - level);
		if (i > 0 && t != found)
			return -1;
		found = t;
	}
	return found;
}

/* From what is seen at a place of the screen, -1..1, to the eye. */
static void to_eye(double v[3], const struct cull_eye *eye, double x, double y)
{
	const double ray[3] = { x * eye->tangent, y * eye->tangent, 1 };

	m3d_apply_transposed(v, eye->frame, ray);
	v3d_normalize(v, v);
	v3d_scale(v, v, -1);
}

static void every_direction_of_a_node_is_in_its_mask(void **state)
{
	uint64_t seed = 5;
	int n_tried = 0;

	(void)state;
	for (uint32_t which = 0; which < 40; which++) {
		const int level = (int)(which % 4), n = (int)(which / 4 % 7);
		struct screen screen = { 0, masks };
		struct cull_eye eye;

		cull_eye_place(&eye, which, 1);
		eye.tangent = 0.1 + 3 * meshes_random(&seed); /* up to 144 degrees */
		screen_make(&screen, n, eye.frame, (const double[2]){ eye.tangent, eye.tangent }, level);
		for (int i = 0; i < 2000; i++) {
			double x = 2 * meshes_random(&seed) - 1, y = 2 * meshes_random(&seed) - 1, v[3];
			int node = screen_node(&screen, x, y, x, y), t;

			to_eye(v, &eye, x, y);
			t = triangle_of(v, level);
			assert_true(node >> 2 * n == 1); /* a point is in a leaf */
			for (; t >= 0 && node > 0; node >>= 1)
				assert_true(has(node, (unsigned)t));
			n_tried += t >= 0;
		}
	}
	assert_true(n_tried > 75000);
}

/* A screen of a thousandth of a degree within a triangle has that bit alone, in all of its nodes. */
static void a_small_screen_has_one_direction(void **state)
{
	(void)state;
	for (unsigned t = 0; t < 128; t++) {
		struct screen screen = { 0, masks };
		double center[3], frame[3][3];

		psr_direction_center(2, t, center);
		v3d_scale(center, center, -1); /* forward: from the eye */
		psr_direction_basis(center, frame);
		screen_make(&screen, 3, (const double(*)[3])frame, (const double[2]){ 1e-5, 1e-5 }, 2);
		for (int node = 1; node < 2 << 6; node++)
			for (unsigned other = 0; other < 128; other++)
				assert_int_equal(has(node, other), other == t);
	}
}

/* Looking along an axis at 90 degrees one sees the face of a cube, which reaches into the four octants around it. */
static void a_screen_along_an_axis_has_four_octants(void **state)
{
	const double frame[3][3] = { { 1, 0, 0 }, { 0, -1, 0 }, { 0, 0, -1 } }; /* forward is -z: to the eye is +z */
	struct screen screen = { 0, masks };

	(void)state;
	screen_make(&screen, 0, frame, (const double[2]){ 1, 1 }, 0);
	assert_int_equal(masks[1][0], 0x0f); /* bit 4 of an octant is z < 0 */
}

/* [G] 6.3: "the mask of each internal BSP tree node is the OR of the masks of its two children" */
static void a_node_has_what_its_children_have(void **state)
{
	(void)state;
	for (uint32_t which = 0; which < 30; which++) {
		struct screen screen = { 0, masks };
		struct cull_eye eye;

		cull_eye_place(&eye, which, 1);
		screen_make(&screen, 4, eye.frame, (const double[2]){ eye.tangent, eye.tangent }, (int)(which % 4));
		for (int node = 1; node < 1 << 8; node++)
			for (int w = 0; w < SCREEN_WORDS; w++)
				assert_true(masks[node][w] == (masks[2 * node][w] | masks[2 * node + 1][w]));
	}
}

/* x0, y0, x1, y1 of a node: each bit below the highest halves it, x first. */
static void bounds_of(int node, double low[2], double high[2])
{
	int depth = 0;

	while (node >> (depth + 1) != 0)
		depth++;
	low[0] = low[1] = -1;
	high[0] = high[1] = 1;
	for (int d = 0; d < depth; d++) {
		double middle = (low[d & 1] + high[d & 1]) / 2;

		if ((node >> (depth - 1 - d) & 1) != 0)
			low[d & 1] = middle;
		else
			high[d & 1] = middle;
	}
}

static void no_smaller_node_holds_a_rectangle(void **state)
{
	struct screen screen = { 4, masks };
	uint64_t seed = 9;

	(void)state;
	for (int i = 0; i < 3000; i++) {
		double low[2], high[2], a[2], b[2];
		int node, most = 1;

		for (int k = 0; k < 2; k++) {
			double size = meshes_random(&seed) * meshes_random(&seed);

			low[k] = -1 + (2 - size) * meshes_random(&seed);
			high[k] = low[k] + size;
		}
		node = screen_node(&screen, low[0], low[1], high[0], high[1]);
		for (int other = 1; other < 2 << 8; other++) { /* deeper ones come later */
			bounds_of(other, a, b);
			if (low[0] >= a[0] && low[1] >= a[1] && high[0] <= b[0] && high[1] <= b[1])
				most = other;
		}
		assert_int_equal(node, most);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_direction_of_a_node_is_in_its_mask),
		cmocka_unit_test(a_small_screen_has_one_direction),
		cmocka_unit_test(a_screen_along_an_axis_has_four_octants),
		cmocka_unit_test(a_node_has_what_its_children_have),
		cmocka_unit_test(no_smaller_node_holds_a_rectangle),
	};

	return cmocka_run_group_tests(tests, make, drop);
}
