/* Cameras by angles: what is in the picture, from where, and how large. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include "base/random.h"
#include "base/vec.h"
#include "client/lib/camera.h"
#include "psr/client.h"
#include "psr/scene.h"

#define N 2000
#define MARGIN 1.06
#define EPS                                                                                                            \
	1e-12 /* coordinates up to 100 and distances up to 1e5 of them: some roundings of 1e7 * 2^-53 of a picture */

static uint64_t state;

static double within(double low, double high)
{
	return random_in(&state, low, high);
}

static void random_box(double box_min[3], double box_max[3])
{
	for (int i = 0; i < 3; i++) {
		double middle = within(-50, 50), half = pow(10, within(-2, 1));

		box_min[i] = middle - half;
		box_max[i] = middle + half;
	}
}

static void random_direction(double v[3])
{
	do
		for (int i = 0; i < 3; i++)
			v[i] = within(-1, 1);
	while (v3d_length(v) < 0.1);
}

/* Where a point is in the picture: 1 and -1 are its edges. */
static void project(double out[2], const struct psr_camera *camera, double aspect, const double p[3])
{
	double forward[3], right[3], up[3], arm[3], half;

	v3d_sub(forward, camera->target, camera->eye);
	v3d_normalize(forward, forward);
	v3d_cross(right, forward, camera->up);
	v3d_normalize(right, right);
	v3d_cross(up, right, forward);
	v3d_sub(arm, p, camera->eye);
	assert_true(v3d_dot(arm, forward) > camera->near_z);
	half = camera->kind == PSR_CAMERA_ORTHOGRAPHIC ? camera->ortho_height / 2
	                                                    : v3d_dot(arm, forward) * tan(camera->fov_y / 2);
	out[0] = v3d_dot(arm, right) / (half * aspect);
	out[1] = v3d_dot(arm, up) / half;
}

/* The farthest that a corner is from the middle of the picture. */
static double extent_of(const struct psr_camera *camera, double aspect, const double box_min[3],
                        const double box_max[3])
{
	double most = 0;

	for (int corner = 0; corner < 8; corner++) {
		double p[3], at[2];

		for (int i = 0; i < 3; i++)
			p[i] = corner >> i & 1 ? box_max[i] : box_min[i];
		project(at, camera, aspect, p);
		most = fmax(most, fmax(fabs(at[0]), fabs(at[1])));
	}
	return most;
}

static void wish_random(struct psr_camera_wish *wish)
{
	memset(wish, 0, sizeof *wish);
	wish->has_angles = within(0, 1) < 0.8;
	wish->azimuth = within(-400, 400);
	wish->elevation = within(-90, 90);
	wish->roll = wish->has_angles ? within(-200, 200) : 0;
	wish->fov_y = within(0, 1) < 0.3 ? 0 : within(0.05, 2.6);
	wish->has_up = within(0, 1) < 0.5;
	random_direction(wish->has_up ? wish->up : wish->natural_up);
}

static void every_corner_is_in_the_picture_whatever_the_way_up_and_the_angles(void **unused)
{
	(void)unused;
	for (uint64_t seed = 1; seed <= N; seed++) {
		double low[3], high[3], aspect, most;
		struct psr_camera_wish wish;
		struct psr_camera camera;
		struct psr_error err;

		state = seed;
		random_box(low, high);
		wish_random(&wish);
		aspect = within(0.3, 3);
		if (psr_camera_complete(&camera, &wish, low, high, aspect, &err) != PSR_OK)
			fail_msg("%s", err.text);
		most = extent_of(&camera, aspect, low, high);
		if (!(most <= 1 / MARGIN + EPS))
			fail_msg("box %d reaches to %g", (int)seed, most);
		if (wish.fov_y == 0) /* and no more is left than the margin */
			assert_true(most >= 1 / MARGIN - EPS);
	}
}

static void it_is_at_every_turn_of_a_turntable(void **unused)
{
	(void)unused;
	for (uint64_t seed = 1; seed <= N / 10; seed++) {
		double low[3], high[3], most = 0;
		struct psr_camera_wish wish;
		struct psr_camera camera;
		const double *up;

		state = seed;
		random_box(low, high);
		wish_random(&wish);
		wish.has_angles = 1;
		wish.n_turn = 1 + (uint32_t)within(1, 20);
		up = wish.has_up ? wish.up : wish.natural_up;
		assert_int_equal(psr_camera_complete(&camera, &wish, low, high, 1.5, NULL), PSR_OK);
		for (uint32_t k = 0; k < wish.n_turn; k++) {
			struct psr_camera turned = camera;

			psr_camera_turn(&turned, up, 360.0 * k / wish.n_turn, low, high);
			most = fmax(most, extent_of(&turned, 1.5, low, high));
		}
		assert_true(most <= 1 / MARGIN + EPS);
		assert_true(most >= 1 / MARGIN - EPS); /* one of them fills it */
	}
}

static const double box_min[3] = { -1, -2, -3 }, box_max[3] = { 1, 2, 3 };

static void complete(struct psr_camera *camera, struct psr_camera_wish wish)
{
	assert_int_equal(psr_camera_complete(camera, &wish, box_min, box_max, 1, NULL), PSR_OK);
}

static void assert_way(const double v[3], double x, double y, double z)
{
	const double expected[3] = { x, y, z };
	double unit[3];

	v3d_normalize(unit, v);
	for (int i = 0; i < 3; i++)
		assert_true(fabs(unit[i] - expected[i]) < 1e-15); /* sines of whole quarters, normalised */
}

static void azimuth_0_is_the_front_90_the_right_side_and_elevation_90_the_top(void **unused)
{
	struct psr_camera camera;

	(void)unused;
	complete(&camera, (struct psr_camera_wish){ .has_angles = 1, .fov_y = 0.5 });
	assert_way(camera.eye, 0, 0, 1);
	complete(&camera, (struct psr_camera_wish){ .has_angles = 1, .fov_y = 0.5, .azimuth = 90 });
	assert_way(camera.eye, 1, 0, 0);
	complete(&camera, (struct psr_camera_wish){ .has_angles = 1, .fov_y = 0.5, .azimuth = -90 });
	assert_way(camera.eye, -1, 0, 0);
	complete(&camera, (struct psr_camera_wish){ .has_angles = 1, .fov_y = 0.5, .elevation = 90 });
	assert_way(camera.eye, 0, 1, 0);
	assert_way(camera.up, 0, 0, -1);
	/* +Z up: -Y is the front, as CAD has it. */
	complete(&camera, (struct psr_camera_wish){ .has_angles = 1, .fov_y = 0.5, .natural_up = { 0, 0, 1 } });
	assert_way(camera.eye, 0, -1, 0);
	assert_way(camera.up, 0, 0, 1);
}

static void the_default_angles_are_those_of_the_default_view(void **unused)
{
	struct psr_camera plain, angles;

	(void)unused;
	complete(&plain, (struct psr_camera_wish){ .fov_y = 0.5 });
	complete(&angles, (struct psr_camera_wish){ .fov_y = 0.5, .has_angles = 1, .azimuth = PSR_CAMERA_AZIMUTH,
	                                            .elevation = PSR_CAMERA_ELEVATION });
	for (int i = 0; i < 3; i++) /* they are told to 1e-4 degrees, at a distance below 20 */
		assert_true(fabs(plain.eye[i] - angles.eye[i]) < 20 * 1e-4);
}

static void what_a_person_says_is_up_wins_over_the_model(void **unused)
{
	struct psr_camera camera;

	(void)unused;
	complete(&camera, (struct psr_camera_wish){ .fov_y = 0.5, .natural_up = { 0, 0, 1 } });
	assert_way(camera.up, 0, 0, 1);
	complete(&camera,
	         (struct psr_camera_wish){ .fov_y = 0.5, .natural_up = { 0, 0, 1 }, .has_up = 1, .up = { 0, 3, 0 } });
	assert_way(camera.up, 0, 1, 0);
	/* An eye above looks along the natural up: the back is up then. */
	complete(&camera,
	         (struct psr_camera_wish){ .fov_y = 0.5, .natural_up = { 0, 0, 1 }, .has_eye = 1, .eye = { 0, 0, 9 } });
	assert_way(camera.up, 0, 1, 0);
}

static void zoom_enlarges_and_roll_turns(void **unused)
{
	static const double corner[3] = { 1, 2, 3 };
	struct psr_camera camera;
	double plain[2], zoomed[2], rolled[2];

	(void)unused;
	for (int is_ortho = 0; is_ortho < 2; is_ortho++) {
		struct psr_camera_wish wish = {
			.has_eye = 1, .eye = { 0, 0, 20 }, .fov_y = is_ortho ? 0 : 0.5, .ortho_height = 9
		};

		complete(&camera, wish);
		project(plain, &camera, 1, corner);
		wish.zoom = 2;
		complete(&camera, wish);
		project(zoomed, &camera, 1, corner);
		wish.roll = 90;
		complete(&camera, wish);
		project(rolled, &camera, 1, corner);
		for (int i = 0; i < 2; i++)
			assert_true(fabs(zoomed[i] - 2 * plain[i]) < 1e-14);
		/* The camera clockwise, the picture counter-clockwise. */
		assert_true(fabs(rolled[0] + zoomed[1]) < 1e-14 && fabs(rolled[1] - zoomed[0]) < 1e-14);
	}
}

static void a_zoom_beyond_all_angles_is_refused(void **unused)
{
	struct psr_camera_wish wish = { .fov_y = 0.5, .zoom = 1e6 };
	struct psr_camera camera;
	struct psr_error err;

	(void)unused;
	assert_int_equal(psr_camera_complete(&camera, &wish, box_min, box_max, 1, &err), PSR_ERR_ARG);
	assert_non_null(strstr(err.text, "a zoom of 1e+06"));
}

static void a_turn_is_an_azimuth(void **unused)
{
	struct psr_camera turned, asked;
	static const double up[3] = { 0, 0, 2 };

	(void)unused;
	for (int degrees = -360; degrees <= 360; degrees += 45) {
		struct psr_camera_wish wish = { .has_angles = 1, .fov_y = 0, .azimuth = 20, .elevation = 30,
			                            .has_up = 1, .up = { 0, 0, 1 }, .ortho_height = 1 };

		complete(&turned, wish);
		psr_camera_turn(&turned, up, degrees, box_min, box_max);
		wish.azimuth += degrees;
		complete(&asked, wish);
		for (int i = 0; i < 3; i++) /* the distance is another one, the way there the same */
			assert_true(fabs(turned.up[i] - asked.up[i]) < 1e-14);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_corner_is_in_the_picture_whatever_the_way_up_and_the_angles),
		cmocka_unit_test(it_is_at_every_turn_of_a_turntable),
		cmocka_unit_test(azimuth_0_is_the_front_90_the_right_side_and_elevation_90_the_top),
		cmocka_unit_test(the_default_angles_are_those_of_the_default_view),
		cmocka_unit_test(what_a_person_says_is_up_wins_over_the_model),
		cmocka_unit_test(zoom_enlarges_and_roll_turns),
		cmocka_unit_test(a_zoom_beyond_all_angles_is_refused),
		cmocka_unit_test(a_turn_is_an_azimuth),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
