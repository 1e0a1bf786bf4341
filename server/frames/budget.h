/* Which settings a request gets that has a budget of time, error or RMSE, and what they will take.
 *
 * A model without clock and I/O: work, foreseen by a survey, times what a unit of it took in the frames before. The
 * ladder is generic; it rises from the cheapest settings to the best. */
#ifndef PSRD_BUDGET_H
#define PSRD_BUDGET_H

#include <stdint.h>
#include "psr/message.h"

#define BUDGET_RUNGS 11

enum budget_work {
	BUDGET_SAMPLES,   /* plan, cull, warp: of samples, blocks that are tested and pixels; without a pass */
	BUDGET_PIXELS,    /* gaps, resolve, shade, fill: of pixels drawn; empty ones count less, in shadows' light more */
	BUDGET_SMOOTH,    /* of these, where they are smoothed */
	BUDGET_SPLATS,    /* as BUDGET_SAMPLES, of samples and the area of their discs, */
	BUDGET_SUBPIXELS, /* as BUDGET_PIXELS, in passes above 0 */
	BUDGET_ANSWER,    /* of pixels coded; and all time that no other kind has */
	BUDGET_SHADOWS,   /* of shadow maps that do not stand; they are as fine as the picture */
	BUDGET_N_WORK,
};

/* What a rung would meet: render/survey.h. */
struct budget_counts {
	double n_blocks, n_samples, spread;
};

/* What a frame shows, before settings are chosen. */
struct budget_view {
	uint32_t width, height, planes;
	double area; /* pixels of the picture that models cover */
	struct budget_counts at[BUDGET_RUNGS];
	unsigned n_shadow_lights;
	int can_be_fine; /* a fine picture is none of another kind: render/fine.h */
	int is_calibrated; /* rmse and ms have what calibrations of the scene's models foresee: */
	double rmse[BUDGET_RUNGS]; /* codes of sRGB; INFINITY: unknown */
	double ms[BUDGET_RUNGS];   /* of some machine: to be compared with each other; 0: unknown */
	struct psr_msg_settings kept; /* of the flow's last frame if it drew this scene: its maps stand; or scale 0 */
};

void budget_densities(double density[BUDGET_RUNGS]); /* of the ladder's rungs, for the survey; they never fall */

/* The median of the last frames': one slow frame changes nothing. */
#define BUDGET_LAST 9
struct budget_rate {
	double ns[BUDGET_LAST]; /* of a unit of work */
	unsigned n;             /* frames so far */
};

/* The last frames of a rung: how many times what rates and work say they took, and what they showed. */
#define BUDGET_PAST 32
struct budget_past {
	struct budget_ratio {
		float ratio, area, n_samples; /* the latter as logarithms */
	} frame[BUDGET_PAST];
	unsigned n; /* frames so far */
};

/* What the frames of a flow took, as the machine was loaded then. */
struct budget_learnt {
	struct budget_rate rate[BUDGET_N_WORK];
	struct budget_past past[BUDGET_RUNGS];
	double hope[BUDGET_RUNGS];  /* of rungs better than those drawn: they are tried at so much of their price */
	double error[BUDGET_RUNGS]; /* the bound of the last frame of a rung, pixels of the whole picture; 0: unknown */
	unsigned n_frames;
};

void budget_init(struct budget_learnt *learnt);
void budget_inherit(struct budget_learnt *learnt, const struct budget_learnt *from); /* a new flow: rates alone */

struct budget_spent {
	double ns[BUDGET_N_WORK]; /* of each kind; ANSWER is not read */
	double n_blocks, n_samples, n_covered; /* as the frame met them; of refined frames sub-pixels */
	double total_ns;          /* from the start of work until the frame's end is queued */
	double error_px;          /* pixels of the whole picture */
};

/* Learns from a frame of any settings, refinement level 0, that was drawn to its end. is_seen: the view was surveyed;
 * without, only rates are learnt. */
void budget_learn(struct budget_learnt *learnt, const struct budget_view *view, int is_seen,
                  const struct psr_msg_settings *settings, const struct budget_spent *spent);

struct budget_price {
	struct psr_msg_settings settings; /* scale 0: there are none such */
	double ns;                        /* foreseen: 95 of 100 frames take at most so long */
	int has_rmse;
	double rmse;                      /* foreseen: 9 of 10 views have at most so much; codes of sRGB */
};

struct budget_choice {
	struct budget_price chosen, cheaper, better; /* the neighbours on the ladder */
	int is_met;                                  /* as far as foreseen */
};

/* TIME: the best rung that is foreseen to take at most limit_ns; else the cheapest one. */
void budget_choose_time(struct budget_choice *choice, const struct budget_learnt *learnt,
                        const struct budget_view *view, double limit_ns);

/* ERROR: the cheapest rung whose bound is foreseen to be at most limit_px; else the one of the least bound. */
void budget_choose_error(struct budget_choice *choice, const struct budget_learnt *learnt,
                         const struct budget_view *view, double limit_px);

/* RMSE: the cheapest rung that is foreseen to have at most limit codes; else the one of the least. The view is
 * calibrated. */
void budget_choose_rmse(struct budget_choice *choice, const struct budget_learnt *learnt,
                        const struct budget_view *view, double limit);

int budget_is_asked(const struct psr_msg_frame *request); /* of time, error or RMSE: settings are chosen */
unsigned budget_most_pass(const struct psr_msg_frame *request); /* that may be chosen for it, or is asked for */

/* ---- for the files of budgets ---- */

extern const struct psr_msg_settings budget_ladder[BUDGET_RUNGS];
int budget_rung_of(const struct psr_msg_settings *settings); /* -1: none */
unsigned budget_doublings(const struct psr_msg_settings *settings); /* of a picture's sides: passes, fine pictures */
double budget_density(const struct psr_msg_settings *settings); /* drawn pixels beside each other in one of the whole */
double budget_foresee(const struct budget_learnt *learnt, const struct budget_view *view, int rung); /* ns */

#endif
