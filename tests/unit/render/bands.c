/* Bands: tiles of most differential points are cut, and no bit of a frame or its report changes. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "render/bands.h"
#include "render/cull.h"
#include "render/stages.h"
#include "tests/unit/lib/points.h"
#include "tests/unit/lib/shapes.h"
#include "tests/unit/lib/threads.h"

#define WIDTH 600
#define HEIGHT 300 /* three rows of tiles, the last of which ends within a part */
#define TILES (3 * 3)
#define SPHERES 9

static struct dpoint_set set;
static struct psr_model *sphere, *of_blocks;
static struct psr_instance instance[SPHERES + 1]; /* the last is of blocks */

static int setup(void **state)
{
	struct revolved s;

	(void)state;
	revolve(&s, 0, 0.8, 6, 5);
	points_of_patch(&set, &s.patch, 24, POINTS_GREY);
	sphere = points_to_model(&set);
	for (int i = 0; i < SPHERES; i++)
		instance[i] = (struct psr_instance){ .model = sphere, .rotation = { 0, sin(0.2 * i), 0, cos(0.2 * i) },
			                                 .scale = 0.9, .translation = { 0.1 * (i % 3), 0.1 * (i / 3), -0.05 * i } };
	of_blocks = shape_build(&(struct shape_options){ .resolution = 64, .diffuse = 0x8040c0, .scale = 1 }, 0.9);
	instance[SPHERES] = (struct psr_instance){ .model = of_blocks, .rotation = { 0, 0, 0, 1 }, .scale = 1,
		                                       .translation = { 0.5, 1, 0 } };
	return 0;
}

static int teardown(void **state)
{
	(void)state;
	psr_model_unref(sphere);
	psr_model_unref(of_blocks);
	dpoint_set_fini(&set);
	return 0;
}

/* All spheres are in the middle of the picture. */
static void set_scene(struct psr_scene *scene, int n)
{
	*scene = (struct psr_scene){
		.instance = instance, .n_instances = (uint32_t)n, .ambient = { 0.5, 0.5, 0.5 },
		.camera = { .eye = { 0.5, 1, 8 }, .up = { 0, 1, 0 }, .fov_y = 0.7 },
	};
}

/* Lists bands of the scene for so many threads. */
static uint32_t bands_of(struct band band[TILES * BANDS_MOST], uint32_t n_entries[TILES], const struct psr_scene *scene,
                         uint32_t levels, int n_threads)
{
	struct render_settings settings;
	struct psr_report report = { 0 };
	struct plan plan = { 0 };
	struct bins bins = { 0 };
	uint32_t n;

	render_settings_default(&settings, WIDTH, HEIGHT);
	assert_int_equal(psr_scene_validate(scene, NULL), PSR_OK);
	assert_int_equal(plan_make(&plan, scene, &settings, NULL), PSR_OK);
	assert_int_equal(cull_blocks(&bins, &simd_c, &plan, NULL, &report), PSR_OK);
	assert_int_equal(plan.tiles_x * plan.tiles_y, TILES);
	n = bands_make(band, &plan, &bins, levels, n_threads);
	for (int t = 0; t < TILES; t++)
		n_entries[t] = bins.tile_begin[t + 1] - bins.tile_begin[t];
	bins_clear(&bins);
	plan_clear(&plan);
	return n;
}

static void bands_are_all_rows_of_all_tiles(void **state)
{
	struct band band[TILES * BANDS_MOST];
	uint32_t n_entries[TILES];
	struct psr_scene scene;

	(void)state;
	for (int n_spheres = 1; n_spheres <= SPHERES; n_spheres += 4)
		for (int n_threads = 1; n_threads <= 64; n_threads *= 2) {
			uint8_t rows[TILES][TILE_HEIGHT] = { { 0 } };

			set_scene(&scene, n_spheres);
			const uint32_t n = bands_of(band, n_entries, &scene, 0, n_threads);

			for (uint32_t i = 0; i < n; i++) {
				assert_true(band[i].y0 % PART_HEIGHT == 0 && band[i].y1 <= TILE_HEIGHT);
				for (uint32_t y = band[i].y0; y < band[i].y1; y++)
					rows[band[i].tile][y]++;
			}
			for (uint32_t t = 0; t < TILES; t++)
				for (uint32_t y = 0; y < TILE_HEIGHT && t / 3 * TILE_HEIGHT + y < HEIGHT; y++)
					assert_int_equal(rows[t][y], 1);
		}
}

static void a_tile_beyond_a_threads_share_is_cut(void **state)
{
	struct band band[TILES * BANDS_MOST];
	uint32_t n_entries[TILES], total = 0, most = 0, n_cut = 0;
	struct psr_scene scene;

	(void)state;
	set_scene(&scene, SPHERES);
	assert_int_equal(bands_of(band, n_entries, &scene, 0, 1), TILES);
	assert_int_equal(bands_of(band, n_entries, &scene, 4, 2), TILES); /* cells */
	set_scene(&scene, SPHERES + 1);
	assert_int_equal(bands_of(band, n_entries, &scene, 0, 2), TILES); /* blocks, which are counted by row */
	set_scene(&scene, SPHERES);
	bands_of(band, n_entries, &scene, 0, 1);
	for (uint32_t t = 0; t < TILES; t++) {
		total += n_entries[t];
		most = n_entries[t] > n_entries[most] ? t : most;
	}
	assert_true(n_entries[most] > total / 2); /* what the scene is for */
	const uint32_t n = bands_of(band, n_entries, &scene, 0, 2);

	for (uint32_t i = 0; i < n; i++)
		n_cut += band[i].tile == most;
	assert_int_equal(n_cut, 2);
	assert_int_equal(n, TILES + 1);
	/* What takes longest comes first. */
	assert_true(band[0].tile == most && band[1].tile == most);
}

struct drawn {
	uint8_t rgb[3 * WIDTH * HEIGHT];
	uint64_t words[WIDTH * HEIGHT];
	struct psr_report report;
};

static void draw(struct drawn *to, const struct psr_scene *scene, int n_threads)
{
	struct psr_frame frame = { .width = WIDTH, .height = HEIGHT, .rgb = to->rgb, .words = to->words };
	struct render_settings settings;
	struct psr_renderer *renderer;
	struct psr_pool *pool = NULL;

	render_settings_default(&settings, WIDTH, HEIGHT);
	assert_int_equal(psr_renderer_create(&renderer, NULL), PSR_OK);
	if (n_threads > 1)
		assert_int_equal(psr_pool_create(&pool, n_threads, NULL), PSR_OK);
	/* The second frame finds words that the first left empty. */
	for (int i = 0; i < 2; i++)
		assert_int_equal(renderer_draw(renderer, scene, &settings, pool, &frame, NULL), PSR_OK);
	to->report = frame.report;
	psr_pool_destroy(pool);
	psr_renderer_destroy(renderer);
}

static void cut_tiles_are_drawn_the_same_by_threads(void **state)
{
	struct drawn *whole = malloc(sizeof *whole), *cut = malloc(sizeof *cut);
	struct psr_scene scene;

	(void)state;
	for (int way = 0; way < 3; way++) {
		set_scene(&scene, SPHERES);
		if (way == 1)
			scene.camera = (struct psr_camera){ .eye = { 0.5, 1, 8 }, .up = { 0, 1, 0 },
				                                .kind = PSR_CAMERA_ORTHOGRAPHIC, .ortho_height = 6 };
		if (way == 2) /* the eye is among them */
			scene.camera.eye[2] = 0.9;
		draw(whole, &scene, 1);
		for (int n_threads = 2; n_threads <= 9; n_threads = 2 * n_threads - 1) {
			draw(cut, &scene, n_threads);
			assert_memory_equal(whole->rgb, cut->rgb, sizeof whole->rgb);
			assert_memory_equal(whole->words, cut->words, sizeof whole->words);
			assert_memory_equal(whole->report.count, cut->report.count, sizeof whole->report.count);
		}
	}
	free(whole);
	free(cut);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(bands_are_all_rows_of_all_tiles),
		cmocka_unit_test(a_tile_beyond_a_threads_share_is_cut),
		cmocka_unit_test(cut_tiles_are_drawn_the_same_by_threads),
	};

	only_threads_under_tsan();
	return cmocka_run_group_tests(tests, setup, teardown);
}
