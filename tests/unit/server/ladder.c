/* Settings by a budget, with simulated times: no clock, no frames. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include "base/random.h"
#include "model/calibration.h"
#include "psr/render.h"
#include "server/frames/budget.h"

#define MS 1e6

#define AREA 150000   /* pixels of the picture that the model covers; */
#define N_SAMPLES 4e6 /* its samples, */
#define N_BLOCKS 1e5  /* and its blocks */

static struct budget_view whole = { .width = 640, .height = 480, .planes = 1 << PSR_PLANE_COLOR, .area = AREA,
	                               .can_be_fine = 1 };

/* A machine: what a unit of work takes, and how much a frame's time spreads. */
struct machine {
	double sample, splat, pixel, smooth, answer; /* ns */
	double load, spread;                  /* factor on all; a frame takes up to 1 + spread times as long */
	uint64_t random;
};

static double density(const struct psr_msg_settings *s)
{
	return ldexp(1, s->pass > 0 ? s->pass : s->smooth == PSR_SMOOTH_FINE) / s->scale;
}

/* Coarse models: a sample counts as of the next power of two of the spacing. */
static double samples_of(const struct psr_msg_settings *s)
{
	const double step = exp2(floor(log2(s->spacing_px / density(s))));

	return fmin(AREA / (step * step), N_SAMPLES);
}

/* What a survey sees: it is off by a fifth, another way for each rung. */
static int set_up(void **state)
{
	(void)state;
	for (int i = 0; i < BUDGET_RUNGS; i++) {
		const double n = samples_of(&budget_ladder[i]) * (i % 2 != 0 ? 1.2 : 0.8);

		whole.at[i] = (struct budget_counts){ N_BLOCKS, n, 2 * n };
	}
	return 0;
}

static void draw(struct budget_spent *spent, struct machine *m, const struct budget_view *view,
                 const struct psr_msg_settings *s)
{
	const double n = (double)view->width * view->height, drawn = n * density(s) * density(s);
	const double factor = m->load * (1 + m->spread * random_in(&m->random, 0, 1));

	memset(spent, 0, sizeof *spent);
	spent->n_samples = samples_of(s);
	spent->n_blocks = N_BLOCKS;
	spent->n_covered = AREA * density(s) * density(s);
	spent->ns[s->pass > 0 ? BUDGET_SPLATS : BUDGET_SAMPLES] =
		factor * (s->pass > 0 ? m->splat : m->sample) * samples_of(s);
	spent->ns[s->pass > 0 ? BUDGET_SUBPIXELS : BUDGET_PIXELS] = factor * m->pixel * drawn;
	spent->ns[BUDGET_SMOOTH] = s->smooth && s->pass == 0 ? factor * m->smooth * drawn : 0;
	for (int i = 0; i < BUDGET_N_WORK; i++)
		spent->total_ns += spent->ns[i];
	spent->total_ns += factor * m->answer * n / (s->scale * s->scale);
	spent->error_px = 2.5 / density(s);
}

static const struct machine usual = { .sample = 12, .splat = 200, .pixel = 9, .smooth = 4, .answer = 5, .load = 1,
	                                  .spread = 0.2, .random = 7 };

/* Asks for n frames of a budget. Returns how many took longer; *mean_ns: the mean time of a frame. */
static int run(struct budget_learnt *learnt, struct machine *m, double limit_ns, int n, double *mean_ns)
{
	int n_late = 0;

	*mean_ns = 0;
	for (int i = 0; i < n; i++) {
		struct budget_choice choice;
		struct budget_spent spent;

		budget_choose_time(&choice, learnt, &whole, limit_ns);
		draw(&spent, m, &whole, &choice.chosen.settings);
		budget_learn(learnt, &whole, 1, &choice.chosen.settings, &spent);
		n_late += spent.total_ns > limit_ns;
		*mean_ns += spent.total_ns / n;
	}
	return n_late;
}

static double time_of(const struct machine *m, const struct psr_msg_settings *s)
{
	struct machine slowest = *m;
	struct budget_spent spent;

	slowest.load *= 1 + m->spread;
	slowest.spread = 0;
	draw(&spent, &slowest, &whole, s);
	return spent.total_ns;
}

/* From the fastest setting's time up: of 2000 frames at most 5 % are late once the first 100 have taught. Half of these
 * budgets lie between the times of two settings, half just above one. */
static void frames_of_all_budgets_stay_within_their_time(void **state)
{
	static const double limits[] = { 1, 1.5, 2.5, 4, 6, 8, 12, 20, 33, 50, 100, 300, 1000 };

	(void)state;
	for (size_t i = 0; i < sizeof limits / sizeof limits[0]; i++) {
		struct machine m = usual;
		struct budget_learnt learnt;
		double mean_ns;
		int n_late;

		budget_init(&learnt);
		assert_true(limits[i] * MS >= time_of(&m, &(struct psr_msg_settings){ .scale = 4, .spacing_px = 1 }));
		run(&learnt, &m, limits[i] * MS, 100, &mean_ns);
		n_late = run(&learnt, &m, limits[i] * MS, 2000, &mean_ns);
		if (n_late > 100)
			fail_msg("%d of 2000 frames are over %g ms", n_late, limits[i]);
	}
}

/* A budget of 1.25 times what a setting takes at most gets that setting or a better one, nine times out of ten. */
static void a_budget_that_a_setting_meets_is_used(void **state)
{
	static const struct psr_msg_settings rungs[] = {
		{ .scale = 2, .spacing_px = 1 }, { .scale = 1, .spacing_px = 1, .smooth = 1 },
		{ .scale = 1, .spacing_px = 1, .smooth = 1, .pass = 2 },
	};

	(void)state;
	for (size_t i = 0; i < sizeof rungs / sizeof rungs[0]; i++) {
		struct machine m = usual;
		const double limit_ns = 1.25 * time_of(&m, &rungs[i]);
		struct budget_learnt learnt;
		double mean_ns;
		int n_used = 0;

		budget_init(&learnt);
		run(&learnt, &m, limit_ns, 200, &mean_ns);
		for (int k = 0; k < 1000; k++) {
			struct budget_choice choice;

			budget_choose_time(&choice, &learnt, &whole, limit_ns);
			n_used += time_of(&m, &choice.chosen.settings) >= time_of(&m, &rungs[i]);
			run(&learnt, &m, limit_ns, 1, &mean_ns);
		}
		if (n_used < 900)
			fail_msg("%d of 1000 frames are as good as budget %zu allows", n_used, i);
	}
}

/* Another client halves the machine: few frames are late before the flow has learnt it, and quality comes back after. */
static void load_is_learnt_and_forgotten(void **state)
{
	struct machine m = usual;
	struct budget_learnt learnt;
	double idle_ns, loaded_ns, again_ns;

	(void)state;
	budget_init(&learnt);
	run(&learnt, &m, 12 * MS, 300, &idle_ns);
	m.load = 2;
	assert_true(run(&learnt, &m, 12 * MS, 40, &loaded_ns) <= 12);
	assert_true(run(&learnt, &m, 12 * MS, 1000, &loaded_ns) <= 60);
	m.load = 1;
	run(&learnt, &m, 12 * MS, 300, &again_ns);
	run(&learnt, &m, 12 * MS, 300, &again_ns);
	assert_true(again_ns > 0.8 * idle_ns);
}

/* Caches are cold, a core sleeps: the first frame takes twenty times as long. Ten frames later nothing is left of it. */
static void a_slow_first_frame_is_forgotten(void **state)
{
	const struct psr_msg_settings plain = { .scale = 1, .spacing_px = 1 };
	struct machine m = usual;
	struct budget_learnt learnt;
	struct budget_spent spent;

	(void)state;
	budget_init(&learnt);
	m.load = 20;
	draw(&spent, &m, &whole, &plain);
	budget_learn(&learnt, &whole, 1, &plain, &spent);
	m.load = 1;
	for (int i = 0; i < 10; i++) {
		draw(&spent, &m, &whole, &plain);
		budget_learn(&learnt, &whole, 1, &plain, &spent);
	}
	assert_true(budget_foresee(&learnt, &whole, budget_rung_of(&plain)) < 1.5 * time_of(&usual, &plain));
}

/* In one of two views pieces hide each other: the survey counts six times what frames meet. Neither has the other's
 * ratio of time to work. */
static void views_have_prices_of_their_own(void **state)
{
	const struct psr_msg_settings plain = { .scale = 1, .spacing_px = 1 };
	const int rung = budget_rung_of(&plain);
	struct machine m = usual;
	struct budget_view deep = whole;
	struct budget_learnt learnt;
	struct budget_spent spent;

	(void)state;
	budget_init(&learnt);
	deep.at[rung].n_samples *= 6;
	for (int i = 0; i < 60; i++) {
		const struct budget_view *view = i % 2 != 0 ? &deep : &whole;

		draw(&spent, &m, view, &plain);
		budget_learn(&learnt, view, 1, &plain, &spent);
	}
	for (int i = 0; i < 2; i++) {
		const double ns = budget_foresee(&learnt, i > 0 ? &deep : &whole, rung);

		assert_true(ns < 1.3 * time_of(&m, &plain) && ns > time_of(&m, &plain) / (1 + m.spread));
	}
}

/* Passes that were never drawn: their rates are another machine's guess, a calibration has what they cost beside others.
 */
static void a_rung_that_was_never_drawn_begins_with_the_calibration(void **state)
{
	const struct psr_msg_settings plain = { .scale = 1, .spacing_px = 1 }, *pass = &budget_ladder[8];
	struct budget_view view = whole;
	struct machine m = usual;
	struct budget_learnt learnt;
	struct budget_spent spent;

	(void)state;
	m.splat = m.sample;
	budget_init(&learnt);
	for (int i = 0; i < 40; i++) {
		draw(&spent, &m, &whole, &plain);
		budget_learn(&learnt, &whole, 1, &plain, &spent);
	}
	assert_true(budget_foresee(&learnt, &view, 8) > 4 * time_of(&m, pass));
	view.is_calibrated = 1;
	for (int i = 0; i < BUDGET_RUNGS; i++)
		view.ms[i] = time_of(&m, &budget_ladder[i]) * 17 / MS; /* of a slower machine */
	assert_true(budget_foresee(&learnt, &view, 8) < 2 * time_of(&m, pass));
	assert_true(budget_foresee(&learnt, &view, 8) > time_of(&m, pass) / (1 + m.spread));
}

static void what_cannot_be_met_gets_the_nearest_and_says_so(void **state)
{
	struct budget_view view = whole;
	struct budget_learnt learnt;
	struct budget_choice choice;

	(void)state;
	budget_init(&learnt);
	budget_choose_time(&choice, &learnt, &view, 1);
	assert_true(!choice.is_met && choice.chosen.settings.scale == 4 && choice.cheaper.settings.scale == 0);
	assert_true(choice.better.settings.scale == 2 && choice.better.ns > choice.chosen.ns);
	budget_choose_time(&choice, &learnt, &view, INFINITY);
	assert_true(choice.is_met && choice.chosen.settings.pass == 4 && choice.better.settings.scale == 0);
	assert_true(choice.cheaper.settings.pass == 3 && choice.cheaper.ns < choice.chosen.ns);
	budget_choose_error(&choice, &learnt, &view, 1e-6);
	assert_true(!choice.is_met && choice.chosen.settings.pass == 4);
	budget_choose_error(&choice, &learnt, &view, 1e6);
	assert_true(choice.is_met && choice.chosen.settings.scale == 4);
}

static void only_settings_that_the_picture_takes_are_chosen(void **state)
{
	struct budget_view view = whole;
	struct budget_learnt learnt;
	struct budget_choice choice;

	(void)state;
	budget_init(&learnt);
	view.width = 642; /* a multiple of 2, not of 4 */
	budget_choose_time(&choice, &learnt, &view, 1);
	assert_int_equal(choice.chosen.settings.scale, 2);
	view.width = 641;
	budget_choose_time(&choice, &learnt, &view, 1);
	assert_true(choice.chosen.settings.scale == 1 && choice.chosen.settings.spacing_px == 2);
	view.planes = 1 << PSR_PLANE_COLOR | 1 << PSR_PLANE_ID; /* not refined */
	budget_choose_time(&choice, &learnt, &view, INFINITY);
	assert_true(choice.chosen.settings.pass == 0 && choice.chosen.settings.smooth);
	view.planes = 1 << PSR_PLANE_ID;
	budget_choose_time(&choice, &learnt, &view, INFINITY);
	assert_true(choice.chosen.settings.scale == 1 && !choice.chosen.settings.smooth);
}

/* Where samples are too far apart a fine picture is the smooth one, and the step from smooth goes to pass 1. */
static void fine_pictures_are_chosen_where_they_differ(void **state)
{
	const struct psr_msg_settings fine = { .scale = 1, .spacing_px = 1, .smooth = PSR_SMOOTH_FINE };
	struct budget_view view = whole;
	struct budget_learnt learnt;
	struct budget_choice choice;

	(void)state;
	budget_init(&learnt);
	const double limit_ns = budget_foresee(&learnt, &view, budget_rung_of(&fine));
	budget_choose_time(&choice, &learnt, &view, limit_ns);
	assert_true(choice.is_met && choice.chosen.settings.smooth == PSR_SMOOTH_FINE && choice.chosen.settings.pass == 0);
	assert_true(choice.cheaper.settings.smooth == 1 && choice.better.settings.pass == 1);
	view.can_be_fine = 0;
	budget_choose_time(&choice, &learnt, &view, limit_ns);
	assert_true(choice.chosen.settings.smooth == 1 && choice.chosen.settings.pass == 0);
	assert_true(choice.better.settings.pass == 1);
	view.can_be_fine = 1;
	view.planes |= 1 << PSR_PLANE_ID;
	budget_choose_time(&choice, &learnt, &view, INFINITY);
	assert_true(choice.chosen.settings.smooth == 1);
}

/* A calibration of before has no figures of fine pictures: no limit on the error takes them, a time may. */
static void a_calibration_without_fine_pictures_offers_none(void **state)
{
	const int rung = PSR_RUNG_FINE;
	struct budget_view view = whole;
	struct budget_learnt learnt;
	struct budget_choice choice;
	struct machine m = usual;
	struct budget_spent spent;

	(void)state;
	budget_init(&learnt);
	for (int i = 0; i < 10; i++) {
		draw(&spent, &m, &whole, &budget_ladder[rung]);
		budget_learn(&learnt, &whole, 1, &budget_ladder[rung], &spent);
	}
	view.is_calibrated = 1;
	for (int i = 0; i < BUDGET_RUNGS; i++) {
		view.rmse[i] = i == rung ? INFINITY : ldexp(64, -i);
		view.ms[i] = i == rung ? 0 : i + 1;
	}
	for (int i = 0; i < BUDGET_RUNGS; i++)
		assert_true(isfinite(budget_foresee(&learnt, &view, i)) && budget_foresee(&learnt, &view, i) > 0);
	budget_choose_rmse(&choice, &learnt, &view, view.rmse[rung - 1] / 2);
	assert_true(choice.is_met && choice.chosen.settings.pass >= 1);
	budget_choose_time(&choice, &learnt, &view, 2 * time_of(&m, &budget_ladder[rung]));
	assert_true(choice.chosen.settings.smooth == PSR_SMOOTH_FINE && !choice.chosen.has_rmse);
}

/* The bound of a rung is that of its last frame; coarse models have the same one whatever is drawn. */
static void an_error_is_foreseen_from_frames(void **state)
{
	const struct psr_msg_settings plain = { .scale = 1, .spacing_px = 1 };
	struct budget_learnt learnt;
	struct budget_choice choice;
	struct machine m = usual;
	struct budget_spent spent;

	(void)state;
	budget_init(&learnt);
	draw(&spent, &m, &whole, &plain);
	spent.error_px = 0.6;
	budget_learn(&learnt, &whole, 1, &plain, &spent);
	budget_choose_error(&choice, &learnt, &whole, 0.61);
	assert_true(choice.is_met && choice.chosen.settings.scale == 1 && choice.chosen.settings.pass == 0);
	budget_choose_error(&choice, &learnt, &whole, 1.21);
	assert_true(choice.is_met && choice.chosen.settings.scale == 2);
	budget_choose_error(&choice, &learnt, &whole, 0.31); /* as fine as pass 1, and cheaper */
	assert_true(choice.is_met && choice.chosen.settings.smooth == PSR_SMOOTH_FINE);
	budget_choose_error(&choice, &learnt, &whole, 0.16);
	assert_true(choice.is_met && choice.chosen.settings.pass == 2);
}

/* The cheapest rung within the limit; the best one where none is. */
static void a_likeness_is_that_of_the_calibration(void **state)
{
	struct budget_view view = whole;
	struct budget_learnt learnt;
	struct budget_choice choice;

	(void)state;
	budget_init(&learnt);
	view.is_calibrated = 1;
	for (int i = 0; i < BUDGET_RUNGS; i++)
		view.rmse[i] = ldexp(64, -i);
	for (int i = 0; i < BUDGET_RUNGS; i++) {
		budget_choose_rmse(&choice, &learnt, &view, view.rmse[i]);
		const int rung = budget_rung_of(&choice.chosen.settings);

		assert_true(choice.is_met && rung >= i && choice.chosen.has_rmse && choice.chosen.rmse == view.rmse[rung]);
		assert_true(rung == 0 || choice.cheaper.rmse == view.rmse[rung - 1]);
		for (int better = i; better < BUDGET_RUNGS; better++)
			assert_true(choice.chosen.ns <= budget_foresee(&learnt, &view, better));
	}
	budget_choose_rmse(&choice, &learnt, &view, 0.01);
	assert_true(!choice.is_met && budget_rung_of(&choice.chosen.settings) == BUDGET_RUNGS - 1);
	view.planes |= 1 << PSR_PLANE_ID; /* not refined */
	budget_choose_rmse(&choice, &learnt, &view, 0.01);
	assert_true(!choice.is_met && choice.chosen.settings.pass == 0);
	view.is_calibrated = 0;
	budget_choose_time(&choice, &learnt, &view, 1);
	assert_false(choice.chosen.has_rmse);
}

/* Calibrations number settings as psrd does. */
static void the_ladder_is_that_of_calibrations(void **state)
{
	(void)state;
	for (int i = 0; i < BUDGET_RUNGS; i++) {
		const struct psr_msg_settings *a = &budget_ladder[i];
		const struct psr_rung *b = &psr_ladder[i];

		assert_true(a->scale == b->scale && a->smooth == b->smooth && a->pass == b->pass);
		assert_true(a->spacing_px == b->spacing_px);
	}
}

static void a_pass_is_foreseen_where_it_may_be_chosen(void **state)
{
	struct psr_msg_frame frame = { .planes = 1 << PSR_PLANE_COLOR, .budget = PSR_WIRE_BUDGET_TIME };

	(void)state;
	assert_int_equal(budget_most_pass(&frame), PSR_WIRE_MAX_PASS);
	frame.planes |= 1 << PSR_PLANE_WORDS;
	assert_int_equal(budget_most_pass(&frame), 0);
	frame = (struct psr_msg_frame){ .planes = 1, .budget = PSR_WIRE_BUDGET_SETTINGS, .settings.pass = 2 };
	assert_int_equal(budget_most_pass(&frame), 2);
	frame = (struct psr_msg_frame){ .planes = 1 };
	assert_int_equal(budget_most_pass(&frame), 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(frames_of_all_budgets_stay_within_their_time),
		cmocka_unit_test(a_budget_that_a_setting_meets_is_used),
		cmocka_unit_test(load_is_learnt_and_forgotten),
		cmocka_unit_test(a_slow_first_frame_is_forgotten),
		cmocka_unit_test(views_have_prices_of_their_own),
		cmocka_unit_test(a_rung_that_was_never_drawn_begins_with_the_calibration),
		cmocka_unit_test(what_cannot_be_met_gets_the_nearest_and_says_so),
		cmocka_unit_test(only_settings_that_the_picture_takes_are_chosen),
		cmocka_unit_test(fine_pictures_are_chosen_where_they_differ),
		cmocka_unit_test(a_calibration_without_fine_pictures_offers_none),
		cmocka_unit_test(an_error_is_foreseen_from_frames),
		cmocka_unit_test(a_likeness_is_that_of_the_calibration),
		cmocka_unit_test(the_ladder_is_that_of_calibrations),
		cmocka_unit_test(a_pass_is_foreseen_where_it_may_be_chosen),
	};

	return cmocka_run_group_tests(tests, set_up, NULL);
}
