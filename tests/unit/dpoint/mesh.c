#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "base/vec.h"
#include "dpoint/mesh.h"
#include "dpoint/sample.h"
#include "patches.h"

#define OVERHANG 0.001f

/* A mesh of arrays of the test's: nothing of it is freed. */
struct grid_mesh {
	struct psr_mesh mesh;
	double position[2500][3];
	float normal[2500][3];
	uint32_t triangle[5000][3], material[5000];
};

static void use(struct grid_mesh *m, uint32_t n_vertices, uint32_t n_triangles)
{
	memset(&m->mesh, 0, sizeof m->mesh);
	memset(m->material, 0, sizeof m->material);
	m->mesh.n_vertices = n_vertices;
	m->mesh.n_triangles = n_triangles;
	m->mesh.position = m->position;
	m->mesh.normal = m->normal;
	m->mesh.triangle = m->triangle;
	m->mesh.triangle_material = m->material;
}

/* A sphere of radius 1 by longitudes and latitudes, without its caps, or a torus. */
static void round_mesh(struct grid_mesh *m, int is_torus, int n)
{
	uint32_t n_triangles = 0;

	for (int i = 0; i <= n; i++)
		for (int j = 0; j <= n; j++) {
			const double a = i == n ? 0 : 6.283185307179586 * i / n;
			const double b = is_torus ? (j == n ? 0 : 6.283185307179586 * j / n) : -1 + 2.0 * j / n;
			const double out = is_torus ? 1 : 0, r = is_torus ? 0.4 : 1;
			const uint32_t v = (uint32_t)(i * (n + 1) + j);
			const double normal[3] = { cos(a) * cos(b), sin(a) * cos(b), sin(b) };

			for (int k = 0; k < 3; k++)
				m->normal[v][k] = (float)normal[k];
			v3d_set(m->position[v], cos(a) * (out + r * cos(b)), sin(a) * (out + r * cos(b)), r * sin(b));
			if (i == n || j == n)
				continue;
			memcpy(m->triangle[n_triangles++], ((uint32_t[]){ v, v + (uint32_t)n + 1, v + 1 }), 12);
			memcpy(m->triangle[n_triangles++], ((uint32_t[]){ v + 1, v + (uint32_t)n + 1, v + (uint32_t)n + 2 }), 12);
		}
	use(m, (uint32_t)((n + 1) * (n + 1)), n_triangles);
}

static void cube_mesh(struct grid_mesh *m)
{
	static const uint32_t triangle[12][3] = {
		{ 0, 2, 1 }, { 1, 2, 3 }, { 4, 5, 6 }, { 5, 7, 6 }, { 0, 1, 4 }, { 1, 5, 4 },
		{ 2, 6, 3 }, { 3, 6, 7 }, { 0, 4, 2 }, { 2, 4, 6 }, { 1, 3, 5 }, { 3, 7, 5 },
	};

	for (int i = 0; i < 8; i++) {
		v3d_set(m->position[i], i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5);
		v3f_set(m->normal[i], 0, 0, 0);
	}
	memcpy(m->triangle, triangle, sizeof triangle);
	use(m, 8, 12);
}

static void sample(struct dpoint_surface *surface, const struct grid_mesh *m, double cell, float delta)
{
	const struct dpoint_mesh_options options = { .scale = 1, .cell = cell, .delta = delta };

	dpoint_surface_init(surface);
	assert_int_equal(dpoint_sample_mesh(surface, &m->mesh, &options, NULL), PSR_OK);
}

/* Corners have the exact shape within the ring's first order; pieces lie on chords, and their normals between. */
static void pieces_of_round_meshes_have_their_curvatures(void **state)
{
	struct grid_mesh *m = malloc(sizeof *m);

	(void)state;
	assert_non_null(m);
	for (int is_torus = 0; is_torus < 2; is_torus++) {
		struct dpoint_surface surface;
		double sum = 0;

		round_mesh(m, is_torus, 48);
		sample(&surface, m, 1, 1);
		assert_int_equal(surface.n_bad, 0);
		assert_int_equal(surface.n_candidates, 2 * 48 * 48);
		for (size_t i = 0; i < surface.n_candidates; i++) {
			const struct dpoint *p = &surface.candidate[i].point;
			const double away = hypot(p->at[0], p->at[1]);
			const double exact[2] = { is_torus ? -2.5 : -1, is_torus ? -(away - 1) / 0.4 / away : -1 };

			sum += pow(p->lambda_u - exact[0], 2) + pow(p->lambda_u * p->rho - exact[1], 2);
		}
		/* A word has 5.9 % of lambda_u, and 1/126 of that of rho. Triangles of h = 0.13 at most have the error of the
		 * ring's order at most: (h / r)^2 = 0.02 to 0.1 of the curvature where all is symmetric. */
		sum = sqrt(sum / (2 * (double)surface.n_candidates));
		assert_true(sum < (is_torus ? 2.5 : 1) * (0.059 + 1.0 / 126 + 0.05));
		dpoint_surface_fini(&surface);
	}
	free(m);
}

static void choose_all(struct dpoint_surface *surface, struct dpoint_cover *cover, struct dpoint_choice *choice,
                       const struct dpoint_cover_options *options)
{
	assert_int_equal(dpoint_fit(surface, options, NULL, NULL), PSR_OK);
	assert_int_equal(dpoint_cover_init(cover, surface, options, NULL, NULL), PSR_OK);
	assert_int_equal(dpoint_mend(surface, cover, options, NULL, NULL), PSR_OK);
	assert_int_equal(dpoint_choose(choice, cover), PSR_OK);
	assert_int_equal(choice->n_holes, 0);
}

/* A rectangle ends at the edges: nothing of it is outside of the cube by more than it may reach over twice, once as it
 * grows and once as its point moves, but for its tilt. A candidate that mends a hole reaches over by its cell. */
static void no_extent_crosses_an_edge(void **state)
{
	const struct dpoint_cover_options options = {
		.sine = dpoint_sine(0.01), .slack = 1e-5f, .angle = 0.05f, .height = 0.005f, .overhang = OVERHANG,
	};
	struct grid_mesh *m = malloc(sizeof *m);

	(void)state;
	assert_non_null(m);
	for (int is_square = 0; is_square < 2; is_square++) {
		struct dpoint_surface surface;
		struct dpoint_cover cover;
		struct dpoint_choice choice;
		size_t n_before;
		double largest = 0;

		cube_mesh(m);
		m->mesh.n_triangles = is_square ? 2 : 12; /* the face at z = -0.5, with borders */
		sample(&surface, m, 0.05, 0.25f);
		n_before = surface.n_candidates;
		choose_all(&surface, &cover, &choice, &options);
		for (size_t i = 0; i < surface.n_candidates; i++) {
			const struct dpoint_candidate *c = &surface.candidate[i];
			const double over = i < n_before ? 2 * OVERHANG + 0.25 * 0.012 : 0.05;
			float v[3];

			if (!choice.is_kept[i])
				continue;
			v3f_cross(v, c->point.normal, c->point.u);
			assert_true(c->point.lambda_u == 0);
			largest = fmax(largest, c->delta[0] * c->delta[1]);
			for (int corner = 0; corner < 4; corner++) {
				float at[3];

				v3f_add_scaled(at, c->point.at, corner & 1 ? c->delta[0] : -c->delta[0], c->point.u);
				v3f_add_scaled(at, at, corner & 2 ? c->delta[1] : -c->delta[1], v);
				for (int k = 0; k < 3; k++)
					assert_true(fabsf(at[k]) <= 0.5 + over);
			}
		}
		/* And inside of the faces rectangles are as large as they may be. */
		assert_true(largest == 0.25 * 0.25);
		assert_true(choice.n_kept * 4 < n_before);
		dpoint_choice_fini(&choice);
		dpoint_cover_fini(&cover);
		dpoint_surface_fini(&surface);
	}
	free(m);
}

#define CUT_OUT 0.2

static int is_beside_cut_out(void *userdata, uint32_t triangle, double u, double v, uint64_t *attr)
{
	const struct grid_mesh *m = userdata;
	const uint32_t *corner = m->triangle[triangle];
	double at[3];

	for (int k = 0; k < 3; k++)
		at[k] = (1 - u - v) * m->position[corner[0]][k] + u * m->position[corner[1]][k] + v * m->position[corner[2]][k];
	*attr = 0;
	return !(fabs(at[0]) < CUT_OUT && fabs(at[1]) < CUT_OUT);
}

/* A piece is there if its middle is, so what is there ends within a piece, 1.5 grains; rectangles reach over that as
 * over a border, and those that mend by a cell, which is no larger. */
static void no_extent_crosses_what_is_cut_out(void **state)
{
	const struct dpoint_cover_options options = {
		.sine = dpoint_sine(0.01), .slack = 1e-5f, .angle = 0.05f, .height = 0.005f, .overhang = OVERHANG,
	};
	const double grain = 0.01, inside = CUT_OUT - 2 * 1.5 * grain - 2 * (double)OVERHANG - 0.25 * 0.012;
	struct grid_mesh *m = malloc(sizeof *m);
	struct psr_material material = { .alpha = PSR_ALPHA_MASK };
	const struct dpoint_mesh_options mesh = { .scale = 1, .cell = 0.05, .delta = 0.25f, .grain_of = &grain,
		                                      .look = is_beside_cut_out, .userdata = m };
	struct dpoint_surface surface;
	struct dpoint_cover cover;
	struct dpoint_choice choice;
	size_t n_facets = 0;

	(void)state;
	assert_non_null(m);
	cube_mesh(m);
	m->mesh.n_triangles = 2;
	m->mesh.material = &material;
	dpoint_surface_init(&surface);
	assert_int_equal(dpoint_sample_mesh(&surface, &m->mesh, &mesh, NULL), PSR_OK);
	choose_all(&surface, &cover, &choice, &options);
	for (size_t i = 0; i < surface.n_candidates; i++) {
		const struct dpoint_candidate *c = &surface.candidate[i];
		float v[3];

		v3f_cross(v, c->point.normal, c->point.u);
		for (int place = 0; place < 21 * 21 && choice.is_kept[i]; place++) {
			float at[3];

			v3f_add_scaled(at, c->point.at, c->delta[0] * (float)(place % 21 - 10) / 10, c->point.u);
			v3f_add_scaled(at, at, c->delta[1] * (float)(place / 21 - 10) / 10, v);
			assert_false(fabs((double)at[0]) < inside && fabs((double)at[1]) < inside);
		}
	}
	/* Nor is there a facet. */
	for (size_t f = 0; f < surface.facets.n; f++) {
		double middle[2] = { 0, 0 };

		for (int i = 0; i < 3; i++)
			for (int k = 0; k < 2; k++)
				middle[k] += (double)surface.facets.facet[f].corner[i][k] / 3;
		n_facets += fabs(middle[0]) < inside && fabs(middle[1]) < inside;
	}
	assert_int_equal(n_facets, 0);
	dpoint_choice_fini(&choice);
	dpoint_cover_fini(&cover);
	dpoint_surface_fini(&surface);
	free(m);
}

/* After the fit, what is under a rectangle suits it: normals are within the angle wherever the surface goes on. */
static void under_a_fitted_rectangle_normals_are_within_the_angle(void **state)
{
	const struct dpoint_cover_options options = {
		.sine = dpoint_sine(0.2), .slack = 1e-5f, .angle = 0.06f, .height = 0.01f, .overhang = OVERHANG,
	};
	struct dpoint_surface surface;
	struct revolved torus;
	size_t n = 0;
	const struct dpoint_uniform uniform = { 10, 2, { 0, 0, 0 }, 1, 0.5f, 0, 0, 0 };

	(void)state;
	revolve(&torus, 1, 0.4, 0, 9);
	dpoint_surface_init(&surface);
	assert_int_equal(dpoint_sample_uniform(&surface, &torus.patch, &uniform), PSR_OK);
	assert_int_equal(dpoint_fit(&surface, &options, NULL, NULL), PSR_OK);
	for (size_t i = 0; i < surface.n_candidates; i += 5) {
		const struct dpoint_candidate *c = &surface.candidate[i];
		const struct dpoint_limit limit = { options.sine, { c->delta[0], c->delta[1] } };
		float extent[2], v[3];

		dpoint_extent(extent, &c->point, &limit);
		v3f_cross(v, c->point.normal, c->point.u);
		for (size_t k = 0; k < surface.n_cells; k++) {
			const struct dpoint_cell *cell = &surface.cell[k];
			float middle[3] = { 0, 0, 0 }, inside = INFINITY, n_here[3], normal[3];

			for (int corner = 0; corner < 4; corner++) {
				float away[3];

				v3f_sub(away, cell->corner[corner], c->point.at);
				const float p[3] = { v3f_dot(away, c->point.u), v3f_dot(away, v), v3f_dot(away, c->point.normal) };
				v3f_add_scaled(middle, middle, 0.25f, p);
				inside = fminf(inside, fminf(extent[0] - fabsf(p[0]), extent[1] - fabsf(p[1])));
			}
			v3f_set(normal, v3f_dot(cell->normal, c->point.u), v3f_dot(cell->normal, v),
			        v3f_dot(cell->normal, c->point.normal));
			if (inside < 2 * OVERHANG || normal[2] < 0 || fabsf(middle[2]) > 0.2f)
				continue;
			dpoint_normal_at(n_here, c->point.lambda_u, c->point.rho, middle[0], middle[1]);
			v3f_normalize(n_here, n_here);
			assert_true(v3f_dot(n_here, normal) >= cosf(options.angle) - 1e-6f);
			n++;
		}
	}
	assert_true(n > surface.n_candidates);
	dpoint_surface_fini(&surface);
}

static void two_turns_cover_all_with_little_more(void **state)
{
	const struct dpoint_cover_options options = {
		.sine = dpoint_sine(0.03), .slack = 1e-5f, .angle = 0.06f, .height = 0.01f, .overhang = OVERHANG,
	};
	const struct dpoint_uniform uniform = { 16, 1, { 0, 0, 0 }, 1, 0.5f, 0, 0, 0 };
	struct revolved torus;
	size_t n_kept[2];

	(void)state;
	revolve(&torus, 1, 0.4, 0, 9);
	for (int i = 0; i < 2; i++) {
		struct dpoint_surface surface;
		struct dpoint_cover cover;
		struct dpoint_choice choice;

		dpoint_surface_init(&surface);
		assert_int_equal(dpoint_sample_uniform(&surface, &torus.patch, &uniform), PSR_OK);
		assert_int_equal(dpoint_simplify(&choice, &cover, &surface, &options, i == 0 ? 1 : 4, NULL, NULL), PSR_OK);
		assert_int_equal(choice.n_holes, 0);
		n_kept[i] = choice.n_kept;
		assert_true(i == 0 ? surface.n_candidates >= 4096 : surface.n_candidates < 2048);
		dpoint_choice_fini(&choice);
		dpoint_cover_fini(&cover);
		dpoint_surface_fini(&surface);
	}
	assert_true(n_kept[1] < n_kept[0] * 3 / 2);
}

static void mending_leaves_no_hole(void **state)
{
	/* Extents of 0.02 r where candidates are 0.1 r apart. */
	const struct dpoint_cover_options options = { .sine = 0.02f, .slack = 1e-5f, .angle = 0.05f, .height = 0.001f };
	struct grid_mesh *m = malloc(sizeof *m);
	struct dpoint_surface surface;
	struct dpoint_cover cover;
	struct dpoint_choice choice;

	(void)state;
	assert_non_null(m);
	round_mesh(m, 1, 40);
	sample(&surface, m, 1, 1);
	assert_int_equal(dpoint_cover_init(&cover, &surface, &options, NULL, NULL), PSR_OK);
	assert_int_equal(dpoint_choose(&choice, &cover), PSR_OK);
	assert_true(choice.n_holes > surface.n_cells / 2);
	dpoint_choice_fini(&choice);
	assert_int_equal(dpoint_mend(&surface, &cover, &options, NULL, NULL), PSR_OK);
	assert_int_equal(dpoint_choose(&choice, &cover), PSR_OK);
	assert_int_equal(choice.n_holes, 0);
	dpoint_choice_fini(&choice);
	dpoint_cover_fini(&cover);
	dpoint_surface_fini(&surface);
	free(m);
}

/* Mends a lone cell of a surface that is one facet. */
static void mend_one(struct dpoint_candidate *out, const float corner[4][3], const float normal[3],
                     const float facet[3][3])
{
	const struct dpoint_cover_options options = { .sine = 0.02f, .slack = 1e-5f, .angle = 0.05f, .height = 0.001f };
	struct dpoint_surface surface;
	struct dpoint_cover cover;
	struct dpoint_cell *cell;

	dpoint_surface_init(&surface);
	cell = dpoint_surface_cell(&surface);
	assert_non_null(cell);
	memset(cell, 0, sizeof *cell);
	memcpy(cell->corner, corner, sizeof cell->corner);
	memcpy(cell->normal, normal, sizeof cell->normal);
	assert_int_equal(facets_add(&surface.facets, facet[0], facet[1], facet[2]), PSR_OK);
	assert_int_equal(facets_sort(&surface.facets), PSR_OK);
	assert_int_equal(dpoint_cover_init(&cover, &surface, &options, NULL, NULL), PSR_OK);
	assert_int_equal(dpoint_mend(&surface, &cover, &options, NULL, NULL), PSR_OK);
	assert_int_equal(surface.n_candidates, 1);
	assert_int_equal(dpoint_cover_size(&cover, 0), 1);
	*out = surface.candidate[0];
	dpoint_cover_fini(&cover);
	dpoint_surface_fini(&surface);
}

/* Of a cell whose surface leans by 30 degrees from its plane, that is within the facets: a point in the plane stays on
 * them, one that leans as the surface is a fortieth off at the ends. */
static void mending_stays_nearest(void **state)
{
	static const float corner[4][3] = { { 0, 0, 0 }, { 0.1f, 0, 0 }, { 0.1f, 0.1f, 0 }, { 0, 0.1f, 0 } };
	static const float facet[3][3] = { { -1, -1, 0 }, { 3, -1, 0 }, { -1, 3, 0 } };
	static const float leaning[3] = { 0.5f, 0, 0.8660254f };
	struct dpoint_candidate point;

	(void)state;
	mend_one(&point, corner, leaning, facet);
	assert_true(point.point.normal[2] > 0.99f);
}

/* A slanted piece, whose surface ends below its short side, or above: a rectangle along its longest sides, at 59 degrees
 * to the edge, would reach beyond it by 0.0353. One along the edge covers the piece, too. That reaches 0.05 down to the
 * edge and 0.07 aside, rounded up: 0.015 of both together, 19 % of a class, and pi / 256 of a turn of the sides. */
static void mending_ends_at_a_slanted_edge(void **state)
{
	static const float upright[3] = { 0, 0, 1 };
	static const float piece[4][2] = { { 0, 0 }, { 0.08f, 0 }, { 0.14f, 0.1f }, { 0.06f, 0.1f } };
	const double over = 1.19 * (0.05 + 0.015 * 0.12 + 0.07 * 1.19 * 3.1416 / 256) - 0.05;

	(void)state;
	assert_true(over < 0.015);
	for (int is_above = 0; is_above < 2; is_above++)
		for (int first = 0; first < 4; first++) { /* whichever corner comes first */
			const float end = is_above ? 0.1f : 0, far = is_above ? -6 : 6;
			const float facet[3][3] = { { is_above ? 6 : -6, end, 0 }, { is_above ? -6 : 6, end, 0 }, { 0, far, 0 } };
			struct dpoint_candidate c;
			float corner[4][3], v[3];

			for (int i = 0; i < 4; i++)
				v3f_set(corner[i], piece[(i + first) % 4][0], piece[(i + first) % 4][1], 0);
			mend_one(&c, (const float(*)[3])corner, upright, facet);
			v3f_cross(v, c.point.normal, c.point.u);
			for (int i = 0; i < 4; i++) {
				float at[3];

				v3f_add_scaled(at, c.point.at, i & 1 ? c.delta[0] : -c.delta[0], c.point.u);
				v3f_add_scaled(at, at, i & 2 ? c.delta[1] : -c.delta[1], v);
				assert_true(is_above ? at[1] <= 0.1 + over : at[1] >= -over);
			}
		}
}

static double area_of(const struct dpoint_cell *cell)
{
	double sum[3] = { 0, 0, 0 };

	for (int i = 1; i < 3; i++) {
		double a[3], b[3], n[3];

		for (int k = 0; k < 3; k++) {
			a[k] = (double)cell->corner[i][k] - (double)cell->corner[0][k];
			b[k] = (double)cell->corner[i + 1][k] - (double)cell->corner[0][k];
		}
		v3d_cross(n, a, b);
		v3d_add_scaled(sum, sum, 0.5, n);
	}
	return v3d_length(sum);
}

/* A triangle of sides 1 and 1/100 is cut along the long ones alone, into 101 parts: the longest is a little over 1. One
 * of 1 and 0.035 has four rows of 104, 78, 52 and 26. Areas are the triangle's; places are floats of at most 1. */
static void narrow_triangles_have_pieces_that_are_not(void **state)
{
	static const struct narrow {
		double across;
		size_t n;
	} narrow[] = { { 0.01, 101 }, { 0.035, 260 } };
	struct grid_mesh *m = malloc(sizeof *m);

	(void)state;
	assert_non_null(m);
	for (size_t i = 0; i < 2; i++)
		for (int turned = 0; turned < 6; turned++) {
			const double at[3][3] = { { 0, 0, 0 }, { 1, 0, 0 }, { 0, narrow[i].across, 0 } };
			struct dpoint_surface surface;
			double area = 0;
			size_t n = 0;

			for (int k = 0; k < 3; k++) {
				memcpy(m->position[k], at[turned < 3 ? (k + turned) % 3 : (turned - k) % 3], sizeof at[0]);
				v3f_set(m->normal[k], 0, 0, 1);
				m->triangle[0][k] = (uint32_t)k;
			}
			use(m, 3, 1);
			sample(&surface, m, 0.01, 0.1f);
			for (size_t c = 0; c < surface.n_cells; c++) {
				if (surface.cell[c].part == DPOINT_BEYOND)
					continue;
				area += area_of(&surface.cell[c]);
				n++;
			}
			assert_int_equal(n, narrow[i].n);
			assert_true(fabs(area - 0.5 * narrow[i].across) <= 1e-6 * narrow[i].across + (double)n * 1e-8);
			dpoint_surface_fini(&surface);
		}
	free(m);
}

/* A torus whose tube has a radius of 0.4: normals turn by 0.1 along 0.04 of it, and along 0.14 of its outside, which is
 * 1.4 away from the axis. Cells of 0.2 are cut until their sides are no longer, or to a quarter: 0.05, whose diagonal
 * is 1.42 times as long. */
static void pieces_are_cut_where_normals_turn(void **state)
{
	const double most = 0.1;
	struct grid_mesh *m = malloc(sizeof *m);
	size_t n[2];

	(void)state;
	assert_non_null(m);
	round_mesh(m, 1, 40);
	for (int k = 0; k < 2; k++) {
		const struct dpoint_mesh_options options = { .scale = 1, .cell = 0.2, .delta = 0.1f, .turn = k * most };
		struct dpoint_surface surface;

		dpoint_surface_init(&surface);
		assert_int_equal(dpoint_sample_mesh(&surface, &m->mesh, &options, NULL), PSR_OK);
		n[k] = surface.n_cells;
		for (size_t c = 0; c < surface.n_cells && k == 1; c++)
			for (int i = 0; i < 4; i++) {
				double side[3];

				for (int j = 0; j < 3; j++)
					side[j] = (double)surface.cell[c].corner[(i + 1) % 4][j] - (double)surface.cell[c].corner[i][j];
				/* Chords of 1/40 of a turn bend normals by up to 1.01 of what the torus does. */
				assert_true(v3d_length(side) <= 1.01 * 1.4 * most || v3d_length(side) <= 0.2 / 4 * 1.5);
			}
		dpoint_surface_fini(&surface);
	}
	assert_true(n[1] > 2 * n[0]);
	free(m);
}

static void too_many_pieces_are_refused(void **state)
{
	const struct dpoint_mesh_options options = { .scale = 1, .cell = 1e-5, .delta = 1 };
	struct grid_mesh *m = malloc(sizeof *m);
	struct dpoint_surface surface;
	struct psr_error err;

	(void)state;
	assert_non_null(m);
	cube_mesh(m);
	dpoint_surface_init(&surface);
	assert_int_equal(dpoint_sample_mesh(&surface, &m->mesh, &options, &err), PSR_ERR_LIMIT);
	assert_non_null(strstr(err.text, "pieces"));
	dpoint_surface_fini(&surface);
	free(m);
}

/* The counts are those of the header, and nothing was cut. */
static void what_is_too_much_is_refused_before_it_is_cut(void **state)
{
	const struct limit {
		double cell, grain;
		const char *says;
	} limit[] = { { 1.4143 / 4097, 0, "a side of" }, { 1.4143 / 1500, 0, "pieces" }, { 1, 1.4143 / 4096, "looked at" } };
	struct grid_mesh *m = malloc(sizeof *m);

	(void)state;
	assert_non_null(m);
	cube_mesh(m);
	memcpy(m->triangle[12], m->triangle[0], 12 * sizeof *m->triangle);
	m->mesh.n_triangles = 24;
	for (size_t i = 0; i < sizeof limit / sizeof *limit; i++) {
		const struct dpoint_mesh_options options = { .scale = 1, .cell = limit[i].cell, .delta = 0.1f,
			                                         .grain_of = &limit[i].grain };
		struct dpoint_surface surface;
		struct psr_error err = { 0 };

		dpoint_surface_init(&surface);
		assert_int_equal(dpoint_sample_mesh(&surface, &m->mesh, &options, &err), PSR_ERR_LIMIT);
		assert_non_null(strstr(err.text, limit[i].says));
		assert_int_equal(surface.n_cells, 0);
		dpoint_surface_fini(&surface);
	}
	free(m);
}

/* Every other triangle has so much red. */
static int look_checked(void *userdata, uint32_t triangle, double u, double v, uint64_t *attr)
{
	const int red = *(const int *)userdata;

	(void)u;
	(void)v;
	*attr = triangle % 2 ? (uint64_t)red << 16 : 0;
	return 1;
}

/* Candidates of a torus cover nothing. Cells whose neighbours look like them get flat points, others bent ones. */
static void what_mends_is_bent_where_looks_differ(void **state)
{
	static const struct dpoint_cover_options options = {
		.sine = 0.2f, .slack = 1e-5f, .angle = 0.1f, .height = 0.004f, .overhang = OVERHANG, .looks = 8,
	};
	struct psr_material opaque = { .alpha = PSR_ALPHA_OPAQUE };
	struct grid_mesh *m = malloc(sizeof *m);

	(void)state;
	assert_non_null(m);
	round_mesh(m, 1, 48);
	m->mesh.material = &opaque;
	m->mesh.n_materials = 1;
	for (int red = 0; red < 256; red += 255) {
		const struct dpoint_mesh_options of_mesh = { .scale = 1, .cell = 0.25, .delta = 0.25f, .look = look_checked,
			                                         .userdata = &red };
		struct dpoint_surface surface;
		struct dpoint_cover cover;
		size_t n, n_bent = 0;

		dpoint_surface_init(&surface);
		assert_int_equal(dpoint_sample_mesh(&surface, &m->mesh, &of_mesh, NULL), PSR_OK);
		n = surface.n_candidates;
		for (size_t i = 0; i < n; i++)
			surface.candidate[i].delta[0] = surface.candidate[i].delta[1] = dpoint_delta_of_class(DPOINT_DELTA_CLASSES - 1);
		assert_int_equal(dpoint_cover_init(&cover, &surface, &options, NULL, NULL), PSR_OK);
		assert_int_equal(dpoint_mend(&surface, &cover, &options, NULL, NULL), PSR_OK);
		assert_int_equal(surface.n_candidates, 2 * n);
		for (size_t i = n; i < 2 * n; i++)
			n_bent += surface.candidate[i].point.lambda_u != 0;
		assert_true(red > 0 ? n_bent > n / 2 : n_bent == 0);
		dpoint_cover_fini(&cover);
		dpoint_surface_fini(&surface);
	}
	free(m);
}

/* Triangles of a torus have a red of 0 and of 6 by turns, and rectangles are wider: without a mean points would have one
 * of these. */
static void a_point_looks_as_the_mean_of_its_cells(void **state)
{
	static const struct dpoint_cover_options options = {
		.sine = 0.2f, .slack = 1e-5f, .angle = 0.2f, .height = 0.01f, .overhang = OVERHANG, .looks = 8,
	};
	struct psr_material opaque = { .alpha = PSR_ALPHA_OPAQUE };
	struct grid_mesh *m = malloc(sizeof *m);
	int red = 6;
	const struct dpoint_mesh_options of_mesh = { .scale = 1, .cell = 0.02, .delta = 0.25f, .look = look_checked,
		                                         .userdata = &red };
	struct dpoint_surface surface;
	struct dpoint_cover cover;
	struct dpoint_choice choice;
	size_t n_between = 0;

	(void)state;
	assert_non_null(m);
	round_mesh(m, 1, 48);
	m->mesh.material = &opaque;
	m->mesh.n_materials = 1;
	dpoint_surface_init(&surface);
	assert_int_equal(dpoint_sample_mesh(&surface, &m->mesh, &of_mesh, NULL), PSR_OK);
	assert_int_equal(dpoint_simplify(&choice, &cover, &surface, &options, 4, NULL, NULL), PSR_OK);
	for (size_t i = 0; i < surface.n_candidates; i++) {
		const uint64_t attr = surface.candidate[i].point.attr;

		if (!choice.is_kept[i])
			continue;
		assert_true(attr >> 15 <= (uint64_t)red << 1); /* no other channel has anything */
		n_between += (attr >> 16) > 0 && (attr >> 16) < 6;
	}
	assert_true(n_between > choice.n_kept / 2);
	dpoint_choice_fini(&choice);
	dpoint_cover_fini(&cover);
	dpoint_surface_fini(&surface);
	free(m);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(pieces_of_round_meshes_have_their_curvatures),
		cmocka_unit_test(no_extent_crosses_an_edge),
		cmocka_unit_test(no_extent_crosses_what_is_cut_out),
		cmocka_unit_test(under_a_fitted_rectangle_normals_are_within_the_angle),
		cmocka_unit_test(two_turns_cover_all_with_little_more),
		cmocka_unit_test(mending_leaves_no_hole),
		cmocka_unit_test(mending_stays_nearest),
		cmocka_unit_test(mending_ends_at_a_slanted_edge),
		cmocka_unit_test(narrow_triangles_have_pieces_that_are_not),
		cmocka_unit_test(pieces_are_cut_where_normals_turn),
		cmocka_unit_test(too_many_pieces_are_refused),
		cmocka_unit_test(what_is_too_much_is_refused_before_it_is_cut),
		cmocka_unit_test(what_mends_is_bent_where_looks_differ),
		cmocka_unit_test(a_point_looks_as_the_mean_of_its_cells),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
