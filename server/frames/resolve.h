/* Requests to settings: those asked for, or those that a budget chooses; and what became of them. */
#ifndef PSRD_RESOLVE_H
#define PSRD_RESOLVE_H

#include "draw.h"
#include "psr/report.h"

struct surveyor;

/* Sets the settings for frame, refine and is_sharp as they are set; a budget of time or error chooses them by what was
 * learnt, for which it surveys the scene. The scene is bound. surveyor NULL: without memory. */
void resolve_settings(struct drawing *d, const struct budget_learnt *learnt, struct surveyor *surveyor);

/* What a frame met and took, but for total_ns. */
void resolve_spent(struct budget_spent *spent, const struct psr_report *report,
                   const struct psr_msg_settings *settings);

#endif
