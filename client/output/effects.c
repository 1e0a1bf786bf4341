#include <inttypes.h>
#include <stdio.h>
#include "effects.h"
#include "psr/render.h"

#define LARGEST_WHY 1000 /* more than any effect's */

/* Returns the next entry of a known effect, from *at on, or NULL. */
static const struct psr_msg_report_entry *next(const struct psr_msg_frame_end *end, unsigned *at,
                                               enum psr_effect *effect)
{
	while (*at < end->n_entries) {
		const struct psr_msg_report_entry *entry = &end->entry[(*at)++];

		if (entry->id < PSR_WIRE_REPORT_EFFECTS || entry->id >= PSR_WIRE_REPORT_EFFECTS + PSR_N_EFFECTS)
			continue;
		*effect = (enum psr_effect)(entry->id - PSR_WIRE_REPORT_EFFECTS);
		return entry;
	}
	return NULL;
}

static const char *why(enum psr_effect effect, const struct psr_msg_report_entry *entry)
{
	return psr_effect_why(effect, (enum psr_why)(entry->ns < LARGEST_WHY ? entry->ns : LARGEST_WHY));
}

void effects_add(cJSON *to, const struct psr_msg_frame_end *end)
{
	cJSON *effects = cJSON_AddObjectToObject(to, "effects");
	const struct psr_msg_report_entry *entry;
	enum psr_effect effect;

	for (unsigned at = 0; (entry = next(end, &at, &effect)) != NULL;) {
		cJSON *item = cJSON_AddObjectToObject(effects, psr_effect_name(effect));

		cJSON_AddBoolToObject(item, "ran", entry->ns == PSR_WHY_RAN);
		if (entry->ns == PSR_WHY_RAN)
			cJSON_AddNumberToObject(item, "count", (double)entry->count);
		else
			cJSON_AddStringToObject(item, "why", why(effect, entry));
	}
}

void effects_print(const struct psr_msg_frame_end *end)
{
	const struct psr_msg_report_entry *entry;
	enum psr_effect effect;

	for (unsigned at = 0; (entry = next(end, &at, &effect)) != NULL;) {
		if (entry->ns == PSR_WHY_RAN)
			printf("%-10s ran: %" PRIu64 " %s\n", psr_effect_name(effect), entry->count, psr_effect_counts(effect));
		else
			printf("%-10s left out: %s\n", psr_effect_name(effect), why(effect, entry));
	}
}
