/* Runs of cubes in the cull: they draw the cubes that are drawn one by one, in the same tiles and depth buffers. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "render/cull.h"
#include "render/renderer.h"
#include "tests/unit/lib/trees.h"

#define WIDTH 700
#define HEIGHT 500

/* What is known of a cube in a tile. */
struct drawn_cube {
	uint32_t tile, slot;
	uint8_t level, is_mixed, at_border;
	uint16_t x[2], y[2];
	float near;
};

struct drawn {
	struct drawn_cube *cube;
	size_t n, capacity;
	struct psr_report report;
};

static int compare(const void *a, const void *b)
{
	const struct drawn_cube *x = a, *y = b;

	return x->tile != y->tile ? (x->tile > y->tile) - (x->tile < y->tile) : (x->slot > y->slot) - (x->slot < y->slot);
}

static void take(struct drawn *to, const struct bins *bins, const struct bin_entry *entry, uint32_t tile, uint32_t slot)
{
	const struct cull_hit *hit = &bins->hit[entry->hit];

	if (to->n == to->capacity) {
		to->capacity = to->capacity ? 2 * to->capacity : 4096;
		to->cube = realloc(to->cube, to->capacity * sizeof *to->cube);
		assert_non_null(to->cube);
	}
	to->cube[to->n++] = (struct drawn_cube){ tile, slot, entry->level, entry->is_mixed, entry->at_border,
		                                     { hit->x0, hit->x1 }, { hit->y0, hit->y1 }, hit->near };
}

/* Culls a scene of octrees, and sorts what entries draw by tile and cube. Each is drawn once in a tile. */
static void cull(struct drawn *to, const struct psr_scene *scene, const struct render_settings *settings, int with_runs)
{
	struct plan plan = { 0 };
	struct bins bins = { 0 };

	memset(to, 0, sizeof *to);
	assert_int_equal(psr_scene_validate(scene, NULL), PSR_OK);
	assert_int_equal(plan_make(&plan, scene, settings, NULL), PSR_OK);
	assert_true(plan.with_runs);
	plan.with_runs = with_runs;
	assert_int_equal(cull_blocks(&bins, simd_get(), &plan, NULL, &to->report), PSR_OK);
	for (uint32_t t = 0; t < plan.tiles_x * plan.tiles_y; t++)
		for (uint32_t e = bins.tile_begin[t]; e < bins.tile_begin[t + 1]; e++) {
			const struct bin_entry *entry = &bins.entry[e];
			const uint64_t cubes = with_runs ? bins.cubes[entry->hit] : 1;

			assert_true(cubes != 0);
			for (uint64_t left = cubes; left; left &= left - 1)
				take(to, &bins, entry, t, entry->slot + (uint32_t)__builtin_ctzll(left));
		}
	if (to->n > 0)
		qsort(to->cube, to->n, sizeof *to->cube, compare);
	for (size_t i = 1; i < to->n; i++)
		assert_true(compare(&to->cube[i - 1], &to->cube[i]) < 0);
	bins_clear(&bins);
	plan_clear(&plan);
}

/* What bounds a run may be wider than what bounds its cubes, and more may be known of how they face. Returns whether
 * any is drawn. */
static int check_same(const struct psr_scene *scene, const struct render_settings *settings)
{
	struct drawn runs, single;

	cull(&runs, scene, settings, 1);
	cull(&single, scene, settings, 0);
	assert_int_equal(runs.n, single.n);
	for (size_t i = 0; i < runs.n; i++) {
		const struct drawn_cube *r = &runs.cube[i], *s = &single.cube[i];

		assert_int_equal(r->tile, s->tile);
		assert_int_equal(r->slot, s->slot);
		assert_int_equal(r->level, s->level);
		assert_true(r->is_mixed <= s->is_mixed && r->at_border >= s->at_border);
		assert_true(r->x[0] <= s->x[0] && r->x[1] >= s->x[1] && r->y[0] <= s->y[0] && r->y[1] >= s->y[1]);
		assert_true(r->near <= s->near);
	}
	assert_int_equal(runs.report.n_blocks_drawn, single.report.n_blocks_drawn);
	assert_int_equal(runs.report.n_samples_drawn, single.report.n_samples_drawn);
	assert_int_equal(runs.report.n_clamped, single.report.n_clamped);
	assert_int_equal(runs.report.levels, single.report.levels);
	assert_int_equal(runs.report.octree_levels, single.report.octree_levels);
	assert_true(runs.report.error_px >= single.report.error_px);
	free(runs.cube);
	free(single.cube);
	return runs.n > 0;
}

static double random_of(uint64_t *state, double low, double high)
{
	*state = *state * 6364136223846793005u + 1442695040888963407u;
	return low + (high - low) * (double)(*state >> 11) * 0x1p-53;
}

/* From near, from far and from within; a third of it without perspective. Two instances, one of which is turned.
 * Returns in how many views `check` finds something. */
static int check_each_view(const struct tree_options *options, int n,
                           int (*check)(const struct psr_scene *scene, const struct render_settings *settings))
{
	struct psr_model *model = tree_build(options);
	struct psr_instance instance[2] = { { .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1 },
		                                { .model = model, .rotation = { 0.6, 0, 0, 0.8 }, .scale = 0.7,
		                                  .translation = { 1.4, 0.2, -0.3 } } };
	struct psr_scene scene = { .instance = instance, .n_instances = 2 };
	struct render_settings settings;
	uint64_t state = 7;
	int n_seen = 0;

	render_settings_default(&settings, WIDTH, HEIGHT);
	for (int i = 0; i < n; i++) {
		const double distance = exp2(random_of(&state, -2, 4));

		scene.camera = (struct psr_camera){ .up = { 0, 1, 0 }, .fov_y = random_of(&state, 0.2, 1.4) };
		for (int a = 0; a < 3; a++) {
			scene.camera.eye[a] = random_of(&state, -1, 1) * distance;
			scene.camera.target[a] = random_of(&state, -0.3, 0.3);
		}
		if (i % 3 == 2) {
			scene.camera.kind = PSR_CAMERA_ORTHOGRAPHIC;
			scene.camera.ortho_height = distance;
		}
		settings.cell_bias = i % 4 == 3 ? 1 : 0;
		settings.cull_tests = i % 5 == 4 ? PSR_CULL_ALL & ~(unsigned)PSR_CULL_CONES : PSR_CULL_ALL;
		n_seen += check(&scene, &settings);
	}
	psr_model_unref(model);
	return n_seen;
}

static void check_views(const struct tree_options *options)
{
	assert_true(check_each_view(options, 45, check_same) > 30); /* what has one side is not seen from within */
}

static void runs_draw_the_cubes_that_single_tests_leave(void **state)
{
	(void)state;
	check_views(&(struct tree_options){ .levels = 8, .radius = 0.9, .is_one_sided = 1, .with_offsets = 1, .keep = 1 });
}

static void so_they_do_of_what_has_two_sides(void **state)
{
	(void)state;
	check_views(&(struct tree_options){ .levels = 7, .radius = 0.9, .keep = 1 });
}

static void so_they_do_of_sparse_clouds(void **state)
{
	(void)state;
	check_views(&(struct tree_options){ .levels = 7, .radius = 0.9, .is_one_sided = 1, .keep = 0.3 });
}

static void runs_make_a_twentieth_of_the_entries(void **state)
{
	const struct tree_options options = { .levels = 8, .radius = 0.9, .is_one_sided = 1, .keep = 1 };
	struct psr_model *model = tree_build(&options);
	struct psr_instance instance = { .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	const struct psr_scene scene = { .instance = &instance, .n_instances = 1,
		                             .camera = { .eye = { 1, 2, 4 }, .up = { 0, 1, 0 }, .fov_y = 0.6 } };
	uint32_t n[2];

	(void)state;
	for (int with_runs = 0; with_runs < 2; with_runs++) {
		struct render_settings settings;
		struct psr_report report = { 0 };
		struct plan plan = { 0 };
		struct bins bins = { 0 };

		render_settings_default(&settings, 240, 120); /* in one tile, all of a run is alike */
		assert_int_equal(psr_scene_validate(&scene, NULL), PSR_OK);
		assert_int_equal(plan_make(&plan, &scene, &settings, NULL), PSR_OK);
		plan.with_runs = with_runs;
		assert_int_equal(cull_blocks(&bins, simd_get(), &plan, NULL, &report), PSR_OK);
		n[with_runs] = bins.tile_begin[plan.tiles_x * plan.tiles_y];
		bins_clear(&bins);
		plan_clear(&plan);
	}
	assert_true(n[1] > 0 && n[1] * 20 < n[0]);
	psr_model_unref(model);
}

/* Counts how often each cube is in a chunk, of which a cluster's cubes may be several; and that none of a group out of
 * view may show. */
static int check_chunks(const struct psr_scene *scene, const struct render_settings *settings)
{
	const struct simd *simd = simd_get();
	struct plan plan = { 0 };
	struct bins bins = { 0 };
	uint32_t n_chunks, n_out = 0;

	assert_int_equal(psr_scene_validate(scene, NULL), PSR_OK);
	assert_int_equal(plan_make(&plan, scene, settings, NULL), PSR_OK);
	assert_true(bins_room(&bins, group, plan.n_groups));
	assert_int_equal(cull_choose_levels(&bins, &plan, NULL), PSR_OK);
	assert_int_equal(cull_make_chunks(&bins, &plan, &n_chunks), PSR_OK);
	uint8_t *const n = calloc(plan.n_slots, 1);
	assert_non_null(n);
	for (uint32_t c = 0; c < n_chunks; c++) {
		const struct cull_chunk *chunk = &bins.chunk[c];
		const struct plan_instance *in = &plan.instance[chunk->instance];
		const struct psr_blocks *b = in->cull.blocks;
		const uint32_t end = chunk->first_block + chunk->n_blocks;
		uint32_t n_cubes = 0;

		for (uint32_t k = chunk->first_cluster; k < b->n_clusters && b->cluster[k].first_block < end; k++) {
			const uint32_t first = b->cluster[k].first_block, own_end = first + b->cluster[k].n_blocks;

			if (bins.group[in->first_group + b->cluster[k].group].is_out || !cull_is_chosen(&bins, in, &b->cluster[k]))
				continue;
			for (uint32_t i = first; i < own_end; i++)
				if (i >= chunk->first_block && i < end) {
					n[in->first_slot + i]++;
					n_cubes++;
				}
		}
		assert_in_range(n_cubes, 1, CULL_MOST_CHUNK);
	}
	for (uint32_t i = 0; i < plan.n_instances; i++) {
		const struct plan_instance *in = &plan.instance[i];
		const struct psr_blocks *b = in->cull.blocks;

		for (uint32_t k = 0; k < b->n_clusters; k++) {
			const int is_out = bins.group[in->first_group + b->cluster[k].group].is_out;
			n_out += (uint32_t)is_out;
			const int is_drawn = !is_out && cull_is_chosen(&bins, in, &b->cluster[k]);

			for (uint32_t j = 0; j < b->cluster[k].n_blocks; j++) {
				struct cull_batch batch;

				assert_int_equal(n[in->first_slot + b->cluster[k].first_block + j], is_drawn);
				if (!is_out)
					continue;
				simd->cull(&batch, &in->cull, b->cluster[k].first_block + j, 1);
				assert_int_equal(batch.is_left[0], 0);
			}
		}
	}
	free(n);
	bins_clear(&bins);
	plan_clear(&plan);
	return n_out > 0;
}

/* Levels with bounds of bunches, and with ones that tell nothing. Returns whether a bunch was chosen at once. */
static int check_bunches(const struct psr_scene *scene, const struct render_settings *settings)
{
	struct plan plan = { 0 };
	struct bins bins[2] = { 0 };
	int has_alike = 0;

	assert_int_equal(psr_scene_validate(scene, NULL), PSR_OK);
	assert_int_equal(plan_make(&plan, scene, settings, NULL), PSR_OK);
	const struct psr_cubes *cubes = plan.instance[0].cull.cubes;
	const uint32_t n_groups = cubes->groups.n_clusters / cubes->groups.n_levels;
	const uint32_t n_bunches = (n_groups + CUBES_BUNCH - 1) / CUBES_BUNCH;
	struct psr_cube_bunch *const wide = calloc(n_bunches, sizeof *wide);
	struct psr_cubes other = *cubes;
	assert_non_null(wide);
	for (uint32_t i = 0; i < n_bunches; i++)
		wide[i].radius = 1e20f;
	other.bunch = wide;
	for (int k = 0; k < 2; k++) {
		assert_true(bins_room(&bins[k], group, plan.n_groups));
		assert_int_equal(cull_choose_levels(&bins[k], &plan, NULL), PSR_OK);
		for (uint32_t i = 0; i < plan.n_instances; i++)
			plan.instance[i].cull.cubes = &other;
	}
	for (uint32_t i = 0; i < plan.n_instances; i++)
		for (uint32_t g = 0; g < n_groups; g++) {
			const struct cull_group *a = &bins[0].group[plan.instance[i].first_group + g];
			const struct cull_group *b = &bins[1].group[plan.instance[i].first_group + g];

			assert_int_equal(a->level, b->level);
			assert_int_equal(a->fits, b->fits);
			assert_int_equal(a->is_out, b->is_out);
			assert_int_equal(b->n_alike, 1);
			has_alike |= a->n_alike > 1;
		}
	for (int k = 0; k < 2; k++)
		bins_clear(&bins[k]);
	plan_clear(&plan);
	free(wide);
	return has_alike;
}

static void bunches_have_the_levels_of_their_groups(void **state)
{
	/* A thousand groups: of three views one at least has a bunch that is all in the picture, or all out of it. */
	const struct tree_options cloud = { .levels = 10, .radius = 0.9, .keep = 0.2 };

	(void)state;
	assert_true(check_each_view(&cloud, 60, check_bunches) > 20);
}

static void chunks_have_each_chosen_cube_once_and_leave_out_none_in_view(void **state)
{
	const struct tree_options sphere = { .levels = 8, .radius = 0.9, .keep = 1 };
	const struct tree_options ball = { .levels = 7, .radius = 1.8, .is_solid = 1, .keep = 1 }; /* fills the cube */

	(void)state;
	assert_true(check_each_view(&sphere, 20, check_chunks) > 10);
	assert_true(check_each_view(&ball, 20, check_chunks) > 4);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(runs_draw_the_cubes_that_single_tests_leave),
		cmocka_unit_test(so_they_do_of_what_has_two_sides),
		cmocka_unit_test(so_they_do_of_sparse_clouds),
		cmocka_unit_test(runs_make_a_twentieth_of_the_entries),
		cmocka_unit_test(bunches_have_the_levels_of_their_groups),
		cmocka_unit_test(chunks_have_each_chosen_cube_once_and_leave_out_none_in_view),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
