/* What psrd chose for a budget of time, error or likeness, what it foresaw and what it took. Frames without such a
 * budget have none of this. */
#ifndef PSR_CLIENT_OUTPUT_BUDGET_H
#define PSR_CLIENT_OUTPUT_BUDGET_H

#include <cjson/cJSON.h>
#include "psr/client.h"

int budget_is_said(const struct psr_msg_frame *asked);

/* Adds "budget": asked, kept, the prices of the settings chosen, and of the next cheaper and better ones. */
void budget_add(cJSON *report, const struct psr_msg_frame *asked, const struct psr_event *event);

/* Prints a line on standard error. */
void budget_print(const char *program, const struct psr_msg_frame *asked, const struct psr_msg_frame_end *end);

#endif
