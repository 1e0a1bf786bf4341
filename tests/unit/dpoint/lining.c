#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
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

struct lined {
	struct roof roof;
	struct dpoint_cover_options options;
	struct dpoint_surface surface;
	struct dpoint_cover cover;
	struct dpoint_choice choice;
};

static void make(struct lined *l, float slit, const uint8_t *is_two_sided)
{
	const struct dpoint_mesh_options mesh = { .scale = 1, .cell = 0.02, .delta = 0.25f };

	l->options = (struct dpoint_cover_options){ .sine = dpoint_sine(0.01), .slack = 2e-5f, .angle = 0.035f,
		                                        .height = HEIGHT, .overhang = 5e-4f, .delta = 0.25f, .slit = slit,
		                                        .is_two_sided = is_two_sided };
	dpoint_surface_init(&l->surface);
	assert_int_equal(dpoint_sample_mesh(&l->surface, &l->roof.mesh, &mesh, NULL), PSR_OK);
	assert_int_equal(dpoint_simplify(&l->choice, &l->cover, &l->surface, &l->options, 1, NULL, NULL), PSR_OK);
}

static void end(struct lined *l)
{
	dpoint_choice_fini(&l->choice);
	dpoint_cover_fini(&l->cover);
	dpoint_surface_fini(&l->surface);
}

/* Rays that graze the flat face, 32 around each place, and get one and a half heights deep: to places well within. */
static size_t count_through(const struct lined *l)
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
	struct lined l;
	size_t n_open, n_kept;

	(void)state;
	make_roof(&l.roof, 1, 0.25);
	make(&l, 0, NULL);
	n_open = count_through(&l);
	n_kept = l.choice.n_kept;
	end(&l);
	assert_true(n_open > 1000); /* without it */
	make(&l, 4 * HEIGHT, NULL);
	assert_int_equal(count_through(&l), 0);
	assert_true(l.choice.n_kept > n_kept && l.choice.n_kept < 2 * n_kept);
	end(&l);
}

static void what_has_no_wide_slit_is_let_be(void **state)
{
	static const struct {
		double lean;
		float slit;
		uint8_t is_two_sided;
	} cases[] = { { 0, 1e-4f, 0 }, { 0.25, 0.5f, 0 }, { 0.25, 4 * HEIGHT, 1 } };

	(void)state;
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct lined l;
		size_t n_kept;

		make_roof(&l.roof, 1, cases[i].lean);
		make(&l, 0, &cases[i].is_two_sided);
		n_kept = l.choice.n_kept;
		end(&l);
		make(&l, cases[i].slit, &cases[i].is_two_sided);
		assert_int_equal(l.choice.n_kept, n_kept);
		end(&l);
	}
}

/* How far before both faces of a roof a place is. */
static float before(const float at[3])
{
	return 0.70710678f * (at[2] + fabsf(at[0]));
}

/* Linings have the faces' own normals, and are behind: so are all corners of their rectangles, of both faces. */
static void a_lining_does_not_come_out_of_the_next_face(void **state)
{
	struct lined l;
	size_t n = 0;

	(void)state;
	make_roof(&l.roof, 2, 0.25);
	make(&l, 4 * HEIGHT, NULL);
	for (size_t i = 0; i < l.surface.n_candidates; i++) {
		const struct dpoint *p = &l.surface.candidate[i].point;
		float extent[2], v[3];

		if (!l.choice.is_kept[i] || p->normal[1] > 0.1f || before(p->at) > -0.5f * HEIGHT)
			continue;
		n++;
		dpoint_candidate_extent(extent, &l.surface.candidate[i], l.options.sine);
		v3f_cross(v, p->normal, p->u);
		for (int c = 0; c < 4; c++) {
			float at[3];

			v3f_add_scaled(at, p->at, c & 1 ? extent[0] : -extent[0], p->u);
			v3f_add_scaled(at, at, c & 2 ? extent[1] : -extent[1], v);
			assert_true(before(at) < -0.5f * HEIGHT && fabsf(at[1]) < 0.5f);
		}
	}
	assert_true(n >= 2);
	end(&l);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(nobody_sees_through_a_face_that_its_normals_lean_from),
		cmocka_unit_test(what_has_no_wide_slit_is_let_be),
		cmocka_unit_test(a_lining_does_not_come_out_of_the_next_face),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
