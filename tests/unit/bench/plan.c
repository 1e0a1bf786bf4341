/* What a load asks for: paths of cameras, choices by weight, ranges and limits as people write them, fairness. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/view.h"
#include "client/bench/measure.h"
#include "client/bench/plan.h"
#include "client/bench/sweep.h"
#include "../lib/folder.h"

static const struct scene scene = { .box_min = { -1, -2, -3 }, .box_max = { 1, 2, 3 }, .up = { 0, 1, 0 } };

static void make(struct flight *flight, const char *path)
{
	struct psr_error err;
	struct view_wish view;

	view_wish_init(&view);
	assert_int_equal(view_check(&view, &err), PSR_OK);
	if (flight_make(flight, path, &view, &scene, 4.0 / 3, &err) != PSR_OK)
		fail_msg("%s", err.text);
}

static double distance(const double a[3], const double b[3])
{
	return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
}

static void every_camera_of_every_path_is_valid_and_repeatable(void **state)
{
	static const char *const paths[] = { "orbit", "zoom", "flick", "random" };

	(void)state;
	for (size_t p = 0; p < sizeof paths / sizeof paths[0]; p++) {
		struct flight flight;

		make(&flight, paths[p]);
		for (uint64_t k = 0; k < 300; k++) {
			struct psr_camera camera, again, next;
			struct psr_error err;

			flight_at(&camera, &flight, k, 0.25, 99);
			flight_at(&again, &flight, k, 0.25, 99);
			flight_at(&next, &flight, k + 1, 0.25, 99);
			assert_memory_equal(&camera, &again, sizeof camera);
			if (view_check_camera(&camera, &err) != PSR_OK)
				fail_msg("%s, request %d: %s", paths[p], (int)k, err.text);
			assert_memory_not_equal(camera.eye, next.eye, sizeof camera.eye);
		}
		flight_fini(&flight);
	}
}

static void an_orbit_closes_and_clients_stand_apart(void **state)
{
	struct psr_camera first, last, other;
	struct flight flight;

	(void)state;
	make(&flight, "orbit");
	flight_at(&first, &flight, 0, 0, 0);
	flight_at(&last, &flight, 120, 0, 0);
	flight_at(&other, &flight, 0, 0.5, 0);
	assert_memory_equal(first.eye, last.eye, sizeof first.eye);
	assert_true(fabs(distance(other.eye, other.target) - distance(first.eye, first.target)) < 1e-9);
	assert_true(distance(first.eye, other.eye) > distance(first.eye, first.target));
	flight_fini(&flight);
}

static void a_zoom_comes_eight_times_as_near_and_goes_back(void **state)
{
	struct psr_camera far, near, back;
	struct flight flight;

	(void)state;
	make(&flight, "zoom");
	flight_at(&far, &flight, 0, 0, 0);
	flight_at(&near, &flight, 60, 0, 0);
	flight_at(&back, &flight, 120, 0, 0);
	assert_true(fabs(distance(far.eye, far.target) / distance(near.eye, near.target) - 8) < 1e-9);
	assert_true(distance(far.eye, back.eye) < 1e-9);
	flight_fini(&flight);
}

static void a_file_of_cameras_is_taken_in_turn(void **state)
{
	FILE *file = fopen(in_folder("cameras"), "w");
	struct psr_camera camera, again;
	struct flight flight;

	(void)state;
	assert_non_null(file);
	fputs("azimuth=10\nazimuth=20 zoom=2\neye=0,0,9 target=0,0,1\n", file);
	fclose(file);
	make(&flight, in_folder("cameras"));
	assert_int_equal(flight.n_list, 3);
	flight_at(&camera, &flight, 2, 0, 0);
	flight_at(&again, &flight, 5, 0, 0);
	assert_true(camera.eye[2] == 9 && camera.target[2] == 1);
	assert_memory_equal(&camera, &again, sizeof camera);
	flight_fini(&flight);
}

/* A path that psr view recorded moves on by a thirtieth of a second a picture. */
static void a_recorded_path_is_sampled_thirty_times_a_second(void **state)
{
	static const char text[] = "{\"poses\":[{\"seconds\":0,\"eye\":[0,0,5],\"target\":[0,0,0],\"up\":[0,1,0],\"fov\":30},"
		"{\"seconds\":2,\"eye\":[0,0,11],\"target\":[0,0,0],\"up\":[0,1,0],\"fov\":30}]}";
	FILE *file = fopen(in_folder("path.json"), "w");
	struct psr_camera camera;
	struct flight flight;

	(void)state;
	assert_non_null(file);
	fputs(text, file);
	fclose(file);
	make(&flight, in_folder("path.json"));
	assert_int_equal(flight.n_list, 61);
	flight_at(&camera, &flight, 10, 0, 0);
	assert_true(fabs(camera.eye[2] - 6) < 1e-9);
	assert_true(fabs(camera.fov_y - 0.5235987755982988) < 1e-12);
	flight_fini(&flight);
}

/* The share of n draws has a standard deviation of sqrt(p (1 - p) / n); five of them are never passed by chance. */
static void kinds_are_chosen_by_weight_and_alike_each_time(void **state)
{
	struct bench_plan plan = { .n_kinds = 3, .seed = 5 };
	const double p[3] = { 0.6, 0.1, 0.3 };
	const uint64_t n = 60000;
	uint64_t n_of[3] = { 0 };

	(void)state;
	plan.kind[0].up_to = 0.6;
	plan.kind[1].up_to = 0.7;
	plan.kind[2].up_to = 1;
	for (uint32_t client = 0; client < 6; client++)
		for (uint64_t k = 0; k < n / 6; k++) {
			const uint32_t kind = bench_kind_of(&plan, client, k);

			assert_int_equal(kind, bench_kind_of(&plan, client, k));
			n_of[kind]++;
		}
	for (int i = 0; i < 3; i++)
		assert_true(fabs((double)n_of[i] / (double)n - p[i]) < 5 * sqrt(p[i] * (1 - p[i]) / (double)n));
}

static void ranges_of_sweeps_are_read(void **state)
{
	static const char *const bad[] = { "", "clients", "clients=", "clients=4", "clients=4..", "clients=..4",
	                                   "clients=4..2",
		                               "clients=0..4", "rate=0..4", "rate=1..2/0", "rate=1..2/65", "rate=1..2/2x",
		                               "rate=1..2/1.5", "speed=1..2", "rate=1x..2", "clients=1..1000000", "rate=nan..2" };
	struct sweep sweep;
	struct psr_error err;

	(void)state;
	assert_int_equal(sweep_parse(&sweep, "clients=1..64", &err), PSR_OK);
	assert_true(!sweep.is_rate && sweep.low == 1 && sweep.high == 64 && sweep.n == 7);
	assert_int_equal(sweep_parse(&sweep, "rate=0.5..12.5/3", &err), PSR_OK);
	assert_true(sweep.is_rate && sweep.low == 0.5 && sweep.high == 12.5 && sweep.n == 3);
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
		if (sweep_parse(&sweep, bad[i], &err) != PSR_ERR_ARG)
			fail_msg("'%s' was taken", bad[i]);
}

static void limits_of_latency_are_read(void **state)
{
	static const char *const bad[] = { "", "p99", "p99=", "p99=50", "p98=50ms", "p99=-1ms", "p99=0ms", "p99=50m",
		                               "p99=1e9s", "p99=50ms " };
	struct psr_error err;
	struct slo slo;

	(void)state;
	assert_int_equal(slo_parse(&slo, "p99.9=2.5ms", &err), PSR_OK);
	assert_true(slo.part == 0.999 && slo.limit_ns == 2500000);
	assert_int_equal(slo_parse(&slo, "max=3s", &err), PSR_OK);
	assert_true(slo.part == 1 && slo.limit_ns == 3000000000u);
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
		if (slo_parse(&slo, bad[i], &err) != PSR_ERR_ARG)
			fail_msg("'%s' was taken", bad[i]);
}

static void fairness_is_one_for_equals_and_a_part_for_one_alone(void **state)
{
	(void)state;
	assert_true(measure_fairness((const uint64_t[]){ 7, 7, 7, 7 }, 4) == 1);
	assert_true(measure_fairness((const uint64_t[]){ 9, 0, 0, 0 }, 4) == 0.25);
	assert_true(measure_fairness((const uint64_t[]){ 1, 3 }, 2) == 0.8);
	assert_true(measure_fairness((const uint64_t[]){ 0, 0 }, 2) == 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_camera_of_every_path_is_valid_and_repeatable),
		cmocka_unit_test(an_orbit_closes_and_clients_stand_apart),
		cmocka_unit_test(a_zoom_comes_eight_times_as_near_and_goes_back),
		cmocka_unit_test(a_file_of_cameras_is_taken_in_turn),
		cmocka_unit_test(a_recorded_path_is_sampled_thirty_times_a_second),
		cmocka_unit_test(kinds_are_chosen_by_weight_and_alike_each_time),
		cmocka_unit_test(ranges_of_sweeps_are_read),
		cmocka_unit_test(limits_of_latency_are_read),
		cmocka_unit_test(fairness_is_one_for_equals_and_a_part_for_one_alone),
	};

	return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
