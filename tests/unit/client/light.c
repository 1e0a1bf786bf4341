/* The helpers for command lines: lights, codecs, cameras, addresses. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include "psr/client.h"

#define PI 3.14159265358979323846

static void directional_light_has_documented_defaults(void **state)
{
	struct psr_msg_light light;

	(void)state;
	assert_int_equal(psr_light_parse(&light, "dir:1,-2.5,3e-1", NULL), PSR_OK);
	assert_int_equal(light.kind, PSR_WIRE_LIGHT_DIRECTIONAL);
	assert_true(light.direction[0] == 1 && light.direction[1] == -2.5 && light.direction[2] == 0.3);
	assert_true(light.intensity == 1 && light.reference == 0 && light.flags == 0);
	assert_memory_equal(light.color, "\xff\xff\xff", 3);
}

static void options_come_in_any_order(void **state)
{
	struct psr_msg_light light;

	(void)state;
	assert_int_equal(psr_light_parse(&light, "point:1,2,3,ref=4,shadow,color=#102030,intensity=2.5", NULL), PSR_OK);
	assert_int_equal(light.kind, PSR_WIRE_LIGHT_POINT);
	assert_true(light.position[2] == 3 && light.reference == 4 && light.intensity == 2.5);
	assert_int_equal(light.flags, PSR_WIRE_LIGHT_SHADOW);
	assert_memory_equal(light.color, "\x10\x20\x30", 3);
	assert_int_equal(psr_light_parse(&light, "point:1,2,3,intensity=0,shadow", NULL), PSR_OK);
	assert_true(light.intensity == 0);
}

static void spot_shines_from_position_to_target(void **state)
{
	struct psr_msg_light light;

	(void)state;
	assert_int_equal(psr_light_parse(&light, "spot:0,5,0:1,0,-1:30,ref=5", NULL), PSR_OK);
	assert_int_equal(light.kind, PSR_WIRE_LIGHT_SPOT);
	assert_true(light.position[1] == 5);
	assert_true(light.direction[0] == 1 && light.direction[1] == -5 && light.direction[2] == -1);
	assert_true(fabs(light.outer - PI / 6) < 1e-15); /* one rounding of a value below 1 */
	assert_true(light.inner == 0.9 * light.outer);
}

static void bad_lights_are_refused_with_a_sentence(void **state)
{
	static const char *const bad[] = {
		"",
		"dir",
		"dir:",
		"dir:1,2",
		"dir:1,2,3,",
		"dir:1,2,3x",
		"dir:0,0,0",
		"dir:1,2,nan",
		"dir:1,2,inf",
		"sun:1,2,3",
		"dir:1,2,3,ref=2",
		"dir:1e31,0,0",
		"point:1,2,3,color=red",
		"point:1,2,3,color=#12345",
		"point:1,2,3,intensity=-1",
		"point:1,2,3,intensity=2e6",
		"point:1,2,3,intensity=",
		"point:1,2,3,ref=0",
		"point:1,2,3,ref=-1",
		"point:1,2,3,shadows",
		"point:1,2,3,glow",
		"spot:1,2,3",
		"spot:1,2,3:4,5,6",
		"spot:1,2,3:4,5,6:",
		"spot:1,2,3:4,5,6:0",
		"spot:1,2,3:4,5,6:90.1",
		"spot:1,2,3:1,2,3:20",
		"spot:1,2,3:4,5:20",
		"spot:1,2,3:4,5,6:20:3",
	};

	(void)state;
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
		struct psr_msg_light light;
		struct psr_error err = { 0, "" };

		if (psr_light_parse(&light, bad[i], &err) != PSR_ERR_ARG || err.text[0] == '\0')
			fail_msg("'%s' was taken", bad[i]);
	}
}

static void parsed_lights_pass_the_wire(void **state)
{
	static const char *const good[] = { "dir:0,0,1e-30", "point:1e30,2,3,ref=1e-30",
		                                "spot:0,0,0:0,0,1:90,intensity=1e6", "spot:0,0,0:0,0,1:0.001" };
	static struct psr_msg_scene scene;
	static uint8_t storage[PSR_WIRE_MAX_MESSAGE];
	struct psr_buf buf = { storage, 0, sizeof storage };

	(void)state;
	scene.n_lights = 4;
	for (int i = 0; i < 4; i++)
		assert_int_equal(psr_light_parse(&scene.light[i], good[i], NULL), PSR_OK);
	assert_int_equal(psr_msg_scene_encode(&buf, 1, &scene, NULL), PSR_OK);
}

static void codecs_are_told_apart(void **state)
{
	static const char *const bad[] = { "", "jpeg", "jpeg:", "jpeg:0", "jpeg:101", "jpeg:85.5", "png", "lossless:1" };
	uint8_t codec, quality;

	(void)state;
	assert_int_equal(psr_codec_parse(&codec, &quality, "jpeg:85", NULL), PSR_OK);
	assert_true(codec == PSR_CODEC_JPEG && quality == 85);
	assert_int_equal(psr_codec_parse(&codec, &quality, "lossless", NULL), PSR_OK);
	assert_true(codec == PSR_CODEC_ZSTD && quality == 0);
	assert_int_equal(psr_codec_parse(&codec, &quality, "raw", NULL), PSR_OK);
	assert_true(codec == PSR_CODEC_RAW && quality == 0);
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
		assert_int_equal(psr_codec_parse(&codec, &quality, bad[i], NULL), PSR_ERR_ARG);
}

static void addresses_are_checked(void **state)
{
	static const char *const good[] = { "127.0.0.1:7447", "localhost:1",    "[::1]:65535",
		                                "tcp://host:80",  "tcp://[::1]:80", "unix:/tmp/s" };
	static const char *const bad[] = { "",      "host",     "host:",   "host:0",     "host:65536", "host:80x",
		                               ":80",   "::1:80",   "[::1]",   "[]:80",      "[::1:80",    "http://x:80",
		                               "unix:", "host: 80", "host:-1", "host:000080" };
	char path[256] = "unix:";

	(void)state;
	for (size_t i = 0; i < sizeof good / sizeof good[0]; i++)
		assert_int_equal(psr_address_check(good[i], NULL), PSR_OK);
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
		if (psr_address_check(bad[i], NULL) != PSR_ERR_ARG)
			fail_msg("'%s' was taken", bad[i]);
	assert_int_equal(psr_address_check("tls://host:80", NULL), PSR_ERR_UNSUPPORTED);
	memset(path + 5, 'a', 107); /* sun_path has 108 bytes with the NUL */
	assert_int_equal(psr_address_check(path, NULL), PSR_OK);
	path[5 + 107] = 'a';
	assert_int_equal(psr_address_check(path, NULL), PSR_ERR_ARG);
}

static const double box_min[3] = { -1, 0, -1 }, box_max[3] = { 3, 2, 1 };

static void eye_alone_looks_at_the_middle(void **state)
{
	const struct psr_camera_wish wish = { .has_eye = 1, .eye = { 10, 1, 0 }, .fov_y = 0.5 };
	struct psr_msg_camera camera;

	(void)state;
	assert_int_equal(psr_camera_complete(&camera, &wish, box_min, box_max, 1, NULL), PSR_OK);
	assert_true(camera.target[0] == 1 && camera.target[1] == 1 && camera.target[2] == 0);
	assert_true(camera.up[0] == 0 && camera.up[1] == 1 && camera.up[2] == 0);
	assert_true(camera.extent == 0.5);
	/* the farthest corner is 11, 1, 1 away, the nearest point 7 */
	assert_true(fabs(camera.near_z - 1e-3 * sqrt(123)) < 1e-15);
}

static void near_stays_before_a_box_that_is_close(void **state)
{
	const struct psr_camera_wish wish = { .has_eye = 1, .eye = { 3.001, 1, 0 }, .fov_y = 0.5 };
	struct psr_msg_camera camera;

	(void)state;
	assert_int_equal(psr_camera_complete(&camera, &wish, box_min, box_max, 1, NULL), PSR_OK);
	assert_true(camera.near_z > 0 && camera.near_z <= 0.0005 + 1e-12);
}

static void up_turns_where_the_view_runs_along_it(void **state)
{
	struct psr_camera_wish wish = { .has_eye = 1, .eye = { 1, 10, 0 }, .fov_y = 0.5 };
	struct psr_msg_camera camera;
	struct psr_error err;

	(void)state;
	assert_int_equal(psr_camera_complete(&camera, &wish, box_min, box_max, 1, &err), PSR_OK);
	assert_true(camera.up[1] == 0 && camera.up[2] == -1);
	wish.has_up = 1;
	wish.up[1] = 3;
	assert_int_equal(psr_camera_complete(&camera, &wish, box_min, box_max, 1, &err), PSR_ERR_ARG);
	wish.up[1] = 0;
	assert_int_equal(psr_camera_complete(&camera, &wish, box_min, box_max, 1, &err), PSR_ERR_ARG);
	wish = (struct psr_camera_wish){ .has_eye = 1, .eye = { 1, 1, 0 }, .fov_y = 0.5 };
	assert_int_equal(psr_camera_complete(&camera, &wish, box_min, box_max, 1, &err), PSR_ERR_ARG);
}

static void target_alone_moves_the_framed_camera(void **state)
{
	const struct psr_camera_wish none = { .fov_y = 0.5 },
								 wish = { .has_target = 1, .target = { 5, 6, 7 }, .fov_y = 0.5 };
	struct psr_msg_camera framed, camera;

	(void)state;
	assert_int_equal(psr_camera_complete(&framed, &none, box_min, box_max, 2, NULL), PSR_OK);
	assert_int_equal(psr_camera_complete(&camera, &wish, box_min, box_max, 2, NULL), PSR_OK);
	for (int i = 0; i < 3; i++) /* doubles of magnitude below 32: four roundings of 2^-49 */
		assert_true(fabs(camera.eye[i] - camera.target[i] - framed.eye[i] + framed.target[i]) < 1e-13);
	assert_true(camera.target[2] == 7);
}

/* Of a corner of the box above the middle of the picture, along its vertical. */
static double height_in_picture(const struct psr_msg_camera *camera, int corner)
{
	double forward[3], up[3], length, along = 0, height = 0;

	for (int i = 0; i < 3; i++)
		forward[i] = camera->target[i] - camera->eye[i];
	length = sqrt(forward[0] * forward[0] + forward[1] * forward[1] + forward[2] * forward[2]);
	for (int i = 0; i < 3; i++)
		along += camera->up[i] * forward[i] / length;
	for (int i = 0; i < 3; i++)
		up[i] = camera->up[i] - along * forward[i] / length;
	length = sqrt(up[0] * up[0] + up[1] * up[1] + up[2] * up[2]);
	for (int i = 0; i < 3; i++)
		height += up[i] / length * ((corner >> i & 1 ? box_max[i] : box_min[i]) - camera->target[i]);
	return height;
}

static void orthographic_height_is_taken_or_framed(void **state)
{
	const struct psr_camera_wish framed = { .fov_y = 0 }, wish = { .ortho_height = 7 };
	struct psr_msg_camera camera;

	(void)state;
	assert_int_equal(psr_camera_complete(&camera, &wish, box_min, box_max, 1, NULL), PSR_OK);
	assert_true(camera.kind == PSR_WIRE_CAMERA_ORTHOGRAPHIC && camera.extent == 7 && camera.near_z == 0);
	assert_int_equal(psr_camera_complete(&camera, &framed, box_min, box_max, 1, NULL), PSR_OK);
	for (int corner = 0; corner < 8; corner++)
		assert_true(fabs(height_in_picture(&camera, corner)) <= camera.extent / 2);
}

static void key_light_comes_from_the_upper_left_behind_the_camera(void **state)
{
	struct psr_msg_camera camera = { .kind = PSR_WIRE_CAMERA_PERSPECTIVE, .eye = { 0, 0, 5 }, .up = { 0, 1, 0 } };
	struct psr_msg_light light;

	(void)state;
	client_light_key(&light, &camera); /* the view is along -z: right is +x */
	assert_true(light.direction[0] > 0 && light.direction[1] < 0 && light.direction[2] < 0);
	camera.eye[2] = -5;
	client_light_key(&light, &camera);
	assert_true(light.direction[0] < 0 && light.direction[1] < 0 && light.direction[2] > 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(directional_light_has_documented_defaults),
		cmocka_unit_test(options_come_in_any_order),
		cmocka_unit_test(spot_shines_from_position_to_target),
		cmocka_unit_test(bad_lights_are_refused_with_a_sentence),
		cmocka_unit_test(parsed_lights_pass_the_wire),
		cmocka_unit_test(codecs_are_told_apart),
		cmocka_unit_test(addresses_are_checked),
		cmocka_unit_test(eye_alone_looks_at_the_middle),
		cmocka_unit_test(near_stays_before_a_box_that_is_close),
		cmocka_unit_test(up_turns_where_the_view_runs_along_it),
		cmocka_unit_test(target_alone_moves_the_framed_camera),
		cmocka_unit_test(orthographic_height_is_taken_or_framed),
		cmocka_unit_test(key_light_comes_from_the_upper_left_behind_the_camera),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
