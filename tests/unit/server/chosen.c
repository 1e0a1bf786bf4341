/* Budgets of time and error: the settings that psrd chooses come back, and draw the same frame again. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "fixture.h"
#include "model/calibration.h"

static char folder[PATH_MAX];
static struct daemon psrd;
static struct peer p;

/* The plate, measured: each rung has half of the error of the one before. */
static void calibrated_write(void)
{
	struct psr_calibrated view = { .apart = 1, .layers = 1 };
	struct psr_calibrated_fine fine;
	const struct psr_calibration calibration = { 1, &view, &fine };
	struct psr_model *plain, *calibrated;
	char path[2 * PATH_MAX];

	for (int i = 0, in_calb = 0; i < PSR_RUNGS; i++) {
		const float rmse = (float)ldexp(64, -i), ms = (float)(i + 1);

		if (i == PSR_RUNG_FINE) {
			fine = (struct psr_calibrated_fine){ rmse, ms };
		} else {
			view.rmse[in_calb] = rmse;
			view.ms[in_calb++] = ms;
		}
	}
	snprintf(path, sizeof path, "%s/plate.psr", folder);
	assert_int_equal(psr_model_read(&plain, path, NULL), PSR_OK);
	assert_int_equal(psr_model_calibrate(&calibrated, plain, &calibration, NULL), PSR_OK);
	snprintf(path, sizeof path, "%s/measured.psr", folder);
	assert_int_equal(psr_model_write(calibrated, path, NULL), PSR_OK);
	psr_model_unref(plain);
	psr_model_unref(calibrated);
}

static int set_up(void **state)
{
	(void)state;
	folder_make(folder);
	plate_write(folder, "plate.psr", 0x2040c0);
	calibrated_write();
	daemon_start(&psrd, folder, NULL);
	return 0;
}

static int tear_down(void **state)
{
	(void)state;
	daemon_stop(&psrd);
	folder_remove(folder);
	return 0;
}

struct answer {
	struct psr_msg_frame_begin begin;
	struct psr_msg_frame_end end;
};

static void take(struct answer *answer, const struct psr_msg_frame *frame)
{
	struct psr_message message;

	peer_expect(&p, &message, PSR_MSG_FRAME_BEGIN, peer_ask_frame(&p, frame));
	assert_int_equal(psr_msg_frame_begin_decode(&answer->begin, message.payload, message.n, NULL), PSR_OK);
	do
		assert_true(peer_next(&p, &message));
	while (message.type != PSR_MSG_FRAME_END);
	assert_int_equal(psr_msg_frame_end_decode(&answer->end, message.payload, message.n, NULL), PSR_OK);
	assert_int_equal(answer->end.is_final, 1);
}

static const struct psr_msg_report_entry *find(const struct answer *answer, unsigned id)
{
	for (unsigned i = 0; i < answer->end.n_entries; i++)
		if (answer->end.entry[i].id == id)
			return &answer->end.entry[i];
	return NULL;
}

static struct psr_msg_frame ask_time(uint64_t us)
{
	struct psr_msg_frame frame = frame_default(96, 64);

	frame.budget = PSR_WIRE_BUDGET_TIME;
	frame.time_budget_us = us;
	return frame;
}

static struct psr_msg_frame ask_error(double px)
{
	struct psr_msg_frame frame = frame_default(96, 64);

	frame.budget = PSR_WIRE_BUDGET_ERROR;
	frame.error_bound = px;
	return frame;
}

static struct psr_msg_frame ask_rmse(double codes)
{
	struct psr_msg_frame frame = frame_default(96, 64);

	frame.budget = PSR_WIRE_BUDGET_RMSE;
	frame.error_bound = codes;
	return frame;
}

static void expect_same(const struct psr_msg_settings *a, const struct psr_msg_settings *b)
{
	assert_int_equal(a->scale, b->scale);
	assert_int_equal(a->smooth, b->smooth);
	assert_int_equal(a->pass, b->pass);
	assert_true(a->spacing_px == b->spacing_px);
}

/* The settings that were chosen, sent back, draw the same bits, whatever the clock says. */
static void expect_again(const struct psr_msg_frame *asked, const struct answer *answer)
{
	struct psr_msg_frame frame = *asked;
	struct answer again;

	frame.budget = PSR_WIRE_BUDGET_SETTINGS;
	frame.time_budget_us = 0;
	frame.error_bound = 0;
	frame.settings = answer->begin.settings;
	take(&again, &frame);
	expect_same(&again.begin.settings, &answer->begin.settings);
	assert_true(again.end.hash[PSR_PLANE_COLOR] == answer->end.hash[PSR_PLANE_COLOR]);
	assert_true(again.end.error_px == answer->end.error_px && again.end.status == PSR_WIRE_FRAME_OK);
	assert_null(find(&again, PSR_WIRE_REPORT_CHOSEN));
}

static void what_was_chosen_comes_back_and_draws_the_same_again(void **state)
{
	const struct psr_msg_frame asked[] = { ask_time(1), ask_time(3000), ask_time(UINT64_C(60000000)), ask_error(1e-6),
		                                   ask_error(0.3), ask_error(2), ask_error(100) };

	(void)state;
	peer_begin(&p, &psrd, "plate");
	for (size_t i = 0; i < sizeof asked / sizeof asked[0]; i++) {
		const struct psr_msg_report_entry *chosen;
		struct psr_msg_settings told;
		struct answer answer;

		take(&answer, &asked[i]);
		chosen = find(&answer, PSR_WIRE_REPORT_CHOSEN);
		assert_non_null(chosen);
		psr_settings_unpack(&told, chosen->count);
		expect_same(&told, &answer.begin.settings);
		assert_true(chosen->ns > 0);
		assert_true(find(&answer, PSR_WIRE_REPORT_CHEAPER) != NULL || told.scale == 4);
		assert_true(find(&answer, PSR_WIRE_REPORT_BETTER) != NULL || told.pass == PSR_WIRE_MAX_PASS);
		expect_again(&asked[i], &answer);
	}
	peer_close(&p);
}

/* A microsecond is too short for any frame; a bound is kept, or the status says that it is not. */
static void what_cannot_be_met_is_drawn_and_said(void **state)
{
	struct psr_msg_frame frame = ask_time(1);
	struct answer answer;

	(void)state;
	peer_begin(&p, &psrd, "plate");
	take(&answer, &frame);
	assert_true(answer.end.status == PSR_WIRE_FRAME_LATE && answer.begin.settings.scale == 4);
	assert_null(find(&answer, PSR_WIRE_REPORT_CHEAPER));
	frame = ask_error(1e-6);
	take(&answer, &frame);
	assert_true(answer.end.status == PSR_WIRE_FRAME_COARSE && answer.begin.settings.pass == PSR_WIRE_MAX_PASS);
	for (double px = 0.02; px < 50; px *= 1.7) {
		frame = ask_error(px);
		take(&answer, &frame);
		assert_int_equal(answer.end.status, answer.end.error_px * answer.begin.settings.scale > px ? PSR_WIRE_FRAME_COARSE
		                                                                                          : PSR_WIRE_FRAME_OK);
	}
	peer_close(&p);
}

/* Sub-pixels have no ids: such planes are drawn in one pass whatever the time, and refused where a pass is asked for. */
static void planes_that_are_not_refined_have_no_passes(void **state)
{
	struct psr_msg_frame frame = ask_time(UINT64_C(60000000));
	struct answer answer;
	char text[PSR_ERROR_TEXT];

	(void)state;
	peer_begin(&p, &psrd, "plate");
	frame.planes |= 1 << PSR_PLANE_ID;
	frame.data_codec = PSR_CODEC_ZSTD;
	take(&answer, &frame);
	assert_int_equal(answer.begin.settings.pass, 0);
	frame.budget = PSR_WIRE_BUDGET_SETTINGS;
	frame.time_budget_us = 0;
	frame.settings = (struct psr_msg_settings){ .scale = 1, .pass = 1, .spacing_px = 1 };
	peer_expect_error(&p, peer_ask_frame(&p, &frame), PSR_WIRE_UNSUPPORTED, text);
	assert_non_null(strstr(text, "refines colour and depth"));
	peer_close(&p);
}

/* A pass of the settings is that of a pass_limit. */
static void a_pass_of_the_settings_is_the_refined_frame(void **state)
{
	struct psr_msg_frame frame = frame_default(96, 64);
	struct answer answer;
	struct psr_msg_frame_end end;

	(void)state;
	peer_begin(&p, &psrd, "plate");
	frame.budget = PSR_WIRE_BUDGET_SETTINGS;
	frame.settings = (struct psr_msg_settings){ .scale = 1, .pass = 2, .spacing_px = 1 };
	take(&answer, &frame);
	assert_true(answer.begin.refine == 0 && answer.begin.settings.pass == 2);
	frame.settings.pass = 0;
	frame.pass_limit = 2;
	peer_ask_frame(&p, &frame);
	do {
		struct psr_message message;

		assert_true(peer_next(&p, &message));
		end.is_final = 0;
		if (message.type == PSR_MSG_FRAME_END)
			assert_int_equal(psr_msg_frame_end_decode(&end, message.payload, message.n, NULL), PSR_OK);
	} while (!end.is_final);
	assert_int_equal(end.pass, 2);
	assert_true(end.hash[PSR_PLANE_COLOR] == answer.end.hash[PSR_PLANE_COLOR]);
	peer_close(&p);
}

static double rmse_of(const struct answer *answer, unsigned id)
{
	const struct psr_msg_report_entry *entry = find(answer, id);

	return entry != NULL ? (double)entry->count / PSR_WIRE_RMSE_ONE : 0;
}

static int rung_of(const struct psr_msg_settings *settings)
{
	int r = 0;

	while (psr_ladder[r].scale != settings->scale || psr_ladder[r].pass != settings->pass
	       || psr_ladder[r].smooth != settings->smooth || psr_ladder[r].spacing_px != settings->spacing_px)
		assert_true(++r < PSR_RUNGS);
	return r;
}

/* Of the rungs that are within it the clock says which is the cheapest. */
static void an_rmse_is_foreseen_by_the_models_calibration(void **state)
{
	struct psr_msg_frame frame;
	struct answer answer;

	(void)state;
	peer_begin(&p, &psrd, "measured");
	for (int i = 0; i < PSR_RUNGS; i++) {
		frame = ask_rmse(1.01 * ldexp(64, -i));
		take(&answer, &frame);
		const int rung = rung_of(&answer.begin.settings);
		const double rmse = ldexp(64, -rung);

		assert_int_equal(answer.end.status, PSR_WIRE_FRAME_OK);
		assert_true(rung >= i);
		assert_true(rmse_of(&answer, PSR_WIRE_REPORT_RMSE_CHOSEN) == rmse);
		assert_true(rmse_of(&answer, PSR_WIRE_REPORT_RMSE_CHEAPER) == (rung > 0 ? 2 * rmse : 0));
		assert_true(rmse_of(&answer, PSR_WIRE_REPORT_RMSE_BETTER) == (rung < PSR_RUNGS - 1 ? rmse / 2 : 0));
		expect_again(&frame, &answer);
	}
	frame = ask_rmse(0.01);
	take(&answer, &frame);
	assert_true(answer.end.status == PSR_WIRE_FRAME_COARSE && answer.begin.settings.pass == PSR_WIRE_MAX_PASS);
	frame = ask_time(UINT64_C(60000000)); /* a budget of time tells it, too */
	take(&answer, &frame);
	assert_true(rmse_of(&answer, PSR_WIRE_REPORT_RMSE_CHOSEN) > 0);
	peer_close(&p);
}

static void an_rmse_that_nobody_can_foresee_is_refused(void **state)
{
	struct psr_msg_frame frame = ask_rmse(8);
	struct answer answer;
	char text[PSR_ERROR_TEXT];

	(void)state;
	peer_begin(&p, &psrd, "plate");
	peer_expect_error(&p, peer_ask_frame(&p, &frame), PSR_WIRE_UNSUPPORTED, text);
	assert_non_null(strstr(text, "psr-model build --calibrate"));
	frame.planes = 1 << PSR_PLANE_ID;
	frame.color_codec = frame.color_quality = 0;
	frame.data_codec = PSR_CODEC_ZSTD;
	peer_expect_error(&p, peer_ask_frame(&p, &frame), PSR_WIRE_ARG, text);
	assert_non_null(strstr(text, "ask for that plane"));
	frame = ask_time(UINT64_C(60000000));
	take(&answer, &frame);
	assert_null(find(&answer, PSR_WIRE_REPORT_RMSE_CHOSEN));
	peer_close(&p);
}

/* A scale that another budget chose is no base for this one; the client holds what the server thinks it does. */
static void in_a_view_frames_of_other_scales_are_sent_whole(void **state)
{
	struct psr_msg_frame frame, coarse = ask_error(1);
	struct answer answer;

	(void)state;
	peer_begin(&p, &psrd, "plate");
	coarse.budget = PSR_WIRE_BUDGET_SETTINGS; /* what a budget of time chooses follows from what frames took */
	coarse.error_bound = 0;
	coarse.settings = (struct psr_msg_settings){ .scale = 4, .spacing_px = 1 };
	for (int i = 0; i < 6; i++) {
		struct psr_msg_frame_end *end = &answer.end;
		struct psr_message message;
		uint32_t id;

		frame = i % 2 == 0 ? coarse : ask_error(1e-6);
		frame.base = i > 0 ? p.id : 0;
		id = ++p.id;
		assert_int_equal(psr_msg_frame_encode(&p.buf, id, 1, &frame, NULL), PSR_OK);
		peer_send(&p);
		peer_expect(&p, &message, PSR_MSG_FRAME_BEGIN, id);
		assert_int_equal(psr_msg_frame_begin_decode(&answer.begin, message.payload, message.n, NULL), PSR_OK);
		assert_int_equal(answer.begin.settings.scale, i % 2 == 0 ? 4 : 1);
		assert_int_equal(answer.begin.base, 0);
		do
			assert_true(peer_next(&p, &message));
		while (message.type != PSR_MSG_FRAME_END);
		assert_int_equal(psr_msg_frame_end_decode(end, message.payload, message.n, NULL), PSR_OK);
		assert_int_equal(psr_msg_ack_encode(&p.buf, id, 1, &(struct psr_msg_ack){ .pass = 0 }, NULL), PSR_OK);
		peer_send(&p);
	}
	peer_close(&p);
}

static void a_budget_stands_alone(void **state)
{
	struct psr_msg_frame frame = ask_time(1000);
	char text[PSR_ERROR_TEXT];

	(void)state;
	peer_begin(&p, &psrd, "plate");
	frame.pass_limit = 1;
	peer_expect_error(&p, peer_ask_frame(&p, &frame), PSR_WIRE_UNSUPPORTED, text);
	assert_non_null(strstr(text, "pass_limit 0"));
	frame.pass_limit = 0;
	frame.flags = PSR_WIRE_FRAME_SHARP;
	assert_int_equal(psr_msg_frame_encode(&p.buf, ++p.id, 1, &frame, NULL), PSR_OK);
	peer_send(&p);
	peer_expect_error(&p, p.id, PSR_WIRE_UNSUPPORTED, text);
	assert_non_null(strstr(text, "without sharp"));
	peer_close(&p);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(what_was_chosen_comes_back_and_draws_the_same_again),
		cmocka_unit_test(what_cannot_be_met_is_drawn_and_said),
		cmocka_unit_test(an_rmse_is_foreseen_by_the_models_calibration),
		cmocka_unit_test(an_rmse_that_nobody_can_foresee_is_refused),
		cmocka_unit_test(planes_that_are_not_refined_have_no_passes),
		cmocka_unit_test(a_pass_of_the_settings_is_the_refined_frame),
		cmocka_unit_test(in_a_view_frames_of_other_scales_are_sent_whole),
		cmocka_unit_test(a_budget_stands_alone),
	};

	return cmocka_run_group_tests(tests, set_up, tear_down);
}
