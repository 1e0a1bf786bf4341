/* Places of samples beside numbers of 80 bits, where the warp's divisions are worst ([G] 7.1). lib/exact.h derives the
 * bounds; each scene is drawn by all stages. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include "base/random.h"
#include "base/vec.h"
#include "lib/blocks.h"
#include "lib/exact.h"

#define SIDE 201 /* odd, so that the view axis meets the middle of a pixel */

/* A lattice along x and y, seen from +z. */
static const struct psr_projection PLAIN = { { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } }, 1.0f / 64 };

static const double WHITE[3] = { 1, 1, 1 };

static struct psr_scene scene_of(const struct psr_instance *instance, uint32_t n)
{
	struct psr_scene scene = { .instance = instance, .n_instances = n };

	scene.camera = (struct psr_camera){ .eye = { 0, 0, 3 }, .up = { 0, 1, 0 }, .fov_y = 0.7 };
	memcpy(scene.ambient, WHITE, sizeof WHITE);
	return scene;
}

static void a_sample_is_where_80_bits_say(void **state)
{
	uint64_t seed = 1, n_inside = 0, n_unsure = 0;

	(void)state;
	if (!exact_is_there())
		return;
	for (int i = 0; i < HARD_CASES(300); i++) {
		struct psr_model *model = hard_random_model(&seed, 40, 1.0 / (16 << random_below(&seed, 5)), 0.1);
		struct psr_instance instance = hard_place(model);
		struct psr_scene scene = scene_of(&instance, 1);
		const double distance = exp2(random_in(&seed, -3, 8));
		double d[3];

		hard_direction(d, &seed);
		hard_direction(scene.camera.up, &seed);
		v3d_scale(scene.camera.eye, d, distance);
		for (int k = 0; k < 3; k++)
			scene.camera.target[k] = random_in(&seed, -0.1, 0.1);
		scene.camera.fov_y = fmin(2.5, random_in(&seed, 0.5, 4) / distance);
		if (random_below(&seed, 3) == 0) {
			scene.camera.kind = PSR_CAMERA_ORTHOGRAPHIC;
			scene.camera.ortho_height = random_in(&seed, 0.1, 4);
		}
		const struct exact_counts counts = exact_check(&scene, SIDE, 150);
		n_inside += counts.n_inside;
		n_unsure += counts.n_unsure;
		psr_model_unref(model);
	}
	/* So that the test is about samples: most are in view, and few of them at borders within their bounds. */
	assert_true(n_inside > (uint64_t)HARD_CASES(300) * 400 && n_unsure < n_inside / 100);
}

/* A plane of one projection of this direction, one block after the other. */
static struct psr_model *sheet(double x, double y, double z, int side, double spacing)
{
	const struct psr_projection projection = hard_projection(x, y, z, spacing);
	const struct hard_model options = { .projection = &projection, .n_projections = 1 };
	struct hard_block block[64];

	assert_true(side * side <= 64);
	memset(block, 0, sizeof block);
	for (int b = 0; b < side * side; b++) {
		block[b].col = 8 * (b % side - side / 2);
		block[b].row = 8 * (b / side - side / 2);
		block[b].mask = UINT64_MAX;
		block[b].flags = PSR_BLOCK_TWO_SIDED;
		for (int i = 0; i < 64; i++) {
			block[b].depth[i] = 0.01 * (i % 7);
			block[b].attr[i] = hard_attr((const double[3]){ x, y, z }, 0, 0);
		}
	}
	return hard_model(&options, block, (uint32_t)(side * side));
}

/* A_zz, the view's z along the projection's, from 1 through 2^-40 to 0: the thesis's (7.6') divides by it. */
static void a_projection_seen_edge_on_is_as_exact(void **state)
{
	(void)state;
	if (!exact_is_there())
		return;
	for (int k = 0; k <= 41; k++) {
		const double zz = k == 41 ? 0 : exp2(-k);
		struct psr_model *model = sheet(sqrt(1 - zz * zz), 0, zz, 4, 1.0 / 64);
		struct psr_instance instance = hard_place(model);
		struct psr_scene scene = scene_of(&instance, 1);

		assert_true(exact_check(&scene, SIDE, SIDE).n_inside > 500);
		scene.camera.eye[2] = 0.7;
		exact_check(&scene, SIDE, SIDE);
		scene.camera.kind = PSR_CAMERA_ORTHOGRAPHIC;
		scene.camera.ortho_height = 2;
		assert_true(exact_check(&scene, SIDE, SIDE).n_inside > 500);
		psr_model_unref(model);
	}
}

/* The eye in the middle of a model, so that z' takes every value around 0; near planes from the least to one that cuts
 * the model. */
static void the_near_plane_cuts_where_80_bits_say(void **state)
{
	static const double near[] = { 0, 1e-30, 1e-6, 1e-3, 0.1, 0.25, 10 };
	uint64_t seed = 3;

	(void)state;
	if (!exact_is_there())
		return;
	for (int i = 0; i < HARD_CASES(20); i++) {
		struct psr_model *model = hard_random_model(&seed, 60, 1.0 / 128, 0.02);
		struct psr_instance instance = hard_place(model);
		struct psr_scene scene = scene_of(&instance, 1);

		for (int k = 0; k < 3; k++)
			scene.camera.eye[k] = random_in(&seed, -0.2, 0.2);
		hard_direction(scene.camera.target, &seed);
		hard_direction(scene.camera.up, &seed);
		scene.camera.fov_y = random_in(&seed, 0.5, 3.1);
		for (size_t n = 0; n < sizeof near / sizeof near[0]; n++) {
			scene.camera.near_z = near[n];
			const struct exact_counts counts = exact_check(&scene, SIDE, SIDE);
			assert_true(near[n] < 10 || counts.n_drawn == 0);
		}
		psr_model_unref(model);
	}
}

/* Samples exactly at the near plane, on either side by a step of depth, and in the plane of the eye: in an orthographic
 * picture along -z all of this is exact, so the bound is 0. */
static void a_sample_at_the_near_plane_is_not_drawn(void **state)
{
	const struct hard_model options = { .projection = &PLAIN, .n_projections = 1 };
	struct hard_block block = { .mask = 0xff, .flags = PSR_BLOCK_TWO_SIDED };
	struct psr_frame frame;
	unsigned n_drawn = 0;

	(void)state;
	for (int i = 0; i < 8; i++) { /* 4 steps of 2^-10 before and behind z = 0 */
		block.depth[i] = (i - 4) * 0x1p-10;
		block.attr[i] = hard_attr((const double[3]){ 0, 0, 1 }, 0, 0);
	}
	struct psr_model *model = hard_model(&options, &block, 1);
	struct psr_instance instance = hard_place(model);
	struct psr_scene scene = scene_of(&instance, 1);
	scene.camera = (struct psr_camera){ .eye = { 0.0625, 0.0625, 0.5 }, .target = { 0.0625, 0.0625, -0.5 },
		                                .up = { 0, 1, 0 }, .kind = PSR_CAMERA_ORTHOGRAPHIC, .ortho_height = 1,
		                                .near_z = 0.5 };
	hard_draw(&frame, &scene, 64, 64);
	for (int i = 0; i < 64 * 64; i++)
		if (frame.words[i] != PSR_WORD_EMPTY) {
			assert_true(frame.words[i] % 64 < 4); /* nearer samples have greater numbers; 4 is in the plane */
			n_drawn++;
		}
	assert_int_equal(n_drawn, 4);
	psr_frame_free(&frame);
	scene.camera.eye[2] = 0; /* the eye's own plane, and no near plane: before and in it nothing is drawn */
	scene.camera.near_z = 1e-30;
	hard_draw(&frame, &scene, 64, 64);
	for (int i = 0; i < 64 * 64; i++)
		assert_true(frame.words[i] == PSR_WORD_EMPTY || frame.words[i] % 64 < 4);
	psr_frame_free(&frame);
	psr_model_unref(model);
}

static void the_eye_may_be_inside_a_block_and_on_a_sample(void **state)
{
	uint64_t seed = 5;

	(void)state;
	if (!exact_is_there())
		return;
	for (int i = 0; i < HARD_CASES(60); i++) {
		struct psr_model *model = hard_random_model(&seed, 20, 1.0 / 32, 0.05);
		struct psr_instance instance = hard_place(model);
		struct psr_scene scene = scene_of(&instance, 1);
		const struct psr_blocks *b = psr_model_blocks(model);
		const uint32_t block = random_below(&seed, 20), sample = (uint32_t)__builtin_ctzll(b->mask[block]);
		float center[3], radius;
		double d[3];

		psr_blocks_sphere(b, block, center, &radius);
		hard_direction(d, &seed);
		for (int k = 0; k < 3; k++)
			scene.camera.eye[k] = (double)center[k] + 0.9 * (double)radius * d[k];
		hard_direction(d, &seed);
		v3d_add(scene.camera.target, scene.camera.eye, d);
		hard_direction(scene.camera.up, &seed);
		scene.camera.fov_y = 2;
		exact_check(&scene, SIDE, SIDE);

		/* On a sample, as near as doubles come: its z' is 0 or next to it. */
		hard_position(scene.camera.eye, b, block, sample);
		v3d_add(scene.camera.target, scene.camera.eye, d);
		exact_check(&scene, SIDE, SIDE);
		scene.camera.near_z = 1e-30; /* nothing keeps z' away from 0 */
		exact_check(&scene, SIDE, SIDE);
		struct psr_settings settings; /* refined, discs as wide as the picture */
		struct psr_frame frame;
		psr_settings_default(&settings, 60, 40);
		settings.pass = 1 + (unsigned)i % 3;
		hard_draw_pass(&frame, &scene, &settings);
		psr_frame_free(&frame);
		psr_model_unref(model);
	}
}

/* One model before the eye, and others a thousand and a million radii away, seen large by their scale. */
static void a_scene_may_be_a_million_radii_deep(void **state)
{
	uint64_t seed = 7;

	(void)state;
	if (!exact_is_there())
		return;
	for (int i = 0; i < HARD_CASES(20); i++) {
		struct psr_model *model = hard_random_model(&seed, 40, 1.0 / 64, 0.02);
		struct psr_instance instance[4] = { hard_place(model), hard_place(model), hard_place(model),
			                                hard_place(model) };
		struct psr_scene scene = scene_of(instance, 4);

		for (int n = 1; n < 4; n++) {
			instance[n].scale = n == 3 ? 1 : exp2(8 * n);
			instance[n].translation[2] = n == 3 ? -1e6 : -3 * instance[n].scale;
			instance[n].translation[0] = random_in(&seed, -1, 1) * instance[n].scale;
			hard_direction(instance[n].rotation, &seed);
			instance[n].rotation[3] = 0; /* half a turn about a random axis */
		}
		scene.camera.eye[2] = 1.5;
		assert_true(exact_check(&scene, SIDE, SIDE).n_inside > 1000);
		/* A million radii away, and as large as before. */
		scene.camera.eye[2] = 1e6;
		scene.camera.fov_y = 3e-6;
		assert_true(exact_check(&scene, SIDE, SIDE).n_inside > 1000);
		psr_model_unref(model);
	}
}

/* Columns of a lattice at whole pixels of an orthographic picture: x is exact, so the bound is 0. A border belongs to
 * the pixel on its right, and that of the picture's right to none. Of equal depths the lower id wins. */
static void a_tie_at_a_border_goes_right_and_to_the_lower_id(void **state)
{
	const struct hard_model options = { .projection = &PLAIN, .n_projections = 1 };
	struct hard_block block[2] = { { .mask = 0xff, .flags = PSR_BLOCK_TWO_SIDED } };
	struct psr_frame frame;

	(void)state;
	for (int i = 0; i < 8; i++)
		block[0].attr[i] = hard_attr((const double[3]){ 0, 0, 1 }, 0, 0);
	block[1] = block[0];
	struct psr_model *model = hard_model(&options, block, 2);
	struct psr_instance instance = hard_place(model);
	struct psr_scene scene = scene_of(&instance, 1);
	for (int shift = -2; shift <= 2; shift++) {
		const double middle = (4 - shift) / 64.0; /* column i is at the left border of pixel i + shift */

		scene.camera = (struct psr_camera){ .eye = { middle, 0, 1 }, .target = { middle, 0, -1 }, .up = { 0, 1, 0 },
			                                .kind = PSR_CAMERA_ORTHOGRAPHIC, .ortho_height = 0.25 };
		hard_draw(&frame, &scene, 8, 16);
		for (int x = 0; x < 8; x++) {
			unsigned n = 0;

			for (int y = 0; y < 16; y++)
				if (frame.words[8 * y + x] != PSR_WORD_EMPTY) {
					assert_int_equal((uint32_t)frame.words[8 * y + x], x - shift);
					n++;
				}
			assert_int_equal(n, x - shift >= 0 && x - shift < 8);
		}
		psr_frame_free(&frame);
	}
	psr_model_unref(model);
}

/* The whole model within a pixel, from three pixels down to a hundred-thousandth of one. */
static void a_model_below_a_pixel_is_where_it_is(void **state)
{
	uint64_t seed = 9;

	(void)state;
	if (!exact_is_there())
		return;
	for (double pixels = 3; pixels > 1e-5; pixels /= 7) {
		struct psr_model *model = hard_random_model(&seed, 30, 1.0 / 64, 0.02);
		struct psr_instance instance = hard_place(model);
		struct psr_scene scene = scene_of(&instance, 1);

		scene.camera.eye[2] = 2 * SIDE / pixels; /* the unit sphere spans 2 / tan(fov / 2) / distance * SIDE / 2 */
		scene.camera.fov_y = 2 * atan(1);
		for (int k = 0; k < 2; k++)
			scene.camera.eye[k] = scene.camera.target[k] = random_in(&seed, -0.3, 0.3) * scene.camera.eye[2] / SIDE;
		const struct exact_counts counts = exact_check(&scene, SIDE, SIDE);
		assert_true(counts.n_drawn >= 1 && counts.n_drawn <= (pixels < 1 ? 4 : 25));
		psr_model_unref(model);
	}
}

/* A step of samples spans up to 1e5 pixels, by nearness and by a narrow angle. */
static void magnified_to_1e5_a_sample_is_where_it_is(void **state)
{
	uint64_t seed = 11, n_inside = 0;

	(void)state;
	if (!exact_is_there())
		return;
	for (int i = 0; i < HARD_CASES(200); i++) {
		struct psr_model *model = hard_random_model(&seed, 10, 1.0 / 64, 0.02);
		struct psr_instance instance = hard_place(model);
		struct psr_scene scene = scene_of(&instance, 1);
		const struct psr_blocks *b = psr_model_blocks(model);
		const double magnification = exp2(random_in(&seed, 3, 17)); /* pixels a step */
		const double distance = random_below(&seed, 2) ? 4 : exp2(random_in(&seed, -8, 0));
		const uint32_t block = random_below(&seed, 10);
		double d[3];

		hard_position(scene.camera.target, b, block, (uint32_t)__builtin_ctzll(b->mask[block]));
		hard_direction(d, &seed);
		v3d_add_scaled(scene.camera.eye, scene.camera.target, distance, d);
		hard_direction(scene.camera.up, &seed);
		const double height = SIDE / 64.0 / magnification; /* of the picture, at the target */
		scene.camera.fov_y = fmax(1e-6, 2 * atan(height / 2 / distance));
		if (random_below(&seed, 2)) {
			scene.camera.kind = PSR_CAMERA_ORTHOGRAPHIC;
			scene.camera.ortho_height = height;
		}
		n_inside += exact_check(&scene, SIDE, SIDE).n_inside;
		psr_model_unref(model);
	}
	assert_true(n_inside >= (uint64_t)HARD_CASES(200)); /* the sample that it looks at */
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_sample_is_where_80_bits_say),
		cmocka_unit_test(a_projection_seen_edge_on_is_as_exact),
		cmocka_unit_test(the_near_plane_cuts_where_80_bits_say),
		cmocka_unit_test(a_sample_at_the_near_plane_is_not_drawn),
		cmocka_unit_test(the_eye_may_be_inside_a_block_and_on_a_sample),
		cmocka_unit_test(a_scene_may_be_a_million_radii_deep),
		cmocka_unit_test(a_tie_at_a_border_goes_right_and_to_the_lower_id),
		cmocka_unit_test(a_model_below_a_pixel_is_where_it_is),
		cmocka_unit_test(magnified_to_1e5_a_sample_is_where_it_is),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
