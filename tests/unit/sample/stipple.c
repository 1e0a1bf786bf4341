/* Surfaces that let a part of the light through: for rays, in models, and in pictures. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "base/srgb.h"
#include "base/pool.h"
#include "render/stages.h"
#include "render/render.h"
#include "surface/stipple.h"
#include "model.h"

static void nothing_is_open_where_all_is_opaque(void **state)
{
	uint64_t random = 3;

	(void)state;
	for (int i = 0; i < 1000; i++) {
		double p[3];

		for (int k = 0; k < 3; k++)
			p[k] = 2 * meshes_random(&random) - 1;
		assert_false(stipple_is_open(1, p, 0.01));
		assert_true(stipple_is_open(0, p, 0.01));
		assert_true(stipple_is_open(0.3f, p, 0.01) || !stipple_is_open(0.7f, p, 0.01));
	}
}

/* 1,024 cells of a sequence of low discrepancy in two dimensions are within some ln(n)^2 / n = 0.047 of their share,
 * whatever the plane. */
static void planes_of_any_slope_are_open_in_proportion(void **state)
{
	static const double axis[][2][3] = {
		{ { 1, 0, 0 }, { 0, 1, 0 } }, { { 0, 1, 0 }, { 0, 0, 1 } },      { { 1, 0, 0 }, { 0, 0, 1 } },
		{ { 0.8, 0, 0.6 }, { 0, 1, 0 } }, { { 0.6, 0.8, 0 }, { 0, 0, 1 } }, { { 0.5, 0.7, 0.51 }, { -0.8, 0.6, 0 } },
	};

	(void)state;
	for (size_t a = 0; a < sizeof axis / sizeof *axis; a++) {
		for (float opacity = 0.2f; opacity < 0.9f; opacity += 0.3f) {
			int n_open = 0;

			for (int i = 0; i < 128 * 128; i++) {
				double p[3];

				for (int k = 0; k < 3; k++)
					p[k] = 0.25 * (i % 128) * axis[a][0][k] + 0.25 * (i / 128) * axis[a][1][k];
				n_open += stipple_is_open(opacity, p, 1);
			}
			assert_float_equal((double)n_open / (128 * 128), 1 - (double)opacity, 0.047);
		}
	}
}

#define SIDE 64
#define RESOLUTION 128

/* Squares across z, each of its own half side and material. */
struct square {
	double z, half;
	int channel; /* 0 red, 1 green, 2 blue: its colour, which no light changes */
	float opacity;
};

static struct psr_mesh *squares(const struct square *square, uint32_t n)
{
	struct psr_mesh *mesh = meshes_new(4 * n, 2 * n);

	free(mesh->material);
	mesh->n_materials = n;
	mesh->material = calloc(n, sizeof *mesh->material);
	for (uint32_t i = 0; i < n; i++) {
		psr_material_default(&mesh->material[i]);
		mesh->material[i].unlit = 1;
		for (int c = 0; c < 3; c++)
			mesh->material[i].base_color[c] = c == square[i].channel;
		if (square[i].opacity < 1)
			mesh->material[i].alpha = PSR_ALPHA_BLEND;
		mesh->material[i].base_color[3] = square[i].opacity;
		for (uint32_t k = 0; k < 4; k++) {
			mesh->position[4 * i + k][0] = (float)((k == 1 || k == 2) ? square[i].half : -square[i].half);
			mesh->position[4 * i + k][1] = (float)(k >= 2 ? square[i].half : -square[i].half);
			mesh->position[4 * i + k][2] = (float)square[i].z;
			mesh->normal[4 * i + k][2] = 1;
		}
		for (uint32_t t = 0; t < 2; t++) {
			mesh->triangle[2 * i + t][0] = 4 * i;
			mesh->triangle[2 * i + t][1] = 4 * i + 1 + t;
			mesh->triangle[2 * i + t][2] = 4 * i + 2 + t;
			mesh->triangle_material[2 * i + t] = i;
		}
	}
	return mesh;
}

static struct psr_model *build_squares(const struct square *square, uint32_t n)
{
	struct psr_mesh *mesh = squares(square, n);
	struct psr_model *model = model_build(mesh, RESOLUTION);

	meshes_free(mesh);
	return model;
}

struct shot {
	double magnification, background;
	unsigned pass;
	int is_smooth, n_threads; /* threads: 0, none but the caller's */
	const struct simd *simd;  /* NULL: the machine's */
};

struct picture {
	uint8_t rgb[3 * SIDE * SIDE];
	float depth[SIDE * SIDE];
	struct psr_report report;
};

/* From above z, along it. */
static void draw(struct picture *picture, const struct psr_model *model, const struct shot *shot)
{
	const double pixel = psr_model_info(model)->spacing / shot->magnification, b = shot->background;
	const struct psr_instance instance = { .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	struct psr_scene scene = { .instance = &instance, .n_instances = 1, .ambient = { 1, 1, 1 }, .background = { b, b, b } };
	struct psr_frame frame = { .width = SIDE, .height = SIDE, .rgb = picture->rgb, .depth = picture->depth };
	struct psr_pool *pool = NULL;
	struct psr_renderer *renderer;
	struct refiner *refiner;
	struct render_settings settings;

	scene.camera = (struct psr_camera){ .kind = PSR_CAMERA_ORTHOGRAPHIC, .ortho_height = SIDE * pixel,
		                                .eye = { 0, 0, 4 }, .up = { 0, 1, 0 } };
	render_settings_default(&settings, SIDE, SIDE);
	settings.smooth = shot->is_smooth;
	settings.pass = shot->pass;
	assert_int_equal(psr_renderer_create(&renderer, NULL), PSR_OK);
	assert_int_equal(refiner_create(&refiner, renderer, NULL), PSR_OK);
	if (shot->n_threads != 0)
		assert_int_equal(psr_pool_create(&pool, shot->n_threads, NULL), PSR_OK);
	if (shot->simd != NULL)
		renderer_use(renderer, shot->simd);
	assert_int_equal(refiner_draw(refiner, &scene, &settings, pool, &frame, NULL), PSR_OK);
	picture->report = frame.report;
	refiner_destroy(refiner);
	psr_renderer_destroy(renderer);
	psr_pool_destroy(pool);
}

/* Light of each pixel within 0.7 of the middle is this. A code of 8 bits is 2.28 / 255 of white at most, by the slope of
 * the sRGB curve; half of it is rounded away of what is behind, of the sum, and of the mean over sub-pixels. An opacity
 * is rounded to half of 1 / 255, twice for two panes. */
static void assert_light(const struct psr_model *model, const struct shot *shot, const double light[3])
{
	static struct picture picture;
	const int reach = (int)(0.7 * shot->magnification / psr_model_info(model)->spacing);
	const int half = reach < SIDE / 2 ? reach : SIDE / 2;

	draw(&picture, model, shot);
	for (int y = SIDE / 2 - half; y < SIDE / 2 + half; y++)
		for (int x = SIDE / 2 - half; x < SIDE / 2 + half; x++)
			for (int c = 0; c < 3; c++)
				assert_float_equal(psr_srgb_to_linear[picture.rgb[3 * (y * SIDE + x) + c]], light[c],
				                   (1.5 * 2.28 + 2 * 0.5) / 255);
}

/* Behind it there is a wall. */
static void a_pane_keeps_its_share_of_the_light_back_in_every_pixel_and_pass(void **state)
{
	static const float opacity[] = { 0.1f, 0.25f, 0.5f, 0.75f, 0.9f };
	static const double magnification[] = { 0.5, 0.66, 1, 2 };

	(void)state;
	for (int i = 0; i < 5; i++) {
		const struct square set[] = { { -0.5, 1, 0, 1 }, { 0.1, 0.8, 2, opacity[i] } };
		const double light[3] = { 1 - (double)opacity[i], 0, (double)opacity[i] };
		struct psr_model *model = build_squares(set, 2);

		for (int m = 0; m < 4; m++)
			for (unsigned pass = 0; pass <= (i != 1 ? 1 : m == 1 ? 3 : 2); pass++)
				for (int is_smooth = 0; is_smooth <= (pass == 0); is_smooth++)
					assert_light(model, &(struct shot){ magnification[m], 0, pass, is_smooth, 3, NULL }, light);
		psr_model_unref(model);
	}
}

static void behind_two_panes_what_both_let_through_is_left(void **state)
{
	static const float opacity[] = { 0.25f, 0.5f, 0.75f };

	(void)state;
	for (int i = 0; i < 3; i++) {
		const double a = (double)opacity[i], light[3] = { (1 - a) * (1 - a), a, (1 - a) * a };
		const struct square set[] = { { -0.5, 1, 0, 1 }, { 0.1, 0.8, 2, opacity[i] }, { 0.4, 0.8, 1, opacity[i] } };
		struct psr_model *model = build_squares(set, 3);

		for (unsigned pass = 0; pass <= 2; pass++)
			assert_light(model, &(struct shot){ 0.8, 0, pass, 0, 3, NULL }, light);
		psr_model_unref(model);
	}
}

static void before_nothing_the_background_is_seen_through_a_pane(void **state)
{
	const struct square set[] = { { 0.1, 0.8, 2, 0.25f } };
	const double light[3] = { 0.75, 0.75, 1 };
	struct psr_model *model = build_squares(set, 1);

	(void)state;
	for (unsigned pass = 0; pass <= 2; pass++)
		assert_light(model, &(struct shot){ 0.8, 1, pass, 0, 3, NULL }, light);
	psr_model_unref(model);
}

static void a_wall_hides_the_pane_behind_it(void **state)
{
	const struct square set[] = { { 0.5, 1, 0, 1 }, { 0.1, 0.8, 2, 0.25f } };
	const double light[3] = { 1, 0, 0 };
	struct psr_model *model = build_squares(set, 2);

	(void)state;
	for (unsigned pass = 0; pass <= 1; pass++)
		assert_light(model, &(struct shot){ 0.8, 0, pass, 0, 3, NULL }, light);
	psr_model_unref(model);
}

static void assert_opacities(const struct psr_blocks *blocks, int of_sheer)
{
	for (uint32_t b = 0; b < blocks->n_blocks; b++)
		for (int s = 0; s < __builtin_popcountll(blocks->mask[b]); s++)
			assert_int_equal(blocks->opacity[psr_blocks_attr_first(blocks, b) + (uint32_t)s],
			                 psr_blocks_is_sheer(blocks, b) ? of_sheer : PSR_OPAQUE);
}

/* A decal less than a step before its wall, which rays find in the same windows of the lattice. Pictures tell but for two
 * steps about its edges, to which discs reach. */
static void a_decal_changes_nothing_of_the_wall_beside_it(void **state)
{
	static const struct square set[] = { { 0, 1, 0, 1 }, { 0.008, 0.3, 2, 0.5f } };
	static struct picture picture;
	struct psr_model *model = build_squares(set, 2);
	const double spacing = psr_model_info(model)->spacing, pixel = spacing / 0.8;

	(void)state;
	assert_opacities(psr_model_blocks(model), 128);
	for (unsigned pass = 0; pass <= 1; pass++) {
		draw(&picture, model, &(struct shot){ 0.8, 0, pass, 0, 3, NULL });
		for (int y = 0; y < SIDE; y++)
			for (int x = 0; x < SIDE; x++) {
				const double u = fabs(x + 0.5 - SIDE / 2) * pixel, v = fabs(y + 0.5 - SIDE / 2) * pixel;
				const double most = u > v ? u : v, red = psr_srgb_to_linear[picture.rgb[3 * (y * SIDE + x)]];

				if (most > 0.9 || fabs(most - 0.3) < 2 * spacing)
					continue;
				assert_float_equal(red, most < 0.3 ? 0.5 : 1, (1.5 * 2.28 + 2 * 0.5) / 255);
			}
	}
	psr_model_unref(model);
}

/* A closed box: all that is in it is seen through it, from inside of the model's hull. */
static void what_is_in_a_case_of_glass_is_seen(void **state)
{
	const double light[3] = { 0.75, 0, 0.25 };
	struct psr_mesh *mesh = meshes_box(0.8, 0), *inner = squares(&(struct square){ 0, 0.75, 0, 1 }, 1);
	struct psr_mesh *both = meshes_new(mesh->n_vertices + 4, mesh->n_triangles + 2);
	struct psr_model *model;

	(void)state;
	free(both->material);
	both->n_materials = 2;
	both->material = calloc(2, sizeof *both->material);
	for (int i = 0; i < 2; i++) {
		psr_material_default(&both->material[i]);
		both->material[i].unlit = 1;
		for (int c = 0; c < 3; c++)
			both->material[i].base_color[c] = c == (i == 0 ? 2 : 0);
	}
	both->material[0].alpha = PSR_ALPHA_BLEND;
	both->material[0].base_color[3] = 0.25f;
	memcpy(both->position, mesh->position, mesh->n_vertices * sizeof *mesh->position);
	memcpy(both->position + mesh->n_vertices, inner->position, 4 * sizeof *inner->position);
	memcpy(both->normal, mesh->normal, mesh->n_vertices * sizeof *mesh->normal);
	memcpy(both->normal + mesh->n_vertices, inner->normal, 4 * sizeof *inner->normal);
	memcpy(both->triangle, mesh->triangle, mesh->n_triangles * sizeof *mesh->triangle);
	for (uint32_t t = 0; t < 2; t++) {
		for (int k = 0; k < 3; k++)
			both->triangle[mesh->n_triangles + t][k] = inner->triangle[t][k] + mesh->n_vertices;
		both->triangle_material[mesh->n_triangles + t] = 1;
	}
	model = model_build(both, RESOLUTION);
	for (unsigned pass = 0; pass <= 1; pass++)
		assert_light(model, &(struct shot){ 0.8, 0, pass, 0, 3, NULL }, light);
	psr_model_unref(model);
	meshes_free(both);
	meshes_free(mesh);
	meshes_free(inner);
}

/* Where less than half of the light is left. Samples are half a step of depth, 2^-15, from their
 * place. Their normals are up to 1.27 degrees off, 0.022 steps a step, by which a pixel's centre within a step of one may
 * count as nearer or further away. */
static void a_pane_has_the_depth_of_what_shows_most(void **state)
{
	static const struct {
		float opacity;
		double z;
	} sets[] = { { 0.25f, -0.5 }, { 0.75f, 0.1 } };
	static struct picture picture;

	(void)state;
	for (int i = 0; i < 3; i++) {
		const struct square set[] = { { 0.1, 0.8, 2, sets[i % 2].opacity }, { -0.5, 1, 0, 1 } };
		struct psr_model *model = build_squares(set, i < 2 ? 2 : 1);
		const double spacing = psr_model_info(model)->spacing;

		draw(&picture, model, &(struct shot){ 0.8, 0, 0, 0, 3, NULL });
		for (int k = -5; k < 5; k++) {
			const float depth = picture.depth[SIDE * (SIDE / 2 + k) + SIDE / 2 + k];

			if (i == 2)
				assert_true(isinf(depth)); /* a pane of a quarter before nothing */
			else
				assert_float_equal(depth, 4 - sets[i].z, 0.022 * spacing + 0x1p-14);
		}
		psr_model_unref(model);
	}
}

struct pane_planes {
	int16_t normal[3 * SIDE * SIDE];
	uint32_t id[SIDE * SIDE];
	uint8_t block[3 * SIDE * SIDE], weight[SIDE * SIDE];
	uint64_t words[SIDE * SIDE];
	float depth[SIDE * SIDE];
};

/* Rounding to 15 bits, and 1.27 degrees by which stored normals are off. */
static void assert_normal(const int16_t n[3], const double expected[3])
{
	for (int k = 0; k < 3; k++)
		assert_float_equal(n[k] / 32767.0, expected[k], 0.0222);
}

/* The pane is turned against the wall, so that their normals differ. */
static void a_pane_that_keeps_back_half_shows_in_all_planes(void **state)
{
	static const float opacity[] = { 0.25f, 0.75f };
	static const double turned[3] = { 0, -0.38941834, 0.92106099 }, straight[3] = { 0, 0, 1 };
	static struct pane_planes all, some;
	struct psr_model *wall = build_squares(&(struct square){ -0.5, 1, 0, 1 }, 1);

	(void)state;
	for (int i = 0; i < 2; i++) {
		struct psr_model *pane = build_squares(&(struct square){ 0.1, 0.8, 2, opacity[i] }, 1);
		const double pixel = psr_model_info(pane)->spacing / 0.8;
		const struct psr_instance instance[] = {
			{ .model = wall, .rotation = { 0, 0, 0, 1 }, .scale = 1 },
			{ .model = pane, .rotation = { 0.19866933, 0, 0, 0.98006658 }, .scale = 1 },
		};
		const struct psr_scene scene = { .instance = instance, .n_instances = 2, .ambient = { 1, 1, 1 },
			                             .camera = { .kind = PSR_CAMERA_ORTHOGRAPHIC, .ortho_height = SIDE * pixel,
			                                         .eye = { 0, 0, 4 }, .up = { 0, 1, 0 } } };
		struct psr_frame frame = { .width = SIDE, .height = SIDE, .normal = all.normal, .id = all.id,
			                       .block = all.block, .weight = all.weight, .words = all.words, .depth = all.depth };
		struct render_settings settings;
		struct psr_renderer *renderer;

		render_settings_default(&settings, SIDE, SIDE);
		assert_int_equal(psr_renderer_create(&renderer, NULL), PSR_OK);
		assert_int_equal(renderer_draw(renderer, &scene, &settings, NULL, &frame, NULL), PSR_OK);
		for (int k = -5; k < 5; k++) {
			const int at = SIDE * (SIDE / 2 + k) + SIDE / 2 + k;

			assert_int_equal(all.id[at], i);
			assert_normal(all.normal + 3 * at, i ? turned : straight);
			assert_int_equal(all.weight[at], 255);
			assert_int_equal(all.block[3 * at], 0);
			/* The wall is first. */
			assert_true((uint32_t)all.words[at] < PSR_BLOCK_SAMPLES * psr_model_blocks(wall)->n_blocks);
			assert_true(i == 0 ? all.depth[at] > 4.4f : all.depth[at] < 4);
		}
		frame.depth = NULL; /* the same without it, by planes of their own */
		frame.words = NULL;
		frame.normal = some.normal;
		frame.id = some.id;
		frame.block = some.block;
		frame.weight = some.weight;
		assert_int_equal(renderer_draw(renderer, &scene, &settings, NULL, &frame, NULL), PSR_OK);
		assert_memory_equal(all.normal, some.normal, sizeof all.normal);
		assert_memory_equal(all.id, some.id, sizeof all.id);
		assert_memory_equal(all.block, some.block, sizeof all.block);
		assert_memory_equal(all.weight, some.weight, sizeof all.weight);
		psr_renderer_destroy(renderer);
		psr_model_unref(pane);
	}
	psr_model_unref(wall);
}

/* A floor's light at (0.6, 0), where panes cast their shadow, of its light without them. */
static double light_under(const struct square *pane, uint32_t n, unsigned pass, uint32_t *n_maps)
{
	struct square set[3] = { { -0.5, 1, 0, 1 } };
	const struct psr_light light = { .direction = { 1, 0, -1 }, .color = { 1.1, 1.1, 1.1 }, .casts_shadow = 1 };
	double red[2];

	memcpy(set + 1, pane, n * sizeof *pane);
	for (int has_panes = 0; has_panes <= 1; has_panes++) {
		static uint8_t rgb[3 * SIDE * SIDE];
		struct psr_mesh *mesh = squares(set, has_panes ? n + 1 : 1);
		for (uint32_t i = 0; i < mesh->n_materials; i++)
			mesh->material[i].unlit = 0;
		struct psr_model *model = model_build(mesh, RESOLUTION);
		const double pixel = psr_model_info(model)->spacing / 0.8;
		const struct psr_instance instance = { .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
		const struct psr_scene scene = { .instance = &instance, .n_instances = 1, .light = &light, .n_lights = 1,
			                             .camera = { .kind = PSR_CAMERA_ORTHOGRAPHIC, .ortho_height = SIDE * pixel,
			                                         .eye = { 0, 0, 4 }, .up = { 0, 1, 0 } } };
		struct psr_frame frame = { .width = SIDE, .height = SIDE, .rgb = rgb };
		struct psr_settings settings;
		struct psr_renderer *renderer;

		psr_settings_default(&settings, SIDE, SIDE);
		settings.pass = pass;
		assert_int_equal(psr_renderer_create(&renderer, NULL), PSR_OK);
		assert_int_equal(psr_render(renderer, &scene, &settings, NULL, &frame, NULL), PSR_OK);
		red[has_panes] = (double)psr_srgb_to_linear[rgb[3 * (SIDE / 2 * SIDE + SIDE / 2 + (int)(0.6 / pixel))]];
		*n_maps = frame.report.n_shadow_maps;
		psr_renderer_destroy(renderer);
		psr_model_unref(model);
		meshes_free(mesh);
	}
	assert_true(red[0] > 0.5 && red[0] < 1);
	return red[1] / red[0];
}

/* Two codes of 8 bits, each of 2.28 / 255 of white at most and half rounded away, beside more than half of white; an
 * opacity is rounded to half of 1 / 255. */
static void shadows_let_light_through_in_proportion(void **state)
{
	static const float opacity[] = { 0.1f, 0.25f, 0.4f, 0.5f, 0.7f, 0.9f };
	const double most = 2 * 2.28 / 255 + 0.5 / 255;
	uint32_t n_maps;

	(void)state;
	for (int i = 0; i < 6; i++)
		for (unsigned pass = 0; pass <= 1; pass++) {
			const struct square pane = { 0.1, 0.3, 2, opacity[i] };

			assert_float_equal(light_under(&pane, 1, pass, &n_maps), 1 - (double)opacity[i], most);
			assert_int_equal(n_maps, pass ? 0 : 2); /* refined frames do not count them */
		}
	const struct square both[] = { { 0.1, 0.3, 2, 0.2f }, { 0.3, 0.3, 2, 0.6f } };
	assert_float_equal(light_under(both, 2, 0, &n_maps), 0.8 * 0.4, most);
	assert_true(n_maps >= 3); /* a fourth, of blocks that were joined from both panes */
	assert_float_equal(light_under(&(struct square){ 0.1, 0.3, 2, 1 }, 1, 0, &n_maps), 0, most);
	assert_int_equal(n_maps, 1);
}

/* Each pane has a word or more in each pixel, 16 bytes each: beyond 64 MB without a limit. */
static void a_crowd_of_panes_takes_little_memory(void **state)
{
	enum { CROWD = 1000 };
	const struct square set[] = { { 0, 0.8, 2, 0.3f } };
	struct psr_model *model = build_squares(set, 1);
	static struct psr_instance instance[CROWD];
	static struct picture picture;
	struct psr_scene scene = { .instance = instance, .n_instances = CROWD, .ambient = { 1, 1, 1 } };
	struct psr_frame frame = { .width = SIDE, .height = SIDE, .rgb = picture.rgb };
	struct render_settings settings;
	struct psr_renderer *renderer;

	(void)state;
	for (int i = 0; i < CROWD; i++)
		instance[i] = (struct psr_instance){ .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1,
			                                 .translation = { 0, 0, (i * 617 % CROWD - CROWD / 2.0) / CROWD } };
	scene.camera = (struct psr_camera){ .kind = PSR_CAMERA_ORTHOGRAPHIC, .ortho_height = 1, .eye = { 0, 0, 4 },
		                                .up = { 0, 1, 0 } };
	render_settings_default(&settings, SIDE, SIDE);
	assert_int_equal(psr_renderer_create(&renderer, NULL), PSR_OK);
	assert_int_equal(renderer_draw(renderer, &scene, &settings, NULL, &frame, NULL), PSR_OK);
	assert_true(psr_renderer_bytes(renderer) < 64 << 20);
	psr_renderer_destroy(renderer);
	psr_model_unref(model);
}

static void pictures_have_the_same_bits_by_any_threads_and_instructions(void **state)
{
	const struct square set[] = { { -0.5, 1, 0, 1 }, { 0.1, 0.8, 2, 0.3f }, { 0.4, 0.6, 1, 0.6f } };
	struct psr_model *model = build_squares(set, 3);
	static struct picture one, other;

	(void)state;
	for (unsigned pass = 0; pass <= 1; pass++) {
		draw(&one, model, &(struct shot){ 0.8, 0, pass, 1, 0, &simd_c });
		assert_int_equal(one.report.effect[PSR_EFFECT_SHEER].why, PSR_WHY_RAN);
		assert_true(one.report.effect[PSR_EFFECT_SHEER].count > 0);
		for (int k = 0; k < 3; k++) {
			draw(&other, model, &(struct shot){ 0.8, 0, pass, 1, k == 0 ? 3 : 0, k == 2 ? &simd_c : NULL });
			assert_memory_equal(one.rgb, other.rgb, sizeof one.rgb);
			assert_memory_equal(one.depth, other.depth, sizeof one.depth);
		}
	}
	psr_model_unref(model);
}

static void only_what_lets_light_through_has_opacities(void **state)
{
	static const float opacity[] = { 0.5f, 1 };

	(void)state;
	for (int i = 0; i < 2; i++) {
		const struct square set[] = { { -0.5, 1, 0, 1 }, { 0.1, 0.8, 2, opacity[i] } };
		struct psr_model *model = build_squares(set, 2);
		const struct psr_blocks *blocks = psr_model_blocks(model);
		uint32_t n = 0;

		for (uint32_t b = 0; b < blocks->n_blocks; b++)
			n += psr_blocks_is_sheer(blocks, b) != 0;
		if (blocks->opacity != NULL)
			assert_opacities(blocks, 128);
		assert_int_equal(blocks->opacity != NULL, i == 0);
		assert_int_equal(n != 0, i == 0);
		assert_true(n < blocks->n_blocks);
		psr_model_unref(model);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(nothing_is_open_where_all_is_opaque),
		cmocka_unit_test(planes_of_any_slope_are_open_in_proportion),
		cmocka_unit_test(a_pane_keeps_its_share_of_the_light_back_in_every_pixel_and_pass),
		cmocka_unit_test(behind_two_panes_what_both_let_through_is_left),
		cmocka_unit_test(before_nothing_the_background_is_seen_through_a_pane),
		cmocka_unit_test(a_wall_hides_the_pane_behind_it),
		cmocka_unit_test(a_decal_changes_nothing_of_the_wall_beside_it),
		cmocka_unit_test(what_is_in_a_case_of_glass_is_seen),
		cmocka_unit_test(a_pane_has_the_depth_of_what_shows_most),
		cmocka_unit_test(a_pane_that_keeps_back_half_shows_in_all_planes),
		cmocka_unit_test(shadows_let_light_through_in_proportion),
		cmocka_unit_test(a_crowd_of_panes_takes_little_memory),
		cmocka_unit_test(pictures_have_the_same_bits_by_any_threads_and_instructions),
		cmocka_unit_test(only_what_lets_light_through_has_opacities),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
