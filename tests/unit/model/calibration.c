/* What settings cost on a model: in files, and foreseen for other views. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <unistd.h>
#include "model/file.h"
#include "fixture.h"

#define N 12

static struct fixture fixture;
static struct psr_model *plain;
static struct psr_calibrated view[N];
static struct psr_calibrated_fine fine[N]; /* of every second view */

/* Magnifications 1/8 to 4, half of them in shadows. */
static int setup(void **state)
{
	(void)state;
	fixture_init(&fixture, 1);
	for (uint32_t i = 0; i < N; i++) {
		view[i] = (struct psr_calibrated){ .apart = (float)ldexp(1, (int)(i / 2) - 3), .layers = 1.5f,
			                               .n_shadow_lights = i % 2 };
		if (i % 2 == 0)
			fine[i] = (struct psr_calibrated_fine){ (float)(10 + i), (float)(i + 1) * 6.5f };
		for (int r = 0; r < PSR_RUNGS_CALB; r++) {
			view[i].rmse[r] = (float)(100 + 10 * i) / (float)(r + 1);
			view[i].ms[r] = (float)(i + 1) * (float)(r + 1);
		}
	}
	return psr_model_create(&plain, &fixture.info, &fixture.blocks, &fixture.presets, NULL);
}

static int teardown(void **state)
{
	(void)state;
	psr_model_unref(plain);
	return 0;
}

static const struct psr_calibration all = { N, view, fine }, old = { N, view, NULL };

static void a_file_keeps_the_calibration(void **state)
{
	struct psr_model *model, *again;
	char path[] = "/tmp/psr-calibration-XXXXXX";
	const int fd = mkstemp(path);

	(void)state;
	assert_true(fd >= 0);
	close(fd);
	assert_int_equal(psr_model_calibration(plain)->n, 0);
	assert_int_equal(psr_model_calibrate(&model, plain, &all, NULL), PSR_OK);
	for (int is_packed = 0; is_packed < 2; is_packed++) {
		const int code = is_packed ? psr_model_write_packed(model, path, NULL) : psr_model_write(model, path, NULL);

		assert_int_equal(code, PSR_OK);
		assert_int_equal(psr_model_read(&again, path, NULL), PSR_OK);
		assert_int_equal(psr_model_calibration(again)->n, N);
		assert_memory_equal(psr_model_calibration(again)->view, view, sizeof view);
		assert_memory_equal(psr_model_calibration(again)->fine, fine, sizeof fine);
		assert_int_equal(psr_model_blocks(again)->n_samples, psr_model_blocks(plain)->n_samples);
		assert_int_equal(psr_model_presets(again)->n_lights, psr_model_presets(plain)->n_lights);
		psr_model_unref(again);
	}
	unlink(path);
	assert_int_equal(psr_model_calibrate(&again, model, &(struct psr_calibration){ 0 }, NULL), PSR_OK);
	assert_int_equal(psr_model_calibration(again)->n, 0);
	psr_model_unref(again);
	psr_model_unref(model);
}

static void what_no_view_has_is_refused(void **state)
{
	const struct {
		size_t at;
		float value;
	} spoilt[] = {
		{ offsetof(struct psr_calibrated, apart), 0 }, { offsetof(struct psr_calibrated, apart), NAN },
		{ offsetof(struct psr_calibrated, layers), -1 }, { offsetof(struct psr_calibrated, zero), 1 },
		{ offsetof(struct psr_calibrated, rmse), INFINITY }, { offsetof(struct psr_calibrated, rmse[9]), -1 },
		{ offsetof(struct psr_calibrated, ms[3]), 0 }, { offsetof(struct psr_calibrated, ms[9]), NAN },
	};

	(void)state;
	for (size_t i = 0; i < sizeof spoilt / sizeof *spoilt; i++) {
		struct psr_calibrated copy[N];
		struct psr_error err;
		struct psr_model *model;

		memcpy(copy, view, sizeof copy);
		memcpy((char *)&copy[3] + spoilt[i].at, &spoilt[i].value, sizeof spoilt[i].value);
		const struct psr_calibration bad = { N, copy, NULL };
		assert_int_equal(psr_model_calibrate(&model, plain, &bad, &err), PSR_ERR_FORMAT);
		assert_non_null(strstr(err.text, "section CALB"));
		assert_non_null(strstr(err.text, "view 3"));
	}
}

/* Files of before know nothing of fine pictures, and some views have none. */
static void only_views_that_were_measured_tell_of_a_rung(void **state)
{
	const int r = PSR_RUNG_FINE;
	struct psr_model *model;

	(void)state;
	assert_true(psr_calibration_at(&all, 4, r).rmse == 14 && psr_calibration_at(&all, 5, r).ms == 0);
	assert_true(psr_calibration_at(&all, 4, r + 1).ms == (double)view[4].ms[r]);
	assert_true(psr_calibration_at(&all, 4, r - 1).ms == (double)view[4].ms[r - 1]);
	assert_true(psr_calibration_ms(&all, NULL, r) > 0 && psr_calibration_rmse(&all, NULL, r) <= 20);
	assert_true(psr_calibration_ms(&old, NULL, r) == 0 && isinf(psr_calibration_rmse(&old, NULL, r)));
	assert_int_equal(psr_model_calibrate(&model, plain, &old, NULL), PSR_OK);
	assert_null(psr_model_calibration(model)->fine);
	psr_model_unref(model);
}

static void what_no_fine_picture_has_is_refused(void **state)
{
	static const struct psr_calibrated_fine spoilt[] = { { -1, 1 }, { NAN, 1 }, { 1, -1 }, { 1, INFINITY } };

	(void)state;
	for (size_t i = 0; i < sizeof spoilt / sizeof *spoilt; i++) {
		struct psr_calibrated_fine copy[N];
		struct psr_model *model;
		struct psr_error err;

		memcpy(copy, fine, sizeof copy);
		copy[3] = spoilt[i];
		assert_int_equal(psr_model_calibrate(&model, plain, &(struct psr_calibration){ N, view, copy }, &err),
		                 PSR_ERR_FORMAT);
		assert_non_null(strstr(err.text, "view 3, fine"));
	}
}

static void too_many_views_are_refused(void **state)
{
	static struct psr_calibrated many[PSR_MAX_CALIBRATED + 1];
	struct psr_model *model;

	(void)state;
	for (size_t i = 0; i <= PSR_MAX_CALIBRATED; i++)
		many[i] = view[0];
	const struct psr_calibration most = { PSR_MAX_CALIBRATED, many, NULL };
	assert_int_equal(psr_model_calibrate(&model, plain, &most, NULL), PSR_OK);
	psr_model_unref(model);
	const struct psr_calibration over = { PSR_MAX_CALIBRATED + 1, many, NULL };
	assert_int_equal(psr_model_calibrate(&model, plain, &over, NULL), PSR_ERR_LIMIT);
}

/* A view like one that was measured, among views four times as far apart and the same in shadows, is foreseen by that:
 * weights of the others are below a tenth each. */
static void similar_views_count_most(void **state)
{
	struct psr_calibrated far = view[0], near = view[10];
	const struct psr_calibration two = { 3, (const struct psr_calibrated[]){ view[0], view[4], view[10] }, NULL };

	(void)state;
	far.layers = near.layers = 1.5f;
	assert_true(fabs(psr_calibration_ms(&two, &far, 0) - 1) < 0.5);
	assert_true(fabs(psr_calibration_ms(&two, &near, 0) - 11) < 0.5);
	assert_true(psr_calibration_rmse(&two, &far, 2) < psr_calibration_rmse(&two, &near, 2));
}

/* 49 of 50 alike views had at most what is foreseen, and one had more (decision 0099). */
static void all_views_but_one_of_fifty_were_within_the_error(void **state)
{
	struct psr_calibrated alike[50];
	int n_over = 0;

	(void)state;
	for (int i = 0; i < 50; i++) {
		alike[i] = view[6];
		alike[i].rmse[5] = (float)(1 + i * 17 % 50);
	}
	const double foreseen = psr_calibration_rmse(&(struct psr_calibration){ 50, alike, NULL }, &view[6], 5);
	for (int i = 0; i < 50; i++)
		n_over += (double)alike[i].rmse[5] > foreseen;
	assert_int_equal(n_over, 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_file_keeps_the_calibration),
		cmocka_unit_test(what_no_view_has_is_refused),
		cmocka_unit_test(only_views_that_were_measured_tell_of_a_rung),
		cmocka_unit_test(what_no_fine_picture_has_is_refused),
		cmocka_unit_test(too_many_views_are_refused),
		cmocka_unit_test(similar_views_count_most),
		cmocka_unit_test(all_views_but_one_of_fifty_were_within_the_error),
	};

	return cmocka_run_group_tests(tests, setup, teardown);
}
