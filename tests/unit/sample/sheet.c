#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "level.h"

static const double zero[3];

struct traced {
	struct psr_mesh *mesh;
	struct ray_scene *scene;
	struct sampling sampling; /* without a pool */
	struct sheets sheets;
};

/* Seen along `direction`, with neighbours on the lattice `spacing` apart. */
static void trace(struct traced *traced, struct psr_mesh *mesh, const double direction[3], double spacing,
                  int n_threads)
{
	struct psr_projection projection = { .spacing = (float)spacing };
	struct psr_pool *pool = NULL;
	double unit[3], frame[3][3];

	v3d_normalize(unit, direction);
	psr_direction_basis(unit, frame);
	for (int k = 0; k < 9; k++)
		projection.axis[k / 3][k % 3] = (float)frame[k / 3][k % 3];
	traced->mesh = mesh;
	assert_int_equal(ray_scene_create(&traced->scene, mesh, zero, 1, NULL), PSR_OK);
	assert_int_equal(psr_pool_create(&pool, n_threads, NULL), PSR_OK);
	traced->sampling = (struct sampling){ .mesh = mesh, .scene = traced->scene, .pool = pool };
	assert_int_equal(sheets_trace(&traced->sheets, NULL, &traced->sampling, &projection), PSR_OK);
	traced->sampling.pool = NULL;
	psr_pool_destroy(pool);
}

static void done(struct traced *traced)
{
	sheets_fini(&traced->sheets);
	ray_scene_destroy(traced->scene);
	meshes_free(traced->mesh);
}

static uint64_t count_hits(const struct sheets *sheets)
{
	uint64_t n = 0;

	for (uint32_t p = 0; p < sheets->n_patches; p++)
		n += (uint64_t)__builtin_popcountll(sheets->patch[p].mask);
	return n;
}

/* Appends b's triangles to a's, and frees b. */
static struct psr_mesh *joined(struct psr_mesh *a, struct psr_mesh *b)
{
	struct psr_mesh *mesh = meshes_new(a->n_vertices + b->n_vertices, a->n_triangles + b->n_triangles);

	memcpy(mesh->position, a->position, a->n_vertices * sizeof *a->position);
	memcpy(mesh->position + a->n_vertices, b->position, b->n_vertices * sizeof *b->position);
	memcpy(mesh->triangle, a->triangle, a->n_triangles * sizeof *a->triangle);
	for (uint32_t i = 0; i < b->n_triangles; i++)
		for (int k = 0; k < 3; k++)
			mesh->triangle[a->n_triangles + i][k] = b->triangle[i][k] + a->n_vertices;
	meshes_free(a);
	meshes_free(b);
	return mesh;
}

/* A sphere of radius r facing within 72.5 degrees (cosine 0.3) has a shadow of pi r^2 (1 - 0.3^2), and a lattice cell
 * an area of spacing^2 sqrt(3) / 2. Facets of 3 degrees blur its rim by a share of 2 sin(1.5 degrees) tan(72.5
 * degrees) at most; a lattice counts an area of n cells to within its outline's, 4 sqrt(n) of them. */
static void all_nested_spheres_are_found(void **state)
{
	const double radius[] = { 0.95, 0.6, 0.3 }, spacing = 0.02;
	struct psr_mesh *mesh = meshes_sphere(60, zero, radius[0]);
	struct traced traced;
	double wanted = 0, slack = 0;

	(void)state;
	for (int i = 1; i < 3; i++)
		mesh = joined(mesh, meshes_sphere(60, zero, radius[i]));
	trace(&traced, mesh, (const double[3]){ 0.3, 0.4, 0.5 }, spacing, 2);
	for (int i = 0; i < 3; i++) {
		double n = 3.14159265 * radius[i] * radius[i] * 0.91 / (spacing * spacing * 0.8660254);

		wanted += n;
		slack += 0.166 * 0.09 / 0.91 * n + 4 * sqrt(n);
	}
	assert_true(fabs((double)count_hits(&traced.sheets) - wanted) < slack);
	assert_int_equal(count_hits(&traced.sheets), traced.sheets.n_hits);
	done(&traced);
}

/* Their samples are `first` on the front one alone, and each layer has patches of its own: none is deeper than a
 * layer. */
static void parallel_squares_make_a_patch_each(void **state)
{
	const double spacing = 0.02, gap = 0.05;
	struct psr_mesh *mesh = meshes_square(1);
	struct traced traced;

	(void)state;
	for (int i = 1; i < 5; i++) {
		struct psr_mesh *lower = meshes_square(1);

		for (uint32_t k = 0; k < 4; k++)
			lower->position[k][2] = -i * gap;
		mesh = joined(mesh, lower);
	}
	for (uint32_t i = 0; i < mesh->n_vertices; i++)
		for (int k = 0; k < 2; k++)
			mesh->position[i][k] *= 0.6;
	trace(&traced, mesh, (const double[3]){ 0, 0, 1 }, spacing, 2);
	/* Seen from straight above, without a rim: a lattice point has all five hits or none. */
	assert_int_equal(count_hits(&traced.sheets) % 5, 0);
	assert_true((double)count_hits(&traced.sheets) > 5 * 1.44 / (spacing * spacing * 0.866) * 0.95);
	for (uint32_t p = 0; p < traced.sheets.n_patches; p++) {
		const struct patch *patch = &traced.sheets.patch[p];
		float z = traced.sheets.sample[p][__builtin_ctzll(patch->mask)].z;

		for (uint64_t left = patch->mask; left != 0; left &= left - 1) {
			unsigned s = (unsigned)__builtin_ctzll(left);

			assert_float_equal(traced.sheets.sample[p][s].z, z, 1e-6);
			assert_int_equal(patch->first >> s & 1, fabsf(z) < 1e-6f);
		}
		assert_int_equal(patch->first & ~patch->mask, 0);
	}
	done(&traced);
}

/* Triangles that lie further apart than the 2.5 steps at which hits are taken for one surface. A block is 7.5 by 7 *
 * 0.866 steps, 9.7 from corner to corner; a single sheet that faces within 72.5 degrees is 9.7 * tan(72.5 degrees) =
 * 30.8 steps deep at most. What several of them share must not be deeper than that, where the whole set is 56 steps
 * deep. */
static void patches_stay_shallow(void **state)
{
	const double spacing = 0.02;
	uint64_t seed = 3;
	uint32_t n_patches = 0;

	(void)state;
	for (int round = 0; round < 10; round++) {
		struct psr_mesh *mesh = meshes_new(3 * 64, 64);
		struct traced traced;

		for (uint32_t i = 0; i < mesh->n_vertices; i++) {
			const uint32_t cell[3] = { i / 3 % 4, i / 12 % 4, i / 48 };

			for (int k = 0; k < 3; k++)
				mesh->position[i][k] = 0.28 * (cell[k] - 2.0) + 0.22 * meshes_random(&seed);
			mesh->triangle[i / 3][i % 3] = i;
		}
		mesh->material->two_sided = 1;
		trace(&traced, mesh, (const double[3]){ 0.01, 0.02, 1 }, spacing, 2);
		n_patches += traced.sheets.n_patches;
		for (uint32_t p = 0; p < traced.sheets.n_patches; p++) {
			float low = INFINITY, high = -INFINITY;

			for (uint64_t left = traced.sheets.patch[p].mask; left != 0; left &= left - 1) {
				low = fminf(low, traced.sheets.sample[p][__builtin_ctzll(left)].z);
				high = fmaxf(high, traced.sheets.sample[p][__builtin_ctzll(left)].z);
			}
			assert_true(high - low <= 30.9f * (float)spacing);
		}
		done(&traced);
	}
	assert_true(n_patches > 600);
}

static void threads_do_not_change_a_sheet(void **state)
{
	struct traced traced[3];

	(void)state;
	for (int i = 0; i < 3; i++) {
		trace(&traced[i], meshes_sphere(20, zero, 0.9), (const double[3]){ 3, 1, -2 }, 0.01, i + 1);
		assert_int_equal(traced[i].sheets.n_patches, traced[0].sheets.n_patches);
		assert_memory_equal(traced[i].sheets.patch, traced[0].sheets.patch,
		                    traced[0].sheets.n_patches * sizeof *traced[0].sheets.patch);
		assert_memory_equal(traced[i].sheets.sample, traced[0].sheets.sample,
		                    traced[0].sheets.n_patches * sizeof *traced[0].sheets.sample);
	}
	for (int i = 0; i < 3; i++)
		done(&traced[i]);
}

/* Nested spheres: the rays of one side find what those of the other would. */
static void both_sides_are_traced_at_once(void **state)
{
	const double direction[3] = { 0.1, -0.2, 1 };
	struct psr_mesh *mesh = joined(meshes_sphere(30, zero, 0.95), meshes_sphere(20, zero, 0.5));
	struct psr_projection turned;
	struct psr_pool *pool = NULL;
	struct sheets front, behind, alone;
	struct traced traced;

	(void)state;
	mesh->material->two_sided = 1;
	trace(&traced, mesh, direction, 0.02, 2);
	turned = traced.sheets.projection;
	for (int k = 0; k < 3; k++) {
		turned.axis[0][k] = -turned.axis[0][k];
		turned.axis[2][k] = -turned.axis[2][k];
	}
	assert_int_equal(psr_pool_create(&pool, 2, NULL), PSR_OK);
	traced.sampling.pool = pool;
	assert_int_equal(sheets_trace(&front, &behind, &traced.sampling, &traced.sheets.projection), PSR_OK);
	assert_int_equal(sheets_trace(&alone, NULL, &traced.sampling, &turned), PSR_OK);
	assert_memory_equal(behind.projection.axis, turned.axis, sizeof turned.axis);
	assert_int_equal(front.n_hits, traced.sheets.n_hits);
	assert_int_equal(count_hits(&behind), count_hits(&alone));
	for (uint32_t p = 0; p < alone.n_patches; p++) {
		for (uint64_t left = alone.patch[p].mask; left != 0; left &= left - 1) {
			unsigned s = (unsigned)__builtin_ctzll(left);
			struct lattice_point at = { 8 * alone.patch[p].row + (int)s / 8, 8 * alone.patch[p].col + (int)s % 8 };
			struct sheet_ref ref = sheets_find(&behind, at, alone.sample[p][s].z, 1e-6f);

			assert_int_not_equal(ref.patch, SHEET_NONE);
			assert_int_equal(behind.sample[ref.patch][s].surface, alone.sample[p][s].surface);
			assert_int_equal(behind.patch[ref.patch].first >> s & 1, alone.patch[p].first >> s & 1);
		}
	}
	psr_pool_destroy(pool);
	sheets_fini(&front);
	sheets_fini(&behind);
	sheets_fini(&alone);
	done(&traced);
}

static void random_points_lie_in_their_lattice_triangles(void **state)
{
	struct sheets sheets = { .projection.spacing = 0.0137f };
	uint64_t seed = 11;

	(void)state;
	for (int i = 0; i < 100000; i++) {
		double x = 2 * meshes_random(&seed) - 1, y = 2 * meshes_random(&seed) - 1, p[3][2], area, weight[3];
		double spacing = (double)sheets.projection.spacing;
		struct lattice_point corner[3];

		sheets_triangle(&sheets, x, y, corner);
		for (int k = 0; k < 3; k++)
			sheets_point(&sheets, corner[k].row, corner[k].col, &p[k][0], &p[k][1]);
		for (int k = 0; k < 3; k++) {
			const double *a = p[(k + 1) % 3], *b = p[(k + 2) % 3];

			/* Neighbours all: the triangle is equilateral, of the lattice's own side. */
			assert_true(fabs(hypot(a[0] - b[0], a[1] - b[1]) - spacing) < 1e-12);
			weight[k] = (a[0] - x) * (b[1] - y) - (a[1] - y) * (b[0] - x);
		}
		area = weight[0] + weight[1] + weight[2];
		for (int k = 0; k < 3; k++)
			assert_true(weight[k] / area > -1e-9 && weight[k] / area < 1 + 1e-9);
	}
}

static void a_sample_is_found_where_it_is(void **state)
{
	struct traced traced;
	const struct sheets *sheets = &traced.sheets;

	(void)state;
	trace(&traced, joined(meshes_sphere(30, zero, 0.9), meshes_sphere(30, zero, 0.5)), (const double[3]){ 3, 1, -2 },
	      0.03, 2);
	for (uint32_t p = 0; p < sheets->n_patches; p++) {
		for (uint64_t left = sheets->patch[p].mask; left != 0; left &= left - 1) {
			unsigned s = (unsigned)__builtin_ctzll(left);
			struct lattice_point at = { 8 * sheets->patch[p].row + (int)s / 8, 8 * sheets->patch[p].col + (int)s % 8 };
			float z = sheets->sample[p][s].z, position[3], projected[3];
			struct sheet_ref ref = sheets_find(sheets, at, z, 0);
			double x, y;

			assert_int_equal(ref.patch, p);
			assert_int_equal(ref.sample, s);
			assert_int_equal(sheets_find(sheets, at, z + 0.09f, 0.08f).patch, SHEET_NONE);
			sheets_position(sheets, ref, position);
			projection_project(&sheets->projection, position, projected);
			sheets_point(sheets, at.row, at.col, &x, &y);
			assert_true(fabs((double)projected[0] - x) < 1e-6 && fabs((double)projected[1] - y) < 1e-6);
			assert_true(fabsf(projected[2] - z) < 1e-6f);
		}
	}
	done(&traced);
}

/* Into a living patch with a free place at a like depth and of the same sides; else into one of its own. */
static void samples_are_added_where_there_is_room(void **state)
{
	struct traced traced;
	struct sheets *sheets = &traced.sheets;
	struct lattice_point at = { 0, 0 }, outside = { 100000, 0 };
	struct sheet_ref ref, first, second;
	struct psr_mesh *mesh = meshes_square(1);
	const double up[3] = { 0, 0, 1 };
	double frame[3][3];
	uint32_t n;

	(void)state;
	/* From 0.02 to 0.52 in projection space: block 0, 0 is left with free places. */
	psr_direction_basis(up, frame);
	for (uint32_t i = 0; i < 4; i++) {
		double x = 0.27 + 0.25 * mesh->position[i][0], y = 0.27 + 0.25 * mesh->position[i][1];

		for (int k = 0; k < 3; k++)
			mesh->position[i][k] = x * frame[0][k] + y * frame[1][k];
	}
	trace(&traced, mesh, up, 0.01, 1);
	n = sheets->n_patches;
	ref = sheets_find(sheets, (struct lattice_point){ 5, 5 }, 0, 0.01f);
	assert_int_not_equal(ref.patch, SHEET_NONE);
	assert_int_equal(sheets_find(sheets, at, 0, 0.01f).patch, SHEET_NONE);
	assert_int_equal(sheets_room(sheets, at, 0, 0).patch, SHEET_NONE); /* none has kept samples */
	sheets_keep(sheets, ref);
	assert_int_equal(sheets_room(sheets, at, 0.02f, 0).patch, ref.patch);
	assert_int_equal(sheets_room(sheets, at, 0.02f, 1).patch, SHEET_NONE);
	assert_int_equal(sheets_room(sheets, at, 0.13f, 0).patch, SHEET_NONE); /* over 12 steps away */
	assert_int_equal(sheets_add(sheets, at, 0.02f, 1, 0, &first), PSR_OK);
	assert_int_equal(first.patch, ref.patch);
	assert_int_equal(sheets->n_patches, n);
	assert_int_equal(sheets_find(sheets, at, 0.02f, 0).patch, first.patch);
	assert_int_equal(sheets_add(sheets, at, 0.021f, 1, 0, &second), PSR_OK);
	assert_int_equal(second.patch, n);
	assert_int_equal(sheets->n_patches, n + 1);
	assert_int_equal(sheets_find(sheets, at, 0.021f, 0).patch, second.patch);
	assert_int_equal(sheets_find(sheets, at, 0.02f, 0).patch, first.patch);
	assert_int_equal(sheets_add(sheets, outside, 0, 1, 0, &second), PSR_OK);
	assert_int_equal(second.patch, SHEET_NONE);
	assert_int_equal(sheets_find(sheets, outside, 0, 9).patch, SHEET_NONE);
	/* Until the arrays have to grow. */
	for (int i = 0; i < 100; i++) {
		assert_int_equal(sheets_add(sheets, at, 0.03f + 0.001f * (float)i, 1, 0, &second), PSR_OK);
		assert_int_equal(second.patch, n + 1 + (uint32_t)i);
	}
	done(&traced);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(all_nested_spheres_are_found),
		cmocka_unit_test(parallel_squares_make_a_patch_each),
		cmocka_unit_test(patches_stay_shallow),
		cmocka_unit_test(threads_do_not_change_a_sheet),
		cmocka_unit_test(both_sides_are_traced_at_once),
		cmocka_unit_test(random_points_lie_in_their_lattice_triangles),
		cmocka_unit_test(a_sample_is_found_where_it_is),
		cmocka_unit_test(samples_are_added_where_there_is_room),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
