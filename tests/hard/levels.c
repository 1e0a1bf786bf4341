/* Levels: which depth buffer a block gets ([G] 7.11), and surfaces that pass from one level to the next ([G] 9.1.2). */
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
#include "base/srgb.h"
#include "base/vec.h"
#include "lib/blocks.h"

#define COLOR 0xc08040u /* r lowest */
#define SIDE 200

/* How many pixels a step of length 1 in space spans at most at p, in camera space: |d(x'/z')| <= |p| |dp| / z'^2. */
static double stretch_at(const double p[3], double focal)
{
	return focal * v3d_length(p) / (p[2] * p[2]);
}

/* The eye in, on and around models, where the least distance of a block's sphere is 0 or less and its logarithm is not
 * a number. Whatever the level: at each sample that a picture shows, the block's step spans at most 2^level pixels,
 * times 1 + 2^-12 (the cull's tolerance) and 2^-20 for its roundings; or the block needed more than the coarsest
 * buffer, and the report counts it. */
static void a_block_in_view_has_a_buffer_that_its_samples_fill(void **state)
{
	uint64_t seed = 1, n_seen = 0;
	unsigned levels = 0;

	(void)state;
	for (int i = 0; i < HARD_CASES(300); i++) {
		struct psr_model *model = hard_random_model(&seed, 50, 1.0 / 64, 0.02);
		const struct psr_blocks *b = psr_model_blocks(model);
		struct psr_instance instance = hard_place(model);
		struct psr_scene scene = { .instance = &instance, .n_instances = 1 };
		struct psr_frame frame;
		double axis[3][3], d[3];

		const uint32_t block = random_below(&seed, b->n_blocks);
		float center[3], radius;
		psr_blocks_sphere(b, block, center, &radius);
		hard_direction(d, &seed);
		/* In the sphere, on it to a float's step, before it, or behind. */
		const double reach = (double[]){ random_in(&seed, 0, 1), 1, 1 + exp2(random_in(&seed, -24, 6)) }[i % 3];
		for (int k = 0; k < 3; k++) {
			scene.camera.eye[k] = (double)center[k] + reach * (double)radius * d[k];
			scene.camera.target[k] = (double)center[k];
		}
		if (i % 3 == 0)
			hard_direction(scene.camera.target, &seed);
		hard_direction(scene.camera.up, &seed);
		scene.camera.fov_y = random_in(&seed, 0.1, 2.8);
		scene.camera.near_z = i % 2 ? 1e-30 : 0;
		hard_draw(&frame, &scene, SIDE, SIDE);
		v3d_sub(axis[2], scene.camera.target, scene.camera.eye);
		v3d_normalize(axis[2], axis[2]);
		v3d_cross(axis[0], axis[2], scene.camera.up);
		v3d_normalize(axis[0], axis[0]);
		v3d_cross(axis[1], axis[2], axis[0]);
		const double focal = SIDE / 2.0 / tan(scene.camera.fov_y / 2);
		for (size_t p = 0; p < SIDE * SIDE; p++) {
			const uint32_t id = (uint32_t)frame.words[p], level = frame.block[3 * p + 1];
			double at[3], seen[3];

			if (frame.words[p] == PSR_WORD_EMPTY || level == 255)
				continue;
			hard_position(at, b, id / 64, id % 64);
			v3d_sub(at, at, scene.camera.eye);
			m3d_apply(seen, (const double(*)[3])axis, at);
			const double pixels = stretch_at(seen, focal) / 64;
			levels |= 1u << level;
			n_seen++;
			if (pixels > (double)(1u << level) * (1 + 0x1p-12 + 0x1p-20)
			    && (level < PSR_MAX_DEPTH_LEVEL || frame.report.n_clamped == 0))
				fail_msg("a step of block %u spans %g pixels, and its level is %u", id / 64, pixels, level);
		}
		psr_frame_free(&frame);
		psr_model_unref(model);
	}
	assert_true(levels == 0xff || HARD_CASES(300) < 300); /* the picture's own, and all seven buffers */
	assert_true(n_seen > (uint64_t)HARD_CASES(300) * 10);
}

static struct psr_model *sheet_of(double spacing, int groups, unsigned levels)
{
	const uint64_t attr = (hard_attr((const double[3]){ 0, 0, 1 }, 0, 0) & 0x7fff) | HARD_UNLIT
	                      | (uint64_t)COLOR << 16;

	return hard_sheet(&(struct hard_sheet){ .spacing = spacing, .groups = groups, .levels = levels, .attr = attr });
}

/* Steps from 1 to 1e6 pixels: up to 128 every block has a buffer that fits, beyond that each counts as clamped. */
static void beyond_the_coarsest_buffer_blocks_are_counted(void **state)
{
	static const double px[] = { 1, 100, 127.9, 128.1, 129, 1000, 1e6 };
	struct psr_model *model = sheet_of(1.0 / 64, 4, 1);
	struct psr_instance instance = hard_place(model);
	struct psr_scene scene = { .instance = &instance, .n_instances = 1 };

	(void)state;
	for (size_t i = 0; i < sizeof px / sizeof px[0]; i++) {
		struct psr_frame frame;

		/* A sample of block (2, 2) of four times four is at the middle of a pixel. */
		scene.camera = (struct psr_camera){ .eye = { 0, 0, 1 }, .up = { 0, 1, 0 }, .kind = PSR_CAMERA_ORTHOGRAPHIC,
			                                .ortho_height = (SIDE + 1) / 64.0 / px[i] };
		hard_draw(&frame, &scene, SIDE + 1, SIDE + 1);
		assert_true(frame.report.n_blocks_drawn > 0 && frame.report.n_covered > 0);
		assert_int_equal(frame.report.n_clamped, px[i] > 128 ? frame.report.n_blocks_drawn : 0);
		psr_frame_free(&frame);
	}
	psr_model_unref(model);
}

/* Whether a channel is the sheet's. The fill rounds down: by 374 of 65,535 at most, where weights are 1 of 256 (gaps.c
 * derives it); and codes are rounded by half a step. Black is behind the sheet, so more is missing where it shows. */
static int is_color(uint8_t code, int channel)
{
	const int own = COLOR >> 8 * channel & 0xff;
	const double light = (double)psr_srgb_to_linear[own], less = (double)psr_srgb_to_linear[own - 1];

	return (double)psr_srgb_to_linear[code] >= light - 374 / 65535.0 - (light - less) / 2 && code <= own;
}

/* Where the ray through a point of the picture meets the sheet, in the sheet's x and y; 0 if it does not before it. */
static int meet(double at[2], const struct psr_scene *scene, double u, double v)
{
	const struct psr_camera *c = &scene->camera;
	double axis[3][3], ray[3], eye[3], back[3][3];
	const double half = 2 * atan2(scene->instance->rotation[0], scene->instance->rotation[3]); /* about x */

	v3d_sub(axis[2], c->target, c->eye);
	v3d_normalize(axis[2], axis[2]);
	v3d_cross(axis[0], axis[2], c->up);
	v3d_normalize(axis[0], axis[0]);
	v3d_cross(axis[1], axis[2], axis[0]);
	const double f = SIDE / 2.0 / tan(c->fov_y / 2);
	for (int k = 0; k < 3; k++)
		ray[k] = axis[2][k] + (u - SIDE / 2.0) / f * axis[0][k] + (v - SIDE / 2.0) / f * axis[1][k];
	v3d_set(back[0], 1, 0, 0);
	v3d_set(back[1], 0, cos(half), sin(half));
	v3d_set(back[2], 0, -sin(half), cos(half));
	m3d_apply(ray, (const double(*)[3])back, ray);
	m3d_apply(eye, (const double(*)[3])back, c->eye);
	if (!(-eye[2] / ray[2] > 0))
		return 0;
	at[0] = eye[0] - eye[2] / ray[2] * ray[0];
	at[1] = eye[1] - eye[2] / ray[2] * ray[1];
	return 1;
}

/* A sheet of 4 levels in 12 x 12 groups, slanted by 0 to 85 degrees, from 0.3 to 20 pixels between samples: depth
 * buffers and levels of the model change within the picture. Pixels whose four corners meet the sheet further inside
 * than three steps of the coarsest level and two of the widest cells in use have its colour: nothing of the
 * background comes through. The same turned in the picture, so that interfaces lie askew to cells. */
static void no_interface_of_a_slanted_plane_has_a_hole(void **state)
{
	const double spacing = 1.0 / 1024;
	const int groups = 12;
	struct psr_model *model = sheet_of(spacing, groups, 4);
	struct psr_instance instance = hard_place(model);
	struct psr_scene scene = { .instance = &instance, .n_instances = 1 };
	const double half = 4 * groups * 8 * spacing;
	uint64_t seed = 2, n_inside = 0;
	unsigned n_mixed = 0, n_clamped = 0;

	(void)state;
	for (int degrees = 0; degrees <= 85; degrees += HARD_CASES(5) < 5 ? 17 : 5)
		for (double distance = 0.05; distance < 2; distance *= 1.5) {
			const double turn = random_in(&seed, 0, 6.2), slant = degrees * PSR_DEGREE / 2;
			struct psr_frame frame;

			instance.rotation[0] = sin(slant);
			instance.rotation[3] = cos(slant);
			v3d_set(scene.camera.eye, 0.01, 0, distance);
			v3d_set(scene.camera.target, 0.01, 0, 0);
			v3d_set(scene.camera.up, sin(turn), cos(turn), 0);
			scene.camera.fov_y = 0.6;
			hard_draw(&frame, &scene, SIDE, SIDE);
			n_clamped += frame.report.n_clamped > 0;
			n_mixed += (frame.report.levels & (frame.report.levels - 1)) != 0;
			const int top = 31 - __builtin_clz(frame.report.levels | 1);
			for (int p = 0; p < SIDE * SIDE; p++) {
				const double reach = 2 * (1 << top);
				int is_inside = 1;

				for (int c = 0; c < 4; c++) {
					const double u = p % SIDE + (c & 1 ? 1 + reach : -reach);
					const double v = p / SIDE + (c & 2 ? 1 + reach : -reach);
					double at[2];

					is_inside &= meet(at, &scene, u, v) && fabs(at[0]) < half - 3 * 8 * spacing
					             && fabs(at[1]) < half * 0.866 - 3 * 8 * spacing;
				}
				const uint8_t *rgb = &frame.rgb[3 * p];
				n_inside += (uint64_t)is_inside;
				/* Blocks that need wider cells than there are may leave holes, and are counted. */
				if (is_inside && frame.report.n_clamped == 0
				    && !(is_color(rgb[0], 0) && is_color(rgb[1], 1) && is_color(rgb[2], 2)))
					fail_msg("%d degrees, distance %g: pixel (%d, %d) is %02x%02x%02x", degrees, distance, p % SIDE,
					         p / SIDE, rgb[0], rgb[1], rgb[2]);
			}
			psr_frame_free(&frame);
		}
	print_message("# %u views of several levels, %u clamped, %llu pixels\n", n_mixed, n_clamped,
	              (unsigned long long)n_inside);
	assert_true(n_mixed > 10 && n_clamped < n_mixed / 5 && n_inside > 500000);
	psr_model_unref(model);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_block_in_view_has_a_buffer_that_its_samples_fill),
		cmocka_unit_test(beyond_the_coarsest_buffer_blocks_are_counted),
		cmocka_unit_test(no_interface_of_a_slanted_plane_has_a_hole),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
