#include "budget.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PART 0.95          /* of frames take at most what is foreseen */
#define FIRST_TAIL 1.5     /* before a rung has frames */
#define MARGIN 0.5         /* more is foreseen after one frame, half of that after two */
#define SCALED_MARGIN 1.2  /* of a rung that is foreseen by another one's frames and a calibration */
#define FIRST_FRAMES 5     /* teach rates alone: they start from other machines' */
#define ALIKE 0.2          /* views whose areas and samples differ by such a factor, logarithm, teach most */
#define LEAST_ALIKE 0.03   /* what other views count */
/* Measured: of a sample's work, a block that is tested; of a disc's, a pixel of its square; of a pixel that the object
 * covers, one that it does not, and each light that casts a shadow there. */
#define BLOCK 2
#define DISC_PIXEL 0.007
#define EMPTY_PIXEL 0.1
#define EMPTY_SUBPIXEL 0.2
#define SHADOW 1
#define SUBPIXEL_MAP 3 /* of a map's work: one of a pass */
#define HOPE_STEP 0.995    /* a frame */
#define LEAST_HOPE 0.6     /* what is foreseen to take over 1.7 times the budget is not tried */

static double least(double a, double b)
{
	return a < b ? a : b;
}

/* Of a frame with these settings that meets these counts. */
static void work_of(double work[BUDGET_N_WORK], const struct budget_view *view, const struct psr_msg_settings *settings,
                    const struct budget_counts *counts, double covered)
{
	const double n_pixels = (double)view->width * view->height, density = budget_density(settings);
	const double drawn = n_pixels * density * density;
	const double lit = least(covered, drawn) * (1 + SHADOW * view->n_shadow_lights);
	const unsigned doublings = budget_doublings(settings);

	memset(work, 0, BUDGET_N_WORK * sizeof *work);
	if (settings->pass > 0) {
		work[BUDGET_SPLATS] = counts->n_samples + DISC_PIXEL * counts->spread;
		work[BUDGET_SUBPIXELS] = EMPTY_SUBPIXEL * drawn + lit;
	} else {
		work[BUDGET_SAMPLES] = counts->n_samples + BLOCK * counts->n_blocks + drawn;
		work[BUDGET_PIXELS] = EMPTY_PIXEL * drawn + lit;
		work[BUDGET_SMOOTH] = settings->smooth ? EMPTY_PIXEL * drawn + least(covered, drawn) : 0;
	}
	work[BUDGET_ANSWER] = n_pixels / (settings->scale * settings->scale);
	if (settings->scale != view->kept.scale || doublings != budget_doublings(&view->kept))
		work[BUDGET_SHADOWS] = view->n_shadow_lights * (doublings > 0 ? SUBPIXEL_MAP : 1.0)
		                       / (settings->scale * sqrt(settings->scale));
}

static void foresee_work(double work[BUDGET_N_WORK], const struct budget_view *view, int rung)
{
	const double density = budget_density(&budget_ladder[rung]);

	work_of(work, view, &budget_ladder[rung], &view->at[rung], view->area * density * density);
}

static int compare_doubles(const void *a, const void *b)
{
	const double x = *(const double *)a, y = *(const double *)b;

	return (x > y) - (x < y);
}

/* What has never been drawn is foreseen by its sibling. */
static double rate_of(const struct budget_learnt *learnt, int kind)
{
	static const struct {
		int kind;
		double times;
	} sibling[BUDGET_N_WORK] = {
		[BUDGET_SPLATS] = { BUDGET_SAMPLES, 70 }, [BUDGET_SUBPIXELS] = { BUDGET_PIXELS, 1.5 },
		[BUDGET_SMOOTH] = { BUDGET_PIXELS, 0.5 },
	};
	const struct budget_rate *rate = &learnt->rate[kind];
	double sorted[BUDGET_LAST];

	if (rate->n == 0 && sibling[kind].times > 0)
		return sibling[kind].times * rate_of(learnt, sibling[kind].kind);
	memcpy(sorted, rate->ns, sizeof sorted);
	qsort(sorted, BUDGET_LAST, sizeof *sorted, compare_doubles);
	return sorted[BUDGET_LAST / 2];
}

static double time_of(const struct budget_learnt *learnt, const double work[BUDGET_N_WORK])
{
	double ns = 0;

	for (int i = 0; i < BUDGET_N_WORK; i++)
		ns += work[i] > 0 ? rate_of(learnt, i) * work[i] : 0;
	return ns;
}

static struct budget_ratio seen_as(const struct budget_view *view, int rung)
{
	return (struct budget_ratio){ .area = (float)log(view->area + 1),
		                          .n_samples = (float)log(view->at[rung].n_samples + 1) };
}

struct weighed {
	double ratio, weight;
};

static int compare_weighed(const void *a, const void *b)
{
	const double x = ((const struct weighed *)a)->ratio, y = ((const struct weighed *)b)->ratio;

	return (x > y) - (x < y);
}

/* What 95 of 100 frames like this one took, of the rung's frames; with few of them the slowest is left out, which may
 * have met something else, and a margin is added. */
static double ratio_of(const struct budget_past *past, const struct budget_ratio *like)
{
	const unsigned n = past->n < BUDGET_PAST ? past->n : BUDGET_PAST;
	const double part = least(PART, 1 - 1.5 / n);
	struct weighed sorted[BUDGET_PAST];
	double all = 0, sum = 0;
	unsigned i;

	for (i = 0; i < n; i++) {
		const struct budget_ratio *p = &past->frame[i];
		const double a = (double)(p->area - like->area) / ALIKE, s = (double)(p->n_samples - like->n_samples) / ALIKE;

		sorted[i] = (struct weighed){ (double)p->ratio, LEAST_ALIKE + exp(-(a * a + s * s) / 2) };
		all += sorted[i].weight;
	}
	qsort(sorted, n, sizeof *sorted, compare_weighed);
	for (i = 0; i < n - 1; i++) {
		sum += sorted[i].weight;
		if (sum >= part * all)
			break;
	}
	return sorted[i].ratio * (1 + MARGIN / n);
}

/* The nearest rung that has frames, of the same kind unless it is known how their times compare; -1: none. */
static int known_near(const struct budget_learnt *learnt, const struct budget_view *view, int rung)
{
	for (int apart = 0; apart < BUDGET_RUNGS; apart++)
		for (int sign = -1; sign <= 1; sign += 2) {
			const int i = rung + sign * apart;

			if (i >= 0 && i < BUDGET_RUNGS && learnt->past[i].n > 0
			    && ((view->ms[rung] > 0 && view->ms[i] > 0) || !budget_ladder[i].pass == !budget_ladder[rung].pass))
				return i;
		}
	return -1;
}

/* A rung without frames takes as many times its neighbour's time as the model's calibration says; without one it is as
 * slow as the neighbour of its kind, by its own work. */
double budget_foresee(const struct budget_learnt *learnt, const struct budget_view *view, int rung)
{
	const int known = known_near(learnt, view, rung);
	const int is_scaled = known >= 0 && known != rung && view->ms[rung] > 0 && view->ms[known] > 0;
	double work[BUDGET_N_WORK], ns;

	foresee_work(work, view, is_scaled ? known : rung);
	ns = time_of(learnt, work);
	if (known < 0)
		return ns * FIRST_TAIL;
	const struct budget_ratio like = seen_as(view, known);
	ns *= ratio_of(&learnt->past[known], &like);
	return is_scaled ? ns * SCALED_MARGIN * view->ms[rung] / view->ms[known] : ns;
}

void budget_init(struct budget_learnt *learnt)
{
	static const double ns[BUDGET_N_WORK] = { 10, 80, 30, 700, 120, 30, 0 }; /* of one slow core */

	memset(learnt, 0, sizeof *learnt);
	for (int kind = 0; kind < BUDGET_N_WORK; kind++)
		for (int i = 0; i < BUDGET_LAST; i++)
			learnt->rate[kind].ns[i] = ns[kind];
	for (int i = 0; i < BUDGET_RUNGS; i++)
		learnt->hope[i] = 1;
}

void budget_inherit(struct budget_learnt *learnt, const struct budget_learnt *from)
{
	budget_init(learnt);
	memcpy(learnt->rate, from->rate, sizeof learnt->rate);
	learnt->n_frames = from->n_frames;
}

/* A rung that is never drawn is never learnt: its price may be foreseen too high. So the better ones are tried now and
 * then. */
static void learn_hope(struct budget_learnt *learnt, int rung)
{
	for (int i = 0; i < BUDGET_RUNGS; i++)
		learnt->hope[i] = i > rung ? fmax(learnt->hope[i] * HOPE_STEP, LEAST_HOPE) : 1;
}

static void learn_rates(struct budget_learnt *learnt, const double work[BUDGET_N_WORK],
                        const struct budget_spent *spent)
{
	double rest = spent->total_ns;

	for (int i = 0; i < BUDGET_N_WORK; i++)
		rest -= i != BUDGET_ANSWER ? spent->ns[i] : 0;
	for (int i = 0; i < BUDGET_N_WORK; i++) {
		const double ns = i == BUDGET_ANSWER ? fmax(rest, 0) : spent->ns[i];
		struct budget_rate *rate = &learnt->rate[i];

		if (work[i] > 0)
			rate->ns[rate->n++ % BUDGET_LAST] = ns / work[i];
	}
}

static void learn_ratio(struct budget_learnt *learnt, const struct budget_view *view, int rung, double total_ns)
{
	struct budget_past *past = &learnt->past[rung];
	struct budget_ratio ratio = seen_as(view, rung);
	double work[BUDGET_N_WORK], foreseen;

	foresee_work(work, view, rung);
	foreseen = time_of(learnt, work);
	if (!(foreseen > 0))
		return;
	ratio.ratio = (float)(total_ns / foreseen);
	past->frame[past->n++ % BUDGET_PAST] = ratio;
}

void budget_learn(struct budget_learnt *learnt, const struct budget_view *view, int is_seen,
                  const struct psr_msg_settings *settings, const struct budget_spent *spent)
{
	struct budget_counts counts = { spent->n_blocks, spent->n_samples, 0 };
	const int rung = budget_rung_of(settings);
	double work[BUDGET_N_WORK];

	if (rung >= 0 && is_seen) /* frames do not tell */
		counts.spread = view->at[rung].spread * spent->n_samples / fmax(view->at[rung].n_samples, 1);
	work_of(work, view, settings, &counts, spent->n_covered);
	if (counts.spread == 0)
		work[BUDGET_SPLATS] = 0;
	learn_rates(learnt, work, spent);
	learnt->n_frames++;
	if (rung < 0)
		return;
	if (is_seen && learnt->n_frames > FIRST_FRAMES)
		learn_ratio(learnt, view, rung, spent->total_ns);
	learnt->error[rung] = spent->error_px;
	learn_hope(learnt, rung);
}
