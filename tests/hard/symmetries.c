/* What may be exchanged, scaled, divided or moved without a change of the picture. All random, from fixed seeds. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/direction.h"
#include "base/random.h"
#include "base/vec.h"
#include "lib/blocks.h"
#include "lib/exact.h"
#include "lib/world.h"
#include "render/cull.h"
#include "render/zbuffer.h"

#define WIDTH 301
#define HEIGHT 260

/* Without ids of samples and instances. */
#define LOOKS (HARD_ALL_PLANES & ~(1u << PSR_PLANE_WORDS | 1u << PSR_PLANE_ID))

static void shuffle(uint32_t *order, uint32_t n, uint64_t *seed)
{
	for (uint32_t i = n - 1; i > 0; i--) {
		const uint32_t j = random_below(seed, i + 1), was = order[i];

		order[i] = order[j];
		order[j] = was;
	}
}

/* Words and cells are minima: the order of a tile's blocks is nothing to them. */
static void blocks_may_be_warped_in_any_order(void **state)
{
	uint64_t seed = 1;

	(void)state;
	for (int i = 0; i < HARD_CASES(100); i++) {
		struct hard_world w;
		struct render_settings settings;
		struct plan plan = { 0 };
		struct bins bins = { 0 };
		struct psr_report report = { 0 };
		struct psr_zstack stack = { 0 };
		uint64_t *word[2];
		float *cells[2];

		hard_world_make(&w, &seed);
		render_settings_default(&settings, TILE_WIDTH, TILE_HEIGHT);
		assert_int_equal(plan_make(&plan, &w.scene, &settings, NULL), PSR_OK);
		assert_int_equal(cull_blocks(&bins, simd_get(), &plan, NULL, &report), PSR_OK);
		const size_t n_cells = zbuffer_measure(&stack, TILE_WIDTH, TILE_HEIGHT, report.levels & ~1u);
		const uint32_t n = bins.tile_begin[1];
		uint32_t *order = malloc((n + 1) * sizeof *order);
		struct bin_entry *entry = malloc((n + 1) * sizeof *entry);
		for (int turn = 0; turn < 2; turn++) {
			struct warp_target target;

			word[turn] = malloc(TILE_WIDTH * TILE_HEIGHT * sizeof *word[turn]);
			cells[turn] = malloc((n_cells + 1) * sizeof *cells[turn]);
			stack.word = word[turn];
			zbuffer_place_cells(&stack, cells[turn]);
			warp_target_make(&target, &plan, &stack, 0, NULL);
			target.clean = target.bare = 0;
			simd_get()->warp_clear(&target, stack.levels);
			for (uint32_t e = 0; e < n; e++)
				order[e] = e;
			if (turn)
				shuffle(order, n, &seed);
			for (uint32_t e = 0; e < n; e++)
				entry[e] = bins.entry[order[e]];
			simd_get()->warp(&target, entry, n);
		}
		assert_memory_equal(word[0], word[1], TILE_WIDTH * TILE_HEIGHT * sizeof *word[0]);
		assert_memory_equal(cells[0], cells[1], n_cells * sizeof *cells[0]);
		for (int turn = 0; turn < 2; turn++) {
			free(word[turn]);
			free(cells[turn]);
		}
		free(order);
		free(entry);
		plan_clear(&plan);
		bins_clear(&bins);
		hard_world_clear(&w);
	}
}

/* A model's blocks in another order are culled and binned in another order. Depths are the same bits. A pixel's sample
 * is the same but where two have the same bits of depth there: then the lower number wins, and numbers changed. */
static void blocks_may_be_culled_and_binned_in_any_order(void **state)
{
	uint64_t seed = 2, n_ties = 0, n_drawn = 0;

	(void)state;
	for (int i = 0; i < HARD_CASES(60); i++) {
		struct hard_world w;
		struct hard_block *other = malloc(HARD_BLOCKS * sizeof *other);
		struct psr_instance instance;
		uint32_t order[HARD_BLOCKS];
		struct psr_frame frame[2];
		uint64_t n_here = 0;

		hard_world_make(&w, &seed);
		for (uint32_t b = 0; b < HARD_BLOCKS; b++)
			order[b] = b;
		shuffle(order, HARD_BLOCKS, &seed);
		for (uint32_t b = 0; b < HARD_BLOCKS; b++)
			other[b] = w.block[order[b]];
		instance = hard_place(hard_world_model(&w, other, HARD_BLOCKS));
		hard_draw(&frame[0], &w.scene, WIDTH, HEIGHT);
		w.scene.instance = &instance;
		hard_draw(&frame[1], &w.scene, WIDTH, HEIGHT);
		hard_same_planes(&frame[0], &frame[1], 1u << PSR_PLANE_DEPTH | 1u << PSR_PLANE_WEIGHT);
		for (size_t p = 0; p < (size_t)WIDTH * HEIGHT; p++) {
			const uint64_t a = frame[0].words[p], b = frame[1].words[p];

			assert_int_equal(a >> 32, b >> 32);
			if (a == PSR_WORD_EMPTY)
				continue;
			n_here += (uint32_t)a != 64 * order[(uint32_t)b / 64] + (uint32_t)b % 64;
			n_drawn++;
		}
		if (n_here == 0)
			hard_same_planes(&frame[0], &frame[1], LOOKS);
		n_ties += n_here;
		psr_frame_free(&frame[0]);
		psr_frame_free(&frame[1]);
		psr_model_unref((struct psr_model *)instance.model);
		hard_world_clear(&w);
		free(other);
	}
	/* Depths have 24 bits; some 20 samples fall to a pixel at most. */
	assert_true(n_ties <= n_drawn / 1000);
}

/* All lengths times 2^n: floats and doubles keep their digits, and the frame its bits, but for the exponents of its
 * depths; in all planes, smoothed, and in passes. */
static void a_scene_scaled_by_a_power_of_two_is_the_same_picture(void **state)
{
	static const int by[] = { -90, -60, -20, -1, 1, 10, 40, 90 };
	uint64_t seed = 3;

	(void)state;
	for (int i = 0; i < HARD_CASES(20); i++) {
		struct hard_world w;
		struct psr_settings settings;
		struct psr_frame plain, still;

		hard_world_make(&w, &seed);
		w.instance.translation[0] = 0.1;
		w.scene.camera.near_z = i % 2 ? 0.3 : 0;
		hard_draw(&plain, &w.scene, WIDTH, HEIGHT);
		psr_settings_default(&settings, 100, 70);
		settings.smooth = 1;
		settings.pass = (unsigned)i % 3;
		hard_draw_pass(&still, &w.scene, &settings);
		for (size_t n = 0; n < sizeof by / sizeof by[0]; n++) {
			const double scale = ldexp(1, by[n]);
			struct psr_instance large = w.instance;
			struct psr_light lamp[2] = { w.light[0], w.light[1] };
			struct psr_scene scaled = w.scene;
			struct psr_frame frame;

			large.scale *= scale;
			v3d_scale(large.translation, w.instance.translation, scale);
			scaled.instance = &large;
			scaled.light = lamp;
			v3d_scale(lamp[1].position, w.light[1].position, scale);
			lamp[1].reference *= scale;
			v3d_scale(scaled.camera.eye, w.scene.camera.eye, scale);
			v3d_scale(scaled.camera.target, w.scene.camera.target, scale);
			scaled.camera.near_z *= scale;
			scaled.camera.ortho_height *= scale;
			hard_draw(&frame, &scaled, WIDTH, HEIGHT);
			hard_same_planes(&plain, &frame, HARD_ALL_PLANES & ~(1u << PSR_PLANE_WORDS | 1u << PSR_PLANE_DEPTH));
			for (size_t p = 0; p < (size_t)WIDTH * HEIGHT; p++) {
				assert_int_equal((uint32_t)plain.words[p], (uint32_t)frame.words[p]);
				assert_true(ldexpf(plain.depth[p], by[n]) == frame.depth[p]);
			}
			assert_true(frame.report.error_px == plain.report.error_px);
			psr_frame_free(&frame);
			hard_draw_pass(&frame, &scaled, &settings);
			hard_same_planes(&still, &frame, 1u << PSR_PLANE_COLOR);
			psr_frame_free(&frame);
		}
		psr_frame_free(&plain);
		psr_frame_free(&still);
		hard_world_clear(&w);
	}
}

/* Half of a model's blocks in one instance, half in another at the same place; and the two in either order. */
static void a_model_may_be_divided_over_two_instances(void **state)
{
	uint64_t seed = 4;

	(void)state;
	for (int i = 0; i < HARD_CASES(60); i++) {
		struct hard_world w;
		struct hard_block half[2][HARD_BLOCKS / 2];
		struct psr_model *model[2];
		struct psr_instance instance[2];
		struct psr_frame whole, parts;

		hard_world_make(&w, &seed);
		hard_draw(&whole, &w.scene, WIDTH, HEIGHT);
		for (int b = 0; b < HARD_BLOCKS; b++)
			half[b % 2][b / 2] = w.block[b];
		for (int h = 0; h < 2; h++)
			model[h] = hard_world_model(&w, half[h], HARD_BLOCKS / 2);
		w.scene.instance = instance;
		w.scene.n_instances = 2;
		for (int turn = 0; turn < 2; turn++) {
			instance[turn] = hard_place(model[0]);
			instance[!turn] = hard_place(model[1]);
			hard_draw(&parts, &w.scene, WIDTH, HEIGHT);
			for (size_t p = 0; p < (size_t)WIDTH * HEIGHT; p++)
				assert_int_equal(whole.words[p] >> 32, parts.words[p] >> 32);
			hard_same_planes(&whole, &parts, 1u << PSR_PLANE_DEPTH | 1u << PSR_PLANE_WEIGHT);
			assert_int_equal(whole.report.count[PSR_STAGE_WARP], parts.report.count[PSR_STAGE_WARP]);
			psr_frame_free(&parts);
		}
		psr_frame_free(&whole);
		psr_model_unref(model[0]);
		psr_model_unref(model[1]);
		hard_world_clear(&w);
	}
}

/* Multiplies quaternions x, y, z, w: first b, then a. */
static void multiply(double r[4], const double a[4], const double b[4])
{
	const double ab[4] = { a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
		                   a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
		                   a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
		                   a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2] };

	memcpy(r, ab, sizeof ab);
}

static void turn(double r[3], const double q[4], const double v[3])
{
	const double p[4] = { v[0], v[1], v[2], 0 }, back[4] = { -q[0], -q[1], -q[2], q[3] };
	double to[4];

	multiply(to, q, p);
	multiply(to, to, back);
	memcpy(r, to, 3 * sizeof *r);
}

/* A pixel shows a in one frame and b in the other, words of equal numbering. Where both are well inside of the pixel in
 * both frames, both were there in both, so one frame had a's depth at most b's, and the other b's at most a's: the
 * exact depths, which the move keeps, are within all four bounds of each other. Else one of them is at a border. */
static int is_explained(const struct psr_scene scene[2], uint64_t a, uint64_t b)
{
	const uint64_t word[2] = { a, b };
	struct exact_place at[2][2];

	for (int w = 0; w < 2; w++)
		for (int s = 0; s < 2; s++) {
			if (word[w] == PSR_WORD_EMPTY)
				continue;
			exact_place(&at[w][s], &scene[s], WIDTH, HEIGHT, (uint32_t)word[w] / 64, (uint32_t)word[w] % 64);
			/* The moved scene's numbers are rounded, too: twice the bound has room for that. */
			at[w][s].off_u *= 2;
			at[w][s].off_v *= 2;
			at[w][s].off_z *= 2;
			if (exact_is_at_border(&at[w][s]))
				return 1;
		}
	if (a == PSR_WORD_EMPTY || b == PSR_WORD_EMPTY)
		return 0;
	return fabsl(at[0][0].z - at[1][0].z)
	       <= at[0][0].off_z + at[0][1].off_z + at[1][0].off_z + at[1][1].off_z;
}

/* Instance, camera and all turned and moved together. */
static void a_scene_may_be_moved_rigidly(void **state)
{
	uint64_t seed = 5, n_differ = 0, n_drawn = 0;

	(void)state;
	if (!exact_is_there())
		return;
	for (int i = 0; i < HARD_CASES(200); i++) {
		struct hard_world w;
		struct psr_instance moved;
		struct psr_scene scene[2];
		struct psr_frame frame[2];
		double q[4], by[3];

		hard_world_make(&w, &seed);
		for (int b = 0; b < HARD_BLOCKS; b++) /* no test of facing, which has bounds of its own */
			w.block[b].flags = PSR_BLOCK_TWO_SIDED;
		psr_model_unref(w.model);
		w.model = hard_world_model(&w, w.block, HARD_BLOCKS);
		moved = w.instance = hard_place(w.model);
		w.scene.n_lights = 0;
		scene[0] = scene[1] = w.scene;
		scene[1].instance = &moved;
		hard_direction(q, &seed);
		const double half = random_in(&seed, 0, 3.1);
		v3d_scale(q, q, sin(half));
		q[3] = cos(half);
		hard_direction(by, &seed);
		v3d_scale(by, by, exp2(random_in(&seed, -3, 36)));
		struct psr_camera *camera = &scene[1].camera;
		multiply(moved.rotation, q, w.instance.rotation);
		turn(moved.translation, q, w.instance.translation);
		v3d_add(moved.translation, moved.translation, by);
		turn(camera->eye, q, camera->eye);
		turn(camera->target, q, camera->target);
		turn(camera->up, q, camera->up);
		v3d_add(camera->eye, camera->eye, by);
		v3d_add(camera->target, camera->target, by);
		for (int s = 0; s < 2; s++)
			hard_draw(&frame[s], &scene[s], WIDTH, HEIGHT);
		for (size_t p = 0; p < (size_t)WIDTH * HEIGHT; p++) {
			const uint64_t a = frame[0].words[p], b = frame[1].words[p];

			n_drawn += a != PSR_WORD_EMPTY;
			if ((uint32_t)a == (uint32_t)b)
				continue;
			n_differ++;
			if (!is_explained(scene, a, b))
				fail_msg("pixel %zu of case %d: sample %u of block %u, and sample %u of block %u after the move", p, i,
				         (uint32_t)a % 64, (uint32_t)a / 64, (uint32_t)b % 64, (uint32_t)b / 64);
		}
		psr_frame_free(&frame[0]);
		psr_frame_free(&frame[1]);
		hard_world_clear(&w);
	}
	/* So that there is something to explain: by 2^36 doubles are off by 2^-17, which is a thousandth of a pixel. */
	print_message("# %llu of %llu pixels differ\n", (unsigned long long)n_differ, (unsigned long long)n_drawn);
	assert_true(n_differ > 0 || HARD_CASES(200) < 200);
	assert_true(n_differ <= n_drawn / 100);
}

/* Coordinates of 20 bits below 1, moved by whole numbers up to 2^21: nothing is rounded, and not a bit changes. Without
 * shadows, whose maps are fitted to the world's coordinates. */
static void a_move_without_rounding_changes_no_bit(void **state)
{
	uint64_t seed = 6;

	(void)state;
	for (int i = 0; i < HARD_CASES(40); i++) {
		struct hard_world w;
		struct psr_frame frame[2];
		double *const moved[] = { w.instance.translation, w.scene.camera.eye, w.scene.camera.target,
			                      w.light[1].position };

		hard_world_make(&w, &seed);
		w.light[0].casts_shadow = w.light[1].casts_shadow = 0;
		for (int turn = 0; turn < 2; turn++) {
			for (int k = 0; k < 3; k++) {
				const double by = turn ? rint(random_in(&seed, -0x1p21, 0x1p21)) : 0;

				for (size_t m = 0; m < sizeof moved / sizeof moved[0]; m++)
					moved[m][k] = rint(moved[m][k] * 0x1p20) * 0x1p-20 + by;
			}
			hard_draw(&frame[turn], &w.scene, WIDTH, HEIGHT);
		}
		hard_same_planes(&frame[0], &frame[1], HARD_ALL_PLANES);
		psr_frame_free(&frame[0]);
		psr_frame_free(&frame[1]);
		hard_world_clear(&w);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(blocks_may_be_warped_in_any_order),
		cmocka_unit_test(blocks_may_be_culled_and_binned_in_any_order),
		cmocka_unit_test(a_scene_scaled_by_a_power_of_two_is_the_same_picture),
		cmocka_unit_test(a_model_may_be_divided_over_two_instances),
		cmocka_unit_test(a_scene_may_be_moved_rigidly),
		cmocka_unit_test(a_move_without_rounding_changes_no_bit),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
