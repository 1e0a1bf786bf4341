#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "gltf_build.h"

#define PLAIN "'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}],"

static struct psr_mesh *import_presets(const char *rest)
{
	struct built b;

	put_triangle(&b);
	return import_built(&b, rest);
}

static const struct psr_camera *camera_of(const struct psr_mesh *m, const char *name)
{
	for (uint32_t i = 0; i < m->n_cameras; i++)
		if (strcmp(m->camera[i].name, name) == 0)
			return &m->camera[i].camera;
	fail_msg("no camera %s", name);
	return NULL;
}

/* The way a camera looks, of unit length. */
static void direction_of(double d[3], const struct psr_camera *c)
{
	double length = 0.0;

	for (int k = 0; k < 3; k++) {
		d[k] = c->target[k] - c->eye[k];
		length += d[k] * d[k];
	}
	for (int k = 0; k < 3; k++)
		d[k] /= sqrt(length);
}

static void cameras_look_along_their_own_minus_z(void **state)
{
	(void)state;
	/* a quarter turn about y, (x, z) -> (z, -x): -z becomes -x; then the parent's move */
	struct psr_mesh *m = import_presets(
		PLAIN "'cameras':[{'type':'perspective','perspective':{'yfov':0.5,'znear':0.125,'aspectRatio':3}},"
		"{'type':'perspective','perspective':{'yfov':1,'znear':0.25,'zfar':9}}],"
		"'nodes':[{'mesh':0},{'name':'plain','camera':0},{'translation':[10,0,0],'children':[3]},"
		"{'name':'turned','camera':1,'rotation':[0,0.70710678118654752,0,0.70710678118654752],'translation':[0,2,0]}]");
	const struct psr_camera *c = camera_of(m, "plain");
	double d[3];

	assert_int_equal(m->n_cameras, 2);
	assert_int_equal(c->kind, PSR_CAMERA_PERSPECTIVE);
	NEAR(c->eye, 0, 0, 0, 0);
	NEAR(c->up, 0, 0, 1, 0);
	direction_of(d, c);
	NEAR(d, 0, 0, 0, -1);
	assert_true(c->fov_y == 0.5 && c->near_z == 0.125);
	c = camera_of(m, "turned");
	NEAR(c->eye, 0, 10, 2, 0);
	NEAR(c->up, 1e-15, 0, 1, 0);
	direction_of(d, c);
	NEAR(d, 1e-15, -1, 0, 0);
	/* the point of its axis beside the middle of the triangle's box, (0.5, 0.5, 0) */
	NEAR(c->target, 1e-14, 0.5, 2, 0);
	assert_true(c->fov_y == 1.0 && c->near_z == 0.25);
	psr_mesh_destroy(m);
}

/* ymag is half of the height; lengths go with the node's scale, angles do not. */
static void scales_of_nodes_scale_lengths_not_angles(void **state)
{
	(void)state;
	struct psr_mesh *m = import_presets(
		PLAIN "'cameras':[{'type':'orthographic','orthographic':{'xmag':3,'ymag':2,'znear':0,'zfar':10}},"
		"{'type':'perspective','perspective':{'yfov':0.5,'znear':0.5}}],"
		"'nodes':[{'mesh':0},{'scale':[4,4,4],'children':[2,3]},{'name':'o','camera':0},"
		"{'name':'p','camera':1,'translation':[0,0,2]}]");
	const struct psr_camera *c = camera_of(m, "o");

	assert_int_equal(c->kind, PSR_CAMERA_ORTHOGRAPHIC);
	assert_true(c->ortho_height == 16.0 && c->near_z == 0.0);
	c = camera_of(m, "p");
	assert_true(c->fov_y == 0.5 && c->near_z == 2.0);
	NEAR(c->eye, 0, 0, 0, 8);
	NEAR(c->up, 0, 0, 1, 0);
	NEAR(c->target, 0, 0, 0, 0);
	psr_mesh_destroy(m);
}

static void lights_keep_intensity_place_and_cone(void **state)
{
	(void)state;
	struct psr_mesh *m = import_presets(
		PLAIN "'extensions':{'KHR_lights_punctual':{'lights':[{'type':'directional','intensity':3,'color':[1,0.5,0]},"
		"{'type':'point','name':'bulb','intensity':100},{'type':'spot','spot':{'innerConeAngle':0.25,"
		"'outerConeAngle':0.5}},{'type':'spot','spot':{}}]}},'nodes':[{'mesh':0},"
		"{'rotation':[0.70710678118654752,0,0,-0.70710678118654752],'extensions':{'KHR_lights_punctual':{'light':0}}},"
		"{'translation':[1,2,3],'extensions':{'KHR_lights_punctual':{'light':1}}},"
		"{'name':'torch','translation':[4,5,6],'scale':[3,3,3],'extensions':{'KHR_lights_punctual':{'light':2}}},"
		"{'extensions':{'KHR_lights_punctual':{'light':3}}}],'extensionsUsed':['KHR_lights_punctual']");
	const struct psr_preset_light *l = m->light;

	assert_int_equal(m->n_lights, 4);
	assert_string_equal(l[0].name, "light 1");
	assert_int_equal(l[0].light.kind, PSR_LIGHT_DIRECTIONAL);
	NEAR(l[0].light.color, 0, 3, 1.5, 0);
	/* a quarter turn about x the other way, (y, z) -> (z, -y): -z becomes -y */
	NEAR(l[0].light.direction, 1e-15, 0, -1, 0);
	assert_string_equal(l[1].name, "bulb");
	assert_int_equal(l[1].light.kind, PSR_LIGHT_POINT);
	NEAR(l[1].light.position, 0, 1, 2, 3);
	NEAR(l[1].light.color, 0, 100, 100, 100);
	assert_true(l[1].light.reference == 1.0);
	assert_string_equal(l[2].name, "torch");
	assert_int_equal(l[2].light.kind, PSR_LIGHT_SPOT);
	NEAR(l[2].light.position, 0, 4, 5, 6);
	NEAR(l[2].light.direction, 0, 0, 0, -1);
	NEAR(l[2].light.color, 0, 1, 1, 1);
	assert_true(l[2].light.inner == 0.25 && l[2].light.outer == 0.5 && l[2].light.reference == 1.0);
	assert_string_equal(l[3].name, "light 2");
	assert_true(l[3].light.inner == 0.0 && fabs(l[3].light.outer - M_PI / 4) < 1e-15);
	assert_string_equal(m->warning, "");
	psr_mesh_destroy(m);
}

#define EYE "{'type':'perspective','perspective':{'yfov':1,'znear':1}"

static void names_are_unlike_and_whole_characters(void **state)
{
	(void)state;
	/* 61 letters and then 3 bytes of one character: 64 with it, one too many */
	static const char letters[] = "abcdefghijklmnopqrstuvwxyzabcdefghijklmnopqrstuvwxyzabcdefghi";
	char json[4096], expected[80];

	snprintf(json, sizeof json, PLAIN "'cameras':[" EYE ",'name':'of the camera'}," EYE "},{'name':'%s\xe2\x82\xac',"
	         "'type':'perspective','perspective':{'yfov':1,'znear':1}}],"
	         "'nodes':[{'mesh':0},{'camera':0},{'camera':0,'name':'of the node'},{'camera':1},{'camera':1},"
	         "{'camera':1,'name':'camera 1'},{'camera':1,'name':'of the node'},{'camera':2},{'camera':2},"
	         "{'camera':1,'name':' a\\u0007b\\n '},{'camera':1,'name':'\\u0001'}]", letters);
	struct psr_mesh *m = import_presets(json);

	assert_int_equal(m->n_cameras, 10);
	assert_string_equal(m->camera[0].name, "of the camera");
	assert_string_equal(m->camera[1].name, "of the node");
	assert_string_equal(m->camera[2].name, "camera 1");
	assert_string_equal(m->camera[3].name, "camera 2");
	assert_string_equal(m->camera[4].name, "camera 1 2");
	assert_string_equal(m->camera[5].name, "of the node 2");
	assert_string_equal(m->camera[6].name, letters);
	snprintf(expected, sizeof expected, "%s 2", letters);
	assert_string_equal(m->camera[7].name, expected);
	assert_string_equal(m->camera[8].name, "a b");
	assert_string_equal(m->camera[9].name, "camera 3");
	psr_mesh_destroy(m);
}

static void only_the_scene_that_is_drawn_gives_presets(void **state)
{
	(void)state;
	struct psr_mesh *m = import_presets(PLAIN "'cameras':[" EYE "}],'nodes':[{'mesh':0},{'camera':0,'name':'out'},"
	                                    "{'camera':0,'name':'in'}],'scenes':[{'nodes':[1]},{'nodes':[0,2]}],'scene':1");

	assert_int_equal(m->n_cameras, 1);
	assert_string_equal(m->camera[0].name, "in");
	psr_mesh_destroy(m);
}

static void presets_that_show_nothing_are_left_out_with_a_warning(void **state)
{
	(void)state;
	static const char *const camera[] = {
		"{'type':'perspective','perspective':{'yfov':0,'znear':1}}",
		"{'type':'perspective','perspective':{'yfov':4,'znear':1}}",
		"{'type':'perspective','perspective':{'yfov':1,'znear':-1}}",
		"{'type':'perspective','perspective':7}",
		"{'type':'orthographic','orthographic':{'ymag':0}}",
		"{'type':'fisheye'}",
		"{}",
	};
	static const char *const light[] = {
		"{'type':'area'}",
		"{}",
		"{'type':'point','intensity':-1}",
		"{'type':'spot','spot':{'innerConeAngle':0.5,'outerConeAngle':0.25}}",
		"{'type':'spot','spot':{'outerConeAngle':4}}",
	};

	for (size_t i = 0; i < sizeof camera / sizeof camera[0]; i++) {
		char json[1024];

		snprintf(json, sizeof json, PLAIN "'cameras':[%s],'nodes':[{'mesh':0},{'camera':0}]", camera[i]);
		struct psr_mesh *m = import_presets(json);

		assert_int_equal(m->n_cameras, 0);
		assert_string_equal(m->warning, "cameras[0] at nodes[1] makes no picture and was left out");
		psr_mesh_destroy(m);
	}
	for (size_t i = 0; i < sizeof light / sizeof light[0]; i++) {
		char json[1024];

		snprintf(json, sizeof json, PLAIN "'extensions':{'KHR_lights_punctual':{'lights':[%s]}},'nodes':[{'mesh':0},"
		         "{'extensions':{'KHR_lights_punctual':{'light':0}}}]", light[i]);
		struct psr_mesh *m = import_presets(json);

		assert_int_equal(m->n_lights, 0);
		assert_string_equal(m->warning, "light 0 at nodes[1] gives no light and was left out");
		psr_mesh_destroy(m);
	}
	struct psr_mesh *m = import_presets(PLAIN "'cameras':[" EYE "}],'nodes':[{'mesh':0},{'camera':0,'scale':[1,1,0]},"
	                                    "{'camera':0,'matrix':[1,0,0,0,0,1,0,0,0,1,0,0,0,0,0,1]}]");

	assert_int_equal(m->n_cameras, 0);
	psr_mesh_destroy(m);
}

static void presets_that_do_not_exist_are_refused(void **state)
{
	(void)state;
	struct built b;

	put_triangle(&b);
	refuse_built(&b, PLAIN "'cameras':[],'nodes':[{'mesh':0,'camera':0}]", PSR_ERR_FORMAT, "camera 0 does not exist");
	refuse_built(&b, PLAIN "'nodes':[{'mesh':0,'extensions':{'KHR_lights_punctual':{'light':0}}}]", PSR_ERR_FORMAT,
	             "light 0 does not exist");
	refuse_built(&b, PLAIN "'cameras':[3],'nodes':[{'mesh':0}]", PSR_ERR_FORMAT, "cameras[0] is not an object");
	refuse_built(&b, PLAIN "'nodes':[{'mesh':0}],'extensions':{'KHR_lights_punctual':{'lights':[[]]}}", PSR_ERR_FORMAT,
	             "lights[0] is not an object");
}

static void no_more_presets_are_kept_than_a_client_is_told(void **state)
{
	(void)state;
	char *json = malloc(65536);
	size_t n;

	assert_non_null(json);
	n = (size_t)sprintf(json, PLAIN "'cameras':[" EYE "}],'nodes':[{'mesh':0}");
	for (int i = 0; i < PSR_MAX_PRESETS + 1; i++)
		n += (size_t)sprintf(json + n, ",{'camera':0}");
	sprintf(json + n, "]");
	struct psr_mesh *m = import_presets(json);

	free(json);
	assert_int_equal(m->n_cameras, PSR_MAX_PRESETS);
	assert_string_equal(m->camera[PSR_MAX_PRESETS - 1].name, "camera 256");
	assert_string_equal(m->warning, "cameras after the first 256 were left out");
	psr_mesh_destroy(m);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(cameras_look_along_their_own_minus_z),
		cmocka_unit_test(scales_of_nodes_scale_lengths_not_angles),
		cmocka_unit_test(lights_keep_intensity_place_and_cone),
		cmocka_unit_test(names_are_unlike_and_whole_characters),
		cmocka_unit_test(only_the_scene_that_is_drawn_gives_presets),
		cmocka_unit_test(presets_that_show_nothing_are_left_out_with_a_warning),
		cmocka_unit_test(presets_that_do_not_exist_are_refused),
		cmocka_unit_test(no_more_presets_are_kept_than_a_client_is_told),
	};

	return cmocka_run_group_tests_name("import_gltf_presets", tests, make_folder, remove_folder);
}
