#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include "base/random.h"
#include "base/stats.h"
#include "budget.h"
#include "report.h"

#define ROUNDS 7
#define LONG_MS 100  /* a rung that takes longer is drawn LONG_ROUNDS times */
#define LONG_ROUNDS 2
#define MOST_MS 200  /* of a budget */
#define LEAST_FRAMES 24 /* with a budget, */
#define MOST_FRAMES 160
#define BUDGET_MS 2000 /* or for so long */
#define TARGET_WITHIN 95
#define TARGET_BEHIND 1
#define SEED 7

/* A rung's frames of a view. */
struct cell {
	double ms, psnr; /* median */
};

static double psnr_of(const struct psr_frame *picture, const struct ladder_view *view)
{
	return ladder_psnr(budget_rmse_of(picture, view));
}

static void request_rung(struct psr_msg_frame *frame, const struct budget_link *link, uint32_t rung, uint32_t view)
{
	budget_link_request(frame, link, view);
	frame->budget = PSR_WIRE_BUDGET_SETTINGS;
	frame->settings = budget_rungs[rung];
}

/* Returns the time that 95 of 100 frames of the fastest rung keep, ms. Each frame shows another view than the one
 * before, as later with budgets: shadow maps of other views' lights do not stay. */
static double draw_ladder(struct cell cell[BUDGET_RUNGS][BUDGET_VIEWS], struct budget_link *link)
{
	double fastest = INFINITY;

	for (uint32_t r = 0; r < BUDGET_RUNGS; r++) {
		double ms[BUDGET_VIEWS][ROUNDS], all[BUDGET_VIEWS * ROUNDS];
		unsigned n_rounds = ROUNDS;
		size_t n = 0;

		for (unsigned k = 0; k < n_rounds; k++)
			for (uint32_t v = 0; v < BUDGET_VIEWS; v++) {
				struct psr_msg_frame frame;
				struct psr_event event;

				request_rung(&frame, link, r, v);
				budget_link_draw(&event, link, &frame);
				cell[r][v].psnr = psnr_of(event.picture, &link->view[v]);
				ms[v][k] = all[n++] = budget_entry_ms(event.end, PSR_WIRE_REPORT_TOTAL);
				if (ms[v][k] > LONG_MS)
					n_rounds = LONG_ROUNDS;
			}
		for (uint32_t v = 0; v < BUDGET_VIEWS; v++)
			cell[r][v].ms = stats_median(ms[v], n_rounds);
		stats_sort(all, n);
		fastest = fmin(fastest, stats_percentile(all, n, 0.95));
	}
	return fastest;
}

static void put(double **list, size_t *n, double value)
{
	double *grown = realloc(*list, (*n + 1) * sizeof **list);

	if (grown == NULL)
		report_die("figures", "have no memory");
	*list = grown;
	grown[(*n)++] = value;
}

static double best_within(struct cell cell[BUDGET_RUNGS][BUDGET_VIEWS], uint32_t view, double ms)
{
	double best = -INFINITY;

	for (uint32_t r = 0; r < BUDGET_RUNGS; r++)
		if (cell[r][view].ms <= ms)
			best = fmax(best, cell[r][view].psnr);
	return best;
}

static void draw_with_budget(struct budget_sums *sums, struct budget_link *link,
                             struct cell cell[BUDGET_RUNGS][BUDGET_VIEWS], double ms)
{
	const unsigned n = (unsigned)fmin(fmax(BUDGET_MS / ms, LEAST_FRAMES), MOST_FRAMES);
	const size_t first = sums->n_behind;
	uint64_t random = SEED;
	unsigned n_within = 0;
	double behind;

	for (unsigned i = 0; i < n; i++) {
		const uint32_t view = random_below(&random, BUDGET_VIEWS);
		const double best = best_within(cell, view, ms);
		struct psr_msg_frame frame;
		struct psr_event event;

		budget_link_request(&frame, link, view);
		frame.budget = PSR_WIRE_BUDGET_TIME;
		frame.time_budget_us = (uint64_t)llround(ms * 1e3);
		budget_link_draw(&event, link, &frame);
		n_within += event.end->status == PSR_WIRE_FRAME_OK;
		if (isfinite(best))
			put(&sums->behind, &sums->n_behind, best - psnr_of(event.picture, &link->view[view]));
		put(&sums->foreseen, &sums->n_foreseen, budget_entry_ms(event.end, PSR_WIRE_REPORT_CHOSEN)
		                                            / budget_entry_ms(event.end, PSR_WIRE_REPORT_TOTAL));
	}
	sums->n_frames += n;
	sums->n_within += n_within;
	behind = sums->n_behind > first ? stats_median(sums->behind + first, sums->n_behind - first) : NAN;
	printf("  %9.3f ms  %4u frames  %6.2f %% within  %6.2f dB behind\n", ms, n, 100.0 * n_within / n, behind);
}

/* The connection is a new one: what it knows of its frames is what budgets taught it. */
void budget_times(struct budget_sums *sums, const char *address, const char *model, const struct ladder_view *view,
                  int has_other)
{
	struct budget_other *other = has_other ? budget_other_start(address, model, view) : NULL;
	struct cell cell[BUDGET_RUNGS][BUDGET_VIEWS];
	struct budget_link link;
	double fastest;

	budget_link_open(&link, address, model, view);
	fastest = draw_ladder(cell, &link);
	budget_link_close(&link);
	printf("%s, %s\n", model, has_other ? "beside another client" : "alone");
	for (uint32_t r = 0; r < BUDGET_RUNGS; r++) {
		double ms[BUDGET_VIEWS], psnr[BUDGET_VIEWS];

		for (uint32_t v = 0; v < BUDGET_VIEWS; v++) {
			ms[v] = cell[r][v].ms;
			psnr[v] = cell[r][v].psnr;
		}
		printf("  rung %u  %9.3f ms  %6.2f dB (medians of views)\n", r, stats_median(ms, BUDGET_VIEWS),
		       stats_median(psnr, BUDGET_VIEWS));
	}
	budget_link_open(&link, address, model, view);
	for (double ms = fastest; ms <= MOST_MS; ms *= 2)
		draw_with_budget(sums, &link, cell, ms);
	budget_link_close(&link);
	budget_other_stop(other);
	fflush(stdout);
}

void budget_times_print(struct budget_sums *sums, const char *what)
{
	char text[128];

	if (sums->n_frames == 0)
		return;
	snprintf(text, sizeof text, "%s: frames within T", what);
	report_target(text, 100 * (double)sums->n_within / (double)sums->n_frames, "%", REPORT_AT_LEAST, TARGET_WITHIN);
	if (sums->n_behind > 0) {
		snprintf(text, sizeof text, "%s: below the best setting that met T, median", what);
		report_target(text, stats_median(sums->behind, sums->n_behind), "dB", REPORT_AT_MOST, TARGET_BEHIND);
	}
	printf("%s: time foreseen over time taken, median %.2f\n", what, stats_median(sums->foreseen, sums->n_foreseen));
	free(sums->behind);
	free(sums->foreseen);
}
