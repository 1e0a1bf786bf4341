#include "budget.h"
#include <math.h>
#include <string.h>
#include "psr/render.h"

/* From the cheapest to the best. Spacings are multiples of 2^-16: a report holds them. */
const struct psr_msg_settings budget_ladder[BUDGET_RUNGS] = {
	{ .scale = 4, .spacing_px = 1 }, { .scale = 2, .spacing_px = 1 },
	{ .scale = 1, .spacing_px = 2 }, { .scale = 1, .spacing_px = 1.5 }, { .scale = 1, .spacing_px = 1 },
	{ .scale = 1, .spacing_px = 1, .smooth = 1 }, { .scale = 1, .spacing_px = 1, .smooth = PSR_SMOOTH_FINE },
	{ .scale = 1, .spacing_px = 1, .smooth = 1, .pass = 1 }, { .scale = 1, .spacing_px = 1, .smooth = 1, .pass = 2 },
	{ .scale = 1, .spacing_px = 1, .smooth = 1, .pass = 3 }, { .scale = 1, .spacing_px = 1, .smooth = 1, .pass = 4 },
};

static int can_refine(uint32_t planes)
{
	return !(planes & ~(1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH));
}

static int is_offered(const struct psr_msg_settings *rung, const struct budget_view *view)
{
	if (view->width % rung->scale != 0 || view->height % rung->scale != 0)
		return 0;
	if (rung->pass > 0)
		return can_refine(view->planes);
	if (rung->smooth == PSR_SMOOTH_FINE && !(view->can_be_fine && can_refine(view->planes)))
		return 0;
	return !rung->smooth || view->planes >> PSR_PLANE_COLOR & 1; /* smoothing changes colour alone */
}

static int is_rung(const struct psr_msg_settings *rung, const struct psr_msg_settings *settings)
{
	const int is_same_edge = rung->pass > 0 || rung->smooth == settings->smooth; /* passes ignore smoothing */

	return rung->scale == settings->scale && rung->pass == settings->pass && is_same_edge
	       && rung->spacing_px == settings->spacing_px;
}

int budget_rung_of(const struct psr_msg_settings *settings)
{
	for (int i = 0; i < BUDGET_RUNGS; i++)
		if (is_rung(&budget_ladder[i], settings))
			return i;
	return -1;
}

unsigned budget_doublings(const struct psr_msg_settings *settings)
{
	return settings->pass > 0 ? settings->pass : settings->smooth == PSR_SMOOTH_FINE;
}

double budget_density(const struct psr_msg_settings *settings)
{
	return ldexp(1, (int)budget_doublings(settings)) / settings->scale;
}

void budget_densities(double density[BUDGET_RUNGS])
{
	for (int i = 0; i < BUDGET_RUNGS; i++)
		density[i] = budget_density(&budget_ladder[i]) / budget_ladder[i].spacing_px;
}

/* ---- choice ---- */

/* Without a frame of this rung: that of the nearest rung that has one, by the size of its pixels; without any: half a
 * pixel, as far as most samples may be off the surface, and two pixels or spacings aside to one that fills a pixel. */
static double error_of(const struct budget_learnt *learnt, int rung)
{
	const double density = budget_density(&budget_ladder[rung]), spacing = budget_ladder[rung].spacing_px;

	for (int apart = 0; apart < BUDGET_RUNGS; apart++)
		for (int sign = -1; sign <= 1; sign += 2) {
			const int i = rung + sign * apart;

			if (i >= 0 && i < BUDGET_RUNGS && learnt->error[i] > 0)
				return learnt->error[i] * budget_density(&budget_ladder[i]) / density;
		}
	return (M_SQRT1_2 + 0.25 * spacing + 2 * M_SQRT2 * fmax(spacing, 1)) / density;
}

static void set_price(struct budget_price *price, const struct budget_learnt *learnt, const struct budget_view *view,
                      int rung)
{
	price->settings = budget_ladder[rung];
	price->ns = budget_foresee(learnt, view, rung);
	price->has_rmse = view->is_calibrated && isfinite(view->rmse[rung]);
	price->rmse = price->has_rmse ? view->rmse[rung] : 0;
}

static void set_choice(struct budget_choice *choice, const struct budget_learnt *learnt, const struct budget_view *view,
                       int rung)
{
	int cheaper = rung - 1, better = rung + 1;

	memset(choice, 0, sizeof *choice);
	set_price(&choice->chosen, learnt, view, rung);
	while (cheaper >= 0 && !is_offered(&budget_ladder[cheaper], view))
		cheaper--;
	while (better < BUDGET_RUNGS && !is_offered(&budget_ladder[better], view))
		better++;
	if (cheaper >= 0)
		set_price(&choice->cheaper, learnt, view, cheaper);
	if (better < BUDGET_RUNGS)
		set_price(&choice->better, learnt, view, better);
}

void budget_choose_time(struct budget_choice *choice, const struct budget_learnt *learnt,
                        const struct budget_view *view, double limit_ns)
{
	int fitting = -1, cheapest = -1;

	for (int i = 0; i < BUDGET_RUNGS; i++) {
		if (!is_offered(&budget_ladder[i], view))
			continue;
		if (budget_foresee(learnt, view, i) * learnt->hope[i] <= limit_ns)
			fitting = i;
		if (cheapest < 0 || budget_foresee(learnt, view, i) < budget_foresee(learnt, view, cheapest))
			cheapest = i;
	}
	set_choice(choice, learnt, view, fitting >= 0 ? fitting : cheapest);
	choice->is_met = fitting >= 0;
}

/* The cheapest rung whose error is within the limit, or the one of the least error. */
static void choose_by_error(struct budget_choice *choice, const struct budget_learnt *learnt,
                            const struct budget_view *view, const double error[BUDGET_RUNGS], double limit)
{
	int fitting = -1, least = -1;

	for (int i = 0; i < BUDGET_RUNGS; i++) {
		if (!is_offered(&budget_ladder[i], view))
			continue;
		if (error[i] <= limit
		    && (fitting < 0 || budget_foresee(learnt, view, i) < budget_foresee(learnt, view, fitting)))
			fitting = i;
		if (least < 0 || error[i] < error[least])
			least = i;
	}
	set_choice(choice, learnt, view, fitting >= 0 ? fitting : least);
	choice->is_met = fitting >= 0;
}

void budget_choose_error(struct budget_choice *choice, const struct budget_learnt *learnt,
                         const struct budget_view *view, double limit_px)
{
	double error[BUDGET_RUNGS];

	for (int i = 0; i < BUDGET_RUNGS; i++)
		error[i] = error_of(learnt, i);
	choose_by_error(choice, learnt, view, error, limit_px);
}

void budget_choose_rmse(struct budget_choice *choice, const struct budget_learnt *learnt,
                        const struct budget_view *view, double limit)
{
	choose_by_error(choice, learnt, view, view->rmse, limit);
}

int budget_is_asked(const struct psr_msg_frame *request)
{
	return request->budget != PSR_WIRE_BUDGET_NONE && request->budget != PSR_WIRE_BUDGET_SETTINGS;
}

unsigned budget_most_pass(const struct psr_msg_frame *request)
{
	if (request->budget == PSR_WIRE_BUDGET_SETTINGS)
		return request->settings.pass == 0 && request->settings.smooth == PSR_SMOOTH_FINE ? 1 : request->settings.pass;
	return budget_is_asked(request) && can_refine(request->planes) ? PSR_WIRE_MAX_PASS : 0;
}
