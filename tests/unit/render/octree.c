/* Octrees as pictures: the sphere that their leaves meet, in its colours, at every level, and always the same. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/srgb.h"
#include "model/cubes.h"
#include "render/stages.h"
#include "tests/unit/lib/trees.h"
#include "tests/unit/lib/threads.h"

#define SIDE 160
#define RADIUS 0.9
#define HALF_DIAGONAL 0.8660254037844386 /* of a leaf, in edges */

static const struct tree_options SOLID = { .levels = 8, .radius = RADIUS, .is_one_sided = 1, .with_offsets = 1, .keep = 1 };

struct drawn {
	struct psr_frame frame;
	uint8_t rgb[3 * SIDE * SIDE];
	float depth[SIDE * SIDE];
	int16_t normal[3 * SIDE * SIDE];
	uint32_t id[SIDE * SIDE];
	uint8_t block[3 * SIDE * SIDE], weight[SIDE * SIDE];
	uint64_t words[SIDE * SIDE];
};

static struct psr_instance place(const struct psr_model *model)
{
	return (struct psr_instance){ .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
}

/* Looks along -z: `height` world units are as high as the picture. */
static struct psr_camera orthographic(double height)
{
	return (struct psr_camera){ .eye = { 0, 0, 4 }, .up = { 0, 1, 0 }, .kind = PSR_CAMERA_ORTHOGRAPHIC,
		                        .ortho_height = height };
}

static struct psr_camera perspective(double distance, double degrees)
{
	return (struct psr_camera){ .eye = { 0, 0, distance }, .up = { 0, 1, 0 },
		                        .fov_y = degrees * 3.14159265358979 / 180 };
}

static void draw_with(struct drawn *to, const struct psr_scene *scene, int n_threads, unsigned pass, int is_full)
{
	struct psr_renderer *renderer;
	struct render_settings settings;
	struct psr_pool *pool = NULL;
	struct refiner *refiner;
	struct psr_error err = { 0 };

	memset(to, 0, sizeof *to);
	to->frame = (struct psr_frame){ .width = SIDE, .height = SIDE, .rgb = to->rgb, .depth = to->depth };
	if (pass == 0) {
		to->frame.normal = to->normal;
		to->frame.id = to->id;
		to->frame.block = to->block;
		to->frame.weight = to->weight;
		to->frame.words = to->words;
	}
	render_settings_default(&settings, SIDE, SIDE);
	settings.pass = pass;
	settings.is_full = is_full;
	assert_int_equal(psr_renderer_create(&renderer, NULL), PSR_OK);
	assert_int_equal(refiner_create(&refiner, renderer, NULL), PSR_OK);
	if (n_threads > 1)
		assert_int_equal(psr_pool_create(&pool, n_threads, NULL), PSR_OK);
	if (refiner_draw(refiner, scene, &settings, pool, &to->frame, &err))
		fail_msg("%s", err.text);
	psr_pool_destroy(pool);
	refiner_destroy(refiner);
	psr_renderer_destroy(renderer);
}

static struct drawn *draw(const struct psr_scene *scene, int n_threads, unsigned pass)
{
	struct drawn *to = malloc(sizeof *to);

	draw_with(to, scene, n_threads, pass, 0);
	return to;
}

static void assert_same(const struct drawn *a, const struct drawn *b)
{
	assert_memory_equal(a->rgb, b->rgb, sizeof a->rgb);
	assert_memory_equal(a->depth, b->depth, sizeof a->depth);
	assert_memory_equal(a->normal, b->normal, sizeof a->normal);
	assert_memory_equal(a->words, b->words, sizeof a->words);
	assert_memory_equal(a->block, b->block, sizeof a->block);
	assert_memory_equal(a->weight, b->weight, sizeof a->weight);
}

/* z' where an orthographic ray through pixel coordinates (u, v) meets the sphere; inf outside. */
static double true_depth(double height, double u, double v)
{
	const double x = (u - SIDE / 2.0) * height / SIDE, y = (v - SIDE / 2.0) * height / SIDE;
	const double d = RADIUS * RADIUS - x * x - y * y;

	return d >= 0 ? 4 - sqrt(d) : INFINITY;
}

/* Counts pixels that contradict the truth. The range of true depths over the pixel grown by `reach` has the pixel's
 * depth, within `slack`; it has samples where the sphere is all over that, and none where it is nowhere in it. */
static void check_sphere(const struct psr_scene *scene, double reach, double slack)
{
	const double height = scene->camera.ortho_height;
	unsigned n_holes = 0, n_stray = 0, n_wrong = 0, n_colors = 0;
	struct drawn *p = draw(scene, 1, 0);

	for (int y = 0; y < SIDE; y++)
		for (int x = 0; x < SIDE; x++) {
			const uint8_t *rgb = p->rgb + 3 * (y * SIDE + x);
			const double z = (double)p->depth[y * SIDE + x], edge = height / SIDE * (1 + reach);
			const double right = (x + 0.5 - SIDE / 2.0) * height / SIDE, down = (y + 0.5 - SIDE / 2.0) * height / SIDE;
			double low = INFINITY, high = -INFINITY;

			for (int i = 0; i < 81; i++) {
				const double u = x - reach + (1 + 2 * reach) * (i % 9) / 8, v = y - reach + (1 + 2 * reach) * (i / 9) / 8;
				const double t = true_depth(height, u, v);

				low = fmin(low, t);
				high = fmax(high, t);
			}
			n_stray += isinf(low) && !isinf(z);
			n_holes += !isinf(high) && isinf(z);
			n_wrong += !isinf(high) && !isinf(z) && (z < low - slack || z > high + slack);
			if (isinf(high) || isinf(z) || fabs(right) < edge || fabs(down) < edge)
				continue;
			n_colors += (rgb[0] > 130) != (right > 0) || (rgb[1] > 130) != (down < 0) || rgb[2] < 130;
		}
	if (n_holes + n_stray + n_wrong + n_colors > 0)
		fail_msg("%u holes, %u stray pixels, %u wrong depths, %u wrong colours", n_holes, n_stray, n_wrong, n_colors);
	free(p);
}

/* Level l's leaves have edges of h = 2^(l - 7): a sample is at most half a diagonal from where the surface meets its
 * leaf, and the coarsest level is drawn whose h is 1 / CUBES_LEVEL_SPACING pixels at most. Where no level is fine enough
 * samples are magnified. Cells of 2^k pixels fill between samples that are further apart than pixels. */
static void spheres_have_no_holes_and_the_right_depths_and_colours(void **state)
{
	static const double heights[] = { 2, 2.9, 3.8, 8, 15 }, magnified[] = { 0.5, 1 };
	struct tree_options options = SOLID;
	const double h = ldexp(2, -SOLID.levels);

	(void)state;
	for (int with_offsets = 0; with_offsets < 2; with_offsets++) {
		options.with_offsets = with_offsets;
		struct psr_model *model = tree_build(&options);
		struct psr_instance instance = place(model);
		struct psr_scene scene = { .instance = &instance, .n_instances = 1, .ambient = { 1, 1, 1 } };

		for (unsigned i = 0; i < sizeof heights / sizeof *heights; i++) {
			scene.camera = orthographic(heights[i]);
			const double pixel = heights[i] / SIDE, leaf = fmax(pixel / CUBES_LEVEL_SPACING, h);
			check_sphere(&scene, fmax(HALF_DIAGONAL * leaf / pixel, 0.5), HALF_DIAGONAL * leaf);
		}
		for (unsigned i = 0; i < sizeof magnified / sizeof *magnified; i++) {
			const double pixels = sqrt(2) * h * SIDE / magnified[i];

			/* Cells are less than twice as wide as samples are apart; what fills is within two of them. */
			scene.camera = orthographic(magnified[i]);
			check_sphere(&scene, 4 * pixels, HALF_DIAGONAL * h);
		}
		psr_model_unref(model);
	}
}

/* Three instances in a line, one behind the other, lit by lights that cast shadows. */
/* Of a sphere all around the picture of which this share of leaves is there: the pixels that show its back, or nothing. */
static int seen_through(double keep, unsigned pass)
{
	const struct tree_options options = { .levels = 7, .radius = RADIUS, .keep = keep };
	struct psr_model *model = tree_build(&options);
	struct psr_instance instance = place(model);
	const struct psr_scene scene = { .instance = &instance, .n_instances = 1, .camera = orthographic(0.8) };
	struct drawn *p = draw(&scene, 2, pass);
	int n = 0;

	for (int i = 0; i < SIDE * SIDE; i++)
		n += !(p->depth[i] < 4);
	free(p);
	psr_model_unref(model);
	return n;
}

/* In the area of a leaf's face are 0.45 leaves: exp(-0.9) of cells of their own size would be empty, exp(-3.6) of those
 * twice as wide, which are filled from around. */
static void sparse_clouds_are_drawn_wider(void **state)
{
	(void)state;
	for (unsigned pass = 0; pass < 3; pass++) {
		assert_int_equal(seen_through(0.3, pass), 0);
		assert_int_equal(seen_through(1, pass), 0);
	}
}

struct scenery {
	struct psr_model *solid, *cloud;
	struct psr_instance instance[3];
	struct psr_light light[2];
	struct psr_scene scene;
};

static void scenery_init(struct scenery *s)
{
	struct tree_options options = SOLID;

	s->solid = tree_build(&options);
	options.is_one_sided = 0;
	options.keep = 0.3;
	options.levels = 7;
	s->cloud = tree_build(&options);
	s->instance[0] = place(s->solid);
	s->instance[1] = place(s->cloud);
	s->instance[2] = place(s->solid);
	s->instance[1].translation[0] = 1.2;
	s->instance[2].translation[0] = -1.5;
	s->instance[2].translation[2] = -1;
	s->light[0] = (struct psr_light){ .kind = PSR_LIGHT_DIRECTIONAL, .direction = { -1, -0.5, -1 },
		                              .color = { 1, 1, 1 }, .casts_shadow = 1 };
	s->light[1] = (struct psr_light){ .kind = PSR_LIGHT_POINT, .position = { 0, 2, 2 }, .color = { 0.5, 0.5, 0.5 },
		                              .casts_shadow = 1 };
	s->scene = (struct psr_scene){ .instance = s->instance, .n_instances = 3, .light = s->light, .n_lights = 2,
		                           .ambient = { 0.1, 0.1, 0.1 }, .camera = perspective(5, 40) };
}

static void scenery_fini(struct scenery *s)
{
	psr_model_unref(s->solid);
	psr_model_unref(s->cloud);
}

static void frames_are_the_same_with_any_threads(void **state)
{
	struct scenery s;

	(void)state;
	scenery_init(&s);
	for (unsigned pass = 0; pass < 2; pass++) {
		struct drawn *one = draw(&s.scene, 1, pass);

		for (int n = 2; n <= 3; n++) {
			struct drawn *other = draw(&s.scene, n, pass);

			assert_same(one, other);
			free(other);
		}
		free(one);
	}
	scenery_fini(&s);
}

static void shortcuts_change_nothing(void **state)
{
	struct drawn *plain = malloc(sizeof *plain), *full = malloc(sizeof *full);
	struct scenery s;

	(void)state;
	scenery_init(&s);
	draw_with(plain, &s.scene, 1, 0, 0);
	draw_with(full, &s.scene, 1, 0, 1);
	assert_memory_equal(plain->rgb, full->rgb, sizeof plain->rgb);
	assert_memory_equal(plain->depth, full->depth, sizeof plain->depth);
	free(plain);
	free(full);
	scenery_fini(&s);
}

/* A plain frame's silhouette is within a leaf of the truth, a disc reaches half a diagonal further. */
static void refinement_smooths_edges_and_keeps_the_inside(void **state)
{
	struct psr_model *model = tree_build(&SOLID);
	struct psr_instance instance = place(model);
	struct psr_scene scene = { .instance = &instance, .n_instances = 1, .ambient = { 1, 1, 1 },
		                       .camera = orthographic(2) };
	unsigned n_grey = 0;

	(void)state;
	for (unsigned pass = 1; pass <= 2; pass++) {
		struct drawn *p = draw(&scene, 1, pass);

		for (int y = 0; y < SIDE; y++)
			for (int x = 0; x < SIDE; x++) {
				const double u = (x + 0.5) * 2 / SIDE - 1, v = (y + 0.5) * 2 / SIDE - 1, r = sqrt(u * u + v * v);
				const uint8_t *rgb = p->rgb + 3 * (y * SIDE + x);
				const int has_any = rgb[0] + rgb[1] + rgb[2] > 0;

				if (r < RADIUS - 3.0 / SIDE)
					assert_true(rgb[2] > 190);
				if (r > RADIUS + 4.0 / SIDE)
					assert_false(has_any);
				n_grey += has_any && rgb[2] < 190;
			}
		free(p);
	}
	assert_true(n_grey > 100); /* the circle crosses some 450 pixels a pass */
	psr_model_unref(model);
}

static void what_is_one_sided_is_not_seen_from_within(void **state)
{
	struct tree_options options = SOLID;

	(void)state;
	for (int is_one_sided = 0; is_one_sided < 2; is_one_sided++) {
		options.is_one_sided = is_one_sided;
		struct psr_model *model = tree_build(&options);
		struct psr_instance instance = place(model);
		struct psr_scene scene = { .instance = &instance, .n_instances = 1, .camera = perspective(0.01, 60) };
		struct drawn *p = draw(&scene, 1, 0);

		assert_int_equal(p->frame.report.n_covered > 0, !is_one_sided);
		free(p);
		psr_model_unref(model);
	}
}

static void planes_tell_of_leaves(void **state)
{
	struct scenery s;
	unsigned n[3] = { 0, 0, 0 };

	(void)state;
	scenery_init(&s);
	struct drawn *p = draw(&s.scene, 1, 0);
	for (int i = 0; i < SIDE * SIDE; i++) {
		if (p->id[i] == UINT32_MAX)
			continue;
		assert_true(p->id[i] < 3);
		n[p->id[i]]++;
		assert_int_equal(p->block[3 * i + 2] == PSR_FACING_TWO_SIDED, p->id[i] == 1);
		assert_true(p->block[3 * i] < CUBES_MOST_LEVELS);
	}
	for (int i = 0; i < 3; i++)
		assert_true(n[i] > 100);
	free(p);
	scenery_fini(&s);
}

static void an_instance_names_what_it_is_drawn_as(void **state)
{
	struct psr_model *model = tree_build(&SOLID);
	struct psr_instance instance = place(model);
	struct psr_scene scene = { .instance = &instance, .n_instances = 1, .camera = orthographic(2) };
	struct psr_error err = { 0 };

	(void)state;
	instance.representation = PSR_OCTREE;
	assert_int_equal(psr_scene_validate(&scene, &err), PSR_OK);
	instance.representation = PSR_BLOCKS;
	assert_int_equal(psr_scene_validate(&scene, &err), PSR_ERR_ARG);
	assert_non_null(strstr(err.text, "no blocks"));
	psr_model_unref(model);
}

/* Seen at SIDE pixels across 2 units of a cube of 2, 2^levels leaves along it; a level is enough where its leaves are
 * 1.07 pixels apart or less (decision 0106). */
static void a_report_says_what_was_drawn_and_how_deep(void **state)
{
	struct psr_model *model = tree_build(&SOLID);
	struct psr_instance instance[2] = { place(model), place(model) };
	struct psr_scene scene = { .instance = instance, .n_instances = 2, .camera = orthographic(2) };
	const uint32_t coarsest = (uint32_t)SOLID.levels - CUBES_MOST_LEVELS + 1;
	uint32_t before = 0;

	(void)state;
	instance[1].representation = PSR_OCTREE;
	instance[1].translation[0] = 100; /* out of sight */
	for (double height = 2; height < 64; height *= 2) {
		scene.camera = orthographic(height);
		for (unsigned pass = 0; pass < 2; pass++) {
			struct drawn *d = draw(&scene, 2, pass);
			const struct psr_report *report = &d->frame.report;

			assert_int_equal(report->drawn_as[PSR_OCTREE].n, 2);
			assert_int_equal(report->drawn_as[PSR_OCTREE].n_automatic, 1);
			assert_int_equal(report->drawn_as[PSR_BLOCKS].n + report->drawn_as[PSR_DPOINTS].n, 0);
			assert_int_equal(report->of_levels, SOLID.levels);
			if (pass == 0 && before > 0) /* half the size: a level less, down to the coarsest */
				assert_int_equal(report->octree_levels, before - (before > coarsest));
			before = pass == 0 ? report->octree_levels : before;
			free(d);
		}
	}
	assert_int_equal(before, coarsest);
	scene.camera.target[0] = scene.camera.eye[0] += 50; /* nothing in view */
	struct drawn *d = draw(&scene, 1, 0);
	assert_int_equal(d->frame.report.octree_levels, 0);
	free(d);
	psr_model_unref(model);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(spheres_have_no_holes_and_the_right_depths_and_colours),
		cmocka_unit_test(sparse_clouds_are_drawn_wider),
		cmocka_unit_test(frames_are_the_same_with_any_threads),
		cmocka_unit_test(shortcuts_change_nothing),
		cmocka_unit_test(refinement_smooths_edges_and_keeps_the_inside),
		cmocka_unit_test(what_is_one_sided_is_not_seen_from_within),
		cmocka_unit_test(planes_tell_of_leaves),
		cmocka_unit_test(an_instance_names_what_it_is_drawn_as),
		cmocka_unit_test(a_report_says_what_was_drawn_and_how_deep),
	};

	only_threads_under_tsan();
	return cmocka_run_group_tests(tests, NULL, NULL);
}
