#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "base/random.h"
#include "base/vec.h"
#include "dpoint/cell_tree.h"
#include "dpoint/choice.h"
#include "dpoint/group.h"
#include "dpoint/sample.h"
#include "patches.h"
#include "tests/unit/lib/threads.h"

static void sample(struct dpoint_surface *surface, const struct dpoint_patch *patch, uint32_t n, float delta)
{
	const struct dpoint_uniform uniform = { n, 2, { 0, 0, 0 }, 1, delta, 7, 0, 0 };

	dpoint_surface_init(surface);
	assert_int_equal(dpoint_sample_uniform(surface, patch, &uniform), PSR_OK);
}

static struct dpoint_cover_options options(double epsilon, float angle)
{
	return (struct dpoint_cover_options){ .sine = dpoint_sine(epsilon), .slack = 1e-5f, .angle = angle, .height = 1 };
}

/* A cell in a candidate's frame, in double: how far its corners are inside of the shortened rectangle (negative:
 * outside), or its middle inside of half of the shorter extent from S_p, and how far off S_p's normal is there. */
static void look(double *inside, double *angle, const struct dpoint_candidate *c, const struct dpoint_cell *cell,
                 const struct dpoint_cover_options *o)
{
	const struct dpoint_limit limit = { o->sine, { c->delta[0], c->delta[1] } };
	double axis[3][3], middle[3] = { 0, 0, 0 }, normal[3], n[3], lambda[2];
	float extent[2], local[3];

	dpoint_extent(extent, &c->point, &limit);
	lambda[0] = c->point.lambda_u;
	lambda[1] = lambda[0] * c->point.rho;
	for (int k = 0; k < 3; k++) {
		axis[0][k] = c->point.u[k];
		axis[2][k] = c->point.normal[k];
		normal[k] = cell->normal[k];
	}
	v3d_cross(axis[1], axis[2], axis[0]);
	*inside = INFINITY;
	for (int i = 0; i < 4; i++) {
		double away[3], p[3];

		for (int k = 0; k < 3; k++)
			away[k] = (double)cell->corner[i][k] - c->point.at[k];
		m3d_apply(p, (const double (*)[3])axis, away);
		v3d_add_scaled(middle, middle, 0.25, p);
		for (int k = 0; k < 2; k++) {
			const double w = lambda[k] * extent[k];

			*inside = fmin(*inside, extent[k] * sqrt(1 - w * w) - o->slack - fabs(p[k]));
		}
	}
	dpoint_normal_at(local, c->point.lambda_u, c->point.rho, (float)middle[0], (float)middle[1]);
	*inside = fmin(*inside, 0.5 * fminf(extent[0], extent[1]) -
	                        fabs(middle[2] - dpoint_height_at(c->point.lambda_u, c->point.rho, (float)middle[0],
	                                                          (float)middle[1])));
	for (int k = 0; k < 3; k++)
		n[k] = local[k];
	v3d_normalize(n, n);
	m3d_apply(normal, (const double (*)[3])axis, normal);
	*angle = v3d_dot(normal, normal) > 0 ? acos(fmin(1, v3d_dot(n, normal))) : 0;
}

/* Which cells a candidate covers, from its list. */
static void mark(uint8_t *is_covered, const struct dpoint_cover *cover, uint32_t i)
{
	for (uint32_t k = 0; k < cover->n[i]; k++) {
		const struct cell_node *node = &cover->tree->node[cover->list[i][k]];

		for (uint32_t e = node->begin; e < node->end; e++) {
			assert_false(is_covered[cover->tree->order[e]]);
			is_covered[cover->tree->order[e]] = 1;
		}
	}
}

static void candidates_cover_the_cells_within_their_rectangles(void **state)
{
	struct revolved torus;

	(void)state;
	revolve(&torus, 1, 0.4, 0, 9);
	for (int round = 0; round < 2; round++) {
		const struct dpoint_cover_options o = options(0.03, round ? 0.05f : 3);
		struct dpoint_surface surface;
		struct dpoint_cover cover;
		uint8_t *is_covered;
		size_t n = 0;

		sample(&surface, &torus.patch, 9, 1);
		assert_int_equal(dpoint_cover_init(&cover, &surface, &o, NULL, NULL), PSR_OK);
		is_covered = malloc(surface.n_cells);
		assert_non_null(is_covered);
		for (uint32_t i = 0; i < surface.n_candidates; i += 7) {
			memset(is_covered, 0, surface.n_cells);
			mark(is_covered, &cover, i);
			for (size_t c = 0; c < surface.n_cells; c++) {
				double inside, angle;

				look(&inside, &angle, &surface.candidate[i], &surface.cell[c], &o);
				n += is_covered[c];
				/* Floats of about 1; the other side of the tube has the opposite normal. */
				if (is_covered[c])
					assert_true(inside >= -1e-6 && angle <= fmin(o.angle, 1.5708) + 1e-5);
				else
					assert_false(inside > 1e-6 && angle < fmin(o.angle, 0.5) - 1e-5);
			}
		}
		assert_true(n > surface.n_candidates);
		free(is_covered);
		dpoint_cover_fini(&cover);
		dpoint_surface_fini(&surface);
	}
}

static void count_all(uint32_t *count, const struct dpoint_cover *cover, const uint8_t *is_kept)
{
	uint8_t *one = malloc(cover->n_cells);

	assert_non_null(one);
	for (uint32_t i = 0; i < cover->n_candidates; i++) {
		if (is_kept != NULL && !is_kept[i])
			continue;
		memset(one, 0, cover->n_cells);
		mark(one, cover, i);
		for (size_t c = 0; c < cover->n_cells; c++)
			count[c] += one[c];
	}
	free(one);
}

static void a_choice_covers_what_can_be_covered_and_has_none_too_much(void **state)
{
	struct revolved shape[3];

	(void)state;
	revolve(&shape[0], 1, 0.4, 0, 9);
	revolve(&shape[1], 0, 1, 6, 5);
	quadric(&shape[2], 1, 0.5, -2);
	for (int s = 0; s < 3; s++) {
		const struct dpoint_cover_options o = options(s == 2 ? 0.01 : 0.03, 3);
		struct dpoint_surface surface;
		struct dpoint_cover cover;
		struct dpoint_choice choice;
		uint32_t *before, *after;
		size_t n_holes = 0, n_kept = 0;

		sample(&surface, &shape[s].patch, s == 2 ? 50 : 12, 1);
		assert_int_equal(dpoint_cover_init(&cover, &surface, &o, NULL, NULL), PSR_OK);
		assert_int_equal(dpoint_choose(&choice, &cover), PSR_OK);
		before = calloc(surface.n_cells, sizeof *before);
		after = calloc(surface.n_cells, sizeof *after);
		assert_true(before != NULL && after != NULL);
		count_all(before, &cover, NULL);
		count_all(after, &cover, choice.is_kept);
		for (size_t c = 0; c < surface.n_cells; c++) {
			assert_true((before[c] > 0) == (after[c] > 0));
			n_holes += before[c] == 0;
		}
		assert_int_equal(choice.n_holes, n_holes);
		for (uint32_t i = 0; i < surface.n_candidates; i++) {
			int is_needed = 0;

			n_kept += choice.is_kept[i];
			for (uint32_t k = 0; k < cover.n[i] && choice.is_kept[i]; k++) {
				const struct cell_node *node = &cover.tree->node[cover.list[i][k]];

				for (uint32_t e = node->begin; e < node->end; e++)
					is_needed |= after[cover.tree->order[e]] == 1;
			}
			assert_true(is_needed || !choice.is_kept[i]);
		}
		assert_int_equal(choice.n_kept, n_kept);
		assert_true(n_kept > 0 && n_kept * 3 < surface.n_candidates);
		free(before);
		free(after);
		dpoint_choice_fini(&choice);
		dpoint_cover_fini(&cover);
		dpoint_surface_fini(&surface);
	}
}

/* Whether a ray from `from` along d, which is of unit length, meets the kept rectangle within `near` of the origin. */
static int meets(const struct dpoint_candidate *c, float sine, const double from[3], const double d[3], double near)
{
	const struct dpoint_limit limit = { sine, { c->delta[0], c->delta[1] } };
	double u[3], n[3], v[3], away[3], t;
	float extent[2];

	for (int k = 0; k < 3; k++) {
		u[k] = c->point.u[k];
		n[k] = c->point.normal[k];
		away[k] = c->point.at[k] - from[k];
	}
	if (v3d_dot(d, n) >= 0)
		return 0;
	t = v3d_dot(away, n) / v3d_dot(d, n);
	if (fabs(t) > near)
		return 0;
	v3d_scale(away, away, -1);
	v3d_add_scaled(away, away, t, d);
	v3d_cross(v, n, u);
	dpoint_extent(extent, &c->point, &limit);
	return fabs(v3d_dot(away, u)) <= extent[0] && fabs(v3d_dot(away, v)) <= extent[1];
}

/* Rays to places of the surface, from any side up to some 84 degrees off: each meets a rectangle near the place. Where
 * neighbours meet, each is off from S_p by the height that is allowed, at most; a ray of that slant passes between two
 * such only if they overlap by less than 2 height / cosine, which is the slack. S_p is epsilon of a radius, at most 1,
 * from its plane at the sides, twice that in a corner, and a slanted ray goes the longer. */
static void no_ray_slips_between_the_chosen_rectangles(void **state)
{
	const double epsilon = 0.03;
	const double least_cosine = 0.1, height = 0.0005;
	const struct dpoint_cover_options o = {
		.sine = dpoint_sine(epsilon), .slack = (float)(2 * height / least_cosine), .angle = 3, .height = (float)height,
	};
	struct revolved shape[2];

	(void)state;
	revolve(&shape[0], 1, 0.4, 0, 9);
	revolve(&shape[1], 0, 1, 6, 5);
	for (int s = 0; s < 2; s++) {
		struct dpoint_surface surface;
		struct dpoint_cover cover;
		struct dpoint_choice choice;
		struct dpoint_span span;
		uint64_t seed = 9;

		sample(&surface, &shape[s].patch, 32, 0.3f);
		assert_int_equal(dpoint_cover_init(&cover, &surface, &o, NULL, NULL), PSR_OK);
		assert_int_equal(dpoint_choose(&choice, &cover), PSR_OK);
		assert_int_equal(choice.n_holes, 0);
		for (int i = 0; i < 3000; i++) {
			const double uv[2] = { random_in(&seed, 0, 1), random_in(&seed, 0, 1) };
			struct dpoint_local local;
			double d[3], cosine;
			int n = 0;

			assert_true(dpoint_patch_span(&span, &shape[s].patch, random_below(&seed, s == 0 ? 16 : 8)));
			if (!dpoint_patch_local(&local, &shape[s].patch, &span, uv))
				continue;
			do {
				for (int k = 0; k < 3; k++)
					d[k] = random_in(&seed, -1, 1);
				v3d_normalize(d, d);
				cosine = -v3d_dot(d, local.axis[2]);
			} while (cosine < least_cosine);
			for (uint32_t c = 0; c < surface.n_candidates && n == 0; c++)
				n += choice.is_kept[c] &&
				     meets(&surface.candidate[c], o.sine, local.at, d, (2 * epsilon + height) / cosine);
			assert_true(n > 0);
		}
		dpoint_choice_fini(&choice);
		dpoint_cover_fini(&cover);
		dpoint_surface_fini(&surface);
	}
}

static void threads_choose_the_same(void **state)
{
	const struct dpoint_cover_options o = options(0.02, 3);
	struct dpoint_surface surface;
	struct dpoint_choice choice[2];
	struct revolved torus;

	(void)state;
	revolve(&torus, 1, 0.4, 0, 9);
	sample(&surface, &torus.patch, 12, 1);
	for (int i = 0; i < 2; i++) {
		struct psr_pool *pool = NULL;
		struct dpoint_cover cover;

		assert_int_equal(psr_pool_create(&pool, 1 + 2 * i, NULL), PSR_OK);
		assert_int_equal(dpoint_cover_init(&cover, &surface, &o, pool, NULL), PSR_OK);
		assert_int_equal(dpoint_choose(&choice[i], &cover), PSR_OK);
		dpoint_cover_fini(&cover);
		psr_pool_destroy(pool);
	}
	assert_memory_equal(choice[0].is_kept, choice[1].is_kept, surface.n_candidates);
	dpoint_choice_fini(&choice[0]);
	dpoint_choice_fini(&choice[1]);
	dpoint_surface_fini(&surface);
}

static void groups_hold_all_points_and_what_they_draw(void **state)
{
	const struct dpoint_cover_options o = options(0.02, 3);
	struct dpoint_surface surface;
	struct dpoint_cover cover;
	struct dpoint_choice choice;
	struct dpoint_set set;
	struct revolved torus;
	size_t n = 0;
	uint64_t seed = 3;

	(void)state;
	revolve(&torus, 0.6, 0.3, 0, 9);
	sample(&surface, &torus.patch, 20, 0.2f);
	assert_int_equal(dpoint_cover_init(&cover, &surface, &o, NULL, NULL), PSR_OK);
	assert_int_equal(dpoint_choose(&choice, &cover), PSR_OK);
	assert_int_equal(dpoint_set_make(&set, &(struct dpoint_grouping){ &surface, &choice, o.sine, NULL }), PSR_OK);
	assert_int_equal(set.n_points, choice.n_kept);
	assert_null(set.delta);
	for (uint32_t i = 0; i < set.n_groups; i++) {
		const struct dpoint_group *g = &set.group[i];
		const struct dpoint_limit limit = dpoint_limit_of(&set, g, 0);
		struct dpoint_sphere sphere;
		float axis[3], cosine;

		assert_int_equal(g->first, n);
		assert_true(g->n > 0 && g->n <= DPOINT_GROUP);
		assert_true(limit.delta[0] <= 0.2f && limit.delta[0] > 0.2f * 0.84f && limit.delta[1] == limit.delta[0]);
		n += g->n;
		dpoint_group_sphere(&sphere, &set, i);
		cosine = dpoint_group_cosine(axis, NULL, &set, i);
		assert_true(v3f_dot(axis, axis) > 0.9999f && dpoint_group_cosine(NULL, axis, &set, i) == cosine);
		for (uint32_t k = 0; k < g->n; k++) {
			struct dpoint p;
			float extent[2], v[3];

			dpoint_unpack(&p, &set.word[g->first + k], &g->box);
			dpoint_extent(extent, &p, &limit);
			v3f_cross(v, p.normal, p.u);
			for (int place = 0; place < 20; place++) {
				const float x = extent[0] * (float)random_in(&seed, -1, 1);
				const float y = extent[1] * (float)random_in(&seed, -1, 1);
				const float height = dpoint_quadric_at(p.lambda_u, p.rho, x, y);
				const float slope[3] = { -p.lambda_u * x, -p.lambda_u * p.rho * y, 1 };
				float at[3], normal[2][3] = { { 0 } }, local[3];

				dpoint_normal_at(local, p.lambda_u, p.rho, x, y);
				for (int c = 0; c < 3; c++) {
					at[c] = p.at[c] + x * p.u[c] + y * v[c] + height * p.normal[c] - sphere.middle[c];
					normal[0][c] = local[0] * p.u[c] + local[1] * v[c] + local[2] * p.normal[c];
					normal[1][c] = slope[0] * p.u[c] + slope[1] * v[c] + slope[2] * p.normal[c];
				}
				assert_true(v3f_length(at) <= sphere.radius);
				for (int way = 0; way < 2; way++)
					assert_true(v3f_dot(normal[way], axis) >= cosine * v3f_length(normal[way]));
			}
		}
	}
	assert_int_equal(n, set.n_points);
	for (uint32_t i = 0; i < set.n_groups; i++)
		for (int k = 0; k < 3; k++)
			assert_true(set.group[i].box.step[k] * DPOINT_PLACE_STEPS <= DPOINT_MOST_BOX);
	dpoint_set_fini(&set);
	dpoint_choice_fini(&choice);
	dpoint_cover_fini(&cover);
	dpoint_surface_fini(&surface);
}

/* Sixteen deltas at random: of 16 neighbours hardly two share one. A group of each takes 32 bytes a point, groups of
 * all 32 a group and 2 a point. */
static void points_have_their_own_deltas_where_that_is_shorter(void **state)
{
	const struct dpoint_cover_options o = options(0.02, 3);
	struct dpoint_surface surface;
	struct dpoint_cover cover;
	struct dpoint_choice choice;
	struct dpoint_set set;
	struct revolved torus;
	uint64_t seed = 4;
	uint32_t n = 0;

	(void)state;
	revolve(&torus, 0.6, 0.3, 0, 9);
	sample(&surface, &torus.patch, 20, 0.2f);
	assert_int_equal(dpoint_cover_init(&cover, &surface, &o, NULL, NULL), PSR_OK);
	assert_int_equal(dpoint_choose(&choice, &cover), PSR_OK);
	for (uint32_t i = 0; i < surface.n_candidates; i++)
		for (int k = 0; k < 2; k++)
			surface.candidate[i].delta[k] = dpoint_delta_of_class(10 + (unsigned)(4 * random_in(&seed, 0, 0.999)));
	assert_int_equal(dpoint_set_make(&set, &(struct dpoint_grouping){ &surface, &choice, o.sine, NULL }), PSR_OK);
	assert_int_equal(set.n_points, choice.n_kept);
	assert_non_null(set.delta);
	assert_true(sizeof *set.group * set.n_groups + 2 * set.n_points < sizeof *set.group * set.n_points);
	for (uint32_t i = 0; i < set.n_groups; i++)
		for (uint32_t k = 0; k < set.group[i].n; k++, n++) {
			const struct dpoint_limit limit = dpoint_limit_of(&set, &set.group[i], k);
			const struct dpoint_candidate *own = NULL;
			float nearest = INFINITY, away[3];
			struct dpoint p;

			assert_int_equal(set.group[i].delta[0], DPOINT_OWN_DELTA);
			assert_int_equal(set.group[i].delta[1], DPOINT_OWN_DELTA);
			dpoint_unpack(&p, &set.word[n], &set.group[i].box);
			for (uint32_t c = 0; c < surface.n_candidates; c++) {
				v3f_sub(away, p.at, surface.candidate[c].point.at);
				if (choice.is_kept[c] && v3f_dot(away, away) < nearest) {
					nearest = v3f_dot(away, away);
					own = &surface.candidate[c];
				}
			}
			/* Places are half a step off on each axis. */
			assert_true(nearest <= 3 * 2.1e-5f * 2.1e-5f);
			assert_true(limit.delta[0] == own->delta[0] && limit.delta[1] == own->delta[1]);
		}
	assert_int_equal(n, set.n_points);
	dpoint_set_fini(&set);
	dpoint_choice_fini(&choice);
	dpoint_cover_fini(&cover);
	dpoint_surface_fini(&surface);
}

/* A plane of 4x4 candidates, each over its own part. One of a whole half, and then another, takes the place of
 * eight. */
static void one_candidate_takes_the_place_of_several(void **state)
{
	const struct dpoint_cover_options o = options(0.02, 3);
	struct revolved plane;
	struct dpoint_surface surface;
	struct dpoint_cover cover;
	struct dpoint_choice choice = { NULL, 0, 0 };
	uint32_t *count;

	(void)state;
	quadric(&plane, 0, 0, 0);
	sample(&surface, &plane.patch, 4, 0.2501f);
	assert_int_equal(surface.n_candidates, 16);
	for (int half = 0; half < 2; half++) {
		struct dpoint_candidate *wide = dpoint_surface_candidate(&surface);

		*wide = surface.candidate[0];
		for (int k = 0; k < 2; k++) {
			const float along = fabsf(wide->point.u[k]);

			wide->point.at[k] = k == 0 ? 0.5f - (float)half : 0;
			wide->delta[0] = along > 0.5f ? (k == 0 ? 0.51f : 1.01f) : wide->delta[0];
			wide->delta[1] = along > 0.5f ? wide->delta[1] : k == 0 ? 0.51f : 1.01f;
		}
	}
	assert_int_equal(dpoint_cover_init(&cover, &surface, &o, NULL, NULL), PSR_OK);
	choice.is_kept = calloc(surface.n_candidates, 1);
	count = calloc(surface.n_cells, sizeof *count);
	assert_true(choice.is_kept != NULL && count != NULL);
	memset(choice.is_kept, 1, 16);
	assert_int_equal(choice_swap(&choice, &cover), PSR_OK);
	for (uint32_t i = 0; i < 16; i++)
		assert_false(choice.is_kept[i]);
	assert_true(choice.is_kept[16] && choice.is_kept[17]);
	count_all(count, &cover, choice.is_kept);
	for (size_t c = 0; c < surface.n_cells; c++)
		assert_true(count[c] > 0);
	free(count);
	dpoint_choice_fini(&choice);
	dpoint_cover_fini(&cover);
	dpoint_surface_fini(&surface);
}

static void of_nothing_nothing_is_chosen(void **state)
{
	const struct dpoint_cover_options o = options(0.02, 3);
	struct dpoint_surface surface;
	struct dpoint_cover cover;
	struct dpoint_choice choice;
	struct dpoint_errors errors;

	(void)state;
	dpoint_surface_init(&surface);
	assert_non_null(dpoint_surface_cell(&surface));
	memset(surface.cell, 0, sizeof *surface.cell);
	assert_int_equal(dpoint_cover_init(&cover, &surface, &o, NULL, NULL), PSR_OK);
	assert_int_equal(dpoint_choose(&choice, &cover), PSR_OK);
	assert_int_equal(choice.n_kept, 0);
	assert_int_equal(choice.n_holes, 1);
	assert_int_equal(dpoint_measure(&errors, &surface, &cover, &choice, NULL), PSR_OK);
	assert_true(errors.normal_worst == 0 && errors.overlap == 0);
	dpoint_choice_fini(&choice);
	dpoint_cover_fini(&cover);
	dpoint_surface_fini(&surface);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(candidates_cover_the_cells_within_their_rectangles),
		cmocka_unit_test(a_choice_covers_what_can_be_covered_and_has_none_too_much),
		cmocka_unit_test(no_ray_slips_between_the_chosen_rectangles),
		cmocka_unit_test(threads_choose_the_same),
		cmocka_unit_test(groups_hold_all_points_and_what_they_draw),
		cmocka_unit_test(points_have_their_own_deltas_where_that_is_shorter),
		cmocka_unit_test(one_candidate_takes_the_place_of_several),
		cmocka_unit_test(of_nothing_nothing_is_chosen),
	};

	only_threads_under_tsan();
	return cmocka_run_group_tests(tests, NULL, NULL);
}
