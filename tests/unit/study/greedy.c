#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"
#include "base/direction.h"
#include "surface/validate.h"
#include "models/studies/greedy/parts.h"
#include "models/studies/greedy/warp.h"
#include "tests/unit/sample/meshes.h"

#define DEGREES (180 / 3.14159265358979323846)

struct object {
	struct psr_mesh *mesh;
	struct ray_scene *scene;
	double origin[3], scale;
};

/* Two spheres that hide each other in part. */
static struct object two_spheres(void)
{
	const double a[3] = { 0, 0, 0 }, b[3] = { 1.5, 0.4, 0.3 };
	struct psr_mesh *first = meshes_sphere(24, a, 1), *second = meshes_sphere(24, b, 0.6);
	struct psr_mesh *mesh = meshes_new(2 * first->n_vertices, 2 * first->n_triangles);
	struct object object = { .mesh = mesh };

	for (uint32_t i = 0; i < mesh->n_vertices; i++) {
		const struct psr_mesh *from = i < first->n_vertices ? first : second;

		memcpy(mesh->position[i], from->position[i % first->n_vertices], sizeof *mesh->position);
		memcpy(mesh->normal[i], from->normal[i % first->n_vertices], sizeof *mesh->normal);
	}
	for (uint32_t i = 0; i < mesh->n_triangles; i++)
		for (int k = 0; k < 3; k++)
			mesh->triangle[i][k] = first->triangle[i % first->n_triangles][k]
			                       + (i < first->n_triangles ? 0 : first->n_vertices);
	meshes_free(first);
	meshes_free(second);
	assert_int_equal(validate_bound_mesh(mesh, object.origin, &object.scale, NULL), PSR_OK);
	assert_int_equal(ray_scene_create(&object.scene, mesh, object.origin, object.scale, NULL), PSR_OK);
	return object;
}

static void object_fini(struct object *object)
{
	ray_scene_destroy(object->scene);
	meshes_free(object->mesh);
}

static struct greedy *scan(const struct object *object, uint32_t resolution, enum greedy_lattice lattice,
                           enum greedy_directions directions, struct psr_pool *pool)
{
	const struct greedy_scan_options options = { resolution, 25 / DEGREES, lattice, directions };
	struct greedy *greedy = NULL;

	assert_int_equal(greedy_create(&greedy, object->mesh, object->scene, object->scale, &options, pool, NULL), PSR_OK);
	return greedy;
}

/* The greatest angle from a normal to the nearest direction, over all quantised normals, degrees. */
static double covering_angle(const struct greedy *greedy, int n_views)
{
	const float (*normal)[3] = psr_direction_table();
	double worst = 1;

	for (uint32_t n = 0; n < PSR_DIRECTIONS; n++) {
		double best = -1;

		for (int v = 0; v < n_views; v++)
			best = fmax(best, (double)v3f_dot(normal[n], greedy->view[v].projection.axis[2]));
		worst = fmin(worst, best);
	}
	return acos(worst) * DEGREES;
}

static void no_normal_is_further_from_a_direction_than_is_said(void **state)
{
	struct object object = two_spheres();
	struct greedy *thesis = scan(&object, 16, GREEDY_EQUILATERAL, GREEDY_THESIS, NULL);
	struct greedy *icosahedral = scan(&object, 16, GREEDY_EQUILATERAL, GREEDY_ICOSAHEDRAL, NULL);

	(void)state;
	assert_int_equal(thesis->n_views, 32);
	assert_int_equal(icosahedral->n_views, 32);
	/* The worst normals lie between the quantised ones, which are up to 1.27 degrees apart from any. */
	assert_true(covering_angle(thesis, 32) <= 32.4 && covering_angle(thesis, 32) > 32.4 - 1.3);
	assert_true(covering_angle(icosahedral, 32) <= 22.6 && covering_angle(icosahedral, 32) > 22.6 - 1.3);
	greedy_destroy(thesis);
	greedy_destroy(icosahedral);
	object_fini(&object);
}

static void every_projection_is_followed_by_its_opposite(void **state)
{
	struct object object = two_spheres();
	struct greedy *greedy = scan(&object, 16, GREEDY_EQUILATERAL, GREEDY_THESIS, NULL);

	(void)state;
	for (int v = 0; v < 32; v += 2)
		assert_true(v3f_dot(greedy->view[v].projection.axis[2], greedy->view[v + 1].projection.axis[2]) < -0.999999f);
	greedy_destroy(greedy);
	object_fini(&object);
}

static void samples_stand_on_the_lattice_and_on_the_surface(void **state)
{
	struct object object = two_spheres();

	(void)state;
	for (int lattice = GREEDY_EQUILATERAL; lattice <= GREEDY_SQUARE; lattice++) {
		struct greedy *greedy = scan(&object, 32, (enum greedy_lattice)lattice, GREEDY_THESIS, NULL);
		double spacing = 2.0 / 32 * cos(25 / DEGREES);
		double pitch = lattice == GREEDY_SQUARE ? 1 : sqrt(3.0) / 2;

		for (int v = 0; v < greedy->n_views; v++) {
			const struct greedy_view *view = &greedy->view[v];

			assert_true(view->n_samples > 100);
			for (uint32_t i = 0; i < view->n_samples; i++) {
				const struct greedy_sample *s = &view->sample[i];
				struct greedy_seen seen = greedy_project(view->projection.axis, s->position);
				double p[3] = { (double)s->position[0], (double)s->position[1], (double)s->position[2] };
				double shift = lattice == GREEDY_SQUARE ? 0 : (s->row & 1) / 2.0;

				/* Floats of size 1: a few units of 2^-24 each. */
				assert_float_equal(seen.x, (s->col + shift) * spacing, 2e-6);
				assert_float_equal(seen.y, s->row * pitch * spacing, 2e-6);
				assert_float_equal(seen.z, s->z, 2e-6);
				assert_true(ray_scene_distance(object.scene, p, 0.1) < 2e-6);
			}
		}
		greedy_destroy(greedy);
	}
	object_fini(&object);
}

static int floor_div(int a, int b)
{
	return (int)floor((double)a / b);
}

static void every_sample_is_in_the_block_of_its_row_and_column(void **state)
{
	struct object object = two_spheres();
	struct greedy *greedy = scan(&object, 32, GREEDY_EQUILATERAL, GREEDY_THESIS, NULL);

	(void)state;
	for (int side = 4; side <= 32; side *= 2) {
		for (int v = 0; v < greedy->n_views; v++) {
			struct greedy_view *view = &greedy->view[v];
			uint32_t n = 0;

			assert_int_equal(greedy_divide(view, side), PSR_OK);
			for (uint32_t b = 0; b < view->n_blocks; b++) {
				const struct greedy_block *block = &view->block[b];

				assert_int_equal(block->first, n);
				n += block->n;
				assert_true(b == 0 || block->row != block[-1].row || block->col != block[-1].col);
				for (uint32_t i = block->first; i < n; i++) {
					assert_int_equal(side * floor_div(view->sample[i].row, side), block->row);
					assert_int_equal(side * floor_div(view->sample[i].col, side), block->col);
				}
			}
			assert_int_equal(n, view->n_samples);
		}
	}
	greedy_destroy(greedy);
	object_fini(&object);
}

/* Of all samples of all views in all sixteen tests: those that no kept sample of any view but a block's
 * covers. */
static uint64_t count_uncovered(const struct greedy *greedy, const struct greedy_block *but)
{
	uint64_t n = 0;

	for (int v = 0; v < greedy->n_views; v++) {
		const struct greedy_view *view = &greedy->view[v];
		struct greedy_facing facing;

		greedy_facing_init(&facing, view->projection.axis);
		for (int test = 0; test < 16; test++) {
			struct greedy_grid grid;
			float *z;

			greedy_grid_init(&grid, test, 4, greedy->ds);
			z = malloc((size_t)grid.side * grid.side * sizeof *z);
			for (uint32_t i = 0; i < grid.side * grid.side; i++)
				z[i] = -INFINITY;
			for (int w = 0; w < greedy->n_views; w++) {
				const struct greedy_view *from = &greedy->view[w];

				for (uint32_t b = 0; b < from->n_blocks; b++) {
					for (uint32_t i = from->block[b].first; i < from->block[b].first + from->block[b].n; i++) {
						struct greedy_seen seen = greedy_project(view->projection.axis, from->sample[i].position);
						uint32_t at = greedy_pixel(&grid, &seen);

						if (from->sample[i].is_kept && &from->block[b] != but
						    && greedy_counts(&facing, &from->sample[i]))
							z[at] = fmaxf(z[at], seen.z);
					}
				}
			}
			for (uint32_t i = 0; i < view->n_samples; i++) {
				struct greedy_seen seen = greedy_project(view->projection.axis, view->sample[i].position);

				n += z[greedy_pixel(&grid, &seen)]
				     < seen.z - greedy_depth_tolerance(view->sample[i].cosine, greedy->ds);
			}
			free(z);
		}
	}
	return n;
}

static void the_first_pass_leaves_no_sample_uncovered(void **state)
{
	struct object object = two_spheres();
	struct greedy *greedy = scan(&object, 32, GREEDY_EQUILATERAL, GREEDY_THESIS, NULL);
	struct greedy_select_options options;
	struct greedy_result result;

	(void)state;
	greedy_select_default(&options);
	options.second_pass = 0;
	assert_int_equal(greedy_select(greedy, &options, &result, NULL), PSR_OK);
	assert_int_equal(result.n_blocks, result.n_first_pass);
	assert_int_equal(count_uncovered(greedy, NULL), 0);
	/* All blocks of the first two projections, which are opposite, are taken ([G] 5.2). */
	for (uint32_t b = 0; b < greedy->view[0].n_blocks; b++)
		assert_true(greedy->view[0].block[b].is_kept);
	greedy_destroy(greedy);
	object_fini(&object);
}

static uint8_t *kept_blocks(const struct greedy *greedy, size_t *n)
{
	uint8_t *kept;

	*n = 0;
	for (int v = 0; v < greedy->n_views; v++)
		*n += greedy->view[v].n_blocks;
	kept = malloc(*n);
	*n = 0;
	for (int v = 0; v < greedy->n_views; v++)
		for (uint32_t b = 0; b < greedy->view[v].n_blocks; b++)
			kept[(*n)++] = greedy->view[v].block[b].is_kept;
	return kept;
}

static void the_second_pass_only_removes_blocks(void **state)
{
	struct object object = two_spheres();
	struct greedy *greedy = scan(&object, 32, GREEDY_EQUILATERAL, GREEDY_ICOSAHEDRAL, NULL);
	struct greedy_select_options options;
	struct greedy_result first, both;
	uint8_t *before, *after;
	size_t n, m;

	(void)state;
	greedy_select_default(&options);
	options.second_pass = 0;
	assert_int_equal(greedy_select(greedy, &options, &first, NULL), PSR_OK);
	before = kept_blocks(greedy, &n);
	options.second_pass = 1;
	assert_int_equal(greedy_select(greedy, &options, &both, NULL), PSR_OK);
	after = kept_blocks(greedy, &m);
	assert_int_equal(n, m);
	for (size_t i = 0; i < n; i++)
		assert_true(after[i] <= before[i]);
	assert_int_equal(both.n_first_pass, first.n_blocks);
	assert_true(both.n_blocks < first.n_blocks);
	free(before);
	free(after);
	greedy_destroy(greedy);
	object_fini(&object);
}

static void selection_by_score_covers_everything_and_keeps_nothing_that_is_not_needed(void **state)
{
	struct object object = two_spheres();
	struct greedy *greedy = scan(&object, 24, GREEDY_EQUILATERAL, GREEDY_ICOSAHEDRAL, NULL);
	struct greedy_select_options options;
	struct greedy_result result;
	uint64_t n_tried = 0;

	(void)state;
	greedy_select_default(&options);
	options.by_score = 1;
	assert_int_equal(greedy_select(greedy, &options, &result, NULL), PSR_OK);
	assert_true(result.n_blocks > 0 && result.n_blocks < result.n_first_pass);
	assert_int_equal(count_uncovered(greedy, NULL), 0);
	for (int v = 0; v < greedy->n_views; v++) {
		for (uint32_t b = 0; b < greedy->view[v].n_blocks; b += 3) {
			if (!greedy->view[v].block[b].is_kept)
				continue;
			assert_true(count_uncovered(greedy, &greedy->view[v].block[b]) > 0);
			n_tried++;
		}
	}
	assert_true(n_tried > 5);
	greedy_destroy(greedy);
	object_fini(&object);
}

static void dropping_samples_uncovers_nothing(void **state)
{
	struct object object = two_spheres();
	struct greedy *greedy = scan(&object, 32, GREEDY_EQUILATERAL, GREEDY_ICOSAHEDRAL, NULL);
	struct greedy_select_options options;
	struct greedy_result all, some;
	uint64_t uncovered;

	(void)state;
	greedy_select_default(&options);
	assert_int_equal(greedy_select(greedy, &options, &all, NULL), PSR_OK);
	uncovered = count_uncovered(greedy, NULL);
	options.drops_samples = 1;
	assert_int_equal(greedy_select(greedy, &options, &some, NULL), PSR_OK);
	assert_true(some.n_samples < all.n_samples && some.n_blocks <= all.n_blocks);
	assert_int_equal(count_uncovered(greedy, NULL), uncovered);
	greedy_destroy(greedy);
	object_fini(&object);
}

static void a_sheet_seen_from_one_side_does_not_cover_its_other_side(void **state)
{
	struct object object = { .mesh = meshes_square(4) };
	struct greedy_select_options options;
	struct greedy_result facing, both;
	struct greedy *greedy;

	(void)state;
	/* The same square once more, facing the other way a tenth of a pixel behind. */
	struct psr_mesh *sheet = meshes_new(2 * object.mesh->n_vertices, 2 * object.mesh->n_triangles);
	for (uint32_t i = 0; i < sheet->n_vertices; i++) {
		uint32_t from = i % object.mesh->n_vertices;
		int back = i >= object.mesh->n_vertices;

		memcpy(sheet->position[i], object.mesh->position[from], sizeof *sheet->position);
		sheet->position[i][2] = back ? -0.1 / 16 : 0;
		sheet->normal[i][2] = back ? -1 : 1;
	}
	for (uint32_t i = 0; i < sheet->n_triangles; i++) {
		uint32_t n = object.mesh->n_triangles, back = i >= n;

		for (int k = 0; k < 3; k++)
			sheet->triangle[i][k] = object.mesh->triangle[i % n][back ? 2 - k : k] + back * object.mesh->n_vertices;
	}
	meshes_free(object.mesh);
	object.mesh = sheet;
	assert_int_equal(validate_bound_mesh(sheet, object.origin, &object.scale, NULL), PSR_OK);
	assert_int_equal(ray_scene_create(&object.scene, sheet, object.origin, object.scale, NULL), PSR_OK);
	greedy = scan(&object, 32, GREEDY_EQUILATERAL, GREEDY_ICOSAHEDRAL, NULL);
	greedy_select_default(&options);
	options.second_pass = 0;
	assert_int_equal(greedy_select(greedy, &options, &facing, NULL), PSR_OK);
	assert_int_equal(count_uncovered(greedy, NULL), 0);
	options.is_facing = 0;
	assert_int_equal(greedy_select(greedy, &options, &both, NULL), PSR_OK);
	assert_true(count_uncovered(greedy, NULL) > 0);
	assert_true(both.n_blocks < facing.n_blocks);
	greedy_destroy(greedy);
	object_fini(&object);
}

static void threads_and_what_came_before_change_nothing(void **state)
{
	struct object object = two_spheres();
	struct psr_pool *pool = NULL;
	struct greedy *one, *four;
	struct greedy_select_options options;
	struct greedy_result a, b;
	uint8_t *kept_a, *kept_b;
	size_t n, m;

	(void)state;
	assert_int_equal(psr_pool_create(&pool, 4, NULL), PSR_OK);
	one = scan(&object, 48, GREEDY_EQUILATERAL, GREEDY_CORNERS, NULL);
	four = scan(&object, 48, GREEDY_EQUILATERAL, GREEDY_CORNERS, pool);
	assert_int_equal(one->n_views, 290);
	assert_int_equal(one->n_scouts, 192);
	greedy_select_default(&options);
	options.is_strict_first = options.forgives_outlines = options.drops_samples = 1;
	assert_int_equal(greedy_select(one, &options, &a, NULL), PSR_OK);
	options.side = 16;
	assert_int_equal(greedy_select(four, &options, &b, NULL), PSR_OK);
	options.side = 8;
	assert_int_equal(greedy_select(four, &options, &b, NULL), PSR_OK);
	kept_a = kept_blocks(one, &n);
	kept_b = kept_blocks(four, &m);
	assert_int_equal(n, m);
	assert_memory_equal(kept_a, kept_b, n);
	assert_int_equal(a.n_samples, b.n_samples);
	free(kept_a);
	free(kept_b);
	greedy_destroy(one);
	greedy_destroy(four);
	psr_pool_destroy(pool);
	object_fini(&object);
}

static void counts_agree_with_what_is_kept(void **state)
{
	struct object object = two_spheres();
	struct greedy *greedy = scan(&object, 32, GREEDY_SQUARE, GREEDY_THESIS, NULL);
	struct greedy_select_options options;
	struct greedy_result result;
	struct greedy_point *point;

	(void)state;
	greedy_select_default(&options);
	options.side = 4;
	assert_int_equal(greedy_select(greedy, &options, &result, NULL), PSR_OK);
	assert_int_equal(result.n_lanes, 16 * result.n_blocks);
	assert_int_equal(result.n_bytes, 10 * result.n_samples + (21 + 2) * result.n_blocks);
	point = calloc(result.n_samples + 1, sizeof *point);
	greedy_points(greedy, point);
	for (uint64_t i = 0; i < result.n_samples; i++)
		assert_true(v3f_length(point[i].position) > 0.1f);
	assert_true(v3f_length(point[result.n_samples].position) == 0);
	free(point);
	greedy_destroy(greedy);
	object_fini(&object);
}

/* The whole of an opaque sphere's far side is culled at most, the near side never. */
static void cones_cull_less_than_the_far_side(void **state)
{
	const double center[3] = { 0 };
	struct object object = { .mesh = meshes_sphere(48, center, 1) };
	struct greedy_select_options options;
	struct greedy_result result;
	struct greedy_warp_time time;

	(void)state;
	assert_int_equal(validate_bound_mesh(object.mesh, object.origin, &object.scale, NULL), PSR_OK);
	assert_int_equal(ray_scene_create(&object.scene, object.mesh, object.origin, object.scale, NULL), PSR_OK);
	greedy_select_default(&options);
	for (int side = 4; side <= 32; side *= 2) {
		struct greedy *greedy = scan(&object, 96, GREEDY_EQUILATERAL, GREEDY_ICOSAHEDRAL, NULL);
		struct greedy_warp *warp = NULL;

		options.side = side;
		assert_int_equal(greedy_select(greedy, &options, &result, NULL), PSR_OK);
		assert_int_equal(greedy_warp_create(&warp, greedy, NULL), PSR_OK);
		assert_int_equal(greedy_warp_run(warp, 8, &time, NULL), PSR_OK);
		/* From 1.73 radii a sphere shows (1 - 1 / 1.73) / 2 = 0.211 of itself: at most 0.789 can be culled. */
		assert_true(time.culled < 0.789);
		assert_true(time.culled > (side <= 8 ? 0.4 : 0));
		greedy_warp_destroy(warp);
		greedy_destroy(greedy);
	}
	object_fini(&object);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(no_normal_is_further_from_a_direction_than_is_said),
		cmocka_unit_test(every_projection_is_followed_by_its_opposite),
		cmocka_unit_test(samples_stand_on_the_lattice_and_on_the_surface),
		cmocka_unit_test(every_sample_is_in_the_block_of_its_row_and_column),
		cmocka_unit_test(the_first_pass_leaves_no_sample_uncovered),
		cmocka_unit_test(the_second_pass_only_removes_blocks),
		cmocka_unit_test(selection_by_score_covers_everything_and_keeps_nothing_that_is_not_needed),
		cmocka_unit_test(dropping_samples_uncovers_nothing),
		cmocka_unit_test(a_sheet_seen_from_one_side_does_not_cover_its_other_side),
		cmocka_unit_test(threads_and_what_came_before_change_nothing),
		cmocka_unit_test(counts_agree_with_what_is_kept),
		cmocka_unit_test(cones_cull_less_than_the_far_side),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
