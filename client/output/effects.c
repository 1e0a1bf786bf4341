#include <inttypes.h>
#include <stdio.h>
#include "client/scene/instance.h"
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

/* ---- what instances are drawn as ---- */

static const struct psr_msg_report_entry *find(const struct psr_msg_frame_end *end, unsigned id)
{
	for (unsigned i = 0; i < end->n_entries; i++)
		if (end->entry[i].id == id)
			return &end->entry[i];
	return NULL;
}

static const char *why_drawn(uint8_t as, uint64_t count)
{
	static const char *const automatic[] = {
		[PSR_WIRE_REP_BLOCKS] = "the model has blocks, the fastest",
		[PSR_WIRE_REP_OCTREE] = "the model has no blocks",
		[PSR_WIRE_REP_DPOINT] = "the model has nothing else",
	};

	if (count >> 32 == 0)
		return "the scene says so";
	return (uint32_t)count == count >> 32 ? automatic[as] : "the scene says so of some; the others have nothing better";
}

void drawn_as_add(cJSON *to, const struct psr_msg_frame_end *end)
{
	cJSON *all = cJSON_AddObjectToObject(to, "drawn_as");
	const struct psr_msg_report_entry *finest = find(end, PSR_WIRE_REPORT_FINEST);

	for (uint8_t as = PSR_WIRE_REP_BLOCKS; as <= PSR_WIRE_REP_DPOINT; as++) {
		const struct psr_msg_report_entry *entry = find(end, PSR_WIRE_REPORT_AS_BLOCKS + as - PSR_WIRE_REP_BLOCKS);
		cJSON *item;

		if (entry == NULL)
			continue;
		item = cJSON_AddObjectToObject(all, instance_representations[as]);
		cJSON_AddNumberToObject(item, "instances", (double)(uint32_t)entry->count);
		cJSON_AddNumberToObject(item, "automatic", (double)(entry->count >> 32));
		cJSON_AddStringToObject(item, "why", why_drawn(as, entry->count));
		if (as == PSR_WIRE_REP_OCTREE && finest != NULL) {
			cJSON_AddNumberToObject(item, "levels", (double)(finest->count & 0xff));
			cJSON_AddNumberToObject(item, "of_levels", (double)(finest->count >> 8 & 0xff));
		}
	}
}

static void print_levels(unsigned levels, unsigned of_levels)
{
	if (levels < of_levels)
		printf("; %u of %u levels suffice", levels, of_levels);
	else
		printf("; all %u levels", levels);
}

static void print_drawn_as(const struct psr_msg_frame_end *end)
{
	const struct psr_msg_report_entry *finest = find(end, PSR_WIRE_REPORT_FINEST);

	for (uint8_t as = PSR_WIRE_REP_BLOCKS; as <= PSR_WIRE_REP_DPOINT; as++) {
		const struct psr_msg_report_entry *entry = find(end, PSR_WIRE_REPORT_AS_BLOCKS + as - PSR_WIRE_REP_BLOCKS);

		if (entry == NULL)
			continue;
		const unsigned n = (uint32_t)entry->count;

		printf("%-10s drawn: %u instance%s, since %s", instance_representations[as], n, n == 1 ? "" : "s",
		       why_drawn(as, entry->count));
		if (as == PSR_WIRE_REP_OCTREE && finest != NULL)
			print_levels((unsigned)(finest->count & 0xff), (unsigned)(finest->count >> 8 & 0xff));
		putchar('\n');
	}
}

/* ---- effects ---- */

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

	print_drawn_as(end);
	for (unsigned at = 0; (entry = next(end, &at, &effect)) != NULL;) {
		if (entry->ns == PSR_WHY_RAN)
			printf("%-10s ran: %" PRIu64 " %s\n", psr_effect_name(effect), entry->count, psr_effect_counts(effect));
		else
			printf("%-10s left out: %s\n", psr_effect_name(effect), why(effect, entry));
	}
}
