/* Settings measured: views, rounds, errors, and what is picked from the rows. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"
#include "measure/ladder.h"
#include "psr/build.h"
#include "simd/simd.h"
#include "tests/unit/sample/meshes.h"

#define SIDE 96
#define RAYS 2

/* A sphere beside the origin, and its model. */
struct fixture {
	struct psr_mesh *mesh;
	struct psr_model *model;
	struct psr_truth *truth;
	struct psr_source *source;
	struct ladder_look look;
};

static int open_fixture(void **state)
{
	struct fixture *f = calloc(1, sizeof *f);
	struct psr_build_options options;

	f->mesh = meshes_sphere(24, (const double[3]){ 5, 1, -2 }, 3);
	v3d_set(f->mesh->up, 0, 1, 0);
	psr_build_options_default(&options);
	options.resolution = 64;
	*state = f;
	if (psr_model_build(&f->model, f->mesh, &options, NULL, NULL) != PSR_OK
	    || psr_truth_create(&f->truth, f->mesh, NULL) != PSR_OK
	    || psr_source_create(&f->source, f->mesh, NULL) != PSR_OK)
		return -1;
	f->look = (struct ladder_look){ .truth = f->truth, .source = f->source, .info = psr_model_info(f->model),
		                            .width = SIDE, .height = SIDE, .seed = 7, .n_threads = 1 };
	return 0;
}

static int close_fixture(void **state)
{
	struct fixture *f = *state;

	psr_source_destroy(f->source);
	psr_truth_destroy(f->truth);
	psr_model_unref(f->model);
	meshes_free(f->mesh);
	free(f);
	return 0;
}

/* ---- views ---- */

static void views_are_of_their_seed_and_number_alone(void **state)
{
	const struct fixture *f = *state;
	struct ladder_look other = f->look;
	struct ladder_view a[8], b[8];

	assert_int_equal(ladder_views_make(a, 8, &f->look, NULL), PSR_OK);
	assert_int_equal(ladder_views_make(b, 5, &f->look, NULL), PSR_OK);
	for (int i = 0; i < 5; i++)
		assert_memory_equal(&a[i].camera, &b[i].camera, sizeof a[i].camera);
	other.seed = 8;
	assert_int_equal(ladder_views_make(b, 8, &other, NULL), PSR_OK);
	for (int i = 0; i < 8; i++) {
		assert_int_equal(a[i].kind, i % LADDER_N_KINDS);
		assert_int_equal(a[i].light.casts_shadow, i >= LADDER_N_KINDS);
		assert_memory_not_equal(a[i].camera.eye, b[i].camera.eye, sizeof a[i].camera.eye);
	}
}

/* Of a sphere of radius 3 about (5, 1, -2). */
static void views_look_at_the_surface_as_their_kind_says(void **state)
{
	const struct fixture *f = *state;
	struct ladder_view view[16];

	assert_int_equal(ladder_views_make(view, 16, &f->look, NULL), PSR_OK);
	for (int i = 0; i < 16; i++) {
		const struct psr_camera *camera = &view[i].camera;
		double normal[3], to_eye[3];

		v3d_sub(normal, camera->target, (const double[3]){ 5, 1, -2 });
		v3d_sub(to_eye, camera->eye, camera->target);
		const double distance = v3d_length(to_eye), angle = acos(v3d_dot(normal, to_eye) / distance / v3d_length(normal));
		const double pixel = 2 * tan(camera->fov_y / 2) * distance / SIDE;
		if (view[i].kind == LADDER_CLOSE || view[i].kind == LADDER_GRAZING) {
			/* The mesh's facets are up to 8 degrees off the sphere, and lie up to 1 - cos(3.75 degrees) inside of it, or
			 * as far as the sphere bulges over a square facet. */
			assert_float_equal(v3d_length(normal), 3, 3 * 0.01);
			assert_true(view[i].kind == LADDER_CLOSE ? angle < 0.84 : angle > 1.16 && angle < 1.63);
			assert_float_equal(f->look.info->spacing / pixel, view[i].kind == LADDER_CLOSE ? 2 : 1, 1e-6);
		} else {
			assert_true(v3d_length(normal) < 0.1);
			assert_true(distance > (view[i].kind == LADDER_FAR ? 40 : 3));
		}
		assert_int_equal(ladder_view_trace(&view[i], &f->look, 1, NULL), PSR_OK);
		assert_true(view[i].n_covered > SIDE / 2);
		ladder_view_fini(&view[i]);
	}
}

/* ---- rungs ---- */

struct measured {
	struct ladder *ladder;
	struct ladder_view view[2];
};

static void measured_make(struct measured *m, const struct fixture *f, const struct ladder_options *options)
{
	assert_int_equal(ladder_create(&m->ladder, options, NULL), PSR_OK);
	assert_int_equal(ladder_views_make(m->view, 2, &f->look, NULL), PSR_OK);
	for (int i = 0; i < 2; i++)
		assert_int_equal(ladder_view_trace(&m->view[i], &f->look, RAYS, NULL), PSR_OK);
}

static void measured_fini(struct measured *m)
{
	ladder_destroy(m->ladder);
	for (int i = 0; i < 2; i++)
		ladder_view_fini(&m->view[i]);
}

static struct ladder_rung usual(const struct fixture *f)
{
	struct ladder_rung rung = { .model = f->model, .isa = LADDER_BEST_ISA };

	render_settings_default(&rung.settings, 1, 1);
	return rung;
}

static void rows_tell_what_changes_a_picture_and_what_does_not(void **state)
{
	const struct fixture *f = *state;
	struct measured m;
	struct ladder_rung rung[6];
	struct ladder_row row[2][6];

	measured_make(&m, f, &(struct ladder_options){ .n_threads = 1, .n_rounds = 3, .most_seconds = 1e9, .seed = 1 });
	for (int i = 0; i < 6; i++)
		rung[i] = usual(f);
	rung[1].n_threads = 3;
	rung[2].isa = PSR_ISA_C;
	rung[3].settings.cull_tests = 0;
	rung[4].settings.gap_threshold = 0;
	rung[4].settings.no_fill = 1;
	rung[5].settings.pass = 2;
	for (int v = 0; v < 2; v++) {
		assert_int_equal(ladder_measure(row[v], m.ladder, &m.view[v], rung, 6, NULL), PSR_OK);
		for (int i = 0; i < 6; i++) {
			const struct ladder_row *r = &row[v][i];

			assert_true(i > 3 || (r->is_same && r->rmse == row[v][0].rmse));
			assert_int_equal(r->n_rounds, 3);
			assert_true(r->ms > 0 && r->ms_low <= r->ms && r->ms <= r->ms_high);
			assert_true(r->ratio_low <= r->ratio && r->ratio <= r->ratio_high);
		}
		assert_true(row[v][0].ratio == 1 && row[v][0].ratio_low == 1 && row[v][0].ratio_high == 1);
	}
	/* Cells without a threshold cover the surface that they come from. */
	assert_true(!row[1][4].is_same && row[1][4].rmse > 2 * row[1][0].rmse);
	assert_true(!row[0][5].is_same && row[0][5].rmse < row[0][0].rmse);
	measured_fini(&m);
}

static void the_error_is_that_of_the_whole_picture_by_covered_pixels(void **state)
{
	const struct fixture *f = *state;
	const struct ladder_rung rung = usual(f);
	struct measured m;
	struct ladder_row row;
	uint8_t *rgb = malloc(3 * SIDE * SIDE);
	double sum = 0;

	measured_make(&m, f, &(struct ladder_options){ .n_threads = 1, .n_rounds = 1, .most_seconds = 1 });
	assert_int_equal(ladder_measure(&row, m.ladder, &m.view[1], &rung, 1, NULL), PSR_OK);
	assert_int_equal(ladder_draw(rgb, m.ladder, &m.view[1], &rung, NULL), PSR_OK);
	for (int i = 0; i < 3 * SIDE * SIDE; i++)
		sum += pow(rgb[i] - m.view[1].truth[i], 2);
	assert_float_equal(row.rmse, sqrt(sum / (3.0 * (double)m.view[1].n_covered)), 1e-9);
	memcpy(m.view[1].truth, rgb, 3 * SIDE * SIDE);
	assert_int_equal(ladder_measure(&row, m.ladder, &m.view[1], &rung, 1, NULL), PSR_OK);
	assert_true(row.rmse == 0);
	assert_true(isinf(ladder_psnr(row.rmse)));
	assert_float_equal(ladder_psnr(25.5), 20, 1e-9);
	free(rgb);
	measured_fini(&m);
}

static void a_slow_rung_sits_out_and_the_first_one_never(void **state)
{
	const struct fixture *f = *state;
	const struct ladder_rung rung[2] = { usual(f), usual(f) };
	struct measured m;
	struct ladder_row row[2];

	measured_make(&m, f, &(struct ladder_options){ .n_threads = 1, .n_rounds = 4, .most_seconds = 1e-12 });
	assert_int_equal(ladder_measure(row, m.ladder, &m.view[0], rung, 2, NULL), PSR_OK);
	assert_int_equal(row[0].n_rounds, 4);
	assert_int_equal(row[1].n_rounds, 1);
	measured_fini(&m);
}

static void shadow_maps_are_drawn_once_and_counted_apart(void **state)
{
	const struct fixture *f = *state;
	struct ladder_rung rung[3] = { usual(f), usual(f), usual(f) };
	struct measured m;
	struct ladder_row row[3];

	measured_make(&m, f, &(struct ladder_options){ .n_threads = 1, .n_rounds = 1, .most_seconds = 1 });
	assert_int_equal(ladder_measure(row, m.ladder, &m.view[0], rung, 2, NULL), PSR_OK);
	assert_true(row[0].shadow_ms == 0 && row[1].shadow_ms == 0);
	m.view[0].light.casts_shadow = 1;
	rung[1].settings.shadow_side = 64;
	rung[2].no_shadows = 1;
	assert_int_equal(ladder_measure(row, m.ladder, &m.view[0], rung, 3, NULL), PSR_OK);
	assert_true(row[0].shadow_ms > 0 && row[1].shadow_ms > 0 && row[2].shadow_ms == 0);
	measured_fini(&m);
}

/* Decodes to black. */
struct coding {
	int n_encoded, n_decoded, code;
};

static int encode(uint64_t *n_bytes, const uint8_t *rgb, uint32_t width, uint32_t height, void *userdata)
{
	struct coding *coding = userdata;

	assert_non_null(rgb);
	assert_int_equal(width * height, SIDE * SIDE);
	*n_bytes = 123;
	coding->n_encoded++;
	return coding->code;
}

static int decode(uint8_t *rgb, uint32_t width, uint32_t height, void *userdata)
{
	struct coding *coding = userdata;

	memset(rgb, 0, (size_t)width * height * 3);
	coding->n_decoded++;
	return PSR_OK;
}

static void what_a_coder_loses_counts(void **state)
{
	const struct fixture *f = *state;
	struct coding coding = { .code = PSR_OK };
	const struct ladder_coder coder = { encode, decode, &coding };
	struct ladder_rung rung[2] = { usual(f), usual(f) };
	struct measured m;
	struct ladder_row row[2];
	struct psr_error err;

	rung[1].coder = &coder;
	measured_make(&m, f, &(struct ladder_options){ .n_threads = 1, .n_rounds = 3, .most_seconds = 1e9 });
	assert_int_equal(ladder_measure(row, m.ladder, &m.view[0], rung, 2, NULL), PSR_OK);
	assert_int_equal(coding.n_encoded, 1 + 3);
	assert_int_equal(coding.n_decoded, 1);
	assert_int_equal(row[1].n_bytes, 123);
	assert_true(row[1].rmse > 2 * row[0].rmse && !row[1].is_same);
	coding.code = psr_fail(&err, PSR_ERR_INTERNAL, "on purpose");
	assert_int_equal(ladder_measure(row, m.ladder, &m.view[0], rung, 2, &err), PSR_ERR_INTERNAL);
	measured_fini(&m);
}

static void what_the_renderer_refuses_is_refused(void **state)
{
	const struct fixture *f = *state;
	struct ladder_rung rung = usual(f);
	struct measured m;
	struct ladder_row row;
	struct psr_error err;

	measured_make(&m, f, &(struct ladder_options){ .n_threads = 1, .n_rounds = 1, .most_seconds = 1 });
	rung.settings.spacing_px = 1000;
	assert_int_equal(ladder_measure(&row, m.ladder, &m.view[0], &rung, 1, &err), PSR_ERR_ARG);
	assert_non_null(strstr(err.text, "spacing"));
	measured_fini(&m);
}

/* ---- picking ---- */

static void no_other_point_beats_an_unbeaten_one(void **state)
{
	/* Slower and worse than 0; equal to 0; as fast as 0 and better; as good as 3 and slower; the best; the fastest. */
	const struct ladder_point point[] = { { 2, 5 }, { 3, 6 }, { 2, 5 }, { 2, 4 }, { 3, 4 }, { 9, 1 }, { 1, 8 } };
	const uint8_t expected[] = { 0, 0, 0, 1, 0, 1, 1 };
	const struct ladder_point equal[] = { { 1, 1 }, { 1, 1 } };
	uint8_t got[7];

	(void)state;
	ladder_unbeaten(got, point, 7);
	assert_memory_equal(got, expected, 7);
	ladder_unbeaten(got, equal, 2);
	assert_true(got[0] && !got[1]);
}

static void the_best_in_time_and_the_cheapest_in_error(void **state)
{
	const struct ladder_point point[] = { { 2, 5 }, { 2, 4 }, { 1, 8 }, { 3, 4 }, { 9, 1 }, { 9, 1 } };

	(void)state;
	assert_int_equal(ladder_best_within(point, 6, 0.5), 6);
	assert_int_equal(ladder_best_within(point, 6, 1), 2);
	assert_int_equal(ladder_best_within(point, 6, 8), 1);
	assert_int_equal(ladder_best_within(point, 6, 9), 4);
	assert_int_equal(ladder_cheapest_within(point, 6, 0.5), 6);
	assert_int_equal(ladder_cheapest_within(point, 6, 1), 4);
	assert_int_equal(ladder_cheapest_within(point, 6, 4.5), 1);
	assert_int_equal(ladder_cheapest_within(point, 6, 8), 2);
	assert_int_equal(ladder_cheapest_within(point, 0, 8), 0);
}

static void views_join_by_the_mean_of_times_and_of_squares(void **state)
{
	const struct ladder_row row[4] = { { .ms = 1, .rmse = 3 }, { .ms = 100, .rmse = 100 }, { .ms = 2, .rmse = 4 },
		                               { .ms = 100, .rmse = 100 } };
	const struct ladder_point point = ladder_join(row, 2, 2);

	(void)state;
	assert_float_equal(point.ms, 1.5, 1e-12);
	assert_float_equal(point.rmse, sqrt(12.5), 1e-12);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(views_are_of_their_seed_and_number_alone),
		cmocka_unit_test(views_look_at_the_surface_as_their_kind_says),
		cmocka_unit_test(rows_tell_what_changes_a_picture_and_what_does_not),
		cmocka_unit_test(the_error_is_that_of_the_whole_picture_by_covered_pixels),
		cmocka_unit_test(a_slow_rung_sits_out_and_the_first_one_never),
		cmocka_unit_test(shadow_maps_are_drawn_once_and_counted_apart),
		cmocka_unit_test(what_a_coder_loses_counts),
		cmocka_unit_test(what_the_renderer_refuses_is_refused),
		cmocka_unit_test(no_other_point_beats_an_unbeaten_one),
		cmocka_unit_test(the_best_in_time_and_the_cheapest_in_error),
		cmocka_unit_test(views_join_by_the_mean_of_times_and_of_squares),
	};

	return cmocka_run_group_tests(tests, open_fixture, close_fixture);
}
