#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "base/random.h"
#include "base/vec.h"
#include "dpoint/mesh.h"
#include "dpoint/sample.h"
#include "dpoint/seal.h"
#include "patches.h"
#include "rays.h"

#define SIDE 8 /* squares of the mesh */

/* A rough square: quadrics of its points agree with their neighbours badly. Nothing of it is freed. */
struct rough {
	struct psr_mesh mesh;
	double position[(SIDE + 1) * (SIDE + 1)][3];
	float normal[(SIDE + 1) * (SIDE + 1)][3];
	uint32_t triangle[2 * SIDE * SIDE][3], material[2 * SIDE * SIDE];
};

static void add_normals(struct rough *m)
{
	for (uint32_t t = 0; t < m->mesh.n_triangles; t++) {
		const uint32_t *v = m->triangle[t];
		double a[3], b[3], n[3];

		v3d_sub(a, m->position[v[1]], m->position[v[0]]);
		v3d_sub(b, m->position[v[2]], m->position[v[0]]);
		v3d_cross(n, a, b);
		for (int i = 0; i < 3; i++)
			for (int k = 0; k < 3; k++)
				m->normal[v[i]][k] += (float)n[k];
	}
	for (uint32_t v = 0; v < m->mesh.n_vertices; v++)
		v3f_normalize(m->normal[v], m->normal[v]);
}

static void make_rough(struct rough *m, double height)
{
	uint64_t seed = 5;
	uint32_t n = 0;

	memset(m, 0, sizeof *m);
	for (uint32_t j = 0; j <= SIDE; j++)
		for (uint32_t i = 0; i <= SIDE; i++) {
			const uint32_t v = j * (SIDE + 1) + i;

			v3d_set(m->position[v], i / (double)SIDE - 0.5, j / (double)SIDE - 0.5,
			        random_in(&seed, -0.5, 0.5) * height / SIDE);
			if (i == SIDE || j == SIDE)
				continue;
			memcpy(m->triangle[n++], ((uint32_t[]){ v, v + 1, v + SIDE + 1 }), 12);
			memcpy(m->triangle[n++], ((uint32_t[]){ v + 1, v + SIDE + 2, v + SIDE + 1 }), 12);
		}
	m->mesh = (struct psr_mesh){ .n_vertices = (SIDE + 1) * (SIDE + 1), .n_triangles = n, .position = m->position,
		                         .normal = m->normal, .triangle = m->triangle, .triangle_material = m->material };
	add_normals(m);
}

/* Rays to the middles of cells and near their corners, of 0, 49 and 69.5 degrees to their planes' normals; of cells with
 * two sides of 85.4 as well, which get two and a half times as far. */
static size_t count_through(const struct dpoint_surface *surface, const struct dpoint_choice *choice,
                            const struct dpoint_cover_options *o, int is_behind)
{
	static const double slant[] = { 0.35, 0.65, 0.08 };
	size_t n = 0;

	for (size_t i = 0; i < surface->n_cells; i++) {
		const struct dpoint_cell *cell = &surface->cell[i];
		float a[3], b[3], normal[3], x[3], y[3];

		if (cell->part == DPOINT_BEYOND)
			continue;
		v3f_sub(a, cell->corner[2], cell->corner[0]);
		v3f_sub(b, cell->corner[3], cell->corner[1]);
		v3f_cross(normal, a, b);
		v3f_normalize(normal, normal);
		v3f_scale(normal, normal, (v3f_dot(normal, cell->normal) < 0) != is_behind ? -1 : 1);
		dpoint_tangents(x, y, normal);
		for (int place = 0; place < 5; place++)
			for (int d = -1; d < (o->is_two_sided != NULL ? 24 : 16); d++) {
				const double angle = (d + 0.5) * (6.283185307179586 / 8);
				const double cosine = d < 0 ? 1 : slant[d / 8], sine = sqrt(1 - cosine * cosine);
				const double behind = (d < 16 ? 6.001 : 15.001) * (double)o->height;
				double at[3], w[3];

				for (int k = 0; k < 3; k++) {
					const double middle = 0.25 * ((double)cell->corner[0][k] + cell->corner[1][k] +
					                              cell->corner[2][k] + cell->corner[3][k]);

					at[k] = place == 4 ? middle : middle + 0.9 * (cell->corner[place][k] - middle);
					w[k] = cosine * normal[k] + sine * (cos(angle) * x[k] + sin(angle) * y[k]);
				}
				n += (size_t)gets_through(surface, choice, o, at, w, behind);
			}
	}
	return n;
}

static void check_sealed(const uint8_t *is_two_sided)
{
	const struct dpoint_cover_options options = {
		.sine = dpoint_sine(0.01), .slack = 1e-5f, .angle = 0.06f, .height = 0.002f, .overhang = 5e-4f,
		.is_two_sided = is_two_sided,
	};
	const struct dpoint_mesh_options mesh = { .scale = 1, .cell = 0.1, .delta = 0.25f };
	const int n_sides = is_two_sided != NULL ? 2 : 1;
	struct rough *m = malloc(sizeof *m);
	struct dpoint_surface surface;
	struct dpoint_cover cover;
	struct dpoint_choice choice;
	size_t n_kept;

	assert_non_null(m);
	make_rough(m, 0.6);
	/* Without it some do: else this would test nothing. */
	dpoint_surface_init(&surface);
	assert_int_equal(dpoint_sample_mesh(&surface, &m->mesh, &mesh, NULL), PSR_OK);
	assert_int_equal(dpoint_fit(&surface, &options, NULL, NULL), PSR_OK);
	assert_int_equal(dpoint_cover_init(&cover, &surface, &options, NULL, NULL), PSR_OK);
	assert_int_equal(dpoint_mend(&surface, &cover, &options, NULL, NULL), PSR_OK);
	assert_int_equal(dpoint_choose(&choice, &cover), PSR_OK);
	assert_int_equal(choice.n_holes, 0);
	n_kept = choice.n_kept;
	for (int side = 0; side < n_sides; side++)
		assert_true(count_through(&surface, &choice, &options, side) > 0);
	assert_int_equal(seal(&surface, &choice, &cover, NULL, &options, &(struct dpoint_work){ NULL, NULL }), PSR_OK);
	for (int side = 0; side < n_sides; side++)
		assert_int_equal(count_through(&surface, &choice, &options, side), 0);
	assert_true(choice.n_kept > n_kept && choice.n_kept < surface.n_candidates);
	/* And what is whole gets nothing. */
	n_kept = choice.n_kept;
	assert_int_equal(seal(&surface, &choice, &cover, NULL, &options, &(struct dpoint_work){ NULL, NULL }), PSR_OK);
	assert_int_equal(choice.n_kept, n_kept);
	dpoint_choice_fini(&choice);
	dpoint_cover_fini(&cover);
	dpoint_surface_fini(&surface);
	free(m);
}

static void no_ray_that_is_looked_at_gets_through(void **state)
{
	(void)state;
	check_sealed(NULL);
}

static void none_along_either_of_two_sides_does(void **state)
{
	(void)state;
	check_sealed((const uint8_t[]){ 1 });
}

/* Rays to the middles of a torus's cells along the two lines in which its inner half does not bend, 86 degrees off. */
static size_t count_along(const struct dpoint_surface *surface, const struct dpoint_choice *choice,
                          const struct dpoint_cover_options *o, double out, double r)
{
	size_t n = 0;

	for (size_t i = 0; i < surface->n_cells; i++) {
		float m[3];
		double at[3], round, cosine;

		dpoint_cell_middle(m, &surface->cell[i]);
		for (int k = 0; k < 3; k++)
			at[k] = m[k];
		round = hypot(at[0], at[1]);
		cosine = (round - out) / r;
		if (cosine > -0.2)
			continue;
		for (int d = 0; d < 4; d++) {
			const double normal[3] = { cosine * at[0] / round, cosine * at[1] / round, at[2] / r };
			const double around[3] = { -at[1] / round, at[0] / round, 0 };
			const double ratio = sqrt(-cosine * r / (out + r * cosine)); /* along the tube, for 1 around the axis */
			double tube[3], w[3];

			v3d_cross(tube, normal, around);
			for (int k = 0; k < 3; k++)
				w[k] = (d & 1 ? 1 : -1) * around[k] + (d & 2 ? ratio : -ratio) * tube[k];
			v3d_normalize(w, w);
			for (int k = 0; k < 3; k++)
				w[k] = 0.07 * normal[k] + sqrt(1 - 0.07 * 0.07) * w[k];
			n += (size_t)gets_through(surface, choice, o, at, w, 15.001 * (double)o->height);
		}
	}
	return n;
}

static void none_along_a_saddle_does(void **state)
{
	const double out = 0.6, r = 0.3;
	const struct dpoint_cover_options options = {
		.sine = dpoint_sine(0.02), .slack = 2e-5f, .angle = 0.1f, .height = 0.002f, .overhang = 5e-4f,
	};
	const struct dpoint_uniform uniform = { .n = 16, .cells = 2, .scale = 1, .delta = 0.125f, .sine = options.sine };
	struct revolved torus;
	struct dpoint_surface surface;
	struct dpoint_cover cover;
	struct dpoint_choice choice;

	(void)state;
	revolve(&torus, out, r, 0, 9);
	dpoint_surface_init(&surface);
	assert_int_equal(dpoint_sample_uniform(&surface, &torus.patch, &uniform), PSR_OK);
	assert_int_equal(dpoint_fit(&surface, &options, NULL, NULL), PSR_OK);
	assert_int_equal(dpoint_cover_init(&cover, &surface, &options, NULL, NULL), PSR_OK);
	assert_int_equal(dpoint_mend(&surface, &cover, &options, NULL, NULL), PSR_OK);
	assert_int_equal(dpoint_choose(&choice, &cover), PSR_OK);
	assert_true(count_along(&surface, &choice, &options, out, r) > 0);
	assert_int_equal(seal(&surface, &choice, &cover, NULL, &options, &(struct dpoint_work){ NULL, NULL }), PSR_OK);
	assert_int_equal(count_along(&surface, &choice, &options, out, r), 0);
	dpoint_choice_fini(&choice);
	dpoint_cover_fini(&cover);
	dpoint_surface_fini(&surface);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(no_ray_that_is_looked_at_gets_through),
		cmocka_unit_test(none_along_a_saddle_does),
		cmocka_unit_test(none_along_either_of_two_sides_does),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
