/* EWA splats where sums are at the limits of their words: planes of leaves that all fall into one quarter of a pixel. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdlib.h>
#include <string.h>
#include "base/direction.h"
#include "model/tree.h"
#include "render/render.h"
#include "simd/ewa.h"
#include "simd/simd.h"
#include "tests/unit/lib/threads.h"

#define SIDE 8
#define PIXEL 5.0 /* world units; a plane is 2 wide */
/* Leaves stand apart: all levels have as many, and the coarsest is drawn. */
#define LEVELS 12
#define APART 16
#define ROW ((1u << LEVELS) / APART)
#define EDGE (2.0 / ROW) /* of what is drawn */

/* Leaves of a plane that faces +z. color: of each, sRGB. */
static struct psr_model *plane(uint32_t n, uint8_t color)
{
	const struct psr_model_info info = { .scale = 1, .up = { 0, 1, 0 }, .resolution = 64, .spacing = 0.001,
		                                 .box_min = { -1, -1, -1 }, .box_max = { 1, 1, 1 } };
	const float ahead[3] = { 0, 0, 1 };
	struct psr_model *model;
	struct octree_maker maker;
	struct octree *tree;

	assert_int_equal(octree_maker_init(&maker, LEVELS, NULL), PSR_OK);
	/* Morton order of the plane: bits of the number go to x and y by turns. */
	for (uint32_t i = 0; i < n; i++) {
		uint32_t at[3] = { 0, 0, 1u << (LEVELS - 1) };

		for (int bit = 0; bit < 16; bit++)
			at[bit % 2] |= (i >> bit & 1) << bit / 2;
		assert_int_equal(octree_maker_put(&maker, octree_path((const uint32_t[3]){ at[0] * APART, at[1] * APART, at[2] }), NULL), PSR_OK);
	}
	tree = octree_maker_take(&maker);
	octree_maker_fini(&maker);
	for (int c = 0; c < 3; c++)
		tree->low[c] = -1;
	tree->edge = 2;
	tree->is_one_sided = 1;
	tree->normal = malloc(n * sizeof *tree->normal);
	tree->color = malloc(n * sizeof *tree->color);
	assert_true(tree->normal != NULL && tree->color != NULL);
	for (uint32_t i = 0; i < n; i++) {
		tree->normal[i] = psr_direction_encode(ahead);
		memset(tree->color[i], color, 3);
	}
	assert_int_equal(psr_model_create_octree(&model, &info, tree, NULL, NULL), PSR_OK);
	octree_destroy(tree);
	return model;
}

/* One light from the eye: white where a normal is the leaves', which the sums must keep. */
struct stage {
	struct psr_model *model[3];
	struct psr_instance instance[PSR_MAX_INSTANCES];
	struct psr_light light;
	struct psr_scene scene;
};

static void stage_add(struct stage *s, const struct psr_model *model, double nearer)
{
	s->instance[s->scene.n_instances++] =
		(struct psr_instance){ .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1,
		                       .translation = { PIXEL / 4, PIXEL / 4, nearer } };
}

/* n leaves of a colour, and one of another one, half an edge in front of them: the pixel's own. */
static struct stage *stage_make(uint32_t n, uint8_t first, uint8_t color)
{
	const uint32_t most = ROW * ROW;
	struct stage *s = calloc(1, sizeof *s);

	assert_non_null(s);
	s->light = (struct psr_light){ .kind = PSR_LIGHT_DIRECTIONAL, .direction = { 0, 0, -1 }, .color = { 1, 1, 1 } };
	s->scene = (struct psr_scene){ .instance = s->instance, .light = &s->light, .n_lights = 1,
		                           .camera = { .eye = { 0, 0, 4 }, .up = { 0, 1, 0 }, .ortho_height = SIDE * PIXEL,
		                                       .kind = PSR_CAMERA_ORTHOGRAPHIC } };
	s->model[0] = plane(1, first);
	stage_add(s, s->model[0], 0.6 * EDGE);
	if (n % most > 0) {
		s->model[1] = plane(n % most, color);
		stage_add(s, s->model[1], 0);
	}
	if (n >= most)
		s->model[2] = plane(most, color);
	for (uint32_t i = 0; i < n / most; i++)
		stage_add(s, s->model[2], 0);
	return s;
}

static void stage_unmake(struct stage *s)
{
	for (int i = 0; i < 3; i++)
		psr_model_unref(s->model[i]);
	free(s);
}

/* Draws with these kernels, or the machine's own. Returns the colour of the one pixel that is not black, or -1. */
static int draw(const struct stage *s, const struct simd *simd, uint64_t n)
{
	uint8_t rgb[3 * SIDE * SIDE];
	struct psr_frame frame = { .width = SIDE, .height = SIDE, .rgb = rgb };
	struct psr_renderer *renderer;
	struct render_settings settings;
	struct psr_error err;
	int found = -1;

	render_settings_default(&settings, SIDE, SIDE);
	settings.with_ewa = 1;
	assert_int_equal(psr_renderer_create(&renderer, NULL), PSR_OK);
	if (simd != NULL)
		renderer_use(renderer, simd);
	if (renderer_draw(renderer, &s->scene, &settings, NULL, &frame, &err))
		fail_msg("%s", err.text);
	assert_int_equal(frame.report.effect[PSR_EFFECT_SPLATS].count, n);
	for (int i = 0; i < SIDE * SIDE; i++)
		if (rgb[3 * i] > 0) {
			assert_true(found < 0);
			found = rgb[3 * i];
		}
	psr_renderer_destroy(renderer);
	return found;
}

/* The colour of a pixel of n leaves. */
static int color_of(uint32_t n, uint8_t first, uint8_t color)
{
	struct stage *s = stage_make(n - 1, first, color);
	const int found = draw(s, NULL, n);

	stage_unmake(s);
	return found;
}

/* Seen from ahead a leaf has the first shape, and a mask of one pixel. Those of the pixel's quarters differ by a rounding,
 * and with one weight less, leaves that come up to the limit stay below it. */
static uint32_t weight_of_one(void)
{
	const uint8_t *weight = ewa_weight + ewa_size[0].first;
	uint32_t least = 255, most = 0;

	for (int sector = 0; sector < EWA_SECTORS; sector++) {
		least = weight[sector] < least ? weight[sector] : least;
		most = weight[sector] > most ? weight[sector] : most;
	}
	assert_true(most - least <= 1);
	return color_of((EWA_MOST_WEIGHT - 1) / least, 1, 255) > 250 ? least : most;
}

/* Below 2^20 a pixel is the mean of all its leaves: 4095 (2^20 - 1), of white, is below 2^32. From there on it is its
 * own leaf. */
static void sums_hold_what_weights_below_the_limit_bring(void **state)
{
	const uint32_t w = weight_of_one();
	const uint32_t n = (EWA_MOST_WEIGHT - 1) / w;

	(void)state;
	assert_true((uint64_t)(EWA_MOST_WEIGHT - 1) * EWA_COLOR_ONE <= UINT32_MAX);
	assert_true((uint64_t)EWA_MOST_WEIGHT * 512 <= INT32_MAX); /* a normal, rounded up */
	/* A normal of 15 bits is 1.3 degrees off at most, 0.03 % of light: less than half a code. */
	assert_in_range(color_of(n, 255, 255), 254, 255);
	/* One of some thousand leaves is black: nothing of the mean. Then it is all. */
	assert_in_range(color_of(n, 1, 255), 254, 255);
	assert_in_range(color_of(n + 1, 1, 255), 0, 2);
}

/* The worst that a kernel may do: every cube has 64 leaves, and a pixel in the middle of all their masks. */
static uint64_t n_cubes;

static uint64_t add_most(const struct warp_target *t, const struct bin_entry *entry, uint32_t n)
{
	uint32_t *weight = &t->sum->lane[EWA_WEIGHT];

	(void)entry;
	assert_true(*weight <= UINT32_MAX - n * (255 * PSR_BLOCK_SAMPLES));
	*weight += n * (255 * PSR_BLOCK_SAMPLES);
	n_cubes += n;
	return 0;
}

/* No scene comes near, as it has at most 2^26 blocks: of leaves that are this much narrower than pixels the coarsest level
 * is drawn, which has three cubes of finer ones a leaf, so 2^26 / 3 leaves of weight 111. Were there more, nothing else
 * would hold the weights. */
static void weights_stay_within_their_word_whatever_kernels_add(void **state)
{
	const uint32_t n = 70 * ROW * ROW;
	struct stage *s = stage_make(n, 100, 200);
	struct simd simd = *simd_get();

	(void)state;
	simd.ewa_sums = add_most;
	n_cubes = 0;
	draw(s, &simd, n + 1);
	/* More than fill a word. */
	assert_true(n_cubes * 255 * PSR_BLOCK_SAMPLES > UINT64_C(1) << 32);
	stage_unmake(s);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(sums_hold_what_weights_below_the_limit_bring),
		cmocka_unit_test(weights_stay_within_their_word_whatever_kernels_add),
	};

	only_threads_under_tsan();
	return cmocka_run_group_tests(tests, NULL, NULL);
}
