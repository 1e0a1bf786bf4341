/* Things narrower than a pixel: what their samples cover, and how they are drawn. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <string.h>
#include "base/pool.h"
#include "base/srgb.h"
#include "render/render.h"
#include "render/stages.h"
#include "level.h"
#include "model.h"

#define RESOLUTION 96
#define PIXEL (2.0 / RESOLUTION) /* the box below has a sphere of radius 1 or so */
#define SIDE 64

/* A black rod or plate along x, as long as the unit sphere, so many pixels wide along y and z. */
static struct psr_mesh *rod(double wide, double thick)
{
	struct psr_mesh *mesh = meshes_box(1, 0);

	for (uint32_t i = 0; i < mesh->n_vertices; i++) {
		mesh->position[i][1] *= (float)(wide * PIXEL / 2);
		mesh->position[i][2] *= (float)(thick * PIXEL / 2);
	}
	mesh->material->unlit = 1;
	for (int c = 0; c < 3; c++)
		mesh->material->base_color[c] = 0;
	return mesh;
}

/* The part of a disc of width 1 to the left of a line at t. */
static double left_of(double t)
{
	return t <= -0.5 ? 0 : t >= 0.5 ? 1 : 0.5 + (asin(2 * t) + 2 * t * sqrt(1 - 4 * t * t)) / M_PI;
}

/* The part of a disc in a strip whose middle is `off` from the disc's. */
static double strip(double wide, double off)
{
	return left_of(off + wide / 2) - left_of(off - wide / 2);
}

/* A sample may stand 0.4 pixels beside a place on its wire's side. Of the 32 rays through a disc, strips of all widths,
 * places and directions have up to 3.8 more or less than their share (all were tried), and opacities are rounded down.
 * A wire is somewhat narrower than PIXEL says, as the sphere is somewhat larger: by a thousandth. */
static void a_wire_covers_its_width_of_a_disc(void **state)
{
	static const double width[] = { 0.1, 0.25, 0.5 };

	(void)state;
	for (int w = 0; w < 3; w++) {
		struct level_set set;
		uint32_t n_inside = 0;

		level_set_make(&set, rod(width[w], width[w]), RESOLUTION, 2);
		for (uint32_t i = 0; i < set.level.kept.n; i++) {
			const struct kept_sample *sample = &set.level.kept.sample[i];
			const double opacity = sample->opacity / 255.0;

			if (fabs((double)sample->position[0]) > 1 - PIXEL)
				continue; /* a disc beyond the end */
			n_inside++;
			assert_int_equal(sample->traits & ~PSR_BLOCK_OFF, PSR_BLOCK_SHEER | PSR_BLOCK_THIN);
			assert_true(opacity <= strip(width[w], 0) + 0.121);
			assert_true(opacity >= strip(0.99 * width[w], 0.4 + width[w] / 2) - 0.121);
		}
		assert_true(n_inside > RESOLUTION / 2);
		level_set_close(&set);
	}
}

static void inside_of_a_leaf_samples_are_opaque(void **state)
{
	struct level_set set;
	uint32_t n_inside = 0;

	(void)state;
	level_set_make(&set, rod(8, 0.2), RESOLUTION, 2);
	for (uint32_t i = 0; i < set.level.kept.n; i++) {
		const struct kept_sample *sample = &set.level.kept.sample[i];

		if (fabs((double)sample->position[0]) > 1 - PIXEL || fabs((double)sample->position[1]) > 3 * PIXEL)
			continue;
		n_inside++;
		assert_int_equal(sample->opacity, PSR_OPAQUE);
		assert_int_equal(sample->traits, 0);
	}
	assert_true(n_inside > 4 * RESOLUTION);
	level_set_close(&set);
}

struct shot {
	double magnification;
	unsigned pass;
	int n_threads; /* 0: none but the caller's */
	const struct simd *simd; /* NULL: the machine's */
};

/* From above z, along it, before white. */
static void draw(uint8_t rgb[3 * SIDE * SIDE], const struct psr_model *model, const struct shot *shot)
{
	const struct psr_instance instance = { .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	struct psr_scene scene = { .instance = &instance, .n_instances = 1, .ambient = { 1, 1, 1 },
		                       .background = { 1, 1, 1 } };
	struct psr_frame frame = { .width = SIDE, .height = SIDE, .rgb = rgb };
	struct psr_pool *pool = NULL;
	struct psr_renderer *renderer;
	struct refiner *refiner;
	struct render_settings settings;

	scene.camera = (struct psr_camera){ .kind = PSR_CAMERA_ORTHOGRAPHIC, .eye = { 0, 0, 4 }, .up = { 0.2, 1, 0 },
		                                .ortho_height = SIDE * psr_model_info(model)->spacing / shot->magnification };
	render_settings_default(&settings, SIDE, SIDE);
	settings.pass = shot->pass;
	assert_int_equal(psr_renderer_create(&renderer, NULL), PSR_OK);
	assert_int_equal(refiner_create(&refiner, renderer, NULL), PSR_OK);
	if (shot->n_threads != 0)
		assert_int_equal(psr_pool_create(&pool, shot->n_threads, NULL), PSR_OK);
	if (shot->simd != NULL)
		renderer_use(renderer, shot->simd);
	assert_int_equal(refiner_draw(refiner, &scene, &settings, pool, &frame, NULL), PSR_OK);
	assert_int_equal(frame.report.effect[PSR_EFFECT_VEILS].why, PSR_WHY_RAN);
	assert_true(frame.report.effect[PSR_EFFECT_VEILS].count > 0);
	assert_int_equal(frame.report.effect[PSR_EFFECT_SHEER].why, PSR_WHY_NOTHING);
	refiner_destroy(refiner);
	psr_renderer_destroy(renderer);
	psr_pool_destroy(pool);
}

static struct psr_model *build_rod(double wide, double thick)
{
	struct psr_mesh *mesh = rod(wide, thick);
	struct psr_model *model = model_build(mesh, RESOLUTION);

	meshes_free(mesh);
	return model;
}

/* The light that a rod keeps back in the middle columns, a column. */
static double kept_back(const struct psr_model *model, const struct shot *shot, double *most)
{
	static uint8_t rgb[3 * SIDE * SIDE];
	double sum = 0;

	draw(rgb, model, shot);
	*most = 0;
	for (int y = 0; y < SIDE; y++)
		for (int x = SIDE / 4; x < 3 * SIDE / 4; x++) {
			const double dark = 1 - (double)psr_srgb_to_linear[rgb[3 * (y * SIDE + x)]];

			sum += dark;
			*most = dark > *most ? dark : *most;
		}
	return sum / (SIDE / 2);
}

/* Drawn as an opaque line, it would keep back all light of a pixel in each column. */
static void a_wire_lets_most_of_the_light_of_its_pixels_through(void **state)
{
	static const double magnification[] = { 0.5, 1 };
	struct psr_model *thin = build_rod(0.1, 0.1), *thick = build_rod(0.5, 0.5);

	(void)state;
	for (int m = 0; m < 2; m++)
		for (unsigned pass = 0; pass <= 2; pass++) {
			const struct shot shot = { magnification[m], pass, 2, NULL };
			double most, unused;
			const double little = kept_back(thin, &shot, &most), much = kept_back(thick, &shot, &unused);

			assert_true(little > 0);
			assert_true(most < 0.5);
			assert_true(much > 2 * little);
			assert_true(much < 1);
		}
	psr_model_unref(thin);
	psr_model_unref(thick);
}

static void threads_and_kernels_change_no_bit_of_wires(void **state)
{
	static uint8_t first[3 * SIDE * SIDE], other[3 * SIDE * SIDE];
	struct psr_model *model = build_rod(0.3, 0.3);

	(void)state;
	for (unsigned pass = 0; pass <= 1; pass++) {
		draw(first, model, &(struct shot){ 0.8, pass, 0, NULL });
		for (int n = 1; n <= 3; n++) {
			draw(other, model, &(struct shot){ 0.8, pass, n, NULL });
			assert_memory_equal(first, other, sizeof first);
		}
		draw(other, model, &(struct shot){ 0.8, pass, 0, &simd_c });
		assert_memory_equal(first, other, sizeof first);
	}
	psr_model_unref(model);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_wire_covers_its_width_of_a_disc),
		cmocka_unit_test(inside_of_a_leaf_samples_are_opaque),
		cmocka_unit_test(a_wire_lets_most_of_the_light_of_its_pixels_through),
		cmocka_unit_test(threads_and_kernels_change_no_bit_of_wires),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
