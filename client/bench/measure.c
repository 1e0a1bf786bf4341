#include <stdio.h>
#include <string.h>
#include "measure.h"

const char *measure_stage_name(unsigned id)
{
	static const char *const names[MEASURE_STAGES] = {
		[PSR_WIRE_REPORT_QUEUE] = "queue", [PSR_WIRE_REPORT_PLAN] = "plan", [PSR_WIRE_REPORT_SHADOW] = "shadow",
		[PSR_WIRE_REPORT_CULL] = "cull", [PSR_WIRE_REPORT_WARP] = "warp", [PSR_WIRE_REPORT_GAPS] = "gaps",
		[PSR_WIRE_REPORT_RESOLVE] = "resolve", [PSR_WIRE_REPORT_SHADE] = "shade", [PSR_WIRE_REPORT_FILL] = "fill",
		[PSR_WIRE_REPORT_SMOOTH] = "smooth", [PSR_WIRE_REPORT_ENCODE] = "encode", [PSR_WIRE_REPORT_TOTAL] = "total",
		[PSR_WIRE_REPORT_CORES] = "cores",
	};

	return id < MEASURE_STAGES ? names[id] : NULL;
}

void measure_add(struct measure *measure, const struct conn_request *request, const struct conn_answer *answer,
                 uint64_t now_ns)
{
	uint64_t server_ns = 0;

	if (answer->outcome == CONN_SUPERSEDED) {
		measure->n_superseded++;
		return;
	}
	if (answer->outcome == CONN_FAILED) {
		measure->n_failed[-answer->code]++;
		if (measure->first_failure[0] == '\0' && answer->text != NULL)
			snprintf(measure->first_failure, sizeof measure->first_failure, "%.255s", answer->text);
		return;
	}
	measure->n_bytes += request->bytes;
	histogram_add(&measure->latency, now_ns - request->intended_ns);
	histogram_add(&measure->first, request->first_ns - request->intended_ns);
	if (request->decode_ns > 0)
		histogram_add(&measure->decode, request->decode_ns);
	for (unsigned i = 0; i < answer->end->n_entries; i++) {
		const struct psr_msg_report_entry *entry = &answer->end->entry[i];

		if (measure_stage_name(entry->id) != NULL)
			histogram_add(&measure->stage[entry->id], entry->ns);
		if (entry->id == PSR_WIRE_REPORT_QUEUE || entry->id == PSR_WIRE_REPORT_TOTAL)
			server_ns += entry->ns;
		if (entry->id == PSR_WIRE_REPORT_CHOSEN) {
			measure->n_budgets++;
			measure->n_within += answer->end->status == PSR_WIRE_FRAME_OK;
		}
	}
	histogram_add(&measure->server, server_ns);
}

void measure_merge(struct measure *to, const struct measure *from)
{
	histogram_merge(&to->latency, &from->latency);
	histogram_merge(&to->waited, &from->waited);
	histogram_merge(&to->first, &from->first);
	histogram_merge(&to->decode, &from->decode);
	for (unsigned i = 0; i < MEASURE_STAGES; i++)
		histogram_merge(&to->stage[i], &from->stage[i]);
	histogram_merge(&to->server, &from->server);
	if (to->first_failure[0] == '\0')
		memcpy(to->first_failure, from->first_failure, sizeof to->first_failure);
	to->n_budgets += from->n_budgets;
	to->n_within += from->n_within;
	to->n_bytes += from->n_bytes;
	to->n_superseded += from->n_superseded;
	to->n_unfinished += from->n_unfinished;
	for (unsigned i = 0; i < MEASURE_CODES; i++)
		to->n_failed[i] += from->n_failed[i];
}

uint64_t measure_failed(const struct measure *measure)
{
	uint64_t n = 0;

	for (unsigned i = 0; i < MEASURE_CODES; i++)
		n += measure->n_failed[i];
	return n;
}

double measure_fairness(const uint64_t *n_drawn, size_t n)
{
	double sum = 0, squares = 0;

	for (size_t i = 0; i < n; i++) {
		sum += (double)n_drawn[i];
		squares += (double)n_drawn[i] * (double)n_drawn[i];
	}
	return squares > 0 ? sum * sum / ((double)n * squares) : 1;
}
