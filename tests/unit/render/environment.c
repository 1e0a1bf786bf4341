/* What surrounds a caller does not show in its frames: rounding and flushing of the thread, how many threads draw. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <fenv.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>
#include <xxhash.h>
#ifdef __x86_64__
#include <immintrin.h>
#endif
#include "base/direction.h"
#include "simd/isa.h"
#include "render/stages.h"
#include "tests/unit/lib/shapes.h"
#include "tests/unit/lib/threads.h"

#define FLUSH_AND_DAZ 0x8040u /* of MXCSR: results and operands that are denormal count as 0 */

struct view {
	uint32_t width, height;
	int n_threads;
	enum psr_camera_kind kind;
	double ortho_height;
};

/* Distances of 1e-20: their squares are denormal. A light with a fall-off, so that positions count. */
static uint64_t draw(const struct view *view, const struct psr_model *model, double unit)
{
	const struct psr_instance instance = { .model = model, .rotation = { 0, 0, 0, 1 }, .scale = unit };
	const struct psr_light light[2] = {
		{ .kind = PSR_LIGHT_DIRECTIONAL, .direction = { -1, -2, -1.5 }, .color = { 0.3, 0.3, 0.3 } },
		{ .kind = PSR_LIGHT_POINT,
		  .position = { 2 * unit, unit, 2 * unit },
		  .color = { 0.7, 0.6, 0.5 },
		  .reference = 2 * unit },
	};
	const struct psr_scene scene = {
		.instance = &instance, .n_instances = 1, .light = light, .n_lights = 2, .ambient = { 0.1, 0.1, 0.1 },
		.camera = { .eye = { 0.7 * unit, 0.4 * unit, 2.1 * unit }, .up = { 0, 1, 0 }, .kind = view->kind, .fov_y = 1.1,
			    .ortho_height = view->ortho_height * unit },
	};
	const size_t n = (size_t)view->width * view->height;
	struct psr_frame frame = { .width = view->width,
		                       .height = view->height,
		                       .rgb = malloc(3 * n),
		                       .depth = malloc(4 * n) };
	struct psr_renderer *renderer;
	struct render_settings settings;
	struct psr_pool *pool;
	struct psr_error err;
	render_settings_default(&settings, view->width, view->height);
	assert_non_null(frame.rgb);
	assert_non_null(frame.depth);
	assert_int_equal(psr_renderer_create(&renderer, NULL), PSR_OK);
	assert_int_equal(psr_pool_create(&pool, view->n_threads, NULL), PSR_OK);
	if (renderer_draw(renderer, &scene, &settings, pool, &frame, &err))
		fail_msg("%s", err.text);
	assert_true(frame.report.n_covered > 0);
	const uint64_t hash = XXH64(frame.depth, 4 * n, XXH64(frame.rgb, 3 * n, 0));
	psr_pool_destroy(pool);
	psr_renderer_destroy(renderer);
	free(frame.rgb);
	free(frame.depth);
	return hash;
}

static struct psr_model *sphere(void)
{
	const struct shape_options o = { .resolution = 96,
		                             .diffuse = 0x6090c0,
		                             .metallic = 15,
		                             .reflectance = 6,
		                             .roughness = 80,
		                             .scale = 1 };
	return shape_build(&o, 0.9);
}

static void set_environment(int rounding, unsigned flush)
{
	assert_int_equal(fesetround(rounding), 0);
#ifdef __x86_64__
	_mm_setcsr(_mm_getcsr() | flush);
#else
	(void)flush;
#endif
}

/* In a process of its own, so that tables made at first use are made there, too. */
static uint64_t draw_in(const struct psr_model *model, const struct view *view, double unit, int rounding,
                        unsigned flush)
{
	int ends[2], status;
	uint64_t hash = 0;
	assert_int_equal(pipe(ends), 0);
	const pid_t child = fork();
	if (!child) {
		set_environment(rounding, flush);
		hash = draw(view, model, unit);
		_exit(write(ends[1], &hash, sizeof hash) == sizeof hash && fegetround() == rounding ? 0 : 1);
	}
	assert_true(child > 0);
	assert_int_equal(read(ends[0], &hash, sizeof hash), sizeof hash);
	assert_int_equal(waitpid(child, &status, 0), child);
	assert_int_equal(status, 0);
	close(ends[0]);
	close(ends[1]);
	return hash;
}

/* Before anything else asks for the tables, which are made once. */
static void tables_do_not_depend_on_who_asks_first(void **state)
{
	int ends[2];
	uint64_t hash[2] = { 0 };
	(void)state;
	assert_int_equal(pipe(ends), 0);
	const pid_t child = fork();
	if (!child) {
		set_environment(FE_UPWARD, FLUSH_AND_DAZ);
		hash[0] = XXH64(psr_direction_table(), PSR_DIRECTIONS * 3 * sizeof(float), 0);
		_exit(write(ends[1], hash, sizeof *hash) == sizeof *hash ? 0 : 1);
	}
	assert_true(child > 0);
	assert_int_equal(read(ends[0], hash, sizeof *hash), sizeof *hash);
	assert_int_equal(waitpid(child, NULL, 0), child);
	hash[1] = XXH64(psr_direction_table(), PSR_DIRECTIONS * 3 * sizeof(float), 0);
	assert_true(hash[0] == hash[1]);
	close(ends[0]);
	close(ends[1]);
}

static const struct view views[] = {
	{ 200, 150, 1, PSR_CAMERA_PERSPECTIVE, 0 },
	{ 200, 150, 1, PSR_CAMERA_ORTHOGRAPHIC, 1.9 },
};
static const double units[] = { 1, 1e-20, 1e-29 };

static void frames_do_not_depend_on_the_callers_rounding_or_flushing(void **state)
{
	struct psr_model *model = sphere();
	(void)state;
	for (size_t v = 0; v < sizeof views / sizeof views[0]; v++)
		for (size_t u = 0; u < sizeof units / sizeof units[0]; u++) {
			const uint64_t expected = draw_in(model, &views[v], units[u], FE_TONEAREST, 0);
			assert_true(draw_in(model, &views[v], units[u], FE_TONEAREST, FLUSH_AND_DAZ) == expected);
			assert_true(draw_in(model, &views[v], units[u], FE_UPWARD, 0) == expected);
			assert_true(draw_in(model, &views[v], units[u], FE_TOWARDZERO, FLUSH_AND_DAZ) == expected);
		}
	psr_model_unref(model);
}

static void a_frame_leaves_the_callers_environment_as_it_was(void **state)
{
	struct psr_model *model = sphere();
	fenv_t before;
	(void)state;
	fegetenv(&before);
	set_environment(FE_DOWNWARD, FLUSH_AND_DAZ);
	draw(&views[0], model, 1);
	const int rounding = fegetround();
#ifdef __x86_64__
	const unsigned flush = _mm_getcsr() & FLUSH_AND_DAZ;
#else
	const unsigned flush = FLUSH_AND_DAZ;
#endif
	fesetenv(&before);
	assert_int_equal(rounding, FE_DOWNWARD);
	assert_int_equal(flush, FLUSH_AND_DAZ);
	psr_model_unref(model);
}

/* Tiles of a single column or row stand beside others, which other threads draw at the same time. The sphere fills them
 * all. */
static void threads_do_not_show_where_tiles_are_narrow(void **state)
{
	static const uint32_t size[][2] = { { 257, 140 }, { 263, 129 }, { 513, 131 }, { 17, 300 } };
	struct psr_model *model = sphere();
	(void)state;
	for (int isa = 0; isa < PSR_N_ISAS; isa++) {
		psr_isa_cap((enum psr_isa)isa);
		for (size_t i = 0; i < sizeof size / sizeof size[0]; i++) {
			struct view view = { size[i][0], size[i][1], 1, PSR_CAMERA_ORTHOGRAPHIC, 0.5 };
			const uint64_t expected = draw(&view, model, 1);
			view.n_threads = 4;
			for (int run = 0; run < 5; run++)
				assert_true(draw(&view, model, 1) == expected);
		}
	}
	psr_model_unref(model);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(tables_do_not_depend_on_who_asks_first),
		cmocka_unit_test(frames_do_not_depend_on_the_callers_rounding_or_flushing),
		cmocka_unit_test(a_frame_leaves_the_callers_environment_as_it_was),
		cmocka_unit_test(threads_do_not_show_where_tiles_are_narrow),
	};
	only_threads_under_tsan();
	return cmocka_run_group_tests(tests, NULL, NULL);
}
