#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <dlfcn.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "import/import.h"
#include "psr/build.h"
#include "model/blocks.h"

static uint64_t state_of_random;
static int n_threads_made;

/* Stands before the C library's: counts. */
int pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*start)(void *), void *userdata)
{
	int (*real)(pthread_t *, const pthread_attr_t *, void *(*)(void *), void *);
	void *symbol = dlsym(RTLD_NEXT, "pthread_create");

	memcpy(&real, &symbol, sizeof real);
	n_threads_made++;
	return real(thread, attributes, start, userdata);
}

static double random_unit(void)
{
	/* splitmix64 */
	uint64_t z = state_of_random += 0x9e3779b97f4a7c15u;

	z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
	z = (z ^ z >> 27) * 0x94d049bb133111ebu;
	return (double)((z ^ z >> 31) >> 11) / 9007199254740992.0;
}

static void init(struct import_mesh *im, uint32_t n)
{
	struct psr_material material;

	psr_material_default(&material);
	assert_int_equal(import_mesh_init(im, "cloud", NULL), PSR_OK);
	assert_int_equal(import_mesh_add_material(im, &material, NULL), 0);
	assert_int_equal(import_mesh_grow_points(im, n, 0, NULL), PSR_OK);
	state_of_random = n;
}

static struct psr_mesh *finish(struct import_mesh *im)
{
	struct psr_mesh *mesh = NULL;
	struct psr_error err = { 0, "" };

	if (import_mesh_finish(&mesh, im, &err) != PSR_OK)
		fail_msg("%s", err.text);
	import_mesh_fini(im);
	return mesh;
}

static double dot(const float a[3], const double b[3])
{
	return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void sphere_point(double p[3])
{
	double z = 2 * random_unit() - 1, a = 2 * M_PI * random_unit(), r = sqrt(1 - z * z);

	p[0] = r * cos(a);
	p[1] = r * sin(a);
	p[2] = z;
}

static void normals_of_a_sphere_are_radial_and_outwards(void **state)
{
	(void)state;
	enum { N = 20000 };
	struct import_mesh im;
	double most = 0, sum = 0;

	init(&im, N);
	for (uint32_t i = 0; i < N; i++)
		sphere_point(im.mesh->point[i]);
	struct psr_mesh *m = finish(&im);
	/* The 16 nearest of N points lie within a disc of radius rho with N rho^2 / 4 = 16. There the surface is
	 * z = -r^2 / 2, and the slope of the plane fitted to n = 17 uniform points has, an axis, the deviation
	 * sqrt(E[x^2 (z - E z)^2] / n) / E[x^2] = sqrt(rho^6 / 192 / 17) / (rho^2 / 4) = 0.07 rho: the mean angle is
	 * sqrt(pi / 2) times that, 0.09 rho, and more as rho and the moments of so few points vary, but not twice. No angle
	 * exceeds what the neighbours subtend, rho, where those are all within 1.5 rho. */
	double rho = sqrt(64.0 / N);

	assert_int_equal(m->n_points, N);
	for (uint32_t i = 0; i < N; i++) {
		double angle, c = dot(m->point_normal[i], m->point[i]);

		assert_true(c > 0);
		angle = acos(fmin(c, 1));
		most = fmax(most, angle);
		sum += angle;
	}
	print_message("# mean %.3f rho, most %.3f rho\n", sum / N / rho, most / rho);
	assert_true(sum / N < 0.18 * rho);
	assert_true(most < 1.5 * rho);
	psr_mesh_destroy(m);
}

static void normals_of_a_torus_are_outwards_everywhere(void **state)
{
	(void)state;
	enum { N = 30000 };
	struct import_mesh im;
	double(*truth)[3] = malloc(N * sizeof *truth);

	init(&im, N);
	for (uint32_t i = 0; i < N; i++) {
		double u = 2 * M_PI * random_unit(), v = 2 * M_PI * random_unit(), *p = im.mesh->point[i];

		truth[i][0] = cos(u) * cos(v);
		truth[i][1] = sin(u) * cos(v);
		truth[i][2] = sin(v);
		p[0] = (5 + cos(v)) * cos(u);
		p[1] = (5 + cos(v)) * sin(u);
		p[2] = sin(v) + 1e6;
	}
	struct psr_mesh *m = finish(&im);

	for (uint32_t i = 0; i < N; i++)
		assert_true(dot(m->point_normal[i], truth[i]) > 0);
	free(truth);
	psr_mesh_destroy(m);
}

static void terrain_looks_up_at_survey_coordinates(void **state)
{
	(void)state;
	enum { N = 10000 };
	struct import_mesh im;

	init(&im, N);
	for (uint32_t i = 0; i < N; i++) {
		double x = 100 * random_unit(), y = 100 * random_unit();

		im.mesh->point[i][0] = 412345.678 + x;
		im.mesh->point[i][1] = 5312345.678 + y;
		im.mesh->point[i][2] = 431.5 + 3 * sin(x / 10) * cos(y / 13);
	}
	struct psr_mesh *m = finish(&im);

	for (uint32_t i = 0; i < N; i++)
		assert_true(m->point_normal[i][2] > 0.5f); /* the steepest slope is 0.3 */
	psr_mesh_destroy(m);
}

/* How many of random places inside are in no disc. */
static uint32_t count_holes(const struct psr_mesh *m, double side, double border, uint32_t n)
{
	uint32_t holes = 0;

	for (uint32_t i = 0; i < n; i++) {
		double x = border + (side - 2 * border) * random_unit(), y = border + (side - 2 * border) * random_unit();
		int is_covered = 0;

		for (uint32_t p = 0; p < m->n_points && !is_covered; p++) {
			double dx = m->point[p][0] - x, dy = m->point[p][1] - y, r = m->point_radius[p];

			is_covered = dx * dx + dy * dy <= r * r;
		}
		holes += !is_covered;
	}
	return holes;
}

static double mean_radius(const struct psr_mesh *m)
{
	double sum = 0;

	for (uint32_t i = 0; i < m->n_points; i++)
		sum += m->point_radius[i];
	return sum / m->n_points;
}

static void discs_cover_random_points(void **state)
{
	(void)state;
	enum { N = 8000 };
	struct import_mesh im;

	init(&im, N);
	for (uint32_t i = 0; i < N; i++)
		for (int c = 0; c < 2; c++)
			im.mesh->point[i][c] = random_unit();
	struct psr_mesh *m = finish(&im);

	/* The cell of a point beside a gap that its 16 neighbours do not reach across stays open: the bound is that of
	 * adequacy, 1 in 10,000. */
	assert_true(count_holes(m, 1, 0.02, 100000) < 10);
	print_message("# mean radius %.3f spacings\n", mean_radius(m) * sqrt(N));
	/* One radius for all that leaves exp(-N pi r^2) = 1e-4 open would be 1.7 spacings; those of the cells are less. */
	assert_true(mean_radius(m) * sqrt(N) < 1.7);
	psr_mesh_destroy(m);
}

static void discs_of_a_grid_reach_the_middle_between_four(void **state)
{
	(void)state;
	enum { SIDE = 50 };
	struct import_mesh im;

	init(&im, SIDE * SIDE);
	for (uint32_t i = 0; i < SIDE * SIDE; i++) {
		im.mesh->point[i][0] = i % SIDE;
		im.mesh->point[i][1] = i / SIDE;
	}
	struct psr_mesh *m = finish(&im);

	/* half a diagonal, and 5 % of overlap; floats are 2^-24 off */
	for (uint32_t i = 0; i < SIDE * SIDE; i++)
		assert_true(fabs(m->point_radius[i] / (1.05 * sqrt(0.5)) - 1) < 1e-6);
	psr_mesh_destroy(m);
}

static void an_outlier_stays_small(void **state)
{
	(void)state;
	enum { N = 1000 };
	struct import_mesh im;

	init(&im, N + 1);
	for (uint32_t i = 0; i < N; i++)
		sphere_point(im.mesh->point[i]);
	im.mesh->point[N][0] = 1e5;
	struct psr_mesh *m = finish(&im);
	float most = 0;

	for (uint32_t i = 0; i < N; i++)
		most = fmaxf(most, m->point_radius[i]);
	assert_true(m->point_radius[N] > 0 && m->point_radius[N] <= 2 * most);
	/* and costs the others nothing. A corner of Voronoi's 2 N is farther than r with a chance of (1 + a) exp(-a), where
	 * a = N / (4 pi) pi r^2: 2000 * 21 exp(-20) < 1e-4 for a = 20. */
	assert_true(most < 1.05 * sqrt(80.0 / N));
	psr_mesh_destroy(m);
}

static void points_at_one_place_are_one(void **state)
{
	(void)state;
	struct import_mesh im;

	init(&im, 12);
	for (uint32_t i = 0; i < 12; i++) {
		im.mesh->point[i][0] = i % 4;
		im.mesh->point[i][1] = i % 4 == 0 && i >= 4 ? -0.0 : 0.0;
	}
	im.mesh->point[11][1] = NAN;
	im.mesh->point[10][2] = INFINITY;
	struct psr_mesh *m = finish(&im);

	assert_int_equal(m->n_points, 4);
	assert_int_equal(m->n_dropped_primitives, 8);
	assert_non_null(strstr(m->warning, "not finite were left out: 2"));
	assert_non_null(strstr(m->warning, "duplicate points were left out: 6"));
	psr_mesh_destroy(m);
}

static void normals_of_the_file_stay_and_turn_the_others(void **state)
{
	(void)state;
	enum { N = 2000 };
	struct import_mesh im;

	init(&im, N);
	for (uint32_t i = 0; i < N; i++) {
		sphere_point(im.mesh->point[i]);
		for (int c = 0; c < 3 && i % 100 == 0; c++) /* inwards, and twice as long */
			im.mesh->point_normal[i][c] = (float)(-2 * im.mesh->point[i][c]);
	}
	struct psr_mesh *m = finish(&im);

	for (uint32_t i = 0; i < N; i++) {
		double c = dot(m->point_normal[i], m->point[i]);

		assert_true(c < 0);
		/* three floats, each 2^-25 off before and 2^-25 after they were divided */
		assert_true(i % 100 != 0 || c < -1 + 1e-6);
	}
	psr_mesh_destroy(m);
}

/* Whatever the coordinates: finite unit normals, positive finite radii. */
static void odd_clouds_keep_the_promises(void **state)
{
	(void)state;
	static const double scale[] = { 1e-320, 1e-300, 1e-160, 1e-30, 1, 1e38, 1e150, 1.7e308 };

	for (uint32_t n = 1; n < 40; n++)
		for (size_t s = 0; s < sizeof scale / sizeof scale[0]; s++)
			for (int kind = 0; kind < 4; kind++) {
				struct import_mesh im;

				init(&im, n);
				for (uint32_t i = 0; i < n; i++) {
					double *p = im.mesh->point[i], t = scale[s] * (2 * random_unit() - 1);

					for (int c = 0; c < 3; c++)
						p[c] = kind == 0   ? scale[s] * (2 * random_unit() - 1)
						       : kind == 1 ? t / 3 * (c + 1)
						       : kind == 2 ? scale[s] / 4 * (double)(i / 3 % (2 + (unsigned)c))
						                   : i == 0 ? scale[s] : 1e-9 * i * (c + 1);
				}
				struct psr_mesh *m = finish(&im);

				for (uint32_t i = 0; i < m->n_points; i++) {
					const float *v = m->point_normal[i];

					assert_true(fabs(sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) - 1) < 1e-6);
					assert_true(m->point_radius[i] > 0 && isfinite(m->point_radius[i]));
				}
				psr_mesh_destroy(m);
			}
}

/* The discs of a unit sphere at survey coordinates lie within a sphere that is larger by a radius at most. */
static void a_cloud_becomes_a_model(void **state)
{
	(void)state;
	enum { N = 2000 };
	struct psr_build_options options;
	struct psr_model *model = NULL;
	struct psr_error err = { 0, "" };
	struct import_mesh im;
	float most = 0;

	init(&im, N);
	for (uint32_t i = 0; i < N; i++) {
		sphere_point(im.mesh->point[i]);
		im.mesh->point[i][0] += 412345;
	}
	struct psr_mesh *m = finish(&im);

	for (uint32_t i = 0; i < N; i++)
		most = fmaxf(most, m->point_radius[i]);
	psr_build_options_default(&options);
	options.resolution = 32;
	if (psr_model_build(&model, m, &options, NULL, &err) != PSR_OK)
		fail_msg("%s", err.text);
	/* the sphere's half that one view sees has pi / 4 / 3 of the 32 x 32 pixels at least; there are two */
	assert_true(psr_model_blocks(model)->n_samples > 2 * 268);
	assert_true(psr_model_info(model)->scale > 0.99 && psr_model_info(model)->scale < sqrt(3) * (1 + most));
	assert_true(fabs(psr_model_info(model)->origin[0] - 412345) < most + 0.01);
	psr_model_unref(model);
	psr_mesh_destroy(m);
}

static struct psr_mesh *sphere_by(int n_threads)
{
	enum { N = 30000 };
	struct import_mesh im;

	init(&im, N);
	im.options.n_threads = n_threads;
	for (uint32_t i = 0; i < N; i++)
		sphere_point(im.mesh->point[i]);
	n_threads_made = 0;
	return finish(&im);
}

static void a_cloud_takes_as_many_threads_as_it_may(void **state)
{
	(void)state;
	/* the caller is one of them */
	psr_mesh_destroy(sphere_by(1));
	assert_int_equal(n_threads_made, 0);
	psr_mesh_destroy(sphere_by(3));
	assert_int_equal(n_threads_made, 2);
}

static void threads_change_no_bit_of_a_cloud(void **state)
{
	(void)state;
	struct psr_mesh *one = sphere_by(1), *three = sphere_by(3);

	assert_int_equal(one->n_points, three->n_points);
	assert_memory_equal(one->point, three->point, one->n_points * sizeof *one->point);
	assert_memory_equal(one->point_normal, three->point_normal, one->n_points * sizeof *one->point_normal);
	assert_memory_equal(one->point_radius, three->point_radius, one->n_points * sizeof *one->point_radius);
	psr_mesh_destroy(one);
	psr_mesh_destroy(three);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(normals_of_a_sphere_are_radial_and_outwards),
		cmocka_unit_test(normals_of_a_torus_are_outwards_everywhere),
		cmocka_unit_test(terrain_looks_up_at_survey_coordinates),
		cmocka_unit_test(discs_cover_random_points),
		cmocka_unit_test(discs_of_a_grid_reach_the_middle_between_four),
		cmocka_unit_test(an_outlier_stays_small),
		cmocka_unit_test(points_at_one_place_are_one),
		cmocka_unit_test(normals_of_the_file_stay_and_turn_the_others),
		cmocka_unit_test(odd_clouds_keep_the_promises),
		cmocka_unit_test(a_cloud_becomes_a_model),
		cmocka_unit_test(a_cloud_takes_as_many_threads_as_it_may),
		cmocka_unit_test(threads_change_no_bit_of_a_cloud),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
