#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "base/vec.h"
#include "psr/build.h"
#include "sample/pack/visibility_mask.h"
#include "sample/pack/visibility_mask_table.h"
#include "meshes.h"

#define N_TRIALS 200000 /* of some fifty views */

static const double zero[3];

/* Level 0 and all coarser ones of a mesh; `blocks` is the tests' to change: its arrays are not. */
struct object {
	struct psr_mesh *mesh;
	struct psr_model *model;
	struct ray_scene *scene;
	struct psr_pool *pool;
	struct psr_blocks blocks;
	uint64_t (*mask)[2];
};

static struct object make_object(struct psr_mesh *mesh)
{
	struct object o = { .mesh = mesh };
	struct psr_build_options options;
	const struct psr_model_info *info;

	psr_build_options_default(&options);
	options.resolution = 64;
	options.n_threads = 2;
	assert_int_equal(psr_model_build(&o.model, mesh, &options, NULL, NULL), PSR_OK);
	info = psr_model_info(o.model);
	assert_int_equal(ray_scene_create(&o.scene, mesh, info->origin, info->scale, NULL), PSR_OK);
	assert_int_equal(psr_pool_create(&o.pool, 2, NULL), PSR_OK);
	o.blocks = *psr_model_blocks(o.model);
	o.mask = calloc(o.blocks.n_blocks, sizeof *o.mask);
	o.blocks.visibility_mask = NULL;
	return o;
}

static void drop_object(struct object *o)
{
	free(o->mask);
	psr_pool_destroy(o->pool);
	ray_scene_destroy(o->scene);
	psr_model_unref(o->model);
	meshes_free(o->mesh);
}

/* To cones alone. */
static uint64_t lost_to_cones(const struct object *o, uint64_t n_trials, struct psr_pool *pool)
{
	uint64_t n = UINT64_MAX;

	assert_int_equal(visibility_mask_lost(&o->blocks, o->scene, n_trials, pool, &n), PSR_OK);
	return n;
}

/* To cones and to masks, as they are stored. */
static uint64_t lost(const struct object *o, uint64_t n_trials, struct psr_pool *pool)
{
	struct psr_run *run = calloc(psr_blocks_runs(&o->blocks), sizeof *run);
	struct visibility_mask_table table;
	struct object stored = *o;
	uint64_t n;

	memcpy(run, o->blocks.run, psr_blocks_runs(&o->blocks) * sizeof *run);
	assert_int_equal(visibility_mask_table_make(&table, &o->blocks, (const uint64_t(*)[2])o->mask, run, pool), PSR_OK);
	stored.blocks.run = run;
	stored.blocks.visibility_index = table.index;
	stored.blocks.visibility_mask = (const uint64_t(*)[2])table.mask;
	n = lost_to_cones(&stored, n_trials, pool);
	visibility_mask_table_fini(&table);
	free(run);
	return n;
}

/* ---- masks ---- */

/* Angle from c to the nearest place of a triangle that it is outside of, at least: that is on a side, and within a
 * quarter of that (36 degrees at the most at level 2, 0.16 radians for a quarter) of a corner or a middle. */
static double angle_to(const double c[3], double corner[3][3], double *to_corner)
{
	double least = 10;

	*to_corner = 10;
	for (int i = 0; i < 3; i++) {
		double middle[3];

		v3d_add(middle, corner[i], corner[(i + 1) % 3]);
		v3d_normalize(middle, middle);
		*to_corner = fmin(*to_corner, acos(fmax(-1, fmin(1, v3d_dot(corner[i], c)))));
		least = fmin(least, acos(fmax(-1, fmin(1, v3d_dot(middle, c)))));
	}
	return fmin(least, *to_corner) - 0.16;
}

/* A block around the direction c, seen under an angle beta from the ball's middle, is seen from a direction within 90
 * degrees less beta, and from none beyond 90 degrees and beta and what still counts: 0.0125 of facing and 0.0125 of the
 * normals' quantisation. Corners of triangles are directions that are looked from. */
static void a_ball_is_seen_from_the_triangles_above_it(void **state)
{
	struct object o = make_object(meshes_sphere(64, zero, 1));
	uint32_t n_seen = 0, n_hidden = 0;

	(void)state;
	assert_int_equal(visibility_mask_make(&o.blocks, o.pool, o.mask), PSR_OK);
	for (uint32_t b = 0; b < o.blocks.n_blocks; b++) {
		float center[3], radius;
		double c[3], beta; /* of a chord: an angle up to 0.9 */

		psr_blocks_sphere(&o.blocks, b, center, &radius);
		v3d_set(c, (double)center[0], (double)center[1], (double)center[2]);
		beta = (double)radius * 1.05;
		assert_true(beta < 0.9);
		v3d_normalize(c, c);
		for (unsigned t = 0; t < PSR_MASK_TRIANGLES; t++) {
			double corner[3][3], to_corner, least;
			int is_set = (int)(o.mask[b][t >> 6] >> (t & 63) & 1);

			psr_direction_corners(2, t, corner);
			least = angle_to(c, corner, &to_corner);
			if (to_corner < 1.5707 - beta) {
				assert_int_equal(is_set, 1);
				n_seen++;
			} else if (least > 1.5709 + beta + 0.025) {
				assert_int_equal(is_set, 0);
				n_hidden++;
			}
		}
	}
	assert_true(n_seen > 10000 && n_hidden > 10000);
	drop_object(&o);
}

static void masks_do_not_depend_on_threads(void **state)
{
	struct object o = make_object(meshes_sphere(16, zero, 1));
	uint64_t (*mask)[2] = calloc(o.blocks.n_blocks, sizeof *mask);

	(void)state;
	assert_int_equal(visibility_mask_make(&o.blocks, NULL, o.mask), PSR_OK);
	assert_int_equal(visibility_mask_make(&o.blocks, o.pool, mask), PSR_OK);
	assert_memory_equal(mask, o.mask, o.blocks.n_blocks * sizeof *mask);
	assert_int_equal(visibility_mask_is_full(o.blocks.n_blocks, (const uint64_t(*)[2])mask), 0);
	memset(mask, -1, o.blocks.n_blocks * sizeof *mask);
	assert_int_equal(visibility_mask_is_full(o.blocks.n_blocks, (const uint64_t(*)[2])mask), 1);
	free(mask);
	drop_object(&o);
}

/* ---- what is lost ---- */

static void a_ball_loses_nothing_to_its_cones_and_masks(void **state)
{
	struct object o = make_object(meshes_sphere(32, zero, 1));

	(void)state;
	assert_non_null(o.blocks.cone_x);
	assert_int_equal(visibility_mask_make(&o.blocks, o.pool, o.mask), PSR_OK);
	assert_int_equal(lost(&o, N_TRIALS, o.pool), 0);
	drop_object(&o);
}

/* Nothing hides a ball's front from the eye: with no bit set each pixel is lost, but for those few behind the limb
 * where the faces of the mesh are before the sample, and those that show its far side through a hole; with one bit set,
 * all but those seen from there, some 128th. */
static void without_bits_in_masks_all_is_lost(void **state)
{
	struct object o = make_object(meshes_sphere(64, zero, 1));
	uint64_t n_none, n_one;

	(void)state;
	n_none = lost(&o, N_TRIALS, o.pool);
	assert_true(n_none > N_TRIALS * 0.99 && n_none <= N_TRIALS);
	for (uint32_t b = 0; b < o.blocks.n_blocks; b++)
		o.mask[b][77 >> 6] |= UINT64_C(1) << (77 & 63);
	n_one = lost(&o, N_TRIALS, o.pool);
	assert_true(n_one < n_none && n_one > N_TRIALS * 0.9);
	memset(o.mask, -1, o.blocks.n_blocks * sizeof *o.mask);
	assert_int_equal(lost(&o, N_TRIALS, o.pool), 0);
	assert_int_equal(lost_to_cones(&o, N_TRIALS, o.pool), 0);
	drop_object(&o);
}

/* Cones that point inwards cull what is seen. */
static void turned_cones_lose(void **state)
{
	struct object o = make_object(meshes_sphere(32, zero, 1));
	int8_t *axis[3];

	(void)state;
	for (int k = 0; k < 3; k++) {
		const int8_t *from = k == 0 ? o.blocks.cone_x : k == 1 ? o.blocks.cone_y : o.blocks.cone_z;

		axis[k] = calloc(o.blocks.n_blocks, 1);
		for (uint32_t b = 0; b < o.blocks.n_blocks; b++)
			axis[k][b] = (int8_t)-from[b];
	}
	o.blocks.cone_x = axis[0];
	o.blocks.cone_y = axis[1];
	o.blocks.cone_z = axis[2];
	assert_true(lost_to_cones(&o, N_TRIALS, o.pool) > N_TRIALS / 2);
	for (int k = 0; k < 3; k++)
		free(axis[k]);
	drop_object(&o);
}

static void losses_do_not_depend_on_threads(void **state)
{
	struct object o = make_object(meshes_sphere(16, zero, 1));

	(void)state;
	for (uint32_t b = 0; b < o.blocks.n_blocks; b += 3)
		o.mask[b][0] = UINT64_MAX;
	for (uint64_t n = 1; n <= N_TRIALS; n *= 7) {
		uint64_t first = lost(&o, n, NULL);

		assert_true(first <= n);
		assert_true(lost(&o, n, o.pool) == first);
	}
	drop_object(&o);
}

/* A square that looks up, and above it one that looks down: from above the upper one is not there, and what is seen of
 * the lower one can be lost, though a ray upwards meets the upper one's front. */
static void a_wall_that_turns_its_back_hides_nothing(void **state)
{
	struct psr_mesh *mesh = meshes_new(8, 4);
	static const double corner[4][2] = { { -1, -1 }, { 1, -1 }, { 1, 1 }, { -1, 1 } };
	static const uint32_t triangle[4][3] = { { 0, 1, 2 }, { 0, 2, 3 }, { 4, 6, 5 }, { 4, 7, 6 } };
	uint64_t n_lower = 0, n_upper = 0;
	struct object o;

	(void)state;
	for (int i = 0; i < 8; i++)
		v3d_set(mesh->position[i], corner[i % 4][0], corner[i % 4][1], i < 4 ? -0.2 : 0.2);
	memcpy(mesh->triangle, triangle, sizeof triangle);
	o = make_object(mesh);
	for (int is_upper = 0; is_upper < 2; is_upper++) {
		for (uint32_t b = 0; b < o.blocks.n_blocks; b++)
			memset(o.mask[b], (o.blocks.sphere_z[b] > 0) == is_upper ? 0 : -1, sizeof *o.mask);
		*(is_upper ? &n_upper : &n_lower) = lost(&o, N_TRIALS, o.pool);
	}
	/* Half of the views are from above and show the lower one alone; the rest the upper one. */
	assert_true(n_lower + n_upper > N_TRIALS * 0.99);
	assert_true(n_lower > N_TRIALS / 4 && n_upper > N_TRIALS / 4);
	drop_object(&o);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_ball_is_seen_from_the_triangles_above_it),
		cmocka_unit_test(masks_do_not_depend_on_threads),
		cmocka_unit_test(a_ball_loses_nothing_to_its_cones_and_masks),
		cmocka_unit_test(without_bits_in_masks_all_is_lost),
		cmocka_unit_test(turned_cones_lose),
		cmocka_unit_test(losses_do_not_depend_on_threads),
		cmocka_unit_test(a_wall_that_turns_its_back_hides_nothing),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
