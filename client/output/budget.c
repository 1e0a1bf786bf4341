#include "budget.h"
#include <math.h>
#include <stdio.h>
#include "base/json.h"
#include "client/scene/quality.h"

int budget_is_said(const struct psr_msg_frame *asked)
{
	return asked->budget != PSR_WIRE_BUDGET_NONE && asked->budget != PSR_WIRE_BUDGET_SETTINGS;
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

/* Settings, and what they are foreseen to take and to be worth. */
struct price {
	struct psr_msg_settings settings;
	double ms;
	double db; /* NAN: unknown */
};

/* Returns 0 if the server does not tell. */
static int find_price(struct price *price, const struct psr_msg_frame_end *end, unsigned id)
{
	const struct psr_msg_report_entry *entry = find(end, id);
	const struct psr_msg_report_entry *rmse = find(end, PSR_WIRE_REPORT_RMSE_CHOSEN + id - PSR_WIRE_REPORT_CHOSEN);

	if (entry == NULL)
		return 0;
	psr_settings_unpack(&price->settings, entry->count);
	price->ms = ms_of(entry);
	price->db = rmse != NULL && rmse->count > 0 ? quality_db((double)rmse->count / PSR_WIRE_RMSE_ONE) : NAN;
	return 1;
}

static void add_price(cJSON *to, const char *name, const struct psr_msg_frame_end *end, unsigned id)
{
	struct price price;
	cJSON *json;

	if (!find_price(&price, end, id))
		return;
	json = cJSON_AddObjectToObject(to, name);
	cJSON_AddNumberToObject(json, "ms", price.ms);
	if (!isnan(price.db))
		cJSON_AddNumberToObject(json, "db", price.db);
	cJSON_AddNumberToObject(json, "scale", price.settings.scale);
	json_add_number(json, "spacing_px", price.settings.spacing_px);
	cJSON_AddBoolToObject(json, "smooth", price.settings.smooth);
	cJSON_AddBoolToObject(json, "fine", price.settings.smooth == PSR_SMOOTH_FINE);
	cJSON_AddNumberToObject(json, "pass", price.settings.pass);
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
	add_price(budget, "chosen", end, PSR_WIRE_REPORT_CHOSEN);
	add_price(budget, "cheaper", end, PSR_WIRE_REPORT_CHEAPER);
	add_price(budget, "better", end, PSR_WIRE_REPORT_BETTER);
}

/* As options of psr say it, where they can. */
static void print_price(const char *what, const struct psr_msg_frame_end *end, unsigned id)
{
	struct price price;
	int smooth;

	if (!find_price(&price, end, id))
		return;
	smooth = price.settings.smooth;
	fprintf(stderr, "%s ", what);
	if (price.settings.pass > 0)
		fprintf(stderr, "pass %u", price.settings.pass);
	else if (price.settings.scale > 1)
		fprintf(stderr, "scale %u", price.settings.scale);
	else
		fprintf(stderr, "spacing %g%s", price.settings.spacing_px,
		        smooth == PSR_SMOOTH_FINE ? ", fine" : smooth ? ", smooth" : "");
	fprintf(stderr, " for %.3g ms", price.ms);
	if (!isnan(price.db))
		fprintf(stderr, " and %.1f dB", price.db);
}

void budget_print(const char *program, const struct psr_msg_frame *asked, const struct psr_msg_frame_end *end)
{
	char text[QUALITY_BUDGET_TEXT];

	if (find(end, PSR_WIRE_REPORT_CHOSEN) == NULL) /* of a server that does not tell */
		return;
	fprintf(stderr, "%s:", program);
	print_price(" chose", end, PSR_WIRE_REPORT_CHOSEN);
	fprintf(stderr, ", took %.3g ms", ms_of(find(end, PSR_WIRE_REPORT_TOTAL)));
	print_price("; cheaper:", end, PSR_WIRE_REPORT_CHEAPER);
	print_price("; better:", end, PSR_WIRE_REPORT_BETTER);
	if (end->status != PSR_WIRE_FRAME_OK)
		fprintf(stderr, "; the budget of %s was not kept", quality_budget_text(text, asked));
	fprintf(stderr, "\n");
}
