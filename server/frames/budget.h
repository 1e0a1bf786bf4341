/* Which settings a request gets that has a budget of time or error, and what they will take.
 *
 * A model without clock and I/O: work times what a unit of it took in the frames before. The ladder is generic; it
 * rises from the cheapest settings to the best. */
#ifndef PSRD_BUDGET_H
#define PSRD_BUDGET_H

#include <stdint.h>
#include "psr/message.h"

#define BUDGET_RUNGS 10

enum budget_work {
	BUDGET_SAMPLES, /* plan, cull, warp: of squares of the spacing in the area that models cover */
	BUDGET_PIXELS,  /* gaps, resolve, shade, fill: of pixels drawn, sub-pixels in passes above 0; empty ones count less */
	BUDGET_SMOOTH,  /* of pixels drawn, where they are smoothed */
	BUDGET_ANSWER,  /* of pixels coded; and all time that no other kind has */
	BUDGET_SHADOWS, /* of lights that cast shadows, over the scale: maps that are kept take none */
	BUDGET_N_WORK,
};

/* What a frame shows, before settings are chosen. */
struct budget_view {
	uint32_t width, height, planes;
	double area;      /* pixels that the instances' spheres cover, each within the picture, summed */
	double n_samples; /* of all instances */
	unsigned n_shadow_lights;
};

/* What the frames of a flow took, as the machine was loaded then. */
struct budget_learnt {
	double ns[BUDGET_N_WORK];  /* a unit of work */
	double bias[BUDGET_RUNGS]; /* time of a rung over that of the work alone */
	double hope[BUDGET_RUNGS]; /* of rungs better than those drawn: they are tried at so much of their price */
	unsigned drawn_at[BUDGET_RUNGS]; /* n_frames when the rung was drawn last */
	double tail;               /* 95 of 100 frames take at most so many times what bias and work say */
	double tail_of[BUDGET_RUNGS]; /* of the rung's frames: short ones vary more */
	unsigned n_drawn[BUDGET_RUNGS];
	double error[BUDGET_RUNGS]; /* the bound of the last frame of a rung, pixels of the whole picture; 0: unknown */
	unsigned n_frames;
};

void budget_init(struct budget_learnt *learnt);
void budget_inherit(struct budget_learnt *learnt, const struct budget_learnt *from); /* a new flow: times, no biases */

struct budget_spent {
	double ns[BUDGET_N_WORK]; /* of each kind; ANSWER is not read */
	double total_ns;          /* from the start of work until the frame's end is queued */
	double error_px;          /* pixels of the whole picture */
};

/* Learns from a frame of any settings, refinement level 0, that was drawn to its end. */
void budget_learn(struct budget_learnt *learnt, const struct budget_view *view,
                  const struct psr_msg_settings *settings, const struct budget_spent *spent);

struct budget_price {
	struct psr_msg_settings settings; /* scale 0: there are none such */
	double ns;                        /* foreseen: 95 of 100 frames take at most so long */
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

unsigned budget_most_pass(const struct psr_msg_frame *request); /* that may be chosen for it, or is asked for */

#endif
