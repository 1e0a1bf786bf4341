#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <string.h>
#include <cmocka.h>
#include "base/random.h"
#include "base/vec.h"
#include "patches.h"

/* Curvatures are quotients of sums of some twenty products, each within 2^-52 of its terms. */
#define EXACT 1e-10

typedef void check(const struct dpoint_local *local, const struct dpoint *point);

static int visit(const struct dpoint_patch *patch, check *look)
{
	struct dpoint_span span;
	uint64_t seed = 1;
	int n = 0, n_bad = 0;

	assert_int_equal(dpoint_patch_check(patch, NULL), PSR_OK);
	for (; dpoint_patch_span(&span, patch, (uint32_t)n); n++) {
		for (int i = 0; i < 500; i++) {
			const double uv[2] = { random_in(&seed, 0, 1), i == 0 ? 0 : random_in(&seed, 0, 1) };
			struct dpoint_local local;
			struct dpoint point;
			double at[3];
			int is_good = dpoint_patch_local(&local, patch, &span, uv);

			dpoint_patch_place(at, patch, &span, uv);
			for (int k = 0; k < 3; k++)
				assert_true(at[k] == local.at[k]);
			n_bad += !is_good;
			if (!is_good)
				continue;
			assert_int_equal(dpoint_make(&point, &local), DPOINT_MADE);
			look(&local, &point);
		}
	}
	assert_true(n_bad <= n);
	return n;
}

static void near(double a, double b)
{
	if (!(fabs(a - b) <= EXACT * fmax(1, fabs(b))))
		fail_msg("%.17g is not %.17g", a, b);
}

static void is_sphere(const struct dpoint_local *l, const struct dpoint *p)
{
	(void)p;
	near(v3d_length(l->at), 0.5);
	near(v3d_dot(l->at, l->axis[2]), 0.5);
	/* Next to a pole Su is short: its rounding counts the more. */
	if (hypot(l->at[0], l->at[1]) < 0.01)
		return;
	near(l->shape[0], -2);
	near(l->shape[1], 0);
	near(l->shape[2], -2);
}

static void is_cylinder(const struct dpoint_local *l, const struct dpoint *p)
{
	near(l->axis[2][2], 0);
	assert_true(fabs(p->lambda_u + 1 / 0.25) < 1e-6 && fabs(p->rho) < 1e-9);
	assert_true(fabs(p->u[2]) < 1e-6);
}

/* A torus of radii 1 and 0.25: 1/0.25 around the tube, cos(a) / distance from the axis along it. */
static void is_torus(const struct dpoint_local *l, const struct dpoint *p)
{
	const double away = hypot(l->at[0], l->at[1]), cosine = (away - 1) / 0.25;
	const double along[3] = { -l->at[1] / away, l->at[0] / away, 0 };
	double u[3] = { p->u[0], p->u[1], p->u[2] };

	near((away - 1) * (away - 1) + l->at[2] * l->at[2], 0.0625);
	assert_true(fabs(p->lambda_u + 4) < 1e-6 && fabs(p->rho - cosine / away / 4) < 1e-6);
	assert_true(fabs(v3d_dot(u, along)) < 1e-6);
}

/* z = (a x^2 + 2 b x y + c y^2) / 2: mean and Gaussian curvature of a graph. */
static void is_saddle(const struct dpoint_local *l, const struct dpoint *p)
{
	const double a = 1, b = 0.5, c = -2, x = l->at[0], y = l->at[1];
	const double zx = a * x + b * y, zy = b * x + c * y, w = 1 + zx * zx + zy * zy;

	near(l->at[2], (a * x * x + 2 * b * x * y + c * y * y) / 2);
	near(l->shape[0] * l->shape[2] - l->shape[1] * l->shape[1], (a * c - b * b) / (w * w));
	near(l->shape[0] + l->shape[2], ((1 + zx * zx) * c - 2 * zx * zy * b + (1 + zy * zy) * a) / (w * sqrt(w)));
	assert_true(p->rho < 0);
}

/* Semiaxes 1, 0.6 and 0.3 of x, y and z. */
static void is_ellipsoid(const struct dpoint_local *l, const struct dpoint *p)
{
	const double axis[3] = { 1, 0.6, 0.3 };
	double q = 0, product = 1, sum, normal[3];

	(void)p;
	for (int k = 0; k < 3; k++) {
		normal[k] = l->at[k] / (axis[k] * axis[k]);
		q += normal[k] * normal[k];
		product *= axis[k] * axis[k];
	}
	near(v3d_dot(normal, l->axis[2]) / sqrt(q), 1);
	if (hypot(l->at[0], l->at[1]) < 0.1)
		return;
	near(l->shape[0] * l->shape[2] - l->shape[1] * l->shape[1], 1 / (product * q * q));
	sum = v3d_dot(l->at, l->at) - (axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
	near(l->shape[0] + l->shape[2], sum / (product * q * sqrt(q)));
}

static void exact_surfaces_have_exact_curvatures(void **state)
{
	struct revolved s;

	(void)state;
	revolve(&s, 0, 0.5, 6, 5);
	assert_int_equal(visit(&s.patch, is_sphere), 8);
	cylinder(&s, 0.25);
	assert_int_equal(visit(&s.patch, is_cylinder), 4);
	revolve(&s, 1, 0.25, 0, 9);
	assert_int_equal(visit(&s.patch, is_torus), 16);
	quadric(&s, 1, 0.5, -2);
	assert_int_equal(visit(&s.patch, is_saddle), 1);
	revolve(&s, 0, 1, 6, 5);
	for (int i = 0; i < 45; i++) {
		s.control[i][1] *= 0.6;
		s.control[i][2] *= 0.3;
	}
	assert_int_equal(visit(&s.patch, is_ellipsoid), 8);
}

static void knots_with_repeats(double *knot, uint32_t n, int degree, uint64_t *seed)
{
	double at = -1;

	for (uint32_t i = 0; i < n + (unsigned)degree + 1; i++) {
		if ((int)i > degree && i <= n && (i == n || random_below(seed, 3) > 0))
			at += random_in(seed, 0.3, 1);
		knot[i] = at;
	}
}

/* Random patches: differences of places over 2 h, of which the third derivatives make h^2 and rounding 2^-52 / h^2. */
static void forms_are_those_of_differences(void **state)
{
	static const int degrees[] = { 1, 2, 3, 4, 7, 15 };
	uint64_t seed = 5;

	(void)state;
	for (int round = 0; round < 60; round++) {
		double knot[2][64], control[900][4];
		struct dpoint_patch patch = { .knot = { knot[0], knot[1] }, .control = (const double (*)[4])control };
		struct dpoint_span span;

		for (int k = 0; k < 2; k++) {
			patch.degree[k] = degrees[random_below(&seed, 6)];
			patch.n[k] = (uint32_t)patch.degree[k] + 1 + random_below(&seed, 8);
			knots_with_repeats(knot[k], patch.n[k], patch.degree[k], &seed);
		}
		for (uint32_t i = 0; i < patch.n[0] * patch.n[1]; i++) {
			control[i][0] = i / patch.n[1] + random_in(&seed, -0.2, 0.2);
			control[i][1] = i % patch.n[1] + random_in(&seed, -0.2, 0.2);
			control[i][2] = random_in(&seed, -0.5, 0.5);
			control[i][3] = random_in(&seed, 0.7, 1.4);
		}
		assert_int_equal(dpoint_patch_check(&patch, NULL), PSR_OK);
		for (uint32_t i = 0; dpoint_patch_span(&span, &patch, i); i++) {
			const double h = 1e-3, uv[2] = { random_in(&seed, 0.1, 0.9), random_in(&seed, 0.1, 0.9) };
			double p[3][3][3], height = 0;
			struct dpoint_local local;

			assert_true(dpoint_patch_local(&local, &patch, &span, uv));
			for (int a = 0; a < 3; a++)
				for (int b = 0; b < 3; b++)
					dpoint_patch_place(p[a][b], &patch, &span,
					                   (const double[2]){ uv[0] + (a - 1) * h, uv[1] + (b - 1) * h });
			/* The height of neighbours above the tangent plane is that of the shape. */
			for (int a = 0; a < 9; a += 2) {
				double away[3], x, y;

				v3d_sub(away, p[a / 3][a % 3], local.at);
				x = v3d_dot(away, local.axis[0]);
				y = v3d_dot(away, local.axis[1]);
				height = local.shape[0] * x * x + 2 * local.shape[1] * x * y + local.shape[2] * y * y;
				assert_true(fabs(v3d_dot(away, local.axis[2]) - height / 2) <= 2e-4 * h + 1e-12);
			}
		}
	}
}

static void poles_are_found_and_their_neighbours_are_good(void **state)
{
	struct dpoint_span span;
	struct dpoint_local local;
	struct dpoint point;
	struct revolved s;

	(void)state;
	revolve(&s, 0, 1, 6, 5);
	assert_true(dpoint_patch_span(&span, &s.patch, 0));
	assert_false(dpoint_patch_local(&local, &s.patch, &span, (const double[2]){ 0.3, 0 }));
	near(local.at[2], -1);
	/* The second form is off by some 2^-52 / distance^2 from the pole. */
	assert_true(dpoint_patch_local(&local, &s.patch, &span, (const double[2]){ 0.3, 1e-5 }));
	assert_int_equal(dpoint_make(&point, &local), DPOINT_MADE);
	assert_true(fabs(point.lambda_u + 1) < 1e-4);
}

static void bad_patches_are_refused(void **state)
{
	struct revolved s;
	struct psr_error err;
	double knot[12];

	(void)state;
	memcpy(knot, turn_knots, sizeof knot);
	revolve(&s, 1, 0.25, 0, 9);
	s.patch.knot[0] = knot;
	assert_int_equal(dpoint_patch_check(&s.patch, &err), PSR_OK);
	knot[5] = 0.5;
	assert_int_equal(dpoint_patch_check(&s.patch, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "fall"));
	knot[5] = NAN;
	assert_int_equal(dpoint_patch_check(&s.patch, &err), PSR_ERR_FORMAT);
	for (int i = 0; i < 12; i++)
		knot[i] = 1;
	assert_int_equal(dpoint_patch_check(&s.patch, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "domain"));
	s.patch.knot[0] = turn_knots;
	s.control[3][3] = 0;
	assert_int_equal(dpoint_patch_check(&s.patch, &err), PSR_ERR_FORMAT);
	s.control[3][3] = 1;
	s.control[7][0] = INFINITY;
	assert_int_equal(dpoint_patch_check(&s.patch, &err), PSR_ERR_FORMAT);
	s.control[7][0] = 1;
	s.patch.degree[1] = 16;
	assert_int_equal(dpoint_patch_check(&s.patch, &err), PSR_ERR_FORMAT);
	s.patch.degree[1] = 2;
	s.patch.n[1] = 2;
	assert_int_equal(dpoint_patch_check(&s.patch, &err), PSR_ERR_FORMAT);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(exact_surfaces_have_exact_curvatures),
		cmocka_unit_test(forms_are_those_of_differences),
		cmocka_unit_test(poles_are_found_and_their_neighbours_are_good),
		cmocka_unit_test(bad_patches_are_refused),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
