#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "base/grid.h"
#include "base/maths.h"
#include "base/random.h"
#include "base/vec.h"
#include "dpoint/cloud_fit.h"

/* Clouds of surfaces that are zeros of a function, whose derivatives tell all there is to be found. */
enum surface { SPHERE, CYLINDER, TORUS, SADDLE, CUBE, N_SMOOTH = CUBE };
static const char *const names[] = { "sphere", "cylinder", "torus", "saddle", "cube" };

#define DELTA 0.125f
static const struct dpoint_cover_options cover = { .sine = 0.141f, .slack = 2e-5f, .angle = (float)(2 * PSR_DEGREE),
	                                               .height = 0.002f };

static double value(enum surface surface, const double p[3])
{
	const double round = sqrt(p[0] * p[0] + p[1] * p[1]);

	if (surface == SPHERE)
		return v3d_length(p) - 0.9;
	if (surface == CYLINDER)
		return round - 0.5;
	if (surface == TORUS)
		return sqrt((round - 0.6) * (round - 0.6) + p[2] * p[2]) - 0.3;
	if (surface == SADDLE)
		return (p[2] - (0.5 * p[0] * p[0] - 0.8 * p[1] * p[1])) / sqrt(1 + p[0] * p[0] + 2.56 * p[1] * p[1]);
	return fmax(fabs(p[0]), fmax(fabs(p[1]), fabs(p[2]))) - 0.5;
}

#define STEP 1e-4
static double moved(enum surface surface, const double p[3], int a, double by_a, int b, double by_b)
{
	double q[3] = { p[0], p[1], p[2] };

	q[a] += by_a;
	q[b] += by_b;
	return value(surface, q);
}

/* Returns the length of the first derivatives. */
static double exact_normal(double normal[3], enum surface surface, const double p[3])
{
	for (int a = 0; a < 3; a++)
		normal[a] = (moved(surface, p, a, STEP, a, 0) - moved(surface, p, a, -STEP, a, 0)) / (2 * STEP);
	return v3d_normalize(normal, normal);
}

/* Unit normal, and the second form: minus the second derivatives over the first. */
static void exact(double normal[3], double second[3][3], enum surface surface, const double p[3])
{
	const double length = exact_normal(normal, surface, p);

	for (int a = 0; a < 3; a++)
		for (int b = 0; b < 3; b++)
			second[a][b] = -(moved(surface, p, a, STEP, b, STEP) - moved(surface, p, a, STEP, b, -STEP) -
			                 moved(surface, p, a, -STEP, b, STEP) + moved(surface, p, a, -STEP, b, -STEP)) /
			               (4 * STEP * STEP * length);
}

static double form(const double second[3][3], const double a[3], const double b[3])
{
	double sum = 0;

	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 3; k++)
			sum += a[i] * second[i][k] * b[k];
	return sum;
}

struct sampled {
	uint32_t n;
	double (*at)[3];
	float (*normal)[3], *radius;
	uint32_t *near, *part;
	uint64_t *attr;
	struct dpoint_cloud cloud;
	struct cloud_fit *fit;
};

static void put_in_grid(struct grid *grid, uint32_t *next, const struct sampled *s, uint32_t i)
{
	const float p[3] = { (float)s->at[i][0], (float)s->at[i][1], (float)s->at[i][2] };

	assert_int_equal(grid_put(grid, p, i, &next[i]), PSR_OK);
}

/* Lists the points of all cells that are within the radius of p. */
static uint32_t list_near(uint32_t *list, const struct grid *grid, const uint32_t *next, const double place[3],
                          double radius)
{
	const float p[3] = { (float)place[0], (float)place[1], (float)place[2] };
	uint32_t first[GRID_MOST_AROUND], n = 0;

	for (int c = grid_around(grid, p, radius, first); c-- > 0;)
		for (uint32_t i = first[c]; i != GRID_NONE; i = next[i])
			list[n++] = i;
	return n;
}

/* Random places of the surface no nearer to each other than h / 2, about as many as fit. */
static void sample(struct sampled *s, enum surface surface, double h, double noise)
{
	const uint32_t most = (uint32_t)(14 / (h * h));
	uint32_t *near = malloc(most * sizeof *near), *next = malloc(most * sizeof *next);
	struct grid grid;
	uint64_t seed = 5;

	s->n = 0;
	s->at = malloc(most * sizeof *s->at);
	assert_int_equal(grid_init(&grid, h), PSR_OK);
	for (int tries = 0; tries < 150000 && s->n < most; tries++) {
		double p[3], normal[3];
		int is_free = 1;

		for (int k = 0; k < 3; k++)
			p[k] = random_in(&seed, -1, 1);
		for (int turn = 0; turn < 4; turn++) {
			exact_normal(normal, surface, p);
			v3d_add_scaled(p, p, -value(surface, p), normal);
		}
		if (fabs(value(surface, p)) > 1e-9 || fabs(p[0]) > 1 || fabs(p[1]) > 1 || fabs(p[2]) > 1)
			continue;
		for (uint32_t n = list_near(near, &grid, next, p, h); n > 0 && is_free; n--) {
			double away[3];

			v3d_sub(away, s->at[near[n - 1]], p);
			is_free = v3d_dot(away, away) > h * h / 4;
		}
		if (is_free) {
			memcpy(s->at[s->n], p, sizeof p);
			put_in_grid(&grid, next, s, s->n++);
		}
	}
	grid_fini(&grid);
	free(near);
	free(next);
	s->normal = malloc(s->n * sizeof *s->normal);
	s->radius = malloc(s->n * sizeof *s->radius);
	s->part = calloc(s->n, sizeof *s->part);
	s->attr = calloc(s->n, sizeof *s->attr);
	s->near = malloc((size_t)s->n * DPOINT_MOST_NEAR * sizeof *s->near);
	s->fit = malloc(s->n * sizeof *s->fit);
	for (uint32_t i = 0; i < s->n; i++) {
		double normal[3], off[3] = { 0.17, 0, 0 };

		exact_normal(normal, surface, s->at[i]);
		v3d_add_scaled(s->at[i], s->at[i], noise * (random_in(&seed, -1, 1) + random_in(&seed, -1, 1)), normal);
		/* Off by some 10 degrees to begin with. */
		v3d_add(normal, normal, off);
		v3d_normalize(normal, normal);
		v3f_set(s->normal[i], (float)normal[0], (float)normal[1], (float)normal[2]);
		s->radius[i] = (float)(0.6 * h);
	}
}

/* The nearest of each, the first of those that are as near. */
static void find_near(struct sampled *s, double h)
{
	uint32_t *list = malloc(s->n * sizeof *list), *next = malloc(s->n * sizeof *next);
	struct grid grid;

	assert_int_equal(grid_init(&grid, 2 * h), PSR_OK);
	for (uint32_t i = 0; i < s->n; i++)
		put_in_grid(&grid, next, s, i);
	for (uint32_t i = 0; i < s->n; i++) {
		double distance[DPOINT_MOST_NEAR];
		uint32_t *near = &s->near[i * DPOINT_MOST_NEAR], n;

		/* What is in no cell that is looked at is as far as the radius; cells go by floats. */
		for (double radius = 3 * h; n = 0, radius <= 8 * h; radius += h) {
			for (uint32_t left = list_near(list, &grid, next, s->at[i], radius); left > 0; left--) {
				const uint32_t j = list[left - 1];
				double away[3], d;
				uint32_t to;

				v3d_sub(away, s->at[j], s->at[i]);
				d = v3d_dot(away, away);
				to = n;
				while (to > 0 && (distance[to - 1] > d || (distance[to - 1] == d && near[to - 1] > j)))
					to--;
				if (j == i || to == DPOINT_MOST_NEAR)
					continue;
				n += n < DPOINT_MOST_NEAR;
				memmove(&distance[to + 1], &distance[to], (n - 1 - to) * sizeof *distance);
				memmove(&near[to + 1], &near[to], (n - 1 - to) * sizeof *near);
				distance[to] = d;
				near[to] = j;
			}
			if (n == DPOINT_MOST_NEAR && sqrt(distance[n - 1]) < radius - 1e-6)
				break;
		}
		assert_int_equal(n, DPOINT_MOST_NEAR);
	}
	grid_fini(&grid);
	free(list);
	free(next);
	s->cloud = (struct dpoint_cloud){ s->n, DPOINT_MOST_NEAR, (const double (*)[3])s->at, (const float (*)[3])s->normal,
		                              s->radius, s->near, s->part, s->attr };
}

static void make(struct sampled *s, enum surface surface, double h, double noise)
{
	sample(s, surface, h, noise);
	find_near(s, h);
	assert_int_equal(cloud_fit_all(s->fit, &s->cloud, &cover, DELTA, NULL), PSR_OK);
}

static void drop(struct sampled *s)
{
	free(s->at);
	free(s->normal);
	free(s->radius);
	free(s->near);
	free(s->part);
	free(s->attr);
	free(s->fit);
}

struct errors {
	double curvature, direction, normal, place; /* root mean squares; of both curvatures; radians */
	uint32_t n, n_directed;
};

/* Of places that are three spacings and more from where the surface was cut. */
static void measure(struct errors *e, const struct sampled *s, enum surface surface, double h)
{
	memset(e, 0, sizeof *e);
	for (uint32_t i = 0; i < s->n; i++) {
		const struct cloud_fit *fit = &s->fit[i];
		double normal[3], second[3][3], u[3], v[3], dot, off, across;
		struct dpoint p;

		if ((surface == CYLINDER || surface == SADDLE) &&
		    fmax(fabs(s->at[i][0]), fmax(fabs(s->at[i][1]), fabs(s->at[i][2]))) > 1 - 3 * h)
			continue;
		assert_int_equal(dpoint_make(&p, &fit->local), DPOINT_MADE);
		exact(normal, second, surface, s->at[i]);
		v3d_set(u, p.u[0], p.u[1], p.u[2]);
		v3d_cross(v, normal, u);
		dot = v3d_dot(normal, fit->local.axis[2]);
		off = form((const double(*)[3])second, u, v);
		e->normal += 2 * (1 - dot);
		e->place += pow(value(surface, fit->local.at), 2);
		e->curvature += pow(form((const double(*)[3])second, u, u) - (double)p.lambda_u, 2) +
		                pow(form((const double(*)[3])second, v, v) - (double)(p.lambda_u * p.rho), 2);
		e->n++;
		across = fabs((double)p.lambda_u * (1 - (double)p.rho));
		if (across > 0.5) {
			/* The second form is off * 2 / across = tan of twice the angle to principal directions. */
			e->direction += off * off / (across * across);
			e->n_directed++;
		}
	}
	assert_true(e->n > 50);
	e->curvature = sqrt(e->curvature / (2 * e->n));
	e->direction = e->n_directed > 0 ? sqrt(e->direction / e->n_directed) : 0;
	e->normal = sqrt(e->normal / e->n);
	e->place = sqrt(e->place / e->n);
}

/* A polynomial of the second degree leaves out the third derivatives: curvatures and directions are off by the first
 * power of h, normals by the second, places by the third. Samples at random give some scatter, so powers are asked for
 * less 0.3. */
static void errors_fall_with_the_spacing(void **state)
{
	static const double h[] = { 0.12, 0.06, 0.03 };

	(void)state;
	for (enum surface surface = 0; surface < N_SMOOTH; surface++) {
		struct errors e[3];

		for (int level = 0; level < 3; level++) {
			struct sampled s;

			make(&s, surface, h[level], 0);
			measure(&e[level], &s, surface, h[level]);
			print_message("# %-8s %5u points, h %.3f: curvatures %.2e, directions %.2e, normals %.2e, places %.2e\n",
			              names[surface], s.n, h[level], e[level].curvature, e[level].direction, e[level].normal,
			              e[level].place);
			drop(&s);
			if (level == 0)
				continue;
			assert_true(e[level].curvature <= e[level - 1].curvature / pow(2, 0.7));
			assert_true(e[level].direction <= e[level - 1].direction / pow(2, 0.7) + 1e-6);
			assert_true(e[level].normal <= e[level - 1].normal / pow(2, 1.7));
			assert_true(e[level].place <= e[level - 1].place / pow(2, 2.7));
		}
	}
}

/* Points of a cube, which no polynomial fits at its edges: four in ten are within the two spacings of an edge that
 * neighbours reach. Those that find a face's own polynomial have its normal; all do but some beside corners. */
static void creases_part_polynomials(void **state)
{
	struct sampled s;
	uint32_t n_right = 0;

	(void)state;
	make(&s, CUBE, 0.06, 0);
	for (uint32_t i = 0; i < s.n; i++) {
		double normal[3], second[3][3];

		exact(normal, second, CUBE, s.at[i]);
		n_right += v3d_dot(normal, s.fit[i].local.axis[2]) > cos(5 * PSR_DEGREE);
	}
	print_message("# cube: %u of %u normals are within 5 degrees\n", n_right, s.n);
	assert_true(n_right > 0.9 * s.n);
	drop(&s);
}

/* Noise of a tenth of the spacing, h. The polynomial of the 16 nearest, which are within 2.2 h, has normals that are
 * off by 2 / (sqrt(16) 2.2 h) of it and more; those of more points by less. */
static void noise_takes_more_points(void **state)
{
	const double h = 0.06, noise = 0.006;
	struct sampled s;
	struct errors e;
	double off = 0;

	(void)state;
	make(&s, SPHERE, h, noise / sqrt(2.0 / 3));
	measure(&e, &s, SPHERE, h);
	for (uint32_t i = 0; i < s.n; i++)
		off += pow(value(SPHERE, s.at[i]), 2);
	print_message("# noise %.4f: normals %.2e, places %.2e, curvatures %.2e\n", sqrt(off / s.n), e.normal, e.place,
	              e.curvature);
	assert_true(e.place < 0.5 * noise);
	assert_true(e.normal < 2 * noise / (4 * 2.2 * h));
	drop(&s);
}

/* Too few, all along a line, and a line beside a surface. */
static void points_without_a_surface_are_flat(void **state)
{
	double at[40][3] = { { 0 } };
	float normal[40][3], radius[40];
	uint32_t near[40 * DPOINT_MOST_NEAR], part[40] = { 0 };
	uint64_t attr[40] = { 0 };

	(void)state;
	for (uint32_t n = 2; n <= 40; n += 19) {
		const uint32_t k = n - 1 < DPOINT_MOST_NEAR ? n - 1 : DPOINT_MOST_NEAR;
		struct dpoint_cloud cloud = { n, k, (const double (*)[3])at, (const float (*)[3])normal, radius, near, part, attr };
		struct dpoint_cloud_report report;
		struct dpoint_surface surface;

		for (uint32_t i = 0; i < n; i++) {
			v3d_set(at[i], 0.02 * i, 0, 0);
			v3f_set(normal[i], 0, 0, 1);
			radius[i] = 0.02f;
			for (uint32_t j = 0; j < k; j++)
				near[i * k + j] = (i + 1 + j) % n;
		}
		dpoint_surface_init(&surface);
		assert_int_equal(dpoint_sample_cloud(&surface, &report, &cloud, &cover, DELTA, NULL), PSR_OK);
		assert_true(report.n_flat == n && surface.n_bad == n && surface.n_candidates == n && !report.is_closed);
		for (uint32_t i = 0; i < n; i++) {
			const struct dpoint *p = &surface.candidate[i].point;

			assert_true(p->lambda_u == 0 && p->normal[2] > 0.999f && p->at[0] == (float)at[i][0]);
		}
		dpoint_surface_fini(&surface);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(errors_fall_with_the_spacing),
		cmocka_unit_test(creases_part_polynomials),
		cmocka_unit_test(noise_takes_more_points),
		cmocka_unit_test(points_without_a_surface_are_flat),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
