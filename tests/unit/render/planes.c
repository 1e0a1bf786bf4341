/* Planes beside colour and depth: what they say of a pixel is what the model and the stages have there. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/direction.h"
#include "simd/isa.h"
#include "render/stages.h"
#include "render/block.h"
#include "tests/unit/lib/shapes.h"
#include "tests/unit/lib/threads.h"

#define WIDTH 531 /* strips of 128, 128, 128, 128, 19 */
#define HEIGHT 503
#define PIXELS (WIDTH * HEIGHT)

struct planes {
	uint8_t rgb[3 * PIXELS], weight[PIXELS], block[3 * PIXELS];
	float depth[PIXELS];
	int16_t normal[3 * PIXELS];
	uint32_t id[PIXELS];
	uint64_t words[PIXELS];
	struct psr_report report;
};

/* A sphere, the back of a two-sided square beside it that reaches into the picture, and a sphere behind both. */
struct stage {
	struct psr_model *model[3];
	struct psr_instance instance[3];
	struct psr_scene scene;
};

static void stage_make(struct stage *s)
{
	static const struct psr_light light = { .kind = PSR_LIGHT_DIRECTIONAL, .direction = { -1, -1, -1 },
		                                    .color = { 1, 1, 1 } };
	const double c = cos(0.35), h = sin(0.35); /* half of the angle that the square is turned by */

	for (int i = 0; i < 3; i++) {
		const struct shape_options o = { .resolution = 64,
			                             .diffuse = 0x6090c0,
			                             .scale = 1.5,
			                             .origin = { 0.25, -0.5, 1 },
			                             .two_sided = i == 1,
			                             .cones = 1 };
		s->model[i] = shape_build(&o, i == 1 ? 0 : 0.9);
		s->instance[i] = (struct psr_instance){ .model = s->model[i], .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	}
	s->instance[1].rotation[0] = h;
	s->instance[1].rotation[3] = c;
	memcpy(s->instance[1].translation, (const double[3]){ 2, 0.5, -1 }, 24);
	s->instance[1].scale = 0.8;
	memcpy(s->instance[2].translation, (const double[3]){ -2, 3, 3.5 }, 24);
	s->instance[2].scale = 2;
	s->scene = (struct psr_scene){ .instance = s->instance, .n_instances = 3, .light = &light, .n_lights = 1,
		                           .ambient = { 0.2, 0.2, 0.2 },
		                           .camera = { .eye = { 1, 0.5, -7 }, .target = { 0.8, 0, 1 }, .up = { 0.1, 1, 0 },
		                                       .fov_y = 0.6 } };
}

static void stage_clear(struct stage *s)
{
	for (int i = 0; i < 3; i++)
		psr_model_unref(s->model[i]);
}

static struct planes *draw_what(const struct psr_scene *scene, int has_color, int has_planes, int n_threads)
{
	struct planes *p = calloc(1, sizeof *p);
	struct psr_renderer *renderer;
	struct render_settings settings;
	struct psr_pool *pool = NULL;
	struct psr_error err;

	assert_non_null(p);
	struct psr_frame frame = { .width = WIDTH, .height = HEIGHT, .rgb = has_color ? p->rgb : NULL, .depth = p->depth };
	if (has_planes) {
		frame.normal = p->normal;
		frame.id = p->id;
		frame.block = p->block;
		frame.weight = p->weight;
		frame.words = p->words;
	}
	render_settings_default(&settings, WIDTH, HEIGHT);
	assert_int_equal(psr_renderer_create(&renderer, NULL), PSR_OK);
	if (n_threads > 1)
		assert_int_equal(psr_pool_create(&pool, n_threads, NULL), PSR_OK);
	if (renderer_draw(renderer, scene, &settings, pool, &frame, &err) != PSR_OK)
		fail_msg("%s", err.text);
	psr_pool_destroy(pool);
	psr_renderer_destroy(renderer);
	p->report = frame.report;
	memset(p->report.ns, 0, sizeof p->report.ns);
	return p;
}

static struct planes *draw(const struct psr_scene *scene, int has_planes, int n_threads)
{
	return draw_what(scene, 1, has_planes, n_threads);
}

static int is_seen(const struct planes *p, int i)
{
	return p->words[i] != PSR_WORD_EMPTY && p->weight[i] > 0;
}

/* Takes a sample id apart: the instance, and the block and sample of its model. */
static uint32_t find_sample(const struct stage *s, uint32_t id, uint32_t *block)
{
	uint32_t i = 0;

	for (*block = id / PSR_BLOCK_SAMPLES; *block >= psr_model_blocks(s->model[i])->n_blocks; i++)
		*block -= psr_model_blocks(s->model[i])->n_blocks;
	assert_true(i < 3);
	return i;
}

static void rotate(double out[3], const double q[4], const double v[3])
{
	/* v + 2 q x (q x v + w v) */
	const double t[3] = { q[1] * v[2] - q[2] * v[1] + q[3] * v[0], q[2] * v[0] - q[0] * v[2] + q[3] * v[1],
		                  q[0] * v[1] - q[1] * v[0] + q[3] * v[2] };

	out[0] = v[0] + 2 * (q[1] * t[2] - q[2] * t[1]);
	out[1] = v[1] + 2 * (q[2] * t[0] - q[0] * t[2]);
	out[2] = v[2] + 2 * (q[0] * t[1] - q[1] * t[0]);
}

/* Right, down, forward. */
static void camera_axes(double axis[3][3], const struct psr_camera *camera)
{
	double length = 0, f[3], r[3];

	for (int a = 0; a < 3; a++)
		length = hypot(length, f[a] = camera->target[a] - camera->eye[a]);
	for (int a = 0; a < 3; a++)
		f[a] /= length;
	for (int a = 0; a < 3; a++)
		r[a] = f[(a + 1) % 3] * camera->up[(a + 2) % 3] - f[(a + 2) % 3] * camera->up[(a + 1) % 3];
	length = sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
	for (int a = 0; a < 3; a++) {
		axis[0][a] = r[a] / length;
		axis[2][a] = f[a];
	}
	for (int a = 0; a < 3; a++)
		axis[1][a] = f[(a + 1) % 3] * axis[0][(a + 2) % 3] - f[(a + 2) % 3] * axis[0][(a + 1) % 3];
}

static double float_of_bits(uint32_t bits)
{
	float f;

	memcpy(&f, &bits, sizeof f);
	return (double)f;
}

/* The sample that a word names lies in the word's pixel, at the word's depth. The warp works in double up to a sum of
 * a few floats of at most WIDTH, the test's position is float up to the last: a hundredth of a pixel and 1e-5 of the
 * depth are far above both. */
static void words_name_the_sample_that_falls_into_the_pixel(void **state)
{
	struct stage s;
	double axis[3][3];
	int n = 0;

	(void)state;
	stage_make(&s);
	struct planes *p = draw(&s.scene, 1, 1);
	camera_axes(axis, &s.scene.camera);
	const double focal = HEIGHT / 2.0 / tan(s.scene.camera.fov_y / 2);
	for (int i = 0; i < PIXELS; i++) {
		uint32_t block, k;
		float inner[3];
		double object[3], world[3], at[3] = { 0, 0, 0 }, z = float_of_bits((uint32_t)(p->words[i] >> 32));

		if (p->words[i] == PSR_WORD_EMPTY) {
			assert_true(isinf(z));
			continue;
		}
		k = find_sample(&s, (uint32_t)p->words[i], &block);
		block_position(psr_model_blocks(s.model[k]), block, (uint32_t)p->words[i] % PSR_BLOCK_SAMPLES, inner);
		for (int a = 0; a < 3; a++)
			object[a] = psr_model_info(s.model[k])->origin[a] + psr_model_info(s.model[k])->scale * (double)inner[a];
		rotate(world, s.instance[k].rotation, object);
		for (int a = 0; a < 3; a++)
			for (int b = 0; b < 3; b++)
				at[a] += axis[a][b] *
				         (s.instance[k].translation[b] + s.instance[k].scale * world[b] - s.scene.camera.eye[b]);
		assert_true(fabs(at[2] - z) < 1e-5 * z);
		assert_true(fabs(at[0] / at[2] * focal + WIDTH / 2.0 - (i % WIDTH + 0.5)) < 0.51);
		assert_true(fabs(at[1] / at[2] * focal + HEIGHT / 2.0 - (i / WIDTH + 0.5)) < 0.51);
		n++;
	}
	assert_true(n > PIXELS / 10);
	free(p);
	stage_clear(&s);
}

/* No sample is drawn that faces away from its line of sight by more than BACK_SINE; its normal was looked at in 10
 * bits a component, sqrt(3) / 1022 off at most, and the line of sight is here that of the pixel's centre, 0.71 pixels
 * off at most. Components come in steps of 1/32767, once in the table and once in the plane, between them are
 * rotations in float: half a step on each of three axes, half a step, and 32767 * 2^-20. */
static void normals_are_those_of_the_samples_turned_to_the_eye(void **state)
{
	const double tolerance = 0.5 * 1.7321 + 0.5 + 0.04;
	struct stage s;
	double axis[3][3];
	int n[3] = { 0 };

	(void)state;
	stage_make(&s);
	struct planes *p = draw(&s.scene, 1, 1);
	camera_axes(axis, &s.scene.camera);
	const double focal = HEIGHT / 2.0 / tan(s.scene.camera.fov_y / 2);
	const double most_away = (double)BACK_SINE + 1.7321 / 1022 + 0.71 / focal;
	for (int i = 0; i < PIXELS; i++) {
		const double x = (i % WIDTH + 0.5 - WIDTH / 2.0) / focal, y = (i / WIDTH + 0.5 - HEIGHT / 2.0) / focal;
		double away = 0;
		const int16_t *got = p->normal + 3 * i;
		uint32_t block, k;
		double v[3], world[3], turn = 1;

		if (!is_seen(p, i)) {
			assert_true(got[0] == 0 && got[1] == 0 && got[2] == 0);
			continue;
		}
		k = find_sample(&s, (uint32_t)p->words[i], &block);
		const struct psr_blocks *b = psr_model_blocks(s.model[k]);
		const float *normal = psr_direction_table()[PSR_ATTR_NORMAL(block_attr(b, block, (uint32_t)p->words[i] % 64))];
		for (int a = 0; a < 3; a++)
			v[a] = (double)normal[a];
		rotate(world, s.instance[k].rotation, v);
		if (k == 1) /* seen from its back */
			turn = -1;
		for (int a = 0; a < 3; a++)
			assert_true(fabs(got[a] - turn * 32767 * world[a]) <= tolerance);
		for (int a = 0; a < 3; a++)
			away += got[a] * (x * axis[0][a] + y * axis[1][a] + axis[2][a]) / 32767;
		assert_true(away / sqrt(x * x + y * y + 1) < most_away);
		n[k]++;
	}
	assert_true(n[0] > 1000 && n[1] > 1000 && n[2] > 1000);
	free(p);
	stage_clear(&s);
}

/* Many lights are tabulated by normal, and samples' own normals are not worked out for colours then. */
static void lights_do_not_change_normals(void **state)
{
	struct psr_light light[16];
	struct stage s;

	(void)state;
	stage_make(&s);
	s.scene.n_instances = 1;
	struct planes *one = draw(&s.scene, 1, 1);
	for (int i = 0; i < 16; i++)
		light[i] = s.scene.light[0];
	s.scene.light = light;
	s.scene.n_lights = 16;
	struct planes *many = draw(&s.scene, 1, 1);
	assert_int_equal(one->report.effect[PSR_EFFECT_TABLE].why, PSR_WHY_COST);
	assert_int_equal(many->report.effect[PSR_EFFECT_TABLE].why, PSR_WHY_RAN);
	assert_memory_equal(one->normal, many->normal, sizeof one->normal);
	free(one);
	free(many);
	stage_clear(&s);
}

static void ids_are_instances_and_blocks_say_how_they_were_drawn(void **state)
{
	struct stage s;
	uint32_t levels = 0;
	int n_facing[3] = { 0 };

	(void)state;
	stage_make(&s);
	struct planes *p = draw(&s.scene, 1, 1);
	for (int i = 0; i < PIXELS; i++) {
		const uint8_t *b = p->block + 3 * i;
		uint32_t block, k;

		if (!is_seen(p, i)) {
			assert_true(p->id[i] == UINT32_MAX && b[0] == 255 && b[1] == 255 && b[2] == 255);
			continue;
		}
		k = find_sample(&s, (uint32_t)p->words[i], &block);
		assert_int_equal(p->id[i], k);
		assert_int_equal(b[0], 0);
		assert_in_range(b[1], 0, PSR_MAX_DEPTH_LEVEL);
		levels |= 1u << b[1];
		assert_true(k == 1 ? b[2] == PSR_FACING_TWO_SIDED : b[2] == PSR_FACING_EYE || b[2] == PSR_FACING_MIXED);
		n_facing[b[2]]++;
	}
	/* What is seen was drawn; here every level that was drawn is seen, too. */
	assert_int_equal(levels, p->report.levels);
	assert_true(n_facing[PSR_FACING_EYE] > 0 && n_facing[PSR_FACING_MIXED] > 0 && n_facing[PSR_FACING_TWO_SIDED] > 0);
	free(p);
	stage_clear(&s);
}

/* Orthographic, with neighbouring samples 0.9 * 2^k pixels apart: cells of 2^k pixels fit. */
static void the_depth_level_of_a_block_is_that_of_its_magnification(void **state)
{
	struct stage s;

	(void)state;
	stage_make(&s);
	s.scene.n_instances = 1;
	s.scene.camera.kind = PSR_CAMERA_ORTHOGRAPHIC;
	for (int k = 0; k <= 4; k++) {
		s.scene.camera.ortho_height = psr_model_info(s.model[0])->spacing * HEIGHT / (0.9 * (1 << k));
		struct planes *p = draw(&s.scene, 1, 1);
		int n = 0;
		for (int i = 0; i < PIXELS; i++)
			if (is_seen(p, i)) {
				assert_int_equal(p->block[3 * i + 1], k);
				n++;
			}
		assert_true(n > 0);
		free(p);
	}
	stage_clear(&s);
}

static void weights_count_what_the_report_counts(void **state)
{
	struct stage s;

	(void)state;
	stage_make(&s);
	struct planes *p = draw(&s.scene, 1, 1);
	uint64_t n_covered = 0, n_partial = 0, n_filled = 0, n_own_depth = 0;
	for (int i = 0; i < PIXELS; i++) {
		uint32_t bits;
		n_covered += (uint64_t)is_seen(p, i);
		n_partial += p->words[i] != PSR_WORD_EMPTY && p->weight[i] < 255;
		n_filled += p->weight[i] == 0 && !isinf((double)p->depth[i]);
		memcpy(&bits, &p->depth[i], 4);
		if (p->weight[i] < 128) /* 128 of 256 gives 128, 127 gives 127; from a half on depth is the pixel's own */
			continue;
		assert_int_equal(bits, p->words[i] >> 32);
		n_own_depth++;
	}
	assert_int_equal(n_covered, p->report.n_covered);
	assert_int_equal(n_partial, p->report.count[PSR_STAGE_GAPS]);
	assert_true(n_filled > 0 && n_filled <= p->report.n_filled);
	assert_true(n_own_depth > PIXELS / 4);
	free(p);
	stage_clear(&s);
}

static void planes_change_neither_colors_nor_depth_and_no_thread_or_isa_changes_them(void **state)
{
	const enum psr_isa most = psr_isa_get();
	struct stage s;

	(void)state;
	stage_make(&s);
	struct planes *one = draw(&s.scene, 1, 1), *bare = draw(&s.scene, 0, 1), *many = draw(&s.scene, 1, 3);
	assert_memory_equal(bare->rgb, one->rgb, sizeof one->rgb);
	assert_memory_equal(bare->depth, one->depth, sizeof one->depth);
	assert_memory_equal(&bare->report, &one->report, sizeof one->report);
	assert_memory_equal(one, many, sizeof *one);
	for (int isa = 0; isa < PSR_N_ISAS; isa++) {
		psr_isa_cap((enum psr_isa)isa);
		struct planes *other = draw(&s.scene, 1, 1);
		assert_memory_equal(one, other, sizeof *one);
		free(other);
	}
	psr_isa_cap(most);
	free(one);
	free(bare);
	free(many);
	stage_clear(&s);
}

static void an_empty_scene_is_background_in_every_plane(void **state)
{
	struct stage s;

	(void)state;
	stage_make(&s);
	s.scene.n_instances = 0;
	struct planes *p = draw(&s.scene, 1, 1);
	for (int i = 0; i < PIXELS; i++) {
		assert_true(p->words[i] == PSR_WORD_EMPTY && p->weight[i] == 255 && p->id[i] == UINT32_MAX);
		assert_true(p->block[3 * i] == 255 && p->block[3 * i + 1] == 255 && p->block[3 * i + 2] == 255);
		assert_true(p->normal[3 * i] == 0 && p->normal[3 * i + 1] == 0 && p->normal[3 * i + 2] == 0);
	}
	free(p);
	stage_clear(&s);
}

static void without_color_the_other_planes_are_the_same_and_nothing_is_shaded(void **state)
{
	struct stage s;

	(void)state;
	stage_make(&s);
	struct planes *all = draw(&s.scene, 1, 1), *bare = draw_what(&s.scene, 0, 1, 1);
	assert_memory_equal(bare->depth, all->depth, sizeof all->depth);
	assert_memory_equal(bare->normal, all->normal, sizeof all->normal);
	assert_memory_equal(bare->id, all->id, sizeof all->id);
	assert_memory_equal(bare->block, all->block, sizeof all->block);
	assert_memory_equal(bare->weight, all->weight, sizeof all->weight);
	assert_memory_equal(bare->words, all->words, sizeof all->words);
	assert_int_equal(bare->report.n_covered, all->report.n_covered);
	assert_true(all->report.count[PSR_STAGE_RESOLVE] > 0 && all->report.count[PSR_STAGE_SHADE] > 0);
	assert_int_equal(bare->report.count[PSR_STAGE_RESOLVE], 0);
	assert_int_equal(bare->report.count[PSR_STAGE_SHADE], 0);
	assert_int_equal(all->report.effect[PSR_EFFECT_TWO_SIDED].why, PSR_WHY_RAN);
	assert_int_equal(bare->report.effect[PSR_EFFECT_TWO_SIDED].why, PSR_WHY_OFF);
	free(all);
	free(bare);
	stage_clear(&s);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(words_name_the_sample_that_falls_into_the_pixel),
		cmocka_unit_test(normals_are_those_of_the_samples_turned_to_the_eye),
		cmocka_unit_test(lights_do_not_change_normals),
		cmocka_unit_test(ids_are_instances_and_blocks_say_how_they_were_drawn),
		cmocka_unit_test(the_depth_level_of_a_block_is_that_of_its_magnification),
		cmocka_unit_test(weights_count_what_the_report_counts),
		cmocka_unit_test(planes_change_neither_colors_nor_depth_and_no_thread_or_isa_changes_them),
		cmocka_unit_test(without_color_the_other_planes_are_the_same_and_nothing_is_shaded),
		cmocka_unit_test(an_empty_scene_is_background_in_every_plane),
	};

	only_threads_under_tsan();
	return cmocka_run_group_tests(tests, NULL, NULL);
}
