#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include "base/stats.h"
#include "budget.h"
#include "report.h"

#define LEAST_DB 12
#define MOST_DB 40
#define STEP_DB 2
#define TARGET_ABOVE 90
#define TARGET_RATIO 1.5

static double foreseen(const struct psr_msg_frame_end *end)
{
	for (unsigned i = 0; i < end->n_entries; i++)
		if (end->entry[i].id == PSR_WIRE_REPORT_RMSE_CHOSEN)
			return (double)end->entry[i].count / PSR_WIRE_RMSE_ONE;
	report_die("a picture", "has no RMSE foreseen");
	return 0;
}

static void put(struct budget_likes *likes, double rmse, double measured)
{
	likes->ratio = realloc(likes->ratio, (likes->n + 1) * sizeof *likes->ratio);
	if (likes->ratio == NULL)
		report_die("figures", "have no memory");
	likes->ratio[likes->n++] = rmse / measured;
	likes->n_frames++;
	likes->n_above += measured < rmse;
}

void budget_rmse(struct budget_likes *likes, const char *address, const char *model, const struct ladder_view *view)
{
	struct budget_link link;

	budget_link_open(&link, address, model, view);
	printf("%s, budgets of RMSE\n", model);
	for (int db = LEAST_DB; db <= MOST_DB; db += STEP_DB) {
		double ms[BUDGET_VIEWS], psnr[BUDGET_VIEWS];
		unsigned n_met = 0, n_kept = 0;

		for (uint32_t v = 0; v < BUDGET_VIEWS; v++) {
			struct psr_msg_frame frame;
			struct psr_event event;

			budget_link_request(&frame, &link, v);
			frame.budget = PSR_WIRE_BUDGET_RMSE;
			frame.error_bound = 255 * pow(10, -db / 20.0);
			budget_link_draw(&event, &link, &frame);
			const double measured = budget_rmse_of(event.picture, &view[v]);
			put(likes, foreseen(event.end), measured);
			n_met += event.end->status == PSR_WIRE_FRAME_OK;
			n_kept += event.end->status == PSR_WIRE_FRAME_OK && measured <= frame.error_bound;
			ms[v] = budget_entry_ms(event.end, PSR_WIRE_REPORT_TOTAL);
			psnr[v] = ladder_psnr(measured);
		}
		printf("  %2d dB  %u of %u views foreseen, %u of these kept  %6.2f dB in %9.3f ms (medians of views)\n", db,
		       n_met, BUDGET_VIEWS, n_kept, stats_median(psnr, BUDGET_VIEWS), stats_median(ms, BUDGET_VIEWS));
	}
	budget_link_close(&link);
	fflush(stdout);
}

void budget_rmse_print(struct budget_likes *likes)
{
	if (likes->n_frames == 0)
		return;
	report_target("RMSE: frames below what was foreseen", 100 * (double)likes->n_above / (double)likes->n_frames, "%",
	              REPORT_AT_LEAST, TARGET_ABOVE);
	report_target("RMSE: foreseen over measured, median", stats_median(likes->ratio, likes->n), "x", REPORT_AT_MOST,
	              TARGET_RATIO);
	free(likes->ratio);
}
