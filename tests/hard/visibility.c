/* Cones, masks and the frustum ([G] 6.1, 6.3, 6.4): what they leave out cannot show. The bound is 0 blocks. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/direction.h"
#include "base/random.h"
#include "base/vec.h"
#include "lib/blocks.h"
#include "render/cull.h"
#include "render/warp.h"
#include "sample/pack/cone.h"

#define WIDTH 230
#define HEIGHT 170
#define BLOCKS 2000
#define MOST_SAMPLES 8
#define SPACING (1.0 / 128)

enum family { EQUAL, OPPOSED, COPLANAR, HEMISPHERE, ONE, NEAR, N_FAMILIES };

/* Normals of a family about the axis n. */
static void family_normal(double out[3], enum family family, const double n[3], int i, uint64_t *seed)
{
	double side[3];

	hard_direction(side, seed);
	v3d_set(out, n[0], n[1], n[2]);
	if (family == OPPOSED && i % 2)
		v3d_scale(out, n, -1);
	if (family == COPLANAR) /* across the axis */
		v3d_cross(out, n, side);
	if (family == HEMISPHERE)
		v3d_scale(out, side, v3d_dot(side, n) < 0 ? -1 : 1);
	if (family == NEAR)
		v3d_add_scaled(out, n, random_in(seed, 0, 0.5), side);
	v3d_normalize(out, out);
}

/* A block of at most MOST_SAMPLES samples, whose cone is the modeller's. */
static void make_block(struct hard_block *block, enum family family, const double axis[3], uint64_t *seed)
{
	float normal[MOST_SAMPLES][3];
	int n = 0;

	memset(block, 0, sizeof *block);
	block->col = (int)random_below(seed, 100) - 50;
	block->row = 2 * ((int)random_below(seed, 50) - 25);
	const double z = random_in(seed, -0.5, 0.5), deep = exp2(random_in(seed, -12, -4));
	const uint32_t most = family == ONE ? 1 : 2 + random_below(seed, MOST_SAMPLES - 1);
	while (n < (int)most) {
		const uint32_t s = random_below(seed, 64);
		double v[3];

		if (block->mask >> s & 1)
			continue;
		family_normal(v, family, axis, n, seed);
		block->mask |= UINT64_C(1) << s;
		block->depth[s] = z + random_in(seed, 0, deep);
		block->attr[s] = hard_attr(v, 0, 0);
		memcpy(normal[n++], psr_direction_table()[PSR_ATTR_NORMAL(block->attr[s])], sizeof normal[0]);
	}
	cone_pack((const float(*)[3])normal, n, block->cone, &block->cone_sine);
}

static struct psr_model *random_model(uint64_t *seed)
{
	struct psr_projection projection[8];
	const struct hard_model options = { .projection = projection, .n_projections = 8, .with_cones = 1 };
	struct hard_block *block = malloc(BLOCKS * sizeof *block);
	struct psr_model *model;

	for (int p = 0; p < 8; p++) {
		double d[3];

		hard_direction(d, seed);
		projection[p] = hard_projection(d[0], d[1], d[2], SPACING);
	}
	for (int b = 0; b < BLOCKS; b++) {
		double axis[3];

		hard_direction(axis, seed);
		make_block(&block[b], (enum family)random_below(seed, N_FAMILIES), axis, seed);
		block[b].projection = random_below(seed, 8);
		block[b].group = (uint32_t)b / 100;
	}
	model = hard_model(&options, block, BLOCKS);
	free(block);
	return model;
}

/* From anywhere near, or so that a block's cone is nearly edge-on, where a wrong decision is likeliest. */
static void random_camera(struct psr_camera *camera, const struct psr_blocks *b, uint64_t *seed)
{
	const uint32_t block = random_below(seed, b->n_blocks);
	float center[3], radius;
	double d[3], axis[3] = { b->cone_x[block], b->cone_y[block], b->cone_z[block] };

	*camera = (struct psr_camera){ .fov_y = exp2(random_in(seed, -5, 1.5)), .ortho_height = random_in(seed, 0.05, 3) };
	psr_blocks_sphere(b, block, center, &radius);
	hard_direction(camera->up, seed);
	hard_direction(d, seed);
	if (random_below(seed, 2)) {
		v3d_normalize(axis, axis);
		v3d_add_scaled(d, d, -v3d_dot(d, axis) + random_in(seed, -0.1, 0.1), axis);
		v3d_normalize(d, d);
	}
	const double distance = exp2(random_in(seed, -8, 3));
	for (int k = 0; k < 3; k++)
		camera->eye[k] = (double)center[k] + distance * d[k];
	hard_direction(d, seed);
	for (int k = 0; k < 3; k++)
		camera->target[k] = (double)center[k] + 0.3 * distance * d[k];
	if (random_below(seed, 4) == 0)
		camera->kind = PSR_CAMERA_ORTHOGRAPHIC;
	if (random_below(seed, 3) == 0)
		camera->near_z = distance * random_in(seed, 0, 1.2);
}

/* A scene's plan and its bins, and a picture that is one tile. */
struct world {
	struct psr_instance instance;
	struct psr_scene scene;
	struct render_settings settings;
	struct plan plan;
	struct bins bins;
	uint64_t word[HEIGHT * WIDTH];
	struct warp_target target;
};

static void world_cull(struct world *w, const struct psr_model *model, const struct psr_camera *camera)
{
	struct psr_report report = { 0 };

	w->instance = hard_place(model);
	w->scene = (struct psr_scene){ .instance = &w->instance, .n_instances = 1, .camera = *camera };
	render_settings_default(&w->settings, WIDTH, HEIGHT);
	assert_int_equal(plan_make(&w->plan, &w->scene, &w->settings, NULL), PSR_OK);
	assert_int_equal(cull_blocks(&w->bins, simd_get(), &w->plan, NULL, &report), PSR_OK);
	w->target = (struct warp_target){ .instance = w->plan.warp, .direction = psr_direction_tens(),
		                              .near_z = w->plan.near_z, .perspective = w->plan.perspective, .word = w->word,
		                              .stride = WIDTH, .x1 = WIDTH, .y1 = HEIGHT };
}

static void world_fini(struct world *w)
{
	plan_clear(&w->plan);
	bins_clear(&w->bins);
	free(w);
}

static struct world *world_new(void)
{
	struct world *w = calloc(1, sizeof *w);

	assert_non_null(w);
	return w;
}

/* How many samples of a block fall into the picture; the warp tests whether they face away if is_mixed. */
static uint64_t show(const struct world *w, uint32_t slot, int is_mixed)
{
	const struct bin_entry entry = { .slot = slot, .is_mixed = is_mixed & 1 };

	return simd_get()->warp(&w->target, &entry, 1);
}

/* What the cull made of a block: left out, or drawn with a test for each sample, or drawn without. */
enum verdict { OUT, MIXED, ALL };

static void verdicts(uint8_t *verdict, const struct world *w, uint32_t n_blocks)
{
	memset(verdict, OUT, n_blocks);
	for (uint32_t e = 0; e < w->bins.tile_begin[w->plan.tiles_x * w->plan.tiles_y]; e++)
		verdict[w->bins.entry[e].slot] = w->bins.entry[e].is_mixed ? MIXED : ALL;
}

static void of_a_million_blocks_none_that_shows_is_left_out(void **state)
{
	const int n_models = HARD_CASES(50), n_cameras = 10;
	struct world *w = world_new();
	uint64_t seed = 1, n_out = 0, n_all = 0, n_saved = 0;
	static uint8_t verdict[BLOCKS];

	(void)state;
	for (int m = 0; m < n_models; m++) {
		struct psr_model *model = random_model(&seed);

		for (int c = 0; c < n_cameras; c++) {
			struct psr_camera camera;

			random_camera(&camera, psr_model_blocks(model), &seed);
			world_cull(w, model, &camera);
			verdicts(verdict, w, BLOCKS);
			for (uint32_t b = 0; b < BLOCKS; b++) {
				const uint64_t n = show(w, b, 1);

				if (verdict[b] == OUT && n != 0)
					fail_msg("block %u of model %d shows %u samples to camera %d, and was left out", b, m, (unsigned)n,
					         c);
				n_out += verdict[b] == OUT;
				n_saved += verdict[b] == OUT && show(w, b, 0) != 0;
				if (verdict[b] != ALL)
					continue;
				n_all++;
				if (show(w, b, 0) != n)
					fail_msg("block %u of model %d has samples that face away from camera %d", b, m, c);
			}
		}
		psr_model_unref(model);
	}
	/* So that the test is about something: all three verdicts are frequent, and cones leave out what is in view. */
	const uint64_t n = (uint64_t)n_models * (uint64_t)n_cameras * BLOCKS;
	print_message("# %llu blocks, %llu left out, of which cones alone %llu; %llu drawn without a test\n",
	              (unsigned long long)n, (unsigned long long)n_out, (unsigned long long)n_saved,
	              (unsigned long long)n_all);
	assert_true(n_out > n / 5 && n_saved > n / 100 && n_all > n / 100 && n - n_out > n / 5);
	world_fini(w);
}

/* From far away, by families. Samples are dropped whose normals are more than BACK_SINE = 0.0125 beyond perpendicular.
 * A cone's sine is at most 0.0109 above that of the smallest cap (sample/pack/cone.h), and the cull allows 0.0027: so
 * blocks of equal normals whose stored normal is 0.0125 + 0.0109 + 0.0027 = 0.0261 beyond perpendicular are left out.
 * Of opposed normals, and of others that no cone below a hemisphere holds, nothing is known: they are drawn and
 * tested. */
static void each_family_of_normals_is_culled_as_its_cone_allows(void **state)
{
	const struct psr_projection projection = hard_projection(0, 0, 1, SPACING);
	const struct hard_model options = { .projection = &projection, .n_projections = 1, .with_cones = 1 };
	const struct psr_camera camera = { .eye = { 0, 0, 9 }, .target = { 0, 0, 0 }, .up = { 0, 1, 0 },
		                               .kind = PSR_CAMERA_ORTHOGRAPHIC, .ortho_height = 4 };
	struct world *w = world_new();
	uint64_t seed = 2;
	unsigned n_out = 0;

	(void)state;
	for (int i = 0; i < HARD_CASES(5000); i++) {
		const double sine = random_in(&seed, -0.05, 0.05), turn = random_in(&seed, 0, 6.3);
		const double axis[3] = { cos(turn) * sqrt(1 - sine * sine), sin(turn) * sqrt(1 - sine * sine), sine };
		const enum family family = (enum family)random_below(&seed, NEAR);
		struct hard_block block;
		uint8_t verdict;

		make_block(&block, family, axis, &seed);
		struct psr_model *model = hard_model(&options, &block, 1);
		const int s = __builtin_ctzll(block.mask);
		const float facing = psr_direction_table()[PSR_ATTR_NORMAL(block.attr[s])][2];
		world_cull(w, model, &camera);
		verdicts(&verdict, w, 1);
		if (family == EQUAL || family == ONE) {
			assert_true(facing > -0.0261f || verdict == OUT);
			assert_true(facing < 0.0261f || verdict == ALL);
			n_out += verdict == OUT;
		}
		if (family == OPPOSED)
			assert_int_equal(verdict, MIXED);
		if (block.cone_sine == PSR_CONE_ANY)
			assert_int_equal(verdict, MIXED);
		assert_true(verdict != OUT || show(w, 0, 1) == 0);
		psr_model_unref(model);
	}
	assert_true(n_out > 0);
	world_fini(w);
}

/* Whatever a block's mask: if the surface at a sample may be seen along the direction to the eye, the bit of that
 * direction's triangle is set, and the cull asks for it. So a block is left out by no mask that tells the truth. */
static void masks_ask_for_the_direction_of_each_sample_in_view(void **state)
{
	struct world *w = world_new();
	struct cull_masks *masks = malloc(sizeof *masks);
	uint64_t seed = 3, n_seen = 0;

	(void)state;
	for (int m = 0; m < HARD_CASES(20); m++) {
		struct psr_model *model = random_model(&seed);
		const struct psr_blocks *b = psr_model_blocks(model);

		for (int c = 0; c < 20; c++) {
			struct psr_camera camera;

			random_camera(&camera, b, &seed);
			world_cull(w, model, &camera);
			cull_masks_make(masks, &w->plan, &w->plan.instance[0]);
			const float *eye = w->plan.instance[0].cull.eye;
			for (uint32_t block = 0; block < BLOCKS; block++) {
				struct cull_batch batch;

				simd_get()->cull(&batch, &w->plan.instance[0].cull, block, 1);
				if (!batch.is_left[0])
					continue;
				for (uint64_t left = b->mask[block]; left; left &= left - 1) {
					double at[3];
					float d[3];

					/* The block's samples are in view, all or some: each that is must be asked for. */
					hard_position(at, b, block, (uint32_t)__builtin_ctzll(left));
					for (int k = 0; k < 3; k++)
						d[k] = w->plan.perspective ? (float)((double)eye[k] - at[k]) : eye[k];
					double v[3];
					v3d_sub(v, at, camera.eye);
					const double z = v3d_dot(v, w->plan.axes[2]);
					const double x = v3d_dot(v, w->plan.axes[0]), y = v3d_dot(v, w->plan.axes[1]);
					const double half_w = WIDTH / 2.0 / (double)w->plan.focal, half_h = half_w / WIDTH * HEIGHT;
					if (w->plan.perspective && !(z > 1e-4 && fabs(x) < half_w * z && fabs(y) < half_h * z))
						continue;
					const unsigned triangle = psr_direction_encode(d) >> 8;
					const uint64_t *range = masks->range[batch.range[0]];
					if (!(range[triangle >> 6] >> (triangle & 63) & 1))
						fail_msg("block %u of model %d, camera %d: triangle %u is left out", block, m, c, triangle);
					n_seen++;
				}
			}
		}
		psr_model_unref(model);
	}
	assert_true(n_seen > (uint64_t)HARD_CASES(20) * 1000);
	free(masks);
	world_fini(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(of_a_million_blocks_none_that_shows_is_left_out),
		cmocka_unit_test(each_family_of_normals_is_culled_as_its_cone_allows),
		cmocka_unit_test(masks_ask_for_the_direction_of_each_sample_in_view),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
