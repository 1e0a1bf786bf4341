#include "report.h"
#include <inttypes.h>
#include <stdio.h>
#include "base/json.h"
#include "base/outfile.h"

static const struct { const char *name; double part; } parts[] = {
	{ "p50", 0.5 }, { "p90", 0.9 }, { "p99", 0.99 }, { "p99.9", 0.999 }, { "max", 1 },
};
#define N_PARTS (sizeof parts / sizeof parts[0])

void report_print_row(const struct measure_row *row)
{
	const double s = row->length_s > 0 ? row->length_s : 1;

	printf("%6.1f s  %8.1f frames/s  %8.2f MB/s  p50 %8.2f  p99 %8.2f  max %8.2f ms", row->seconds,
	       (double)row->n_drawn / s, (double)row->n_bytes / 1e6 / s, (double)row->p50_ns / 1e6,
	       (double)row->p99_ns / 1e6, (double)row->max_ns / 1e6);
	if (row->n_waiting > 0)
		printf("  waiting %" PRIu64, row->n_waiting);
	if (row->n_superseded > 0)
		printf("  superseded %" PRIu64, row->n_superseded);
	if (row->n_failed > 0)
		printf("  failed %" PRIu64, row->n_failed);
	printf("\n");
	fflush(stdout);
}

static void print_histogram(const char *name, const struct histogram *histogram)
{
	printf("%-10s", name);
	for (size_t i = 0; i < N_PARTS; i++)
		printf(" %9.2f", (double)histogram_percentile(histogram, parts[i].part) / 1e6);
	printf(" %9.2f %9" PRIu64 "\n", histogram_mean(histogram) / 1e6, histogram->n);
}

/* The server's processor time for the frames that were measured. */
static double server_s(const struct bench_result *result)
{
	return result->measure.stage[PSR_WIRE_REPORT_CORES].sum / 1e9;
}

static double within(const struct measure *measure)
{
	return 100 * (double)measure->n_within / (double)measure->n_budgets;
}

static void print_ends(const struct bench_result *result)
{
	const struct measure *measure = &result->measure;

	printf("superseded %" PRIu64 ", unfinished %" PRIu64 ", failed %" PRIu64, measure->n_superseded,
	       measure->n_unfinished, measure_failed(measure));
	for (int i = 0; i < MEASURE_CODES; i++)
		if (measure->n_failed[i] > 0)
			printf("; %s %" PRIu64, psr_strerror(-i), measure->n_failed[i]);
	printf("\n");
	if (measure->first_failure[0] != '\0')
		printf("the first failure: %s\n", measure->first_failure);
	if (result->n_lost > 0)
		printf("connections lost: %" PRIu64 "; the first: %s\n", result->n_lost, result->first_error.text);
}

static void print_load(const struct bench_load *load)
{
	if (load->rate > 0)
		printf("%g requests/s (%s) of %" PRId64 " clients", load->rate, load->is_poisson ? "Poisson" : "constant",
		       load->n_clients);
	else
		printf("%" PRId64 " clients, %" PRId64 " under way each", load->n_clients, load->n_inflight);
	if (load->is_view)
		printf(", in views");
}

void report_print(const struct bench_result *result, const char *what)
{
	const struct bench_load *load = &result->load;
	const struct measure *measure = &result->measure;

	printf("%s, ", what);
	print_load(load);
	printf(", %.1f s\n", result->seconds);
	printf("frames/s  %10.1f in all, %.1f each\n", bench_rate(result), bench_rate(result) / (double)load->n_clients);
	printf("MB/s      %10.2f\n", result->seconds > 0 ? (double)result->n_bytes / 1e6 / result->seconds : 0);
	printf("%-10s", "ms");
	for (size_t i = 0; i < N_PARTS; i++)
		printf(" %9s", parts[i].name);
	printf(" %9s %9s\n", "mean", "n");
	print_histogram("latency", &measure->latency);
	print_histogram("first byte", &measure->first);
	if (measure->waited.n > 0)
		print_histogram("waited", &measure->waited);
	if (measure->decode.n > 0)
		print_histogram("decode", &measure->decode);
	for (unsigned i = 0; i < MEASURE_STAGES; i++)
		if (measure->stage[i].max > 0)
			print_histogram(measure_stage_name(i), &measure->stage[i]);
	print_histogram("psrd", &measure->server);
	if (measure->n_budgets > 0)
		printf("within the budget: %.2f %% of %" PRIu64 "\n", within(measure), measure->n_budgets);
	print_ends(result);
	printf("fairness (Jain) %.3f; processor time: this program %.2f s, psrd's frames %.2f s\n", result->fairness,
	       result->processor_s, server_s(result));
}

/* ---- JSON and CSV ---- */

static void add_histogram(cJSON *to, const char *name, const struct histogram *histogram)
{
	cJSON *item = cJSON_AddObjectToObject(to, name);

	for (size_t i = 0; i < N_PARTS; i++)
		json_add_number(item, parts[i].name, (double)histogram_percentile(histogram, parts[i].part) / 1e6);
	json_add_number(item, "mean", histogram_mean(histogram) / 1e6);
	cJSON_AddNumberToObject(item, "n", (double)histogram->n);
}

static void add_load(cJSON *to, const struct bench_load *load)
{
	cJSON *item = cJSON_AddObjectToObject(to, "load");

	cJSON_AddNumberToObject(item, "clients", (double)load->n_clients);
	if (load->rate > 0) {
		cJSON_AddNumberToObject(item, "rate", load->rate);
		cJSON_AddStringToObject(item, "arrivals", load->is_poisson ? "poisson" : "constant");
	} else {
		cJSON_AddNumberToObject(item, "inflight", (double)load->n_inflight);
	}
	cJSON_AddBoolToObject(item, "views", load->is_view);
	cJSON_AddBoolToObject(item, "decoded", load->is_decoded);
}

static void add_failures(cJSON *to, const struct measure *measure)
{
	cJSON *item = cJSON_AddObjectToObject(to, "failures");

	for (int i = 0; i < MEASURE_CODES; i++)
		if (measure->n_failed[i] > 0)
			cJSON_AddNumberToObject(item, psr_strerror(-i), (double)measure->n_failed[i]);
}

static void add_rows(cJSON *to, const struct bench_result *result)
{
	cJSON *rows = cJSON_AddArrayToObject(to, "rows");

	for (size_t i = 0; i < result->n_rows; i++) {
		const struct measure_row *row = &result->row[i];
		cJSON *item = cJSON_CreateObject();

		cJSON_AddNumberToObject(item, "at", row->seconds);
		cJSON_AddNumberToObject(item, "frames", (double)row->n_drawn);
		cJSON_AddNumberToObject(item, "bytes", (double)row->n_bytes);
		cJSON_AddNumberToObject(item, "p50", (double)row->p50_ns / 1e6);
		cJSON_AddNumberToObject(item, "p99", (double)row->p99_ns / 1e6);
		cJSON_AddNumberToObject(item, "max", (double)row->max_ns / 1e6);
		cJSON_AddNumberToObject(item, "waiting", (double)row->n_waiting);
		cJSON_AddNumberToObject(item, "superseded", (double)row->n_superseded);
		cJSON_AddNumberToObject(item, "failed", (double)row->n_failed);
		cJSON_AddItemToArray(rows, item);
	}
}

cJSON *report_json(const struct bench_result *result, const char *what)
{
	const struct measure *measure = &result->measure;
	cJSON *json = cJSON_CreateObject(), *stages;

	cJSON_AddStringToObject(json, "what", what);
	add_load(json, &result->load);
	cJSON_AddNumberToObject(json, "seconds", result->seconds);
	cJSON_AddNumberToObject(json, "frames", (double)result->n_drawn);
	cJSON_AddNumberToObject(json, "frames_per_s", bench_rate(result));
	cJSON_AddNumberToObject(json, "mb_per_s", result->seconds > 0 ? (double)result->n_bytes / 1e6 / result->seconds : 0);
	cJSON_AddNumberToObject(json, "failed", (double)measure_failed(measure));
	cJSON_AddNumberToObject(json, "superseded", (double)measure->n_superseded);
	cJSON_AddNumberToObject(json, "unfinished", (double)measure->n_unfinished);
	cJSON_AddNumberToObject(json, "connections_lost", (double)result->n_lost);
	cJSON_AddNumberToObject(json, "fairness", result->fairness);
	cJSON_AddNumberToObject(json, "processor_s", result->processor_s);
	cJSON_AddNumberToObject(json, "server_processor_s", server_s(result));
	cJSON_AddNumberToObject(json, "percentile_error", HISTOGRAM_ERROR);
	if (measure->n_budgets > 0)
		json_add_number(json, "within_budget_percent", within(measure));
	add_failures(json, measure);
	if (measure->first_failure[0] != '\0')
		cJSON_AddStringToObject(json, "first_failure", measure->first_failure);
	add_histogram(json, "latency_ms", &measure->latency);
	add_histogram(json, "first_byte_ms", &measure->first);
	add_histogram(json, "waited_ms", &measure->waited);
	add_histogram(json, "decode_ms", &measure->decode);
	stages = cJSON_AddObjectToObject(json, "server_ms");
	for (unsigned i = 0; i < MEASURE_STAGES; i++)
		if (measure->stage[i].n > 0)
			add_histogram(stages, measure_stage_name(i), &measure->stage[i]);
	add_histogram(json, "psrd_ms", &measure->server);
	add_rows(json, result);
	return json;
}

int report_csv(const struct bench_result *result, const char *path, struct psr_error *err)
{
	static const char head[] = "at_s,frames,bytes,p50_ms,p99_ms,max_ms,waiting,superseded,failed\n";
	struct outfile file;
	int code = outfile_open(&file, path, OUTFILE_PLAIN, err);

	if (code != PSR_OK)
		return code;
	outfile_write(&file, head, sizeof head - 1);
	for (size_t i = 0; i < result->n_rows; i++) {
		const struct measure_row *row = &result->row[i];
		char line[256];
		const int n = snprintf(line, sizeof line, "%.3f,%" PRIu64 ",%" PRIu64 ",%.3f,%.3f,%.3f,%" PRIu64 ",%" PRIu64
		                       ",%" PRIu64 "\n", row->seconds, row->n_drawn, row->n_bytes, (double)row->p50_ns / 1e6,
		                       (double)row->p99_ns / 1e6, (double)row->max_ns / 1e6, row->n_waiting,
		                       row->n_superseded, row->n_failed);

		outfile_write(&file, line, (size_t)n);
	}
	return outfile_close(&file, PSR_OK, err);
}
