/* What is told of measured settings: points, the unbeaten ones, tables; coarser words; JPEG. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "model/blocks.h"
#include "models/price/price.h"
#include "tests/unit/lib/shapes.h"

/* ---- judging ---- */

#define N_VIEWS 3
#define N_SETTINGS 6

struct fixture {
	struct price price;
	struct price_options options;
	struct ladder_view view[N_VIEWS];
	struct ladder_row row[N_VIEWS * N_SETTINGS];
};

/* Settings of all views alike, in ms and codes. "fast" draws the usual picture, faster in three of four frames; "noise"
 * as well, but not so; "many threads" would win and is no choice. Two views are from around, one is from far. */
static void fixture_make(struct fixture *f)
{
	static const struct {
		const char *name;
		double ms, rmse, ratio_high;
		int is_same, is_choice;
	} settings[N_SETTINGS] = {
		{ "usual", 2, 8, 1, 1, 1 },        { "fast", 1.9, 8, 0.97, 1, 1 }, { "noise", 1.8, 8, 1.01, 1, 1 },
		{ "many threads", 1, 8, 0.5, 1, 0 }, { "best", 20, 2, 11, 0, 1 },    { "beaten", 21, 3, 12, 0, 1 },
	};

	memset(f, 0, sizeof *f);
	f->options = (struct price_options){ .n_views = N_VIEWS, .size = { 64, 48 }, .resolution = 32, .n_rounds = 5 };
	f->price.options = &f->options;
	f->price.view = f->view;
	f->price.row = f->row;
	f->price.set.n = N_SETTINGS;
	f->view[1].kind = LADDER_FAR;
	for (int i = 0; i < N_SETTINGS; i++) {
		strcpy(f->price.set.setting[i].name, settings[i].name);
		f->price.set.setting[i].knob = "knob";
		f->price.set.setting[i].is_choice = settings[i].is_choice;
		for (int v = 0; v < N_VIEWS; v++)
			f->row[v * N_SETTINGS + i] = (struct ladder_row){
				.ms = settings[i].ms, .rmse = settings[i].rmse, .ratio = settings[i].ratio_high,
				.ratio_high = settings[i].ratio_high, .is_same = settings[i].is_same, .n_rounds = 5,
			};
	}
}

static void rows_become_points_of_all_views_and_of_kinds(void **state)
{
	struct fixture f;

	(void)state;
	fixture_make(&f);
	f.row[0].rmse = 4;                /* views 0 and 2 are from around */
	f.row[N_SETTINGS].rmse = 9;
	f.row[N_SETTINGS].ms = 5;
	f.row[N_SETTINGS + 4].is_same = 0;
	f.row[4].n_bytes = 300;
	price_judge(&f.price);
	assert_float_equal(f.price.point[0].ms, (2 + 5 + 2) / 3.0, 1e-12);
	assert_float_equal(f.price.point[0].rmse, sqrt((16 + 81 + 64) / 3.0), 1e-12);
	assert_float_equal(f.price.of_kind[LADDER_AROUND][0].rmse, sqrt((16 + 64) / 2.0), 1e-12);
	assert_float_equal(f.price.of_kind[LADDER_FAR][0].ms, 5, 1e-12);
	assert_true(isnan(f.price.of_kind[LADDER_CLOSE][0].ms));
	assert_float_equal(f.price.bytes[4], 100, 1e-12);
	assert_true(f.price.is_same[0] && !f.price.is_same[4]);
}

static void choices_leave_out_noise_and_what_nobody_chooses(void **state)
{
	struct fixture f;

	(void)state;
	fixture_make(&f);
	price_judge(&f.price);
	assert_int_equal(f.price.n_choices, 4); /* usual, fast, best, beaten */
	assert_int_equal(f.price.n_unbeaten, 2);
	assert_int_equal(f.price.unbeaten[0], 1);
	assert_int_equal(f.price.unbeaten[1], 4);
	assert_true(f.price.is_unbeaten[1] && f.price.is_unbeaten[4]);
	assert_true(!f.price.is_unbeaten[0] && !f.price.is_unbeaten[2] && !f.price.is_unbeaten[3] && !f.price.is_unbeaten[5]);
	assert_int_equal(price_best_within(&f.price, 1), N_SETTINGS);
	assert_int_equal(price_best_within(&f.price, 19), 1);
	assert_int_equal(price_best_within(&f.price, 100), 4);
	assert_int_equal(price_cheapest_within(&f.price, 1), N_SETTINGS);
	assert_int_equal(price_cheapest_within(&f.price, 7), 4);
	assert_int_equal(price_cheapest_within(&f.price, 8), 1);
}

struct seen {
	uint32_t n, setting[16];
	double bound[16];
};

static void see(double bound, uint32_t setting, void *userdata)
{
	struct seen *seen = userdata;

	assert_true(seen->n < 16);
	seen->bound[seen->n] = bound;
	seen->setting[seen->n++] = setting;
}

static void tables_have_a_row_where_the_choice_changes(void **state)
{
	struct fixture f;
	struct seen seen = { 0 };
	const struct price_rows rows = { see, &seen };

	(void)state;
	fixture_make(&f);
	price_judge(&f.price);
	price_equal_times(&f.price, &rows);
	assert_int_equal(seen.n, 2);
	assert_int_equal(seen.setting[0], 1);
	assert_float_equal(seen.bound[0], 1.9, 1e-9);
	assert_int_equal(seen.setting[1], 4);
	assert_true(seen.bound[1] >= 20 && seen.bound[1] < 20 * M_SQRT2); /* of those tried, the first that is enough */
	seen.n = 0;
	price_equal_errors(&f.price, &rows);
	assert_int_equal(seen.n, 2);
	assert_int_equal(seen.setting[0], 1); /* 8 codes are 30.07 dB, 2 codes 42.11 */
	assert_float_equal(seen.bound[0], 30, 1e-9);
	assert_int_equal(seen.setting[1], 4);
	assert_float_equal(seen.bound[1], 32, 1e-9);
}

static void a_picture_without_error_ends_the_tables(void **state)
{
	struct fixture f;
	struct seen seen = { 0 };
	const struct price_rows rows = { see, &seen };

	(void)state;
	fixture_make(&f);
	for (int i = 0; i < N_VIEWS * N_SETTINGS; i++)
		f.row[i].rmse = 0;
	price_judge(&f.price);
	price_equal_times(&f.price, &rows);
	assert_int_equal(seen.n, 1);
	price_equal_errors(&f.price, &rows);
	assert_int_equal(seen.n, 1);
	for (int v = 0; v < N_VIEWS; v++)
		f.row[v * N_SETTINGS + 1].rmse = 8; /* "fast" alone errs, and is no other picture's equal */
	price_judge(&f.price);
	seen.n = 0;
	price_equal_errors(&f.price, &rows);
	assert_int_equal(seen.n, 2);
	assert_int_equal(seen.setting[0], 1);
	assert_int_equal(seen.setting[1], 0);
}

static void the_text_marks_what_is_unbeaten_and_what_is_the_usual_picture(void **state)
{
	struct fixture f;
	char *text = NULL;
	size_t n;
	FILE *to = open_memstream(&text, &n);

	(void)state;
	fixture_make(&f);
	price_judge(&f.price);
	price_print(to, &f.price);
	fclose(to);
	assert_non_null(strstr(text, "\n*= fast "));
	assert_non_null(strstr(text, "\n = usual "));
	assert_non_null(strstr(text, "\n*  best "));
	assert_non_null(strstr(text, "\n   beaten "));
	assert_non_null(strstr(text, "     30 dB  fast "));
	free(text);
}

/* ---- coarser words ---- */

static struct psr_model *sphere(void)
{
	const struct shape_options options = { .resolution = 64, .diffuse = 0xa06040, .scale = 2, .cones = 1 };

	return shape_build(&options, 0.9);
}

static void coarser_normals_are_triangles_that_hold_the_finer_ones(void **state)
{
	struct psr_model *model = sphere(), *coarse;
	const struct psr_blocks *a = psr_model_blocks(model), *b;
	uint64_t n_changed = 0;

	(void)state;
	assert_int_equal(price_normal_bits(&coarse, model, 11, NULL), PSR_OK);
	b = psr_model_blocks(coarse);
	assert_int_equal(b->n_samples, a->n_samples);
	for (uint64_t i = 0; i < a->n_samples; i++) {
		assert_int_equal(PSR_ATTR_NORMAL(a->attr[i]) >> 4, PSR_ATTR_NORMAL(b->attr[i]) >> 4);
		assert_int_equal(PSR_ATTR_NORMAL(b->attr[i]) & 15, 0);
		assert_int_equal(a->attr[i] >> 15, b->attr[i] >> 15);
		n_changed += a->attr[i] != b->attr[i];
	}
	assert_true(n_changed > a->n_samples / 2);
	psr_model_unref(coarse);
	psr_model_unref(model);
}

static void coarser_depths_are_half_a_step_off_at_most(void **state)
{
	struct psr_model *model = sphere(), *coarse;
	const struct psr_blocks *a = psr_model_blocks(model), *b;

	(void)state;
	assert_int_equal(price_depth_bits(&coarse, model, 10, NULL), PSR_OK);
	b = psr_model_blocks(coarse);
	for (uint64_t i = 0; i < a->n_samples; i++) {
		assert_true(abs(a->depth[i] - b->depth[i]) <= 32);
		assert_int_equal(b->depth[i] % 64, 32);
	}
	psr_model_unref(coarse);
	psr_model_unref(model);
}

/* ---- JPEG ---- */

static double loss_of(int quality, int chroma, const uint8_t *rgb, uint64_t *n_bytes)
{
	struct ladder_coder coder;
	uint8_t got[3 * 40 * 24];
	double sum = 0;

	assert_int_equal(price_jpeg_open(&coder, quality, chroma, NULL), PSR_OK);
	assert_int_equal(coder.encode(n_bytes, rgb, 8, 8, coder.userdata), PSR_OK);
	assert_int_equal(coder.encode(n_bytes, rgb, 40, 24, coder.userdata), PSR_OK);
	assert_int_equal(coder.decode(got, 40, 24, coder.userdata), PSR_OK);
	price_jpeg_close(&coder);
	for (size_t i = 0; i < sizeof got; i++)
		sum += (got[i] - rgb[i]) * (got[i] - rgb[i]);
	return sum;
}

static void jpeg_loses_less_with_quality_and_with_full_chroma(void **state)
{
	uint8_t rgb[3 * 40 * 24];
	uint64_t n_low, n_high, n_full;

	(void)state;
	for (int i = 0; i < 40 * 24; i++) {
		rgb[3 * i] = i % 3 == 0 ? 200 : 60;
		rgb[3 * i + 1] = (uint8_t)(i % 40 * 6);
		rgb[3 * i + 2] = i % 2 == 0 ? 30 : 180;
	}
	const double low = loss_of(50, 2, rgb, &n_low), high = loss_of(95, 2, rgb, &n_high);
	const double full = loss_of(95, 1, rgb, &n_full);

	assert_true(low > high && high > full && full > 0);
	assert_true(n_low < n_high && n_high < n_full);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(rows_become_points_of_all_views_and_of_kinds),
		cmocka_unit_test(choices_leave_out_noise_and_what_nobody_chooses),
		cmocka_unit_test(tables_have_a_row_where_the_choice_changes),
		cmocka_unit_test(a_picture_without_error_ends_the_tables),
		cmocka_unit_test(the_text_marks_what_is_unbeaten_and_what_is_the_usual_picture),
		cmocka_unit_test(coarser_normals_are_triangles_that_hold_the_finer_ones),
		cmocka_unit_test(coarser_depths_are_half_a_step_off_at_most),
		cmocka_unit_test(jpeg_loses_less_with_quality_and_with_full_chroma),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
