/* What a frame leaves out changes no byte of it, and costs nothing. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/random.h"
#include "render/stages.h"
#include "render/render.h"
#include "tests/unit/lib/shapes.h"

#define MODELS 6
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
#define CASES 20 /* they take their time */
#else
#define CASES 60
#endif

static struct psr_model *models[MODELS];
static const char *const names[MODELS] = { "teapot", "wheel", "top", "sphere", "square", "matt sphere" };

static int open_models(void **state)
{
	(void)state;
	const struct shape_options shiny = { .resolution = 96,
		                                 .diffuse = 0x6090c0,
		                                 .reflectance = 15,
		                                 .shut = 9,
		                                 .roughness = 110,
		                                 .cones = 1,
		                                 .scale = 3,
		                                 .origin = { 5, -2, 1 } };
	const struct shape_options leaf = { .resolution = 64, .diffuse = 0x20ff20, .two_sided = 1, .scale = 1 };
	const struct shape_options matt = { .resolution = 128, .diffuse = 0xc0c0c0, .scale = 1 };
	struct psr_error err;
	for (int i = 0; i < 3; i++) {
		char path[64];
		snprintf(path, sizeof path, "tests/golden/%s.psr", names[i]);
		if (psr_model_read(&models[i], path, &err))
			return -1;
	}
	models[3] = shape_build(&shiny, 0.9);
	models[4] = shape_build(&leaf, 0);
	models[5] = shape_build(&matt, 0.8);
	return 0;
}

static int close_models(void **state)
{
	(void)state;
	for (int i = 0; i < MODELS; i++)
		psr_model_unref(models[i]);
	return 0;
}

/* A view of one or three models: scene `which` of many. */
struct case_of {
	struct psr_instance instance[3];
	struct psr_light light[5];
	struct psr_scene scene;
	struct render_settings settings;
};

static void case_make(struct case_of *c, uint32_t which)
{
	uint64_t seed = which;
	const struct psr_model *first = models[which % MODELS];
	const struct psr_model_info *info = psr_model_info(first);
	memset(c, 0, sizeof *c);
	c->scene = (struct psr_scene){ .instance = c->instance,
		                           .n_instances = which % 3 == 2 ? 3 : 1,
		                           .light = c->light,
		                           .n_lights = random_below(&seed, 6),
		                           .ambient = { 0.1, 0.2, 0.1 },
		                           .background = { 0.2, 0, 0.5 } };
	for (uint32_t i = 0; i < c->scene.n_instances; i++) {
		c->instance[i] =
			(struct psr_instance){ i ? models[random_below(&seed, MODELS)] : first, { 0, 0, 0, 1 }, { 0, 0, 0 }, 1,
			                       PSR_AUTOMATIC, PSR_COLOR_OWN };
		for (int k = 0; k < 3 && i; k++)
			c->instance[i].translation[k] = random_in(&seed, -info->scale, info->scale);
		if (i) /* a third of a turn about a diagonal */
			for (int k = 0; k < 4; k++)
				c->instance[i].rotation[k] = 0.5;
	}
	for (uint32_t i = 0; i < c->scene.n_lights; i++) {
		struct psr_light *l = &c->light[i];
		l->kind = which % 2 ? PSR_LIGHT_DIRECTIONAL : (enum psr_light_kind)(random_below(&seed, 3));
		l->casts_shadow = (which + i) % 3 == 0;
		for (int k = 0; k < 3; k++) {
			l->direction[k] = random_in(&seed, -1, 1);
			l->position[k] = info->origin[k] + random_in(&seed, -3, 3) * info->scale;
			l->color[k] = i == 3 ? 0 : random_in(&seed, 0, 1);
		}
		l->outer = random_in(&seed, 0.2, 1);
		l->inner = l->outer * 0.7;
	}
	struct psr_camera *camera = &c->scene.camera;
	const double distance = random_in(&seed, which % 7 == 6 ? 0.3 : 1.2, 5) * info->scale;
	double direction[3] = { random_in(&seed, -1, 1), random_in(&seed, -1, 1), random_in(&seed, 0.1, 1) };
	for (int k = 0; k < 3; k++) {
		camera->target[k] = info->origin[k];
		camera->eye[k] = info->origin[k] + direction[k] * distance;
	}
	camera->up[1] = 1;
	camera->kind = random_below(&seed, 4) ? PSR_CAMERA_PERSPECTIVE : PSR_CAMERA_ORTHOGRAPHIC;
	camera->fov_y = random_in(&seed, 0.2, 1.5);
	camera->ortho_height = random_in(&seed, 0.5, 4) * info->scale;
	render_settings_default(&c->settings, 64 + random_below(&seed, 600), 64 + random_below(&seed, 500));
	c->settings.smooth = which % 4 == 1;
}

struct drawn {
	struct psr_frame frame;
};

static void draw(struct drawn *d, const struct case_of *c, const struct render_settings *settings, const struct simd *simd)
{
	struct psr_renderer *renderer;
	struct psr_error err;
	const size_t area = (size_t)settings->width * settings->height;
	d->frame = (struct psr_frame){ .width = settings->width, .height = settings->height, .rgb = malloc(3 * area),
		                           .depth = malloc(4 * area) };
	assert_int_equal(psr_renderer_create(&renderer, NULL), 0);
	if (simd)
		renderer_use(renderer, simd);
	if (renderer_draw(renderer, &c->scene, settings, NULL, &d->frame, &err))
		fail_msg("%s", err.text);
	psr_renderer_destroy(renderer);
}

static void release(struct drawn *d)
{
	free(d->frame.rgb);
	free(d->frame.depth);
}

static void assert_same(const struct drawn *a, const struct drawn *b, uint32_t which, const char *what)
{
	const size_t area = (size_t)a->frame.width * a->frame.height;
	if (memcmp(a->frame.rgb, b->frame.rgb, 3 * area) || memcmp(a->frame.depth, b->frame.depth, 4 * area))
		fail_msg("case %u: %s changes the frame", which, what);
}

static void leaving_out_changes_no_byte(void **state)
{
	(void)state;
	for (uint32_t which = 0; which < CASES; which++) {
		struct case_of c;
		struct drawn lean, full;
		case_make(&c, which);
		draw(&lean, &c, &c.settings, NULL);
		c.settings.is_full = 1;
		draw(&full, &c, &c.settings, NULL);
		assert_same(&lean, &full, which, "leaving out what can be left out");
		release(&lean);
		release(&full);
	}
}

static void tests_of_blocks_change_no_byte(void **state)
{
	(void)state;
	for (uint32_t which = 0; which < CASES * 2 / 3; which++) {
		struct case_of c;
		struct drawn all, some;
		case_make(&c, which);
		draw(&all, &c, &c.settings, NULL);
		for (unsigned tests = 0; tests < PSR_CULL_ALL; tests += which % 2 ? 3 : 1) {
			c.settings.cull_tests = tests;
			draw(&some, &c, &c.settings, NULL);
			assert_same(&all, &some, which, "a test of blocks");
			assert_true(some.frame.report.n_blocks_drawn >= all.frame.report.n_blocks_drawn);
			release(&some);
		}
		release(&all);
	}
}

/* ---- kernels that count how often they are called ---- */

static struct {
	uint64_t light, lit, warp_far, veil, depth_row, fill_push;
} calls;

static void count_light(struct strip *strip, const struct strip_light *light, const float *reaches)
{
	calls.light++;
	simd_c.strip_light(strip, light, reaches);
}

static void count_lit(float (*lit)[4], const struct strip_view *view, const struct strip_lights *lights,
                      uint32_t first, uint32_t n)
{
	calls.lit++;
	simd_c.strip_lit(lit, view, lights, first, n);
}

static void count_far(const struct warp_target *target, uint32_t far[TILE_HEIGHT / FAR_SIDE * (TILE_WIDTH / FAR_SIDE)])
{
	calls.warp_far++;
	simd_c.warp_far(target, far);
}

static void count_veil(const struct warp_target *target, const struct veil_layer *layer,
                       const struct veil_entry *entry, uint32_t n)
{
	calls.veil++;
	simd_c.veil(target, layer, entry, n);
}

static struct simd counting(void)
{
	struct simd simd = simd_c;
	simd.strip_light = count_light;
	simd.strip_lit = count_lit;
	simd.warp_far = count_far;
	simd.veil = count_veil;
	memset(&calls, 0, sizeof calls);
	return simd;
}

static void a_light_without_color_is_not_asked(void **state)
{
	(void)state;
	struct case_of c;
	struct drawn d;
	struct simd simd = counting();
	case_make(&c, 1);
	c.scene.n_lights = 1;
	memset(c.light[0].color, 0, sizeof c.light[0].color);
	draw(&d, &c, &c.settings, &simd);
	assert_true(d.frame.report.n_covered > 0);
	assert_int_equal(calls.light, 0);
	release(&d);
}

static void many_lights_are_tabulated_and_few_are_not(void **state)
{
	(void)state;
	struct case_of c;
	struct drawn d;
	struct simd simd = counting();
	case_make(&c, 5);
	c.scene.n_instances = 1;
	render_settings_default(&c.settings, 640, 480);
	for (int i = 0; i < 5; i++)
		c.light[i] = (struct psr_light){ .kind = PSR_LIGHT_DIRECTIONAL,
			                             .direction = { i - 2, -1, -1 },
			                             .color = { 0.3, 0.3, 0.3 } };
	c.scene.n_lights = 5;
	draw(&d, &c, &c.settings, &simd);
	assert_int_equal(calls.lit, 32768 / STRIP);
	assert_int_equal(d.frame.report.effect[PSR_EFFECT_TABLE].why, PSR_WHY_RAN);
	release(&d);

	simd = counting();
	c.scene.n_lights = 2;
	draw(&d, &c, &c.settings, &simd);
	assert_int_equal(calls.lit, 0);
	assert_int_equal(d.frame.report.effect[PSR_EFFECT_TABLE].why, PSR_WHY_COST);
	release(&d);
}

static void no_veil_is_hung_where_nothing_is_thin(void **state)
{
	(void)state;
	for (uint32_t which = 0; which < CASES; which++) {
		struct case_of c;
		struct drawn d;
		struct simd simd = counting();
		case_make(&c, which);
		draw(&d, &c, &c.settings, &simd);
		assert_int_equal(calls.veil, 0);
		assert_int_equal(d.frame.report.effect[PSR_EFFECT_VEILS].why, PSR_WHY_NOTHING);
		release(&d);
	}
}

static void every_effect_says_why_it_was_left_out(void **state)
{
	(void)state;
	for (uint32_t which = 0; which < CASES; which++) {
		struct case_of c;
		struct drawn d;
		case_make(&c, which);
		draw(&d, &c, &c.settings, NULL);
		for (int e = 0; e < PSR_N_EFFECTS; e++) {
			const char *why = psr_effect_why((enum psr_effect)e, d.frame.report.effect[e].why);
			assert_int_equal(d.frame.report.effect[e].why == PSR_WHY_RAN, *why == '\0');
			if (*why)
				assert_int_equal(d.frame.report.effect[e].count, 0);
		}
		release(&d);
	}
}

/* A renderer that goes from scene to scene: what it keeps from the frame before must not show. */
static void frames_do_not_depend_on_the_frame_before(void **state)
{
	(void)state;
	struct psr_renderer *renderer;
	struct psr_error err;
	assert_int_equal(psr_renderer_create(&renderer, NULL), 0);
	for (uint32_t i = 0; i < CASES * 3 / 2; i++) {
		const uint32_t which = i / 3 * 7 % 60;
		struct case_of c;
		struct drawn alone, next_one;
		case_make(&c, which);
		for (int k = 0; k < 3; k++) /* thrice the same picture, its object somewhere else, and out of it at last */
			c.scene.camera.target[k] += (i % 3) * psr_model_info(c.instance[0].model)->scale;
		render_settings_default(&c.settings, 700, 300);
		draw(&alone, &c, &c.settings, NULL);
		next_one.frame = alone.frame;
		next_one.frame.rgb = malloc(3 * 700 * 300);
		next_one.frame.depth = malloc(4 * 700 * 300);
		if (renderer_draw(renderer, &c.scene, &c.settings, NULL, &next_one.frame, &err))
			fail_msg("%s", err.text);
		assert_same(&alone, &next_one, which, "the frame before");
		release(&alone);
		release(&next_one);
	}
	psr_renderer_destroy(renderer);
}

static void a_moving_camera_takes_no_more_memory(void **state)
{
	(void)state;
	struct psr_renderer *renderer;
	struct psr_error err;
	struct case_of c;
	uint64_t bytes = 0;
	case_make(&c, 3);
	c.scene.n_instances = 1;
	render_settings_default(&c.settings, 320, 240);
	struct psr_frame frame = { .width = 320, .height = 240, .rgb = malloc(3 * 320 * 240) };
	assert_int_equal(psr_renderer_create(&renderer, NULL), 0);
	for (int i = 0; i < 40; i++) {
		const double *middle = psr_model_info(c.instance[0].model)->origin,
					 scale = psr_model_info(c.instance[0].model)->scale;
		c.scene.camera.eye[0] = middle[0] + 3 * scale * sin(i * 0.01);
		c.scene.camera.eye[1] = middle[1];
		c.scene.camera.eye[2] = middle[2] + 3 * scale * cos(i * 0.01);
		if (renderer_draw(renderer, &c.scene, &c.settings, NULL, &frame, &err))
			fail_msg("%s", err.text);
		if (i == 0)
			bytes = psr_renderer_bytes(renderer);
		assert_int_equal(psr_renderer_bytes(renderer), bytes);
	}
	psr_renderer_destroy(renderer);
	free(frame.rgb);
}

static void effects_have_the_protocols_numbers(void **state)
{
	(void)state;
	char line[512];
	unsigned n = 0;
	FILE *file = fopen("proto/PROTOCOL.md", "r");
	assert_non_null(file);
	while (fgets(line, sizeof line, file))
		if (strcmp(line, "| id | effect | count |\n") == 0)
			break;
	while (fgets(line, sizeof line, file) && line[0] == '|') {
		unsigned id;
		char name[32];
		if (sscanf(line, "| %u | %31[a-z-]", &id, name) != 2)
			continue;
		assert_int_equal(id, 64 + n);
		assert_string_equal(name, psr_effect_name((enum psr_effect)n));
		assert_string_not_equal(psr_effect_counts((enum psr_effect)n), "?");
		n++;
	}
	fclose(file);
	assert_int_equal(n, PSR_N_EFFECTS);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(leaving_out_changes_no_byte),
		cmocka_unit_test(tests_of_blocks_change_no_byte),
		cmocka_unit_test(a_light_without_color_is_not_asked),
		cmocka_unit_test(many_lights_are_tabulated_and_few_are_not),
		cmocka_unit_test(no_veil_is_hung_where_nothing_is_thin),
		cmocka_unit_test(every_effect_says_why_it_was_left_out),
		cmocka_unit_test(frames_do_not_depend_on_the_frame_before),
		cmocka_unit_test(a_moving_camera_takes_no_more_memory),
		cmocka_unit_test(effects_have_the_protocols_numbers),
	};
	return cmocka_run_group_tests(tests, open_models, close_models);
}
