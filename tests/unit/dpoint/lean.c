#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "base/random.h"
#include "dpoint/lean.h"
#include "dpoint/mesh.h"
#include "rays.h"

#define HEIGHT 0.008f
#define GRAZE 0.08 /* cosine to a face's normal */

/* A roof of two faces, each a square, that meet at the edge x = 0 at a right angle; of one, it is flat and alone. */
struct roof {
	struct psr_mesh mesh;
	double position[8][3];
	float normal[8][3];
	uint32_t triangle[4][3], material[4];
};

/* lean: of all normals, towards y, in radians. */
static void make_roof(struct roof *r, uint32_t n_faces, double lean)
{
	const double slope = n_faces == 1 ? 0 : 0.7853981633974483, across = cos(slope), down = sin(slope);

	memset(r, 0, sizeof *r);
	for (uint32_t f = 0; f < n_faces; f++) {
		const double away = f == 0 ? 1 : -1;
		const uint32_t first = 4 * f, second = first + 1 + f, third = first + 2 - f;

		for (uint32_t v = 0; v < 4; v++) {
			v3d_set(r->position[first + v], v & 1 ? away * across : 0, v & 2 ? 0.5 : -0.5, v & 1 ? -down : 0);
			v3f_set(r->normal[first + v], (float)(cos(lean) * away * down), (float)sin(lean), (float)(cos(lean) * across));
		}
		memcpy(r->triangle[2 * f], (uint32_t[]){ first, second, first + 3 }, sizeof *r->triangle);
		memcpy(r->triangle[2 * f + 1], (uint32_t[]){ first, first + 3, third }, sizeof *r->triangle);
	}
	r->mesh = (struct psr_mesh){ .n_vertices = 4 * n_faces, .n_triangles = 2 * n_faces, .position = r->position,
		                         .normal = r->normal, .triangle = r->triangle, .triangle_material = r->material };
}

struct leant {
	struct roof roof;
	struct dpoint_cover_options options;
	struct dpoint_surface surface;
	struct dpoint_cover cover;
	struct dpoint_choice choice;
};

static void make(struct leant *l, float slit)
{
	const struct dpoint_mesh_options mesh = { .scale = 1, .cell = 0.02, .delta = 0.25f, .cover = &l->options };

	l->options = (struct dpoint_cover_options){ .sine = dpoint_sine(0.01), .slack = 2e-5f, .angle = 0.035f,
		                                        .height = HEIGHT, .overhang = 5e-4f, .delta = 0.25f, .slit = slit };
	dpoint_surface_init(&l->surface);
	assert_int_equal(dpoint_sample_mesh(&l->surface, &l->roof.mesh, &mesh, NULL), PSR_OK);
	assert_int_equal(dpoint_simplify(&l->choice, &l->cover, &l->surface, &l->options, 1, NULL, NULL), PSR_OK);
}

static void end(struct leant *l)
{
	dpoint_choice_fini(&l->choice);
	dpoint_cover_fini(&l->cover);
	dpoint_surface_fini(&l->surface);
}

/* Rays that graze the flat face, 32 around each place, and get one and a half heights deep: to places well within. */
static size_t count_through(const struct leant *l)
{
	const double sine = sqrt(1 - GRAZE * GRAZE);
	size_t n = 0;

	for (int i = 0; i < 12; i++)
		for (int j = 0; j < 12; j++)
			for (int d = 0; d < 32; d++) {
				const double angle = d * (6.283185307179586 / 32), w[3] = { sine * cos(angle), sine * sin(angle), GRAZE };
				const double at[3] = { 0.2 + 0.05 * i, -0.3 + 0.05 * j, -1.5 * (double)HEIGHT };

				n += (size_t)gets_through(&l->surface, &l->choice, &l->options, at, w, 0);
			}
	return n;
}

static void nobody_sees_through_a_face_that_its_normals_lean_from(void **state)
{
	struct leant l;
	size_t n_open, n_kept;

	(void)state;
	make_roof(&l.roof, 1, 0.25);
	make(&l, 0);
	n_open = count_through(&l);
	n_kept = l.choice.n_kept;
	end(&l);
	assert_true(n_open > 1000); /* without it */
	make(&l, 4 * HEIGHT);
	assert_int_equal(count_through(&l), 0);
	assert_true(l.choice.n_kept < n_kept / 4);
	end(&l);
}

static void what_has_no_wide_slit_is_let_be(void **state)
{
	static const struct {
		double lean;
		float slit;
	} cases[] = { { 0, 1e-4f }, { 0.25, 0.5f } };

	(void)state;
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct leant l;
		size_t n_kept;

		make_roof(&l.roof, 1, cases[i].lean);
		make(&l, 0);
		n_kept = l.choice.n_kept;
		end(&l);
		make(&l, cases[i].slit);
		assert_int_equal(l.choice.n_kept, n_kept);
		end(&l);
	}
}

/* How far before both faces of a roof a place is. */
static float before(const float at[3])
{
	return 0.70710678f * (at[2] + fabsf(at[0]));
}

static void corner_of(float at[3], float extent[2], const struct dpoint_surface *surface, size_t i, float sine, int c)
{
	const struct dpoint *p = &surface->candidate[i].point;
	float v[3];

	dpoint_candidate_extent(extent, &surface->candidate[i], sine);
	v3f_cross(v, p->normal, p->u);
	v3f_add_scaled(at, p->at, c & 1 ? extent[0] : -extent[0], p->u);
	v3f_add_scaled(at, at, c & 2 ? extent[1] : -extent[1], v);
}

/* A quarter of a height over an open side, twice where packing turns a rectangle, and packed normals are off by 0.23
 * degrees: 0.001 where a rectangle is 0.25 long. */
static void tiles_do_not_come_out_of_the_next_face(void **state)
{
	const float off = 0.5f * HEIGHT + 0.001f;
	struct leant l;
	size_t n = 0;

	(void)state;
	make_roof(&l.roof, 2, 0.25);
	make(&l, 4 * HEIGHT);
	assert_true(l.surface.n_lean >= 4);
	for (size_t i = l.surface.first_lean; i < l.surface.first_lean + l.surface.n_lean; i++) {
		n += l.choice.is_kept[i];
		for (int c = 0; c < 4; c++) {
			float at[3], extent[2];

			corner_of(at, extent, &l.surface, i, l.options.sine, c);
			assert_true(fabsf(before(at)) < off && fabsf(at[1]) < 0.5f + off && fabsf(at[0]) < 0.70710678f + off);
		}
	}
	assert_int_equal(n, l.surface.n_lean);
	end(&l);
}

/* ---- one face ---- */

struct random_face {
	struct dpoint_face face;
	double edge[2][3], normal[3];
};

static double real(uint64_t *seed, double low, double high)
{
	return low + (high - low) * (double)random_below(seed, 1u << 24) / (1u << 24);
}

/* From needles, as narrow as 2^-thin, to what is obtuse; normals lean by up to `lean`, as the tangent. */
static void random_face(struct random_face *f, uint64_t *seed, double thin, double lean)
{
	const double length = pow(2, real(seed, -6, 0)), high = length * pow(2, real(seed, -thin, 0));
	const double at[3][2] = { { 0, 0 }, { length, 0 }, { real(seed, -0.5, 1.5) * length, high } };
	double axis[3][3];

	for (int k = 0; k < 3; k++) {
		f->normal[k] = real(seed, -1, 1);
		axis[0][k] = real(seed, -1, 1);
	}
	v3d_normalize(f->normal, f->normal);
	v3d_add_scaled(axis[0], axis[0], -v3d_dot(axis[0], f->normal), f->normal);
	v3d_normalize(axis[0], axis[0]);
	v3d_cross(axis[1], f->normal, axis[0]);
	memset(&f->face, 0, sizeof f->face);
	for (int i = 0; i < 3; i++) {
		const double u = real(seed, -lean, lean), v = real(seed, -lean, lean), unit = 1 / sqrt(1 + u * u + v * v);

		for (int k = 0; k < 3; k++) {
			f->face.corner[i][k] = (float)(at[i][0] * axis[0][k] + at[i][1] * axis[1][k]);
			f->face.normal[i][k] = (float)(unit * (f->normal[k] + u * axis[0][k] + v * axis[1][k]));
		}
	}
	for (int k = 0; k < 3; k++) {
		f->edge[0][k] = (double)f->face.corner[1][k] - f->face.corner[0][k];
		f->edge[1][k] = (double)f->face.corner[2][k] - f->face.corner[0][k];
	}
}

static void local_of(float p[3], const struct dpoint *point, const double at[3])
{
	float away[3], v[3];

	for (int k = 0; k < 3; k++)
		away[k] = (float)(at[k] - (double)point->at[k]);
	v3f_cross(v, point->normal, point->u);
	p[0] = v3f_dot(away, point->u);
	p[1] = v3f_dot(away, v);
	p[2] = v3f_dot(away, point->normal);
}

/* Which tile a place is in, with no less than `inside` to its sides; or none. */
static const struct dpoint_candidate *tile_over(float p[3], const struct dpoint_surface *surface, const double at[3],
                                                float inside)
{
	for (size_t i = 0; i < surface->n_candidates; i++) {
		const struct dpoint_candidate *c = &surface->candidate[i];

		local_of(p, &c->point, at);
		if (fabsf(p[0]) <= c->delta[0] - inside && fabsf(p[1]) <= c->delta[1] - inside)
			return c;
	}
	return NULL;
}

/* How far a place in the plane is beyond the triangle's sides, at most. */
static double beyond_by(const struct random_face *f, const float at[3])
{
	double most = -1;

	for (int i = 0; i < 3; i++) {
		double side[3], out[3], away[3];

		for (int k = 0; k < 3; k++) {
			side[k] = (double)f->face.corner[(i + 1) % 3][k] - f->face.corner[i][k];
			away[k] = (double)at[k] - f->face.corner[i][k];
		}
		v3d_cross(out, side, f->normal);
		v3d_normalize(out, out);
		most = fmax(most, v3d_dot(out, away));
	}
	return most;
}

/* Packing moves nothing here; it tilts by 0.23 degrees, so that seen along another normal a place at the rim is off by
 * 1e-5 of its distance. */
static void tiles_cover_a_face_and_little_else(void **state)
{
	uint64_t seed = 7;
	size_t n_tiles = 0;

	(void)state;
	for (int i = 0; i < 300; i++) {
		const float beyond = (float)pow(2, real(&seed, -11, -6)), all[3] = { beyond, beyond, beyond };
		struct dpoint_surface surface;
		struct random_face f;

		random_face(&f, &seed, 14, 0.5);
		dpoint_surface_init(&surface);
		assert_int_equal(tile_face(&surface, &f.face, all, 0, 0.25f), PSR_OK);
		assert_int_equal(surface.n_lean, surface.n_candidates);
		n_tiles += surface.n_candidates;
		assert_true(surface.n_candidates < 1000);
		for (int k = 0; k < 400; k++) {
			double w[2] = { real(&seed, 0, 1), real(&seed, 0, 1) }, at[3];
			float p[3];

			if (w[0] + w[1] > 1) {
				w[0] = 1 - w[0];
				w[1] = 1 - w[1];
			}
			for (int c = 0; c < 3; c++)
				at[c] = f.face.corner[0][c] + w[0] * f.edge[0][c] + w[1] * f.edge[1][c];
			if (tile_over(p, &surface, at, -1e-5f) == NULL)
				fail_msg("face %d: nothing at %g, %g", i, w[0], w[1]);
		}
		for (size_t t = 0; t < surface.n_candidates; t++)
			for (int c = 0; c < 4; c++) {
				float at[3], extent[2];

				corner_of(at, extent, &surface, t, 1, c);
				assert_true(beyond_by(&f, at) < 2.2 * (double)beyond);
			}
		dpoint_surface_fini(&surface);
	}
	assert_true(n_tiles < 300 * 60);
}

/* A face and its twin beyond the side from corner 0 to 1. */
static void tiles_cover_a_rectangle_and_little_else(void **state)
{
	uint64_t seed = 13;

	(void)state;
	for (int i = 0; i < 200; i++) {
		const double wide = pow(2, real(&seed, -8, 0)), high = pow(2, real(&seed, -8, 0)), turn = real(&seed, 0, 6.28);
		const double axis[2][3] = { { cos(turn), sin(turn), 0 }, { -sin(turn), cos(turn), 0 } };
		const float beyond = (float)pow(2, real(&seed, -11, -6));
		struct dpoint_surface surface;
		struct dpoint_face face = { .shared = 0 };

		for (int c = 0; c < 3; c++) {
			face.corner[0][c] = (float)(wide * axis[0][c]);
			face.corner[1][c] = (float)(high * axis[1][c]);
			for (int k = 0; k < 3; k++)
				face.normal[k][c] = c == 2;
		}
		dpoint_surface_init(&surface);
		assert_int_equal(tile_rectangle(&surface, &face, beyond, 0, 0.125f), PSR_OK);
		assert_true(surface.n_lean == surface.n_candidates && surface.n_lean < 1000);
		for (int k = 0; k < 400; k++) {
			const double x = real(&seed, 0, 1), y = real(&seed, 0, 1);
			double at[3];
			float p[3];

			for (int c = 0; c < 3; c++)
				at[c] = x * face.corner[0][c] + y * face.corner[1][c];
			if (tile_over(p, &surface, at, -1e-5f) == NULL)
				fail_msg("rectangle %d: nothing at %g, %g", i, x, y);
		}
		for (size_t t = 0; t < surface.n_candidates; t++)
			for (int c = 0; c < 4; c++) {
				float at[3], extent[2];

				corner_of(at, extent, &surface, t, 1, c);
				for (int k = 0; k < 2; k++) {
					const double along = (double)at[0] * axis[k][0] + (double)at[1] * axis[k][1];
					const double off = fmax(-along, along - (k ? high : wide));

					assert_true(off < 2.2 * (double)beyond);
				}
			}
		dpoint_surface_fini(&surface);
	}
}

/* Between corners normals are those of shading: exact in the middle of a tile but for 2^-13 a component, and off
 * elsewhere by the second order of how they turn: along the face by 0.7, out of it by 0.06, so by 0.042. Growth has 8
 * bits: 0.003. */
static void leans_are_those_of_the_normals_between_corners(void **state)
{
	uint64_t seed = 11;

	(void)state;
	for (int i = 0; i < 200; i++) {
		const float all[3] = { 1e-3f, 1e-3f, 1e-3f };
		struct dpoint_surface surface;
		struct random_face f;

		random_face(&f, &seed, 3, 0.25);
		dpoint_surface_init(&surface);
		assert_int_equal(tile_face(&surface, &f.face, all, 0, 0.25f), PSR_OK);
		for (int k = 0; k < 100; k++) {
			const double w = real(&seed, 0, 1), x = real(&seed, 0, 1 - w);
			double at[3], normal[3], n[3], dot;
			const struct dpoint_candidate *c;
			float p[3], v[3];

			for (int d = 0; d < 3; d++) {
				at[d] = f.face.corner[0][d] + w * f.edge[0][d] + x * f.edge[1][d];
				normal[d] = (1 - w - x) * (double)f.face.normal[0][d] + w * (double)f.face.normal[1][d] +
				            x * (double)f.face.normal[2][d];
			}
			c = tile_over(p, &surface, at, -1e-5f);
			assert_non_null(c);
			const struct dpoint_lean *lean = &surface.lean[c - surface.candidate];
			v3f_cross(v, c->point.normal, c->point.u);
			for (int d = 0; d < 3; d++) {
				n[d] = c->point.normal[d];
				for (int a = 0; a < 2; a++)
					n[d] += (double)(a ? v : c->point.u)[d] *
					        (lean->at[a] * (double)DPOINT_LEAN_STEP + (double)dpoint_lean_by(lean->by[a][0]) * (double)p[0] +
					         (double)dpoint_lean_by(lean->by[a][1]) * (double)p[1]);
			}
			v3d_normalize(n, n);
			v3d_normalize(normal, normal);
			dot = v3d_dot(n, normal);
			if (!(dot > cos(0.045)))
				fail_msg("face %d: a normal is %g off", i, acos(dot));
		}
		dpoint_surface_fini(&surface);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(nobody_sees_through_a_face_that_its_normals_lean_from),
		cmocka_unit_test(what_has_no_wide_slit_is_let_be),
		cmocka_unit_test(tiles_do_not_come_out_of_the_next_face),
		cmocka_unit_test(tiles_cover_a_face_and_little_else),
		cmocka_unit_test(tiles_cover_a_rectangle_and_little_else),
		cmocka_unit_test(leans_are_those_of_the_normals_between_corners),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
