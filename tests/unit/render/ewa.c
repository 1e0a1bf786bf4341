/* Octrees as EWA splats: a sphere without holes from afar and nearby, mixed colours, and always the same. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/maths.h"
#include "render/render.h"
#include "tests/unit/lib/trees.h"
#include "tests/unit/lib/threads.h"

#define SIDE 160
#define RADIUS 0.9

static const struct tree_options SOLID = { .levels = 7, .radius = RADIUS, .is_one_sided = 1, .with_offsets = 1, .keep = 1 };

struct drawn {
	struct psr_frame frame;
	uint8_t rgb[3 * SIDE * SIDE];
	float depth[SIDE * SIDE];
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
	return (struct psr_camera){ .eye = { 0, 0, distance }, .up = { 0, 1, 0 }, .fov_y = degrees * PSR_DEGREE };
}

static struct drawn *draw(const struct psr_scene *scene, const struct simd *simd, int n_threads, int is_full)
{
	struct drawn *to = calloc(1, sizeof *to);
	struct psr_renderer *renderer;
	struct render_settings settings;
	struct psr_pool *pool = NULL;
	struct psr_error err;

	to->frame = (struct psr_frame){ .width = SIDE, .height = SIDE, .rgb = to->rgb, .depth = to->depth };
	render_settings_default(&settings, SIDE, SIDE);
	settings.with_ewa = 1;
	settings.is_full = is_full;
	assert_int_equal(psr_renderer_create(&renderer, NULL), PSR_OK);
	if (simd != NULL)
		renderer_use(renderer, simd);
	if (n_threads > 1)
		assert_int_equal(psr_pool_create(&pool, n_threads, NULL), PSR_OK);
	if (renderer_draw(renderer, scene, &settings, pool, &to->frame, &err))
		fail_msg("%s", err.text);
	psr_pool_destroy(pool);
	psr_renderer_destroy(renderer);
	return to;
}

static void assert_same(const struct drawn *a, const struct drawn *b)
{
	assert_memory_equal(a->rgb, b->rgb, sizeof a->rgb);
	assert_memory_equal(a->depth, b->depth, sizeof a->depth);
}

/* From leaves of a fiftieth of a pixel to such of 190: pixels of the sphere a leaf's diagonal and two pixels inside of its
 * outline show its front, within half a diagonal and EWA_SAME edges. */
static void spheres_have_no_holes_at_any_magnification(void **state)
{
	static const double heights[] = { 120, 15, 4, 2, 1, 0.3, 0.1, 0.013 };
	struct psr_model *model = tree_build(&SOLID);
	struct psr_instance instance = place(model);
	struct psr_scene scene = { .instance = &instance, .n_instances = 1, .ambient = { 1, 1, 1 } };

	(void)state;
	for (unsigned i = 0; i < sizeof heights / sizeof *heights; i++) {
		const double pixel = heights[i] / SIDE, edge = fmax(ldexp(2, -SOLID.levels), pixel);
		unsigned n_holes = 0, n_inside = 0;

		scene.camera = orthographic(heights[i]);
		struct drawn *p = draw(&scene, NULL, 1, 0);
		for (int y = 0; y < SIDE; y++)
			for (int x = 0; x < SIDE; x++) {
				const double u = (x + 0.5 - SIDE / 2.0) * pixel, v = (y + 0.5 - SIDE / 2.0) * pixel;
				const double z = (double)p->depth[y * SIDE + x], r = sqrt(u * u + v * v) + 1.8 * edge + 2 * pixel;

				if (r >= RADIUS)
					continue;
				n_inside++;
				n_holes += !(z > 3 && z < 4 - sqrt(RADIUS * RADIUS - r * r) + 3 * edge);
			}
		if (n_holes > 0)
			fail_msg("%g high: %u of %u pixels are holes", heights[i], n_holes, n_inside);
		free(p);
	}
	psr_model_unref(model);
}

struct scenery {
	struct psr_model *solid, *cloud;
	struct psr_instance instance[3];
	struct psr_light light[2];
	struct psr_scene scene;
};

/* The camera is inside of the second sphere, and sees the others; one light casts shadows. */
static void scenery_init(struct scenery *s)
{
	struct tree_options options = SOLID;

	s->solid = tree_build(&options);
	options.is_one_sided = 0;
	options.keep = 0.3;
	s->cloud = tree_build(&options);
	s->instance[0] = place(s->solid);
	s->instance[1] = place(s->cloud);
	s->instance[2] = place(s->solid);
	s->instance[1].translation[2] = 2.5;
	s->instance[2].translation[0] = -1;
	s->light[0] = (struct psr_light){ .kind = PSR_LIGHT_DIRECTIONAL, .direction = { -1, -0.5, -1 },
		                              .color = { 1, 1, 1 }, .casts_shadow = 1 };
	s->light[1] = (struct psr_light){ .kind = PSR_LIGHT_POINT, .position = { 0, 2, 2 }, .color = { 0.5, 0.5, 0.5 } };
	s->scene = (struct psr_scene){ .instance = s->instance, .n_instances = 3, .light = s->light, .n_lights = 2,
		                           .ambient = { 0.1, 0.1, 0.1 }, .camera = perspective(2.6, 70) };
}

static void frames_are_the_same_with_any_threads_and_instructions(void **state)
{
	struct scenery s;

	(void)state;
	scenery_init(&s);
	struct drawn *one = draw(&s.scene, simd_of(PSR_ISA_C), 1, 0);
	for (int isa = 0; isa < PSR_N_ISAS; isa++) {
		const struct simd *simd = simd_of((enum psr_isa)isa);

		if (simd == NULL)
			continue;
		for (int is_full = 0; is_full < 2; is_full++) {
			struct drawn *other = draw(&s.scene, simd, 3, is_full);

			assert_same(one, other);
			free(other);
		}
	}
	free(one);
	psr_model_unref(s.solid);
	psr_model_unref(s.cloud);
}

/* Instances that change places have other slots and come in another order; where none of them meet, only that changes. */
static void the_order_of_instances_changes_nothing(void **state)
{
	struct psr_model *model = tree_build(&SOLID);
	struct psr_instance instance[2] = { place(model), place(model) };
	struct psr_scene scene = { .instance = instance, .n_instances = 2, .ambient = { 1, 1, 1 },
		                       .camera = perspective(5, 40) };

	(void)state;
	instance[0].translation[0] = -0.8;
	instance[1].translation[0] = 0.8;
	instance[1].translation[2] = -2;
	struct drawn *one = draw(&scene, NULL, 1, 0);
	const struct psr_instance first = instance[0];
	instance[0] = instance[1];
	instance[1] = first;
	struct drawn *other = draw(&scene, NULL, 1, 0);
	assert_same(one, other);
	free(one);
	free(other);
	psr_model_unref(model);
}

/* A quarter of the sphere is 200 red, another 60, in sRGB: pixels that both meet are between. */
static void leaves_of_one_surface_are_mixed(void **state)
{
	struct psr_model *model = tree_build(&SOLID);
	struct psr_instance instance = place(model);
	struct psr_scene scene = { .instance = &instance, .n_instances = 1, .ambient = { 1, 1, 1 },
		                       .camera = orthographic(0.2) };
	struct drawn *p = draw(&scene, NULL, 1, 0);
	int n_mixed = 0;

	(void)state;
	assert_int_equal(p->frame.report.effect[PSR_EFFECT_SPLATS].why, PSR_WHY_RAN);
	assert_true(p->frame.report.effect[PSR_EFFECT_SPLATS].count > 0);
	for (int x = 0; x < SIDE; x++) {
		const int red = p->rgb[3 * (20 * SIDE + x)], before = x > 0 ? p->rgb[3 * (20 * SIDE + x - 1)] : red;

		assert_true(red >= before - 6); /* from left to right, but for masks' weights of 1 / 16 of a core's at their rims */
		n_mixed += red > 70 && red < 190;
	}
	assert_true(n_mixed > 8); /* a leaf is 12.5 pixels wide */
	free(p);
	psr_model_unref(model);
}

static int compare_paths(const void *a, const void *b)
{
	const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;

	return x < y ? -1 : x > y;
}

/* A roof of metal, 45 degrees to either side of a ridge along y, of leaves 1 / 16 wide. */
static struct psr_model *make_roof(uint32_t material)
{
	enum { ROOF_LEVELS = 5, ROOF_SIDE = 1 << ROOF_LEVELS };
	static uint64_t path[ROOF_SIDE * ROOF_SIDE];
	struct psr_model_info info = { .scale = 1, .up = { 0, 1, 0 }, .resolution = ROOF_SIDE };
	struct octree_maker maker;
	struct psr_model *model;

	for (uint32_t i = 0; i < ROOF_SIDE * ROOF_SIDE; i++) {
		const uint32_t x = i % ROOF_SIDE, at[3] = { x, i / ROOF_SIDE, x < ROOF_SIDE / 2 ? x : ROOF_SIDE - 1 - x };

		path[i] = octree_path(at);
	}
	qsort(path, ROOF_SIDE * ROOF_SIDE, sizeof *path, compare_paths);
	assert_int_equal(octree_maker_init(&maker, ROOF_LEVELS, NULL), PSR_OK);
	for (uint32_t i = 0; i < ROOF_SIDE * ROOF_SIDE; i++)
		assert_int_equal(octree_maker_put(&maker, path[i], NULL), PSR_OK);
	struct octree *tree = octree_maker_take(&maker);
	tree->normal = calloc(tree->n_leaves, sizeof *tree->normal);
	tree->color = calloc(tree->n_leaves, sizeof *tree->color);
	tree->one_material = calloc(1, sizeof *tree->one_material);
	octree_put_material(*tree->one_material, material);
	for (uint64_t i = 0; i < tree->n_leaves; i++) {
		const float left[3] = { -1, 0, 1 }, right[3] = { 1, 0, 1 };
		uint32_t at[3];

		octree_place(path[i], at);
		tree->normal[i] = psr_direction_encode(at[0] < ROOF_SIDE / 2 ? left : right);
		memset(tree->color[i], 255, 3);
	}
	tree->is_one_sided = 1;
	tree->edge = 2;
	for (int c = 0; c < 3; c++) {
		tree->low[c] = info.box_min[c] = -1;
		info.box_max[c] = 1;
	}
	info.spacing = sqrt(3) * 2 / ROOF_SIDE;
	assert_int_equal(psr_model_create_octree(&model, &info, tree, NULL, NULL), PSR_OK);
	octree_destroy(tree);
	octree_maker_fini(&maker);
	return model;
}

/* A mirror at the ridge would reflect the light behind the camera; what is there are slopes that do not. A share t of
 * the right slope gives a mean normal of length L = sqrt((1 + (1 - 2t)^2) / 2), atan(1 - 2t) off the view, and so a squared
 * lobe of 2 (0.97 - L) / L: where it shows most, at t = 0.3, it shows 0.40 of white. 0.45 is code 178. */
static void edges_of_metal_do_not_glitter(void **state)
{
	struct psr_model *model = make_roof(31 | 51u << 16); /* metal, of roughness 0.2 */
	struct psr_instance instance = place(model);
	const struct psr_light light = { .direction = { 0, 0, -1 }, .color = { 1, 1, 1 } };
	struct psr_scene scene = { .instance = &instance, .n_instances = 1, .light = &light, .n_lights = 1,
		                       .camera = orthographic(1.5) };
	struct drawn *p = draw(&scene, NULL, 1, 0);
	int most = 0, n = 0;

	(void)state;
	for (int i = 0; i < SIDE * SIDE; i++) {
		n += p->depth[i] < INFINITY;
		most = p->rgb[3 * i] > most ? p->rgb[3 * i] : most;
	}
	assert_int_equal(n, SIDE * SIDE);
	print_message("the brightest pixel of the ridge: %d\n", most);
	assert_in_range(most, 1, 178);
	free(p);
	psr_model_unref(model);
}

static void discs_and_splats_exclude_each_other(void **state)
{
	struct render_settings settings;
	struct psr_error err;

	(void)state;
	render_settings_default(&settings, 8, 8);
	settings.with_ewa = settings.with_splats = 1;
	assert_int_equal(settings_validate(&settings, &err), PSR_ERR_ARG);
	assert_non_null(strstr(err.text, "at the same time"));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(spheres_have_no_holes_at_any_magnification),
		cmocka_unit_test(frames_are_the_same_with_any_threads_and_instructions),
		cmocka_unit_test(the_order_of_instances_changes_nothing),
		cmocka_unit_test(leaves_of_one_surface_are_mixed),
		cmocka_unit_test(edges_of_metal_do_not_glitter),
		cmocka_unit_test(discs_and_splats_exclude_each_other),
	};

	only_threads_under_tsan();
	return cmocka_run_group_tests(tests, NULL, NULL);
}
