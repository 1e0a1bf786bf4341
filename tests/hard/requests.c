/* Requests at the ends of their ranges and beyond: each is refused by a sentence that names the field, or drawn, finite
 * and where numbers of 80 bits say (lib/exact.h). */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/random.h"
#include "base/vec.h"
#include "lib/blocks.h"
#include "lib/exact.h"

#define PI 3.14159265358979323846

/* All that a request says, in one piece of memory, so that a case is a place and a value. */
struct request {
	struct psr_instance instance;
	struct psr_light light;
	struct psr_scene scene;
	struct psr_settings settings;
};

static void request_make(struct request *r, const struct psr_model *model)
{
	*r = (struct request){ .instance = hard_place(model) };
	r->light = (struct psr_light){ .kind = PSR_LIGHT_SPOT, .position = { 1, 2, 3 }, .direction = { -1, -2, -3 },
		                           .color = { 1, 1, 1 }, .inner = 0.3, .outer = 0.6, .reference = 3,
		                           .casts_shadow = 1 };
	r->scene = (struct psr_scene){ .instance = &r->instance, .n_instances = 1, .light = &r->light, .n_lights = 1,
		                           .ambient = { 0.2, 0.2, 0.2 } };
	r->scene.camera = (struct psr_camera){ .eye = { 0, 0.5, 3 }, .up = { 0, 1, 0 }, .fov_y = 0.8, .ortho_height = 2 };
	psr_settings_default(&r->settings, 48, 32);
}

static struct psr_model *any_model(void)
{
	uint64_t seed = 1;

	return hard_random_model(&seed, 30, 1.0 / 64, 0.02);
}

/* Draws a request, or returns the code of its error. A picture has no NaN and no depth of 0 or less. */
static int answer(const struct request *r, struct psr_error *err)
{
	struct psr_frame frame;
	int rc = psr_frame_alloc(&frame, r->settings.width, r->settings.height,
	                         1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH, err);

	if (rc)
		return rc;
	rc = psr_render(hard_renderer(), &r->scene, &r->settings, NULL, &frame, err);
	for (size_t i = 0; i < (size_t)frame.width * frame.height && rc == PSR_OK; i++)
		if (!(frame.depth[i] > 0))
			fail_msg("pixel %zu has the depth %g", i, (double)frame.depth[i]);
	assert_true(rc || (frame.report.error_px >= 0 && isfinite(frame.report.error_px)));
	psr_frame_free(&frame);
	return rc;
}

#define FIELD(name, what) { offsetof(struct request, name), sizeof(((struct request *)0)->name) / sizeof(double), what }

static const struct field {
	size_t at, n;     /* in doubles */
	const char *what; /* in the sentence that refuses it */
} fields[] = {
	FIELD(scene.camera.eye, "eye"), FIELD(scene.camera.target, "eye, target and up"), FIELD(scene.camera.up, "up"),
	FIELD(scene.camera.fov_y, "field of view"), FIELD(scene.camera.near_z, "near distance"),
	FIELD(scene.ambient, "ambient"), FIELD(scene.background, "background"), FIELD(instance.rotation, "rotation"),
	FIELD(instance.translation, "translation"), FIELD(instance.scale, "scale"), FIELD(light.position, "position"),
	FIELD(light.direction, "direction"), FIELD(light.color, "colour"), FIELD(light.inner, "half angles"),
	FIELD(light.outer, "half angles"), FIELD(light.reference, "reference"), FIELD(settings.spacing_px, "spacing"),
};
#define N_FIELDS (sizeof fields / sizeof fields[0])

static double *place_of(struct request *r, const struct field *field, size_t k)
{
	return (double *)((char *)r + field->at) + k;
}

static void what_is_no_number_is_refused_by_name(void **state)
{
	static const double wrong[] = { NAN, INFINITY, -INFINITY, 1e31, -1e31, 1e300 };
	struct psr_model *model = any_model();

	(void)state;
	for (size_t f = 0; f < N_FIELDS; f++)
		for (size_t k = 0; k < fields[f].n; k++)
			for (size_t w = 0; w < sizeof wrong / sizeof wrong[0]; w++) {
				struct psr_error err = { 0 };
				struct request r;

				request_make(&r, model);
				*place_of(&r, &fields[f], k) = wrong[w];
				const int rc = answer(&r, &err);
				if ((rc != PSR_ERR_ARG && rc != PSR_ERR_LIMIT) || strstr(err.text, fields[f].what) == NULL)
					fail_msg("%g for \"%s\": %d, %s", wrong[w], fields[f].what, rc, err.text);
			}
	psr_model_unref(model);
}

/* Some fields at once at the ends of their ranges, at 0 and at denormal numbers, in passes 0 to 2, of a model of random
 * blocks, one with glass and one with levels, cones and masks. */
static void the_ends_of_all_ranges_are_drawn_or_refused(void **state)
{
	static const double ends[] = { 0, -0.0, 0x1p-1074, 1e-300, 1e-31, 1e-30, 1e-6, 1e-3, 1, -1, PI, 3.14159, 1e6, 1e9,
		                           1e30, -1e30 };
	const uint32_t n_cases = HARD_CASES(20000);
	struct psr_model *model[3] = { any_model() };
	uint64_t seed = 2;
	uint32_t n_drawn = 0;

	(void)state;
	assert_int_equal(psr_model_read(&model[1], "tests/golden/case.psr", NULL), PSR_OK);
	assert_int_equal(psr_model_read(&model[2], "tests/golden/wheel.psr", NULL), PSR_OK);
	for (uint32_t i = 0; i < n_cases; i++) {
		struct psr_error err = { 0 };
		struct request r;

		request_make(&r, model[i % 3]);
		r.scene.camera.kind = (enum psr_camera_kind)random_below(&seed, 2);
		r.light.kind = (enum psr_light_kind)random_below(&seed, 3);
		r.settings.smooth = (int)random_below(&seed, 2);
		r.settings.pass = random_below(&seed, 8) ? 0 : random_below(&seed, 3);
		for (uint32_t n = 1 + random_below(&seed, 3); n > 0; n--) {
			const struct field *field = &fields[random_below(&seed, N_FIELDS)];
			const uint32_t end = random_below(&seed, sizeof ends / sizeof ends[0]);

			*place_of(&r, field, random_below(&seed, (uint32_t)field->n)) = ends[end];
		}
		const int rc = answer(&r, &err);
		assert_true(rc == PSR_OK || ((rc == PSR_ERR_ARG || rc == PSR_ERR_LIMIT) && err.text[0] != 0));
		n_drawn += rc == PSR_OK;
	}
	assert_true(n_drawn > n_cases / 10 && n_drawn < n_cases);
	for (int m = 0; m < 3; m++)
		psr_model_unref(model[m]);
}

static struct psr_error *refuse(const struct psr_scene *scene)
{
	static struct psr_error err;

	memset(&err, 0, sizeof err);
	assert_int_equal(psr_scene_validate(scene, &err), PSR_ERR_ARG);
	return &err;
}

/* The picture's right is forward x up, of length sin(angle): refused below 1e-6; from twice that on its direction is
 * off by a few 2^-53 / 1e-6, far below a float's step. */
static void an_up_next_to_parallel_is_refused_or_exact(void **state)
{
	struct psr_model *model = any_model();
	struct request r;

	(void)state;
	if (!exact_is_there())
		return;
	request_make(&r, model);
	v3d_set(r.scene.camera.eye, 0, 0, 3);
	for (double length = 2e-30; length < 1e30; length *= 1e12) {
		for (double angle = 0; angle < 1e-6; angle = angle > 0 ? angle * 100 : 1e-12) {
			v3d_set(r.scene.camera.up, sin(angle) * length, 0, -cos(angle) * length);
			assert_non_null(strstr(refuse(&r.scene)->text, "parallel"));
			v3d_scale(r.scene.camera.up, r.scene.camera.up, -1);
			assert_non_null(strstr(refuse(&r.scene)->text, "parallel"));
		}
		for (double angle = 2e-6; angle < 1; angle *= 10) {
			v3d_set(r.scene.camera.up, 0.6 * sin(angle) * length, 0.8 * sin(angle) * length, -cos(angle) * length);
			assert_true(exact_check(&r.scene, 101, 101).n_inside > 100);
		}
	}
	memset(r.scene.camera.up, 0, sizeof r.scene.camera.up);
	assert_non_null(strstr(refuse(&r.scene)->text, "up has no length"));
	memcpy(r.scene.camera.target, r.scene.camera.eye, sizeof r.scene.camera.eye);
	assert_non_null(strstr(refuse(&r.scene)->text, "same point"));
	psr_model_unref(model);
}

static void fields_of_view_from_0_to_180_degrees(void **state)
{
	static const double drawn[] = { 1e-6, 1e-5, 1e-3, 1, 3, 3.14, 3.1415, 3.14159 };
	static const double refused[] = { 0, -0.0, -1, 1e-300, 9.9e-7, 3.141591, PI, 2 * PI };
	struct psr_model *model = any_model();
	struct request r;

	(void)state;
	if (!exact_is_there())
		return;
	request_make(&r, model);
	r.scene.n_lights = 0;
	for (size_t i = 0; i < sizeof drawn / sizeof drawn[0]; i++) {
		r.scene.camera.fov_y = drawn[i];
		v3d_set(r.scene.camera.eye, 0, 0, drawn[i] < 1 ? 1 / drawn[i] : 1.5); /* where the model has some size */
		exact_check(&r.scene, 101, 101);
		exact_check(&r.scene, 1000, 10);
		exact_check(&r.scene, 10, 1000);
	}
	for (size_t i = 0; i < sizeof refused / sizeof refused[0]; i++) {
		r.scene.camera.fov_y = refused[i];
		assert_non_null(strstr(refuse(&r.scene)->text, "field of view"));
	}
	psr_model_unref(model);
}

/* 1e4 : 1 and beyond, to the greatest side: across, the angle of sight of 16384 x 1 pixels is next to 180 degrees. */
static void pictures_of_1e4_to_1_are_exact(void **state)
{
	static const uint32_t size[][2] = { { 10000, 1 }, { 1, 10000 }, { 16384, 1 }, { 1, 16384 } };
	struct psr_model *model = any_model();
	struct psr_error err;
	struct request r;

	(void)state;
	if (!exact_is_there())
		return;
	request_make(&r, model);
	r.scene.n_lights = 0;
	for (size_t i = 0; i < sizeof size / sizeof size[0]; i++)
		for (int kind = 0; kind < 2; kind++) {
			r.scene.camera.kind = (enum psr_camera_kind)kind;
			v3d_set(r.scene.camera.eye, 0, 0.01, 1.5);
			r.scene.camera.fov_y = size[i][0] == 1 ? 2 : 0.01;
			r.scene.camera.ortho_height = size[i][0] == 1 ? 2 : 2e-4;
			exact_check(&r.scene, size[i][0], size[i][1]);
		}
	psr_settings_default(&r.settings, 16385, 1);
	assert_int_equal(answer(&r, &err), PSR_ERR_LIMIT);
	psr_settings_default(&r.settings, 0, 1);
	assert_int_equal(answer(&r, &err), PSR_ERR_ARG);
	psr_model_unref(model);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(what_is_no_number_is_refused_by_name),
		cmocka_unit_test(the_ends_of_all_ranges_are_drawn_or_refused),
		cmocka_unit_test(an_up_next_to_parallel_is_refused_or_exact),
		cmocka_unit_test(fields_of_view_from_0_to_180_degrees),
		cmocka_unit_test(pictures_of_1e4_to_1_are_exact),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
