/* Which level of a group of clusters is drawn: on models made by hand, of one block a cluster. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/direction.h"
#include "render/cull.h"
#include "render/renderer.h"

#define GROUPS 5
#define LEVELS 5
#define MAX_CLUSTERS (GROUPS * LEVELS)
#define SPACING (1.0f / 1024)
#define RADIUS 0.0625f

/* Levels that each group has: all, some, neither the finest nor the coarsest, the finest only, the coarsest only. */
static const uint32_t levels_of[GROUPS] = { 0x1f, 0x15, 0x0a, 0x01, 0x10 };

static struct psr_cluster cluster[MAX_CLUSTERS];
static struct psr_model *model;

/* Blocks of all levels have the same middle, as near as windows of their lattices come: level 4, 8 * 16 samples wide, is
 * an eighth of a unit. Groups stand side by side in the plane z = 0, a quarter of a unit apart, and face +z. */
static int make_model(float cluster_radius)
{
	static const struct psr_projection projection = { { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } }, SPACING };
	static const struct psr_run run;
	static int16_t x[MAX_CLUSTERS], y[MAX_CLUSTERS], z[MAX_CLUSTERS];
	static uint16_t depth[64 * MAX_CLUSTERS], offset[MAX_CLUSTERS], r[MAX_CLUSTERS];
	static uint8_t number[MAX_CLUSTERS], flags[MAX_CLUSTERS];
	static uint64_t mask[MAX_CLUSTERS], attr[64 * MAX_CLUSTERS];
	struct psr_model_info info = { .scale = 1,
		                           .box_min = { -1, -1, 0 },
		                           .box_max = { 1, 1, 0 },
		                           .spacing = (double)SPACING,
		                           .tolerance = 0.4,
		                           .resolution = 1024,
		                           .builder = "test" };
	struct psr_blocks blocks = { .n_projections = 1, .n_levels = LEVELS, .projection = &projection, .cluster = cluster,
		                         .run = &run, .sphere_x = x, .sphere_y = y, .sphere_z = z, .sphere_r = r,
		                         .block_projection = number, .flags = flags, .mask = mask, .attr_offset = offset,
		                         .depth = depth, .attr = attr };
	uint32_t n = 0;

	/* Level by level, so that a group's clusters do not follow each other. */
	for (int l = LEVELS - 1; l >= 0; l--) {
		for (int g = 0; g < GROUPS; g++) {
			if (!(levels_of[g] >> l & 1))
				continue;
			cluster[n] = (struct psr_cluster){ .center = { (float)(g - 2) * 0.25f + RADIUS, RADIUS, 0 },
				                               .radius = cluster_radius, .first_block = n, .n_blocks = 1,
				                               .group = (uint32_t)(GROUPS - 1 - g), .level = (uint8_t)l };
			x[n] = (int16_t)(cluster[n].center[0] * 0x1p14f);
			y[n] = (int16_t)(cluster[n].center[1] * 0x1p14f);
			r[n] = (uint16_t)(1.42f * RADIUS * 0x1p15f);
			flags[n] = (uint8_t)(l | PSR_BLOCK_DEPTH);
			mask[n] = UINT64_MAX;
			offset[n] = (uint16_t)(64 * n);
			for (int i = 0; i < 64; i++) {
				depth[64 * n + (uint32_t)i] = 32768;
				attr[64 * n + (uint32_t)i] = psr_direction_encode((const float[3]){ 0, 0, 1 });
			}
			n++;
		}
	}
	blocks.n_blocks = blocks.n_clusters = n;
	blocks.n_samples = 64 * n;
	return psr_model_create(&model, &info, &blocks, NULL, NULL);
}

static int setup(void **state)
{
	(void)state;
	return make_model(1.42f * RADIUS);
}

static int teardown(void **state)
{
	(void)state;
	psr_model_unref(model);
	return 0;
}

struct choice {
	int n_drawn[GROUPS], level[GROUPS], depth_level[GROUPS];
};

static double asked_spacing = 1; /* of the settings */

/* Culls a scene and takes apart which clusters each of its instances draws. */
static void choose(const struct psr_scene *scene, uint32_t side, struct psr_pool *pool, struct choice *choice)
{
	struct render_settings settings;
	struct psr_report report = { 0 };
	struct plan plan = { 0 };
	struct bins bins = { 0 };
	uint32_t n_clusters = psr_model_blocks(model)->n_clusters;

	render_settings_default(&settings, side, side);
	settings.spacing_px = asked_spacing;
	assert_int_equal(plan_make(&plan, scene, &settings, NULL), PSR_OK);
	assert_int_equal(cull_blocks(&bins, simd_get(), &plan, pool, &report), PSR_OK);
	memset(choice, 0, scene->n_instances * sizeof *choice);
	for (uint32_t s = 0; s < plan.n_slots; s++) {
		const struct psr_cluster *k = &cluster[s % n_clusters];
		int is_drawn = 0, depth_level = 0;

		for (uint32_t e = 0; e < bins.tile_begin[plan.tiles_x * plan.tiles_y]; e++) {
			if (bins.entry[e].slot == s) {
				is_drawn = 1;
				depth_level = bins.entry[e].level;
			}
		}
		if (is_drawn) {
			struct choice *c = &choice[s / n_clusters];

			c->n_drawn[k->group]++;
			c->level[k->group] = k->level;
			c->depth_level[k->group] = depth_level;
		}
	}
	bins_clear(&bins);
	plan_clear(&plan);
}

static struct psr_scene scene_at(struct psr_instance *instance, double distance, double fov_y)
{
	*instance = (struct psr_instance){ .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	return (struct psr_scene){ .instance = instance, .n_instances = 1, .ambient = { 1, 1, 1 },
		                       .camera = { .eye = { 0, 0, distance }, .up = { 0, 1, 0 }, .fov_y = fov_y } };
}

/* The level that a group must draw if a unit is stretched to at most that many pixels. */
static int expected_level(uint32_t levels, double pixels)
{
	int best = -1;

	for (int l = 0; l < LEVELS; l++)
		if (levels >> l & 1 && (best < 0 || pixels * (double)SPACING * (1 << l) * (1 - 0x1p-12) <= 1))
			best = l;
	return best;
}

static int is_near_a_limit(double pixels)
{
	double e = log2(pixels * (double)SPACING * (1 - 0x1p-12));

	return fabs(e - nearbyint(e)) < 1e-5; /* single precision: a dozen roundings of 2^-24 */
}

static void one_cluster_of_each_group_is_drawn_and_it_is_the_coarsest_that_fits_a_pixel(void **state)
{
	const uint32_t side = 512;
	int seen[LEVELS] = { 0 };
	struct psr_instance instance;
	struct choice choice;

	(void)state;
	for (double distance = 0.5; distance < 40; distance *= 1.05) {
		struct psr_scene scene = scene_at(&instance, distance, 1.2);

		if (distance < 1) /* so near, all of them are in view from the side only */
			scene.camera.eye[0] = scene.camera.target[0] = 0.25;
		choose(&scene, side, NULL, &choice);
		for (int g = 0; g < GROUPS; g++) {
			int group = GROUPS - 1 - g;
			double x = (double)(g - 2) * 0.25 + (double)RADIUS - scene.camera.eye[0], y = (double)RADIUS, r = 1.42 * y;
			/* 1 / (z cos theta), at the least z and the greatest angle from the axis that the sphere reaches. */
			double d = sqrt(x * x + y * y + distance * distance), widest = acos(distance / d) + asin(r / d);
			double pixels = side / 2.0 / tan(0.6) / ((distance - r) * cos(widest));

			assert_true(choice.n_drawn[group] == 1 || (distance < 1 && choice.n_drawn[group] == 0));
			if (choice.n_drawn[group] == 0 || is_near_a_limit(pixels))
				continue;
			assert_int_equal(choice.level[group], expected_level(levels_of[g], pixels));
			seen[choice.level[group]]++;
			/* What fits a pixel needs no level of the depth buffer. */
			if (pixels * (double)SPACING * (1 << choice.level[group]) <= 1)
				assert_int_equal(choice.depth_level[group], 0);
			else
				assert_int_equal(choice.level[group], __builtin_ctz(levels_of[g]));
		}
	}
	for (int l = 0; l < LEVELS; l++)
		assert_true(seen[l] > 0);
}

static void levels_are_chosen_by_how_near_blocks_reach_whatever_the_sphere_around_them(void **state)
{
	const double side = 512, radius = 0.75, reach = 1.42 * (double)RADIUS;
	int n_coarser = 0;
	struct psr_instance instance;
	struct choice choice;

	psr_model_unref(model);
	assert_int_equal(make_model((float)radius), PSR_OK);
	for (double distance = 2; distance < 40; distance *= 1.05) {
		const struct psr_scene scene = scene_at(&instance, distance, 1.2);

		choose(&scene, (uint32_t)side, NULL, &choice);
		for (int g = 0; g < GROUPS; g++) {
			double x = (double)(g - 2) * 0.25 + (double)RADIUS, y = (double)RADIUS;
			double d = sqrt(x * x + y * y + distance * distance);
			double cosine = cos(acos(distance / d) + asin(radius / d)), focal = side / 2 / tan(0.6);
			double pixels = focal / ((distance - reach) * cosine), by_sphere = focal / ((distance - radius) * cosine);

			if (is_near_a_limit(pixels))
				continue;
			assert_int_equal(choice.level[GROUPS - 1 - g], expected_level(levels_of[g], pixels));
			n_coarser += expected_level(levels_of[g], pixels) > expected_level(levels_of[g], by_sphere);
		}
	}
	assert_true(n_coarser > 0);
	psr_model_unref(model);
	assert_int_equal(setup(state), PSR_OK);
}

static void a_group_never_gets_finer_with_distance(void **state)
{
	struct psr_instance instance;
	struct choice now, before;

	(void)state;
	memset(&before, 0, sizeof before);
	for (double distance = 1; distance < 40; distance *= 1.01) {
		struct psr_scene scene = scene_at(&instance, distance, 1.2);

		choose(&scene, 384, NULL, &now);
		for (int g = 0; g < GROUPS; g++)
			assert_true(now.level[g] >= before.level[g]);
		before = now;
	}
	assert_int_equal(before.level[GROUPS - 1], LEVELS - 1);
}

/* Orthographic: the same stretch everywhere, so groups that have the same levels agree. */
static void orthographic_pictures_choose_by_magnification_alone(void **state)
{
	struct psr_instance instance;
	struct choice choice;

	(void)state;
	for (int l = 0; l < LEVELS; l++) {
		struct psr_scene scene = scene_at(&instance, 3, 0);

		/* Just the magnification that level l is made for. */
		scene.camera.kind = PSR_CAMERA_ORTHOGRAPHIC;
		scene.camera.ortho_height = 256 * (double)SPACING * (1 << l);
		choose(&scene, 256, NULL, &choice);
		for (int g = 0; g < GROUPS; g++)
			if (choice.n_drawn[GROUPS - 1 - g] != 0)
				assert_int_equal(choice.level[GROUPS - 1 - g],
				                 expected_level(levels_of[g], 1024.0 / (1 << l)));
		assert_int_equal(choice.n_drawn[2], 1); /* the middle one is always in view */
	}
}

static void a_greater_spacing_chooses_as_a_smaller_picture_does(void **state)
{
	static const double spacing[] = { 1.0 / 64, 0.25, 0.5, 0.7, 1, 1.41, 2, 4, 64 };
	struct psr_instance instance;
	struct choice choice;

	(void)state;
	for (int l = 0; l < LEVELS; l++) {
		struct psr_scene scene = scene_at(&instance, 3, 0);

		scene.camera.kind = PSR_CAMERA_ORTHOGRAPHIC;
		scene.camera.ortho_height = 256 * (double)SPACING * (1 << l);
		for (size_t s = 0; s < sizeof spacing / sizeof spacing[0]; s++) {
			asked_spacing = spacing[s];
			choose(&scene, 256, NULL, &choice);
			for (int g = 0; g < GROUPS; g++) {
				const int group = GROUPS - 1 - g;

				if (choice.n_drawn[group] == 0)
					continue;
				assert_int_equal(choice.level[group], expected_level(levels_of[g], 1024.0 / (1 << l) / spacing[s]));
				/* Cells of the depth buffer are as large as the distance that was allowed. */
				assert_int_equal(choice.depth_level[group], choice.level[group] > l ? choice.level[group] - l : 0);
			}
			assert_int_equal(choice.n_drawn[2], 1); /* the middle one is always in view */
		}
	}
	asked_spacing = 1;
}

static void instances_choose_for_themselves_whatever_the_threads(void **state)
{
	struct psr_instance instance[3];
	struct choice one[3], four[3];
	struct psr_pool *pool;
	struct psr_scene scene = scene_at(&instance[0], 1, 0.9);

	(void)state;
	for (int i = 1; i < 3; i++) {
		instance[i] = instance[0];
		instance[i].translation[2] = -3.0 * i * i;
	}
	scene.n_instances = 3;
	assert_int_equal(psr_pool_create(&pool, 4, NULL), PSR_OK);
	choose(&scene, 512, NULL, one);
	choose(&scene, 512, pool, four);
	psr_pool_destroy(pool);
	assert_memory_equal(one, four, sizeof one);
	for (int g = 0; g < GROUPS; g++)
		for (int i = 0; i < 3; i++)
			assert_int_equal(one[i].n_drawn[g], 1);
	for (int i = 0; i < 2; i++)
		assert_true(one[i].level[GROUPS - 1] < one[i + 1].level[GROUPS - 1]);
}

/* Through the renderer's door: the samples that win pixels are of the chosen clusters, and the report counts these. */
static void the_picture_has_samples_of_the_chosen_clusters_only(void **state)
{
	struct psr_instance instance;
	struct psr_renderer *renderer;
	struct render_settings settings;
	struct psr_zstack *stack;

	(void)state;
	render_settings_default(&settings, 512, 512);
	assert_int_equal(psr_renderer_create(&renderer, NULL), PSR_OK);
	for (double distance = 1.2; distance < 12; distance *= 1.3) {
		struct psr_scene scene = scene_at(&instance, distance, 1.2);
		const struct psr_report *report = &renderer->report;
		struct choice choice;
		int n_pixels[GROUPS] = { 0 };

		choose(&scene, 512, NULL, &choice);
		assert_int_equal(renderer_warp(renderer, &scene, &settings, NULL, &stack, NULL), PSR_OK);
		for (int i = 0; i < 512 * 512; i++) {
			const struct psr_cluster *k;

			const uint64_t word = psr_zstack_row(stack, (uint32_t)i / 512)[i % 512];

			if (word == PSR_WORD_EMPTY)
				continue;
			k = &cluster[(uint32_t)word / 64];
			assert_int_equal(k->level, choice.level[k->group]);
			n_pixels[k->group]++;
		}
		for (int g = 0; g < GROUPS; g++)
			assert_true(n_pixels[g] > 0);
		assert_int_equal(report->n_blocks, psr_model_blocks(model)->n_blocks);
		assert_int_equal(report->n_blocks_drawn, GROUPS);
		assert_int_equal(report->n_samples_drawn, 64 * GROUPS);
		assert_int_equal(report->count[PSR_STAGE_CULL], GROUPS);
	}
	psr_renderer_destroy(renderer);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(one_cluster_of_each_group_is_drawn_and_it_is_the_coarsest_that_fits_a_pixel),
		cmocka_unit_test(levels_are_chosen_by_how_near_blocks_reach_whatever_the_sphere_around_them),
		cmocka_unit_test(a_group_never_gets_finer_with_distance),
		cmocka_unit_test(orthographic_pictures_choose_by_magnification_alone),
		cmocka_unit_test(a_greater_spacing_chooses_as_a_smaller_picture_does),
		cmocka_unit_test(instances_choose_for_themselves_whatever_the_threads),
		cmocka_unit_test(the_picture_has_samples_of_the_chosen_clusters_only),
	};

	return cmocka_run_group_tests(tests, setup, teardown);
}
