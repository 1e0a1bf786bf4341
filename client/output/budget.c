#include "budget.h"
#include <stdio.h>
#include "base/json.h"
#include "client/scene/quality.h"

int budget_is_said(const struct psr_msg_frame *asked)
{
	return asked->budget == PSR_WIRE_BUDGET_TIME || asked->budget == PSR_WIRE_BUDGET_ERROR;
}

static const struct psr_msg_report_entry *find(const struct psr_msg_frame_end *end, unsigned id)
{
	for (unsigned i = 0; i < end->n_entries; i++)
		if (end->entry[i].id == id)
			return &end->entry[i];
	return NULL;
}

static double ms_of(const struct psr_msg_report_entry *entry)
{
	return entry != NULL ? (double)entry->ns / 1e6 : 0;
}

static void add_price(cJSON *to, const char *name, const struct psr_msg_report_entry *entry)
{
	struct psr_msg_settings settings;
	cJSON *price;

	if (entry == NULL)
		return;
	psr_settings_unpack(&settings, entry->count);
	price = cJSON_AddObjectToObject(to, name);
	cJSON_AddNumberToObject(price, "ms", ms_of(entry));
	cJSON_AddNumberToObject(price, "scale", settings.scale);
	json_add_number(price, "spacing_px", settings.spacing_px);
	cJSON_AddBoolToObject(price, "smooth", settings.is_smooth);
	cJSON_AddNumberToObject(price, "pass", settings.pass);
}

void budget_add(cJSON *report, const struct psr_msg_frame *asked, const struct psr_event *event)
{
	const struct psr_msg_frame_end *end = event->end;
	char text[QUALITY_BUDGET_TEXT];
	cJSON *budget;

	if (!budget_is_said(asked))
		return;
	budget = cJSON_AddObjectToObject(report, "budget");
	cJSON_AddStringToObject(budget, "asked", quality_budget_text(text, asked));
	cJSON_AddBoolToObject(budget, "kept", end->status == PSR_WIRE_FRAME_OK);
	cJSON_AddNumberToObject(budget, "error_px", end->error_px * event->begin->settings.scale);
	add_price(budget, "chosen", find(end, PSR_WIRE_REPORT_CHOSEN));
	add_price(budget, "cheaper", find(end, PSR_WIRE_REPORT_CHEAPER));
	add_price(budget, "better", find(end, PSR_WIRE_REPORT_BETTER));
}

/* As options of psr say it, where they can. */
static void print_price(const char *what, const struct psr_msg_report_entry *entry)
{
	struct psr_msg_settings settings;

	if (entry == NULL)
		return;
	psr_settings_unpack(&settings, entry->count);
	fprintf(stderr, "%s ", what);
	if (settings.pass > 0)
		fprintf(stderr, "pass %u", settings.pass);
	else if (settings.scale > 1)
		fprintf(stderr, "scale %u", settings.scale);
	else
		fprintf(stderr, "spacing %g%s", settings.spacing_px, settings.is_smooth ? ", smooth" : "");
	fprintf(stderr, " for %.3g ms", ms_of(entry));
}

void budget_print(const char *program, const struct psr_msg_frame *asked, const struct psr_msg_frame_end *end)
{
	const struct psr_msg_report_entry *chosen = find(end, PSR_WIRE_REPORT_CHOSEN);
	char text[QUALITY_BUDGET_TEXT];

	if (chosen == NULL) /* of a server that does not tell */
		return;
	fprintf(stderr, "%s:", program);
	print_price(" chose", chosen);
	fprintf(stderr, ", took %.3g ms", ms_of(find(end, PSR_WIRE_REPORT_TOTAL)));
	print_price("; cheaper:", find(end, PSR_WIRE_REPORT_CHEAPER));
	print_price("; better:", find(end, PSR_WIRE_REPORT_BETTER));
	if (end->status != PSR_WIRE_FRAME_OK)
		fprintf(stderr, "; the budget of %s was not kept", quality_budget_text(text, asked));
	fprintf(stderr, "\n");
}
