#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdio.h>
#include "level.h"

#define DEGREE 0.017453292519943295

static const double zero[3];

static void no_direction_is_far_from_all_projections(void **state)
{
	struct psr_projection projection[N_PROJECTIONS];
	uint64_t seed = 21;

	(void)state;
	projection_list(projection, 1, TOLERANCE);
	for (int i = 0; i < 200000; i++) {
		float direction[3], most = -1;

		do
			for (int k = 0; k < 3; k++)
				direction[k] = (float)(2 * meshes_random(&seed) - 1);
		while (v3f_dot(direction, direction) > 1 || v3f_normalize(direction, direction) < 0.1f);
		for (int q = 0; q < N_PROJECTIONS; q++)
			most = fmaxf(most, v3f_dot(direction, projection[q].axis[2]));
		assert_true((double)most > cos(22.7 * DEGREE));
	}
}

/* Normals are smoothed over a few pixels. Those of a sphere are turned by no more than half the angle that what is
 * mixed spans: cells of 3 pixels, eight of them around a place, 1.5 sqrt(3) of them away at most. The facets are 1.5
 * degrees wide. */
static void places_of_a_sphere_belong_to_who_faces_them(void **state)
{
	(void)state;
	for (uint32_t resolution = 64; resolution <= 256; resolution *= 2) {
		struct level_set set;
		uint64_t seed = 3;
		double blur;

		level_set_make(&set, meshes_sphere(120, zero, 0.9), resolution, 2);
		blur = 1.5 * sqrt(3) * 3 * set.level.sampling.ds / 0.9 / 2 + 1.1 * DEGREE;
		for (int i = 0; i < 50000; i++) {
			float p[3], n[3], up[3];
			unsigned owner;

			level_set_place(&set, &seed, p, n);
			owner = owner_of(&set.level.sampling, &set.level.field, p, n);
			assert_true(owner < N_PROJECTIONS);
			v3f_normalize(up, p);
			assert_true((double)v3f_dot(up, set.level.sampling.projection[owner].axis[2]) > cos(22.7 * DEGREE + blur));
		}
		level_set_close(&set);
	}
}

/* What a sample stands for: a cell of its lattice, as large as it is on the surface. The sum is the whole area when
 * each place is owned once. Where owners meet, gap or overlap is no wider than a pixel: 32 regions of area 4 pi 0.9^2
 * / 32, taken for round, have borders of 32 in all, each of them two regions'. Of these few would make blocks of less
 * than a quarter: merged; and none a block of a single sample. */
static void places_of_a_sphere_are_owned_once(void **state)
{
	struct level_set set;
	double area = 0;
	int n_blocks = 0, n_few = 0;

	(void)state;
	level_set_open(&set, meshes_sphere(120, zero, 0.9), 192, 2);
	assert_int_equal(level_own(&set.level, NULL), PSR_OK);
	level_merge(&set.level);
	assert_int_equal(level_keep(&set.level), PSR_OK);
	for (unsigned i = 0; i < N_PROJECTIONS; i++) {
		const struct sheets *sheets = &set.level.sheets[i];
		double spacing = (double)sheets->projection.spacing;

		for (uint32_t p = 0; p < sheets->n_patches; p++) {
			const struct patch *patch = &sheets->patch[p];
			uint64_t owned = set.level.ownership.patch[i][p].mask;

			assert_int_equal(owned & ~patch->mask, 0);
			assert_int_equal(owned & ~patch->kept, 0);
			assert_int_not_equal(__builtin_popcountll(owned), 1);
			n_blocks += owned != 0;
			n_few += owned != 0 && __builtin_popcountll(owned) < 16;
			for (uint64_t left = owned; left != 0; left &= left - 1) {
				float n[3];

				sampling_normal(&set.level.sampling, sheets->sample[p][__builtin_ctzll(left)].surface, n);
				area += spacing * spacing * 0.8660254 / (double)v3f_dot(n, sheets->projection.axis[2]);
			}
		}
	}
	printf("# %.4f of the area; %d of %d blocks own less than a quarter\n", area / (4 * 3.14159265 * 0.81),
	       n_few, n_blocks);
	assert_true(fabs(area - 4 * 3.14159265 * 0.81) < 32 * set.level.sampling.ds);
	assert_true(20 * n_few < n_blocks);
	level_set_close(&set);
}

/* Away from its edges a face has one owner, the one that faces it best, and its lattice is all that is kept: as many
 * points as the area has cells, give or take those along the border. */
static void flat_faces_have_one_owner(void **state)
{
	const double half = 0.55;
	struct level_set set;
	double inside;
	int n[6] = { 0 };
	unsigned owner[6];

	(void)state;
	level_set_make(&set, meshes_box(half, 0), 128, 2);
	inside = half - 10 * set.level.sampling.ds;
	for (int f = 0; f < 6; f++) {
		float sign = f % 2 == 0 ? -1 : 1;

		owner[f] = 0;
		for (unsigned q = 1; q < N_PROJECTIONS; q++)
			if (sign * set.level.sampling.projection[q].axis[2][f / 2] > sign * set.level.sampling.projection[owner[f]].axis[2][f / 2])
				owner[f] = q;
	}
	for (uint32_t i = 0; i < set.level.kept.n; i++) {
		const struct kept_sample *sample = &set.level.kept.sample[i];

		for (int k = 0; k < 3; k++) {
			int f = 2 * k + (sample->position[k] > 0);

			if (fabs((double)sample->position[k]) < half - 1e-6 || fabs((double)sample->position[(k + 1) % 3]) > inside
			    || fabs((double)sample->position[(k + 2) % 3]) > inside)
				continue;
			assert_int_equal(sample->projection, owner[f]);
			n[f]++;
		}
	}
	for (int f = 0; f < 6; f++) {
		double spacing = (double)set.level.sampling.projection[owner[f]].spacing;
		double cosine = fabs((double)set.level.sampling.projection[owner[f]].axis[2][f / 2]);
		double cells = 4 * inside * inside * cosine / (spacing * spacing * 0.8660254);

		assert_true(fabs(n[f] - cells) < 4 * sqrt(cells));
	}
	level_set_close(&set);
}

/* From the front, wherever it is seen from. */
static void a_sheet_is_sampled_once(void **state)
{
	struct level_set set;

	(void)state;
	for (int two_sided = 0; two_sided < 2; two_sided++) {
		struct psr_mesh *mesh = meshes_square(1);

		for (uint32_t i = 0; i < mesh->n_vertices; i++)
			v3d_scale(mesh->position[i], mesh->position[i], 0.7);
		mesh->material->two_sided = two_sided;
		level_set_make(&set, mesh, 96, 2);
		for (uint32_t i = 0; i < set.level.kept.n; i++) {
			const struct kept_sample *sample = &set.level.kept.sample[i];
			const struct sheets *sheets = &set.level.sheets[sample->projection];

			assert_int_equal(sheets->sample[sample->patch][sample->sample].surface & SURFACE_BACK, 0);
			assert_true(psr_direction_table()[sample->normal][2] > 0);
			assert_int_equal(sample->two_sided, two_sided);
		}
		level_set_close(&set);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(no_direction_is_far_from_all_projections),
		cmocka_unit_test(places_of_a_sphere_belong_to_who_faces_them),
		cmocka_unit_test(places_of_a_sphere_are_owned_once),
		cmocka_unit_test(flat_faces_have_one_owner),
		cmocka_unit_test(a_sheet_is_sampled_once),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
