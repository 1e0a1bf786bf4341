/* Gaps and fill ([G] 4.6, 4.7) in pictures of odd shapes, without samples, without weights, and at the ends of their
 * numbers. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/maths.h"
#include "base/random.h"
#include "lib/blocks.h"
#include "render/fill.h"

#define COLOR 0xc08040u /* r lowest */

/* Sheets from z = 2 along -z, in an orthographic picture of `px` pixels a step of the first one's samples. */
static struct psr_scene scene_of(struct psr_instance *instance, uint32_t n, uint32_t height, double step)
{
	struct psr_scene scene = { .instance = instance, .n_instances = n, .background = { 0.2, 0.4, 0.6 } };

	scene.camera = (struct psr_camera){ .eye = { 0.003, 0.001, 2 }, .target = { 0.003, 0.001, 0 }, .up = { 0, 1, 0 },
		                                .kind = PSR_CAMERA_ORTHOGRAPHIC, .ortho_height = height * step };
	return scene;
}

static struct psr_model *sheet_of(double spacing, int groups, double z, uint32_t color)
{
	const uint64_t attr = (hard_attr((const double[3]){ 0, 0, 1 }, 0, 0) & 0x7fff) | HARD_UNLIT | (uint64_t)color << 16;

	return hard_sheet(&(struct hard_sheet){ .spacing = spacing, .groups = groups, .levels = 1, .attr = attr, .z = z });
}

/* Colours are means of whole numbers that are equal, so they are exact. Depths are means of equal floats: up to 14
 * levels are pulled and pushed, each by at most four roundings of 2^-24. */
#define DEPTH_OFF (2 * 14 * 4 * 0x1p-24f)

static void all_have(const struct psr_frame *frame, uint32_t color, float depth)
{
	for (size_t i = 0; i < (size_t)frame->width * frame->height; i++) {
		const uint8_t *c = &frame->rgb[3 * i];

		if ((c[0] | (uint32_t)c[1] << 8 | (uint32_t)c[2] << 16) != color
		    || (frame->depth[i] != depth && !(fabsf(frame->depth[i] - depth) <= DEPTH_OFF * depth)))
			fail_msg("pixel (%zu, %zu) of %ux%u: %02x%02x%02x at %g", i % frame->width, i / frame->width, frame->width,
			         frame->height, c[0], c[1], c[2], (double)frame->depth[i]);
	}
}

/* A flat surface of one colour that reaches beyond the picture, its samples a pixel to 128 apart. Each cell of 2^k
 * pixels, where 2^(k-1) < step <= 2^k, holds a sample: a row in any `step` rows, and a column in any `step` columns of
 * it. So there are no holes.
 *
 * Loosened for pictures so small that no sample falls into them, though cells around them have some: these have no
 * colour to fill with. They show background, and report that no pixel is covered. */
static void one_color_in_pictures_of_any_shape_is_that_color(void **state)
{
	static const struct {
		uint32_t width, height;
		double px; /* between samples */
	} shape[] = {
		{ 1, 1, 1 }, { 1, 1, 100 }, { 1, 333, 5 }, { 333, 1, 5 }, { 1, 77, 1 }, { 77, 1, 128 }, { 2, 3, 2 },
		{ 129, 33, 3 }, { 127, 31, 1.5 }, { 257, 129, 7 }, { 255, 127, 30 }, { 641, 479, 100 }, { 1021, 331, 13 },
		{ 16384, 9, 64 }, { 9, 16384, 64 }, { 16384, 1, 128 }, { 1, 16384, 128 },
#ifndef __SANITIZE_ADDRESS__
		{ 8192, 1025, 100 }, { 2049, 4097, 60 },
#endif
	};

	(void)state;
	for (size_t i = 0; i < sizeof shape / sizeof shape[0]; i++) {
		const uint32_t width = shape[i].width, height = shape[i].height, side = width > height ? width : height;
		const int groups = (int)ceil((side / shape[i].px + 8) / 8 / 0.86) + 1;
		const double spacing = 0.16 / groups;
		struct psr_model *model = sheet_of(spacing, groups, 0, COLOR);
		struct psr_instance instance = hard_place(model);
		struct psr_scene scene = scene_of(&instance, 1, height, spacing / shape[i].px);
		struct psr_frame frame;

		hard_draw(&frame, &scene, width, height);
		if (frame.report.n_covered > 0)
			all_have(&frame, COLOR, 2);
		else
			assert_true((width < shape[i].px || height < shape[i].px) && frame.report.n_filled == 0);
		assert_int_equal(frame.report.n_clamped, 0);
		psr_frame_free(&frame);
		psr_model_unref(model);
	}
}

/* Nothing in view: the background, at infinity, of weight 255; no stage counts a pixel. */
static void a_picture_without_samples_is_its_background(void **state)
{
	static const uint32_t size[][2] = { { 1, 1 }, { 1, 100 }, { 100, 1 }, { 257, 130 }, { 1000, 999 } };
	struct psr_model *model = sheet_of(0.01, 4, 0, COLOR);

	(void)state;
	for (size_t i = 0; i < sizeof size / sizeof size[0]; i++)
		for (int with_model = 0; with_model < 2; with_model++) {
			struct psr_instance instance = hard_place(model);
			struct psr_scene scene = scene_of(&instance, (uint32_t)with_model, size[i][1], 1e-4);
			struct psr_frame frame;

			scene.camera.target[2] = 4; /* looks away */
			hard_draw(&frame, &scene, size[i][0], size[i][1]);
			/* 0.2, 0.4 and 0.6 in sRGB are 0.4845, 0.6651 and 0.7977 of 255. */
			all_have(&frame, 124 | 170 << 8 | 203 << 16, INFINITY);
			for (size_t p = 0; p < (size_t)size[i][0] * size[i][1]; p++)
				assert_true(frame.weight[p] == 255 && frame.words[p] == PSR_WORD_EMPTY);
			assert_int_equal(frame.report.n_covered | frame.report.n_filled | frame.report.count[PSR_STAGE_WARP], 0);
			psr_frame_free(&frame);
		}
	psr_model_unref(model);
}

/* One sample, of a block with cells of 2^k pixels. A cell covers pixels by the distance to its centre, up to a cell
 * away; so beyond two cells around the sample's there is background, exactly. */
static void a_lone_sample_is_seen_within_two_cells(void **state)
{
	const struct psr_projection projection = { { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } }, 0.01f };
	const struct hard_model options = { .projection = &projection, .n_projections = 1 };
	struct hard_block block = { .mask = 1, .flags = PSR_BLOCK_TWO_SIDED };

	(void)state;
	block.attr[0] = 12 | HARD_UNLIT | (uint64_t)COLOR << 16;
	struct psr_model *model = hard_model(&options, &block, 1);
	for (int k = 0; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		struct psr_instance instance = hard_place(model);
		struct psr_scene scene = scene_of(&instance, 1, 513, 0.01 / (1 << k));
		struct psr_frame frame;
		uint32_t sx = 513, sy = 0;

		hard_draw(&frame, &scene, 513, 513);
		for (uint32_t p = 0; p < 513 * 513; p++)
			if (frame.words[p] != PSR_WORD_EMPTY) {
				assert_int_equal(sx, 513);
				sx = p % 513;
				sy = p / 513;
			}
		assert_true(sx < 513);
		for (uint32_t p = 0; p < 513 * 513; p++) {
			const int dx = abs((int)(p % 513 >> k) - (int)(sx >> k)), dy = abs((int)(p / 513 >> k) - (int)(sy >> k));

			if (dx > 2 || dy > 2)
				assert_true(frame.rgb[3 * p] == 124 && isinf(frame.depth[p]) && frame.weight[p] == 255);
		}
		psr_frame_free(&frame);
	}
	psr_model_unref(model);
}

/* A near sheet of samples 1.5 to 100 pixels apart before a far one of 1: cells of the near one cover every pixel whole,
 * so that of the far one's samples each has weight 0. Twice the threshold lies between them: 3 pixels times half of the
 * cell's 2^k ([G] 7.2).
 *
 * Loosened where samples are just 2^k pixels apart, or up to 1/4096 more, for which the cull chooses level k, too: a
 * picture at exactly a level's magnification would take twice as wide cells otherwise. There one column of cells in
 * 4096 has no sample, and a far surface shows through in part. */
static void behind_a_whole_surface_all_weights_are_0(void **state)
{
	static const double px[] = { 1.5, 1.99, 5, 11, 40, 100, 127 };

	(void)state;
	for (size_t i = 0; i < sizeof px / sizeof px[0]; i++) {
		const int k = (int)ceil(log2(px[i])), groups = (int)(240 / px[i] / 8) + 3;
		const double step = 1.0 / 4000, apart = 2 * 1.5 * (1 << k) * step;
		struct psr_model *far = sheet_of(step, 40, 0, 0x0000ff), *near = sheet_of(px[i] * step, groups, 0, COLOR);
		struct psr_instance instance[2] = { hard_place(far), hard_place(near) };
		struct psr_scene scene = scene_of(instance, 2, 200, step);
		struct psr_frame frame;

		scene.camera.eye[2] = 8; /* depths are exact: apart is a multiple of 2^-20 */
		instance[1].translation[2] = rint(apart * 0x1p20) * 0x1p-20;
		hard_draw(&frame, &scene, 200, 200);
		all_have(&frame, COLOR, (float)(8 - instance[1].translation[2]));
		for (uint32_t p = 0; p < 200 * 200; p++)
			assert_true(frame.weight[p] == (frame.depth[p] < 8 && frame.id[p] == 1 ? 255 : 0));
		psr_frame_free(&frame);
		psr_model_unref(far);
		psr_model_unref(near);
	}
}

/* A threshold below the spacing of floats at the surface's depth, or 0: a sample is not behind a cell of its own depth,
 * so a flat surface keeps all of its samples. Seen from 2^10 to 2^23 radii away floats are up to a half unit apart. */
static void a_threshold_below_a_floats_step_keeps_a_flat_surface(void **state)
{
	static const double threshold[] = { 0, 1e-30, 1e-9 }, distance[] = { 2, 0x1p10, 0x1p23 };
	struct psr_model *model = sheet_of(0.01, 6, 0, COLOR);

	(void)state;
	for (size_t t = 0; t < 3; t++)
		for (size_t d = 0; d < 3; d++)
			for (int is_slanted = 0; is_slanted < 2; is_slanted++) {
				struct psr_instance instance = hard_place(model);
				struct psr_scene scene = scene_of(&instance, 1, 64, 0.01 / 3);
				struct render_settings settings;
				struct psr_frame frame;

				render_settings_default(&settings, 64, 64);
				settings.gap_threshold = threshold[t];
				scene.camera.eye[2] = distance[d];
				if (is_slanted) { /* by 45 degrees: cells cover their own surface, and yet nothing shines through */
					instance.rotation[0] = sin(3.14159265 / 8);
					instance.rotation[3] = cos(3.14159265 / 8);
				}
				hard_draw_with(&frame, &scene, &settings);
				if (!is_slanted) {
					all_have(&frame, COLOR, (float)distance[d]);
					for (uint32_t p = 0; p < 64 * 64; p++)
						assert_true(frame.words[p] == PSR_WORD_EMPTY || frame.weight[p] == 255);
				}
				for (uint32_t p = 0; p < 64 * 64; p++)
					assert_true(frame.rgb[3 * p] == (COLOR & 0xff));
				psr_frame_free(&frame);
			}
	psr_model_unref(model);
}

/* ---- the fill alone ---- */

/* One channel of linear light and weights; what the fill makes of it, in 16 bits. */
struct light {
	uint32_t width, height;
	uint16_t *value, *weight, *out;
	float *z, *depth;
};

static uint8_t high_byte[65536], low_byte[65536];

static void fill_with(struct light *l, const uint8_t *table, uint8_t *rgb)
{
	struct plan plan = { .width = l->width, .height = l->height, .focal = 1 };
	const size_t n = (size_t)l->width * l->height;
	const uint32_t rows = (l->height + BRICK - 1) / BRICK, bricks = rows * ((l->width + BRICK - 1) / BRICK);
	uint64_t *word = malloc(n * sizeof *word);
	uint16_t *weight = malloc(n * sizeof *weight), *linear[3];
	uint8_t *marks = malloc(bricks);
	const struct psr_zstack stack = { .width = l->width, .height = l->height, .word = word };
	struct fill fill = { .top = 0 };
	struct psr_report report = { .n_filled = 0 };

	memset(marks, 1, bricks);
	for (int k = 0; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		plan.gap_scale[k] = 1;
		plan.gap_offset[k] = 1e9f; /* one surface */
	}
	memcpy(weight, l->weight, n * sizeof *weight);
	for (int c = 0; c < 3; c++) {
		linear[c] = malloc(n * sizeof *linear[c]);
		memcpy(linear[c], l->value, n * sizeof *linear[c]);
		plan.background[c] = l->value[0];
	}
	for (size_t i = 0; i < n; i++) {
		word[i] = (uint64_t)psr_bits_from_float(l->z[i]) << 32 | (uint32_t)i;
		for (int c = 0; c < 3; c++)
			rgb[3 * i + (size_t)c] = table[l->value[i]];
	}
	const struct fill_picture picture = { &stack,    weight,    marks, linear[0], linear[1],
		                                  linear[2], table, rgb,   l->depth };
	assert_int_equal(fill_begin(&fill, simd_get(), &plan, &picture), PSR_OK);
	for (uint32_t row = 0; row < rows; row++)
		fill_look(&fill, row);
	fill_wants(&fill);
	for (uint32_t row = 0; row < rows; row++)
		fill_pull(&fill, row);
	assert_int_equal(fill_push(&fill, NULL, &report), PSR_OK);
	fill_clear(&fill);
	free(word);
	free(weight);
	free(marks);
	for (int c = 0; c < 3; c++)
		free(linear[c]);
}

static void fill_light(struct light *l)
{
	const size_t n = (size_t)l->width * l->height;
	uint8_t *high = malloc(3 * n), *low = malloc(3 * n);

	for (uint32_t i = 0; i < 65536; i++) {
		high_byte[i] = (uint8_t)(i >> 8);
		low_byte[i] = (uint8_t)i;
	}
	for (int turn = 0; turn < 2; turn++) {
		memcpy(l->depth, l->z, n * sizeof *l->depth);
		fill_with(l, turn ? low_byte : high_byte, turn ? low : high);
	}
	for (size_t i = 0; i < n; i++)
		l->out[i] = (uint16_t)(high[3 * i] << 8 | low[3 * i]);
	free(high);
	free(low);
}

/* All pixels and the background have the value c, up to the greatest; weights are 0 or from w to 256.
 *
 * Every step rounds down, so nothing exceeds c, which would be an overflow. A pixel of weight w loses less than one
 * unit of its premultiplied value, or 256 / w of c; cells of four children add one, of four times the weight: a third
 * more in all. Pushing loses less than 3 units a level: own share, parents' mean and their share. There are at most 11
 * levels. */
static void sums_at_their_maxima_do_not_overflow(void **state)
{
	static const uint32_t size[][2] = { { 1, 1 }, { 1, 37 }, { 300, 1 }, { 33, 65 }, { 517, 259 }, { 1024, 33 } };
	static const uint16_t value[] = {
		65535, 255, 0,
#ifndef __SANITIZE_ADDRESS__ /* the greatest value has the greatest sums, and no value leads elsewhere */
		65534, 32768, 1,
#endif
	};
	static const uint16_t least[] = { 1, 2, 16, 255 };
	uint64_t seed = 1;

	(void)state;
	for (size_t s = 0; s < sizeof size / sizeof size[0]; s++) {
		const size_t n = (size_t)size[s][0] * size[s][1];
		struct light l = { size[s][0], size[s][1], malloc(2 * n), malloc(2 * n), malloc(2 * n), malloc(4 * n),
			               malloc(4 * n) };

		for (size_t v = 0; v < sizeof value / sizeof value[0]; v++)
			for (size_t w = 0; w < sizeof least / sizeof least[0]; w++)
				for (int kind = 0; kind < 4; kind++) { /* all least, one of them, random with holes, none */
					const uint32_t one = random_below(&seed, (uint32_t)n);
					const double off = 256.0 / least[w] * 4 / 3 + 3 * 11;

					for (uint32_t i = 0; i < n; i++) {
						const uint16_t any = (uint16_t)(least[w] + random_below(&seed, 257u - least[w]));
						const uint16_t weight[] = { least[w], i == one ? least[w] : 0,
							                        random_below(&seed, 3) ? any : 0, 0 };

						l.value[i] = value[v];
						l.weight[i] = weight[kind];
						l.z[i] = (float)random_in(&seed, 1, 2);
					}
					fill_light(&l);
					for (size_t i = 0; i < n; i++) {
						if (l.out[i] > value[v] || l.out[i] < value[v] - off)
							fail_msg("%u becomes %u: weights from %u, kind %d, %ux%u", value[v], l.out[i], least[w],
							         kind, size[s][0], size[s][1]);
						/* A mean of depths from 1 to 2, or the background's. */
						assert_true((l.depth[i] >= 1 && l.depth[i] <= 2) || isinf(l.depth[i]));
					}
				}
		free(l.value);
		free(l.weight);
		free(l.out);
		free(l.z);
		free(l.depth);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(one_color_in_pictures_of_any_shape_is_that_color),
		cmocka_unit_test(a_picture_without_samples_is_its_background),
		cmocka_unit_test(a_lone_sample_is_seen_within_two_cells),
		cmocka_unit_test(behind_a_whole_surface_all_weights_are_0),
		cmocka_unit_test(a_threshold_below_a_floats_step_keeps_a_flat_surface),
		cmocka_unit_test(sums_at_their_maxima_do_not_overflow),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
