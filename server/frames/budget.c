#include "budget.h"
#include <math.h>
#include <string.h>

#define LEAST_WEIGHT 0.125 /* of a new frame in what is learnt; the first ones have more */
#define TAIL_STEP 0.1      /* how far the tail moves in 19 frames that keep it, and in one that does not: logarithm */
#define TAIL_PART 0.95
#define FIRST_TAIL 1.5
#define TAIL_FRAMES 20     /* of a rung, before its own tail counts */
#define EMPTY_PIXEL 0.1    /* of the work of one that the object covers */
#define HOPE_STEP 0.995    /* a frame */
#define LEAST_HOPE 0.5     /* what is foreseen to take over twice the budget is not tried */
#define LEAST_TAIL 0.5
#define MOST_TAIL 16

/* From the cheapest to the best. Spacings are multiples of 2^-16: a report holds them. */
static const struct psr_msg_settings ladder[BUDGET_RUNGS] = {
	{ .scale = 4, .spacing_px = 1 }, { .scale = 2, .spacing_px = 1 },
	{ .scale = 1, .spacing_px = 2 }, { .scale = 1, .spacing_px = 1.5 }, { .scale = 1, .spacing_px = 1 },
	{ .scale = 1, .spacing_px = 1, .is_smooth = 1 },
	{ .scale = 1, .spacing_px = 1, .is_smooth = 1, .pass = 1 }, { .scale = 1, .spacing_px = 1, .is_smooth = 1, .pass = 2 },
	{ .scale = 1, .spacing_px = 1, .is_smooth = 1, .pass = 3 }, { .scale = 1, .spacing_px = 1, .is_smooth = 1, .pass = 4 },
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
	return !rung->is_smooth || view->planes >> PSR_PLANE_COLOR & 1; /* smoothing changes colour alone */
}

static int is_rung(const struct psr_msg_settings *rung, const struct psr_msg_settings *settings)
{
	const int is_same_edge = rung->pass > 0 || rung->is_smooth == settings->is_smooth; /* passes ignore smoothing */

	return rung->scale == settings->scale && rung->pass == settings->pass && is_same_edge
	       && rung->spacing_px == settings->spacing_px;
}

static int rung_of(const struct psr_msg_settings *settings)
{
	for (int i = 0; i < BUDGET_RUNGS; i++)
		if (is_rung(&ladder[i], settings))
			return i;
	return -1;
}

/* ---- time ---- */

/* How many drawn pixels stand beside each other in one of the whole picture. */
static double density_of(const struct psr_msg_settings *settings)
{
	return ldexp(1, settings->pass) / settings->scale;
}

static void work_of(double work[BUDGET_N_WORK], const struct budget_view *view, const struct psr_msg_settings *settings)
{
	const double n_pixels = (double)view->width * view->height, density = density_of(settings);
	const double squares = view->area * density * density / (settings->spacing_px * settings->spacing_px);

	work[BUDGET_SAMPLES] = fmin(squares, view->n_samples);
	work[BUDGET_PIXELS] = (EMPTY_PIXEL * n_pixels + (1 - EMPTY_PIXEL) * fmin(view->area, n_pixels)) * density * density;
	work[BUDGET_SMOOTH] = settings->is_smooth && settings->pass == 0 ? work[BUDGET_PIXELS] : 0;
	work[BUDGET_ANSWER] = n_pixels / (settings->scale * settings->scale);
	work[BUDGET_SHADOWS] = (double)view->n_shadow_lights / settings->scale; /* maps are as fine as the picture */
}

static double time_of(const struct budget_learnt *learnt, const double work[BUDGET_N_WORK])
{
	double ns = 0;

	for (int i = 0; i < BUDGET_N_WORK; i++)
		ns += learnt->ns[i] * work[i];
	return ns;
}

/* A rung that was seldom drawn has the tail of all, at most the one that flows begin with. */
static double tail_of(const struct budget_learnt *learnt, int rung)
{
	if (learnt->n_drawn[rung] >= TAIL_FRAMES)
		return learnt->tail_of[rung];
	return fmin(learnt->tail, FIRST_TAIL);
}

static double foresee(const struct budget_learnt *learnt, const struct budget_view *view, int rung)
{
	double work[BUDGET_N_WORK];

	work_of(work, view, &ladder[rung]);
	return time_of(learnt, work) * learnt->bias[rung] * tail_of(learnt, rung);
}

void budget_init(struct budget_learnt *learnt)
{
	/* Of one slow core; the first frames correct them. */
	*learnt = (struct budget_learnt){ .ns = { 40, 80, 30, 30, 0 }, .tail = FIRST_TAIL };
	for (int i = 0; i < BUDGET_RUNGS; i++) {
		learnt->bias[i] = learnt->hope[i] = 1;
		learnt->tail_of[i] = FIRST_TAIL;
	}
}

void budget_inherit(struct budget_learnt *learnt, const struct budget_learnt *from)
{
	budget_init(learnt);
	memcpy(learnt->ns, from->ns, sizeof learnt->ns);
}

/* A step up outweighs 19 steps down, so that the tail rests where one frame of 20 exceeds it. */
static void learn_tail(double *tail, double ratio)
{
	const double step = ratio > *tail ? TAIL_PART * TAIL_STEP : (TAIL_PART - 1) * TAIL_STEP;

	*tail = fmin(fmax(*tail * exp(step), LEAST_TAIL), MOST_TAIL);
}

/* A rung that is never drawn is never learnt: its price may be foreseen far too high, as models have few levels. So the
 * better ones are tried now and then. */
static void learn_hope(struct budget_learnt *learnt, int rung)
{
	for (int i = 0; i < BUDGET_RUNGS; i++)
		learnt->hope[i] = i > rung ? fmax(learnt->hope[i] * HOPE_STEP, LEAST_HOPE) : 1;
}

void budget_learn(struct budget_learnt *learnt, const struct budget_view *view,
                  const struct psr_msg_settings *settings, const struct budget_spent *spent)
{
	const double weight = fmax(LEAST_WEIGHT, 1.0 / (learnt->n_frames + 1));
	const int rung = rung_of(settings);
	double work[BUDGET_N_WORK], rest = spent->total_ns, before, fresh;

	work_of(work, view, settings);
	before = time_of(learnt, work);
	if (rung >= 0 && before > 0 && learnt->n_frames > 0) {
		learn_tail(&learnt->tail, spent->total_ns / (before * learnt->bias[rung]));
		learn_tail(&learnt->tail_of[rung], spent->total_ns / (before * learnt->bias[rung]));
		learnt->n_drawn[rung]++;
	}
	for (int i = 0; i < BUDGET_N_WORK; i++)
		rest -= i != BUDGET_ANSWER ? spent->ns[i] : 0;
	for (int i = 0; i < BUDGET_N_WORK; i++) {
		const double ns = i == BUDGET_ANSWER ? fmax(rest, 0) : spent->ns[i];

		if (work[i] > 0)
			learnt->ns[i] += weight * (ns / work[i] - learnt->ns[i]);
	}
	learnt->n_frames++;
	if (rung < 0)
		return;
	/* Knowledge fades with frames of any rung. */
	fresh = 1 - pow(1 - weight, learnt->n_frames - learnt->drawn_at[rung]);
	learnt->bias[rung] += fresh * (spent->total_ns / fmax(time_of(learnt, work), 1) - learnt->bias[rung]);
	learnt->drawn_at[rung] = learnt->n_frames;
	learnt->error[rung] = spent->error_px;
	learn_hope(learnt, rung);
}

/* ---- choice ---- */

/* Without a frame of this rung: that of the nearest rung that has one, by the size of its pixels; without any: half a
 * pixel, and a cell of the first level that is as wide as the spacing. */
static double error_of(const struct budget_learnt *learnt, int rung)
{
	const double density = density_of(&ladder[rung]), spacing = ladder[rung].spacing_px;

	for (int apart = 0; apart < BUDGET_RUNGS; apart++)
		for (int sign = -1; sign <= 1; sign += 2) {
			const int i = rung + sign * apart;

			if (i >= 0 && i < BUDGET_RUNGS && learnt->error[i] > 0)
				return learnt->error[i] * density_of(&ladder[i]) / density;
		}
	return (M_SQRT1_2 + 0.55 * spacing + 2 * M_SQRT2 * fmax(spacing, 1)) / density;
}

static void set_price(struct budget_price *price, const struct budget_learnt *learnt, const struct budget_view *view,
                      int rung)
{
	price->settings = ladder[rung];
	price->ns = foresee(learnt, view, rung);
}

static void set_choice(struct budget_choice *choice, const struct budget_learnt *learnt, const struct budget_view *view,
                       int rung)
{
	int cheaper = rung - 1, better = rung + 1;

	memset(choice, 0, sizeof *choice);
	set_price(&choice->chosen, learnt, view, rung);
	while (cheaper >= 0 && !is_offered(&ladder[cheaper], view))
		cheaper--;
	while (better < BUDGET_RUNGS && !is_offered(&ladder[better], view))
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
		if (!is_offered(&ladder[i], view))
			continue;
		if (foresee(learnt, view, i) * learnt->hope[i] <= limit_ns)
			fitting = i;
		if (cheapest < 0 || foresee(learnt, view, i) < foresee(learnt, view, cheapest))
			cheapest = i;
	}
	set_choice(choice, learnt, view, fitting >= 0 ? fitting : cheapest);
	choice->is_met = fitting >= 0;
}

void budget_choose_error(struct budget_choice *choice, const struct budget_learnt *learnt,
                         const struct budget_view *view, double limit_px)
{
	int fitting = -1, least = -1;

	for (int i = 0; i < BUDGET_RUNGS; i++) {
		if (!is_offered(&ladder[i], view))
			continue;
		if (error_of(learnt, i) <= limit_px
		    && (fitting < 0 || foresee(learnt, view, i) < foresee(learnt, view, fitting)))
			fitting = i;
		if (least < 0 || error_of(learnt, i) < error_of(learnt, least))
			least = i;
	}
	set_choice(choice, learnt, view, fitting >= 0 ? fitting : least);
	choice->is_met = fitting >= 0;
}

unsigned budget_most_pass(const struct psr_msg_frame *request)
{
	if (request->budget == PSR_WIRE_BUDGET_SETTINGS)
		return request->settings.pass;
	return request->budget != PSR_WIRE_BUDGET_NONE && can_refine(request->planes) ? PSR_WIRE_MAX_PASS : 0;
}
