#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdio.h>
#include "level.h"

/* A lattice triangle with sides of at most 1.05 pixels has its middle 0.606 pixels from its corners, and places are
 * tested half a pixel apart at most, so that none is more than 0.354 from one that was. */
#define FARTHEST (0.606 + 0.354)

static const double zero[3];

static struct psr_mesh *dented_sphere(void)
{
	struct psr_mesh *mesh = meshes_sphere(40, zero, 0.9);

	for (uint32_t i = 0; i < mesh->n_vertices; i++) {
		double *p = mesh->position[i], x = p[0] - 0.5, y = p[1] - 0.5;

		v3d_scale(p, p, 1 - 0.2 * exp(-8 * (x * x + y * y)));
		v3f_set(mesh->normal[i], 0, 0, 0);
	}
	return mesh;
}

/* Triangles that cross each other, of all shapes. */
static struct psr_mesh *soup(uint32_t n, double size)
{
	struct psr_mesh *mesh = meshes_new(3 * n, n);
	uint64_t seed = 77;

	for (uint32_t i = 0; i < n; i++) {
		double center[3];

		for (int k = 0; k < 3; k++)
			center[k] = meshes_random(&seed) - 0.5;
		for (uint32_t c = 0; c < 3; c++) {
			for (int k = 0; k < 3; k++)
				mesh->position[3 * i + c][k] = center[k] + size * (meshes_random(&seed) - 0.5);
			mesh->triangle[i][c] = 3 * i + c;
		}
	}
	return mesh;
}

/* Of 100,000 random places, how many are further than this many pixels from all kept samples. */
static int count_far(const struct level_set *set, double pixels, double *farthest)
{
	uint64_t seed = 1;
	int n_far = 0;

	*farthest = 0;
	for (int i = 0; i < 100000; i++) {
		float p[3], n[3];
		double distance;

		level_set_place(set, &seed, p, n);
		distance = level_set_nearest(set, p, n, 4);
		n_far += distance > pixels;
		*farthest = fmax(*farthest, distance);
	}
	return n_far;
}

static void closed_bodies_are_sampled_all_over(void **state)
{
	struct level_set set;
	double farthest;

	(void)state;
	level_set_make(&set, dented_sphere(), 128, 2);
	assert_in_range(count_far(&set, 0.606, &farthest), 0, 100);
	printf("# farthest: %.3f pixels\n", farthest);
	assert_true(farthest <= FARTHEST);
	level_set_close(&set);
}

static void sheets_are_sampled_to_their_edges(void **state)
{
	(void)state;
	for (int two_sided = 0; two_sided < 2; two_sided++) {
		struct psr_mesh *mesh = meshes_square(1);
		struct level_set set;
		double farthest;

		for (uint32_t i = 0; i < mesh->n_vertices; i++)
			v3d_scale(mesh->position[i], mesh->position[i], 0.7);
		mesh->material->two_sided = two_sided;
		level_set_make(&set, mesh, 96, 2);
		assert_in_range(count_far(&set, 0.606, &farthest), 0, 100);
		assert_true(farthest <= FARTHEST);
		level_set_close(&set);
	}
}

/* Of what crosses itself some can be seen through gaps of a fraction of a pixel only: one place in 2,000 may be
 * further than a pixel from what is kept. */
static void a_soup_of_triangles_is_sampled(void **state)
{
	(void)state;
	for (int two_sided = 0; two_sided < 2; two_sided++) {
		struct psr_mesh *mesh = soup(100, 0.5);
		struct level_set set;
		double farthest;

		mesh->material->two_sided = two_sided;
		level_set_make(&set, mesh, 96, 2);
		assert_in_range(count_far(&set, 1, &farthest), 0, 50);
		level_set_close(&set);
	}
}

/* A rectangle around the line from `from` to `to`, which is perpendicular to the unit vector n. */
static void add_strip(struct psr_mesh *mesh, uint32_t i, const double from[3], const double to[3],
                      const double n[3], double width)
{
	double along[3], aside[3];

	v3d_sub(along, to, from);
	v3d_cross(aside, n, along);
	v3d_normalize(aside, aside);
	for (uint32_t c = 0; c < 4; c++)
		for (int k = 0; k < 3; k++)
			mesh->position[4 * i + c][k] = (c == 1 || c == 2 ? to[k] : from[k])
			                               + (c >= 2 ? 0.5 : -0.5) * width * aside[k];
	for (uint32_t t = 0; t < 2; t++) {
		mesh->triangle[2 * i + t][0] = 4 * i;
		mesh->triangle[2 * i + t][1] = 4 * i + 1 + t;
		mesh->triangle[2 * i + t][2] = 4 * i + 2 + t;
	}
}

/* Spokes from the middle to the sphere, in a plane or in all directions. */
static struct psr_mesh *spokes(uint32_t n, double width, int in_plane, uint64_t seed)
{
	struct psr_mesh *mesh = meshes_new(4 * n, 2 * n);
	double frame[3][3] = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } };

	for (uint32_t i = 0; i < n; i++) {
		double direction[3], from[3], to[3];

		if (i == 0 || !in_plane) {
			do {
				for (int k = 0; k < 3; k++)
					direction[k] = 2 * meshes_random(&seed) - 1;
			} while (v3d_dot(direction, direction) > 1 || v3d_normalize(direction, direction) < 0.1);
			psr_direction_basis(direction, frame);
		}
		for (int k = 0; k < 3; k++)
			to[k] = 0.95 * (cos(6.2831853 * i / n) * frame[0][k] + sin(6.2831853 * i / n) * frame[1][k]);
		v3d_scale(from, to, 0.2);
		add_strip(mesh, i, from, to, frame[2], width);
	}
	return mesh;
}

/* Along their middles, on the front: places are tested half a pixel apart at most, and each is in half a pixel of
 * what is kept (nothing else covers what is no pixel wide), so all in between are within 0.75. */
static void check_spokes(const struct level_set *set)
{
	const struct psr_mesh *mesh = set->mesh;

	for (uint32_t i = 0; i < mesh->n_triangles; i += 2) {
		const uint32_t *t = mesh->triangle[i];
		const float *n = ray_scene_normal(set->scene, i);

		for (int step = 0; step <= 400; step++) {
			float p[3];

			for (int k = 0; k < 3; k++)
				p[k] = (float)((mesh->position[t[0]][k] + mesh->position[t[2]][k]) / 2
				               + (step / 400.0 - 0.5) * (mesh->position[t[1]][k] - mesh->position[t[0]][k]));
			assert_true(level_set_nearest(set, p, n, 2) <= 0.75);
		}
	}
}

static void thin_things_have_no_gaps(void **state)
{
	static const struct {
		uint32_t n;
		double width; /* pixels */
		int in_plane, two_sided;
	} set[] = { { 1, 0.1, 0, 0 }, { 1, 0.1, 0, 1 }, { 24, 0.5, 1, 1 }, { 24, 0.2, 1, 0 }, { 20, 0.5, 0, 1 },
		        { 20, 0.1, 0, 0 } };

	(void)state;
	for (size_t i = 0; i < sizeof set / sizeof *set; i++) {
		struct psr_mesh *mesh = spokes(set[i].n, set[i].width * 2 / 96, set[i].in_plane, i + 1);
		struct adequacy adequacy;
		struct level_set made;

		mesh->material->two_sided = set[i].two_sided;
		level_set_make(&made, mesh, 96, 2);
		/* As of level 0: what views find afterwards is added. */
		assert_int_equal(level_reach(&adequacy, &made.level), PSR_OK);
		check_spokes(&made);
		level_set_close(&made);
	}
}

/* Places are tested a third of a pixel apart, from the foot to the tip of each face, and covered by a sample within half a
 * pixel or moved by 0.55: the middle of a face that is thinner than that is within 0.55 + 0.165, and a tenth for its
 * slant. What views have not found is left to adequacy's rounds; it is little. */
static void needles_are_sampled_from_foot_to_tip_on_every_face(void **state)
{
	struct psr_mesh *mesh = meshes_needles(60, 0.3 * 2 / 96);
	struct level_set set;
	uint32_t n_seen = 0;

	(void)state;
	level_set_make(&set, mesh, 96, 2);
	for (uint32_t i = 0; i < mesh->n_triangles; i++) {
		const uint32_t *t = mesh->triangle[i];
		const float *n = ray_scene_normal(set.scene, i);

		for (int step = 0; step <= 100; step++) {
			double x = step / 100.0;
			float p[3];

			for (int k = 0; k < 3; k++)
				p[k] = (float)((1 - x) * (mesh->position[t[0]][k] + mesh->position[t[1]][k]) / 2
				               + x * mesh->position[t[2]][k]);
			if (!visible_set_has(&set.level.visible, p, n))
				continue;
			assert_true(level_set_nearest(&set, p, n, 2) <= 0.815);
			n_seen++;
		}
	}
	assert_true(n_seen > 80 * mesh->n_triangles);
	level_set_close(&set);
}

static void threads_do_not_change_a_sample(void **state)
{
	struct level_set set[3];

	(void)state;
	for (int i = 0; i < 3; i++) {
		level_set_make(&set[i], dented_sphere(), 64, i + 1);
		assert_int_equal(set[i].level.kept.n, set[0].level.kept.n);
		for (uint32_t k = 0; k < set[0].level.kept.n; k++) {
			const struct kept_sample *a = &set[0].level.kept.sample[k], *b = &set[i].level.kept.sample[k];

			assert_memory_equal(a->position, b->position, sizeof a->position);
			assert_true(a->attr == b->attr && a->projection == b->projection && a->patch == b->patch
			            && a->sample == b->sample && a->two_sided == b->two_sided && a->normal == b->normal);
		}
	}
	for (int i = 0; i < 3; i++)
		level_set_close(&set[i]);
}

/* Without area, or hardly any, or all in one place: nothing breaks, and the square among them is sampled. */
static void slivers_are_survived(void **state)
{
	struct psr_mesh *mesh = meshes_new(4 + 300, 2 + 100);
	struct level_set set;
	uint64_t seed = 13;
	const double from[3] = { -0.3, 0, 0.9 }, to[3] = { 0.3, 0, 0.9 };
	float middle[3] = { 0, 0, 0.9f }, up[3] = { 0, 0, 1 };

	(void)state;
	for (uint32_t i = 0; i < 100; i++) {
		double width = i % 4 == 0 ? 0 : pow(10, -12 * meshes_random(&seed));

		for (uint32_t c = 0; c < 3; c++) {
			double *p = mesh->position[4 + 3 * i + c];

			for (int k = 0; k < 3; k++)
				p[k] = c < 2 || i % 4 != 0 ? 0.5 * meshes_random(&seed) * (k == 0 ? 1 : width)
				                           : mesh->position[4 + 3 * i][k];
			mesh->triangle[2 + i][c] = 4 + 3 * i + c;
		}
	}
	add_strip(mesh, 0, from, to, (const double[3]){ 0, 0, 1 }, 0.4);
	level_set_make(&set, mesh, 32, 2);
	assert_true(level_set_nearest(&set, middle, up, 2) <= FARTHEST);
	for (uint32_t i = 0; i < set.level.kept.n; i++)
		for (int k = 0; k < 3; k++)
			assert_true(fabsf(set.level.kept.sample[i].position[k]) < 1.1f);
	level_set_close(&set);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(closed_bodies_are_sampled_all_over),
		cmocka_unit_test(sheets_are_sampled_to_their_edges),
		cmocka_unit_test(a_soup_of_triangles_is_sampled),
		cmocka_unit_test(thin_things_have_no_gaps),
		cmocka_unit_test(needles_are_sampled_from_foot_to_tip_on_every_face),
		cmocka_unit_test(threads_do_not_change_a_sample),
		cmocka_unit_test(slivers_are_survived),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
