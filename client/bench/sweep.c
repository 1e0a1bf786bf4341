#include "sweep.h"
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/cli.h"
#include "base/json.h"

#define POINTS 7
#define CLOSE_ENOUGH 1.05

static int read_number(double *to, const char **at)
{
	return psr_parse_real(*at, to, at, NULL) == PSR_OK;
}

int sweep_parse(struct sweep *sweep, const char *text, struct psr_error *err)
{
	const char *at = strchr(text, '=');
	double n = POINTS;
	int is_read;

	sweep->is_rate = strncmp(text, "rate=", 5) == 0;
	is_read = at != NULL && (sweep->is_rate || strncmp(text, "clients=", 8) == 0);
	if (is_read) {
		char low[32]; /* 1..64: a number would take the first dot */
		const char *dots = strstr(++at, ".."), *number = low;

		is_read = dots != NULL && (size_t)(dots - at) < sizeof low;
		if (is_read) {
			snprintf(low, sizeof low, "%.*s", (int)(dots - at), at);
			at = dots + 2;
			is_read = read_number(&sweep->low, &number) && *number == '\0' && read_number(&sweep->high, &at);
		}
		if (is_read && *at == '/')
			is_read = read_number(&n, (at++, &at));
	}
	if (!is_read || *at != '\0')
		return psr_fail(err, PSR_ERR_ARG, "--sweep takes clients=1..64 or rate=10..1000, and /N behind it for N points, "
		                "not '%.60s'", text);
	if (!(sweep->low > 0 && sweep->high >= sweep->low) || n != floor(n) || n < 1 || n > SWEEP_MAX
	    || sweep->high > (sweep->is_rate ? 1e7 : BENCH_MAX_CLIENTS) || (!sweep->is_rate && sweep->low < 1))
		return psr_fail(err, PSR_ERR_ARG, "--sweep %.60s: the range rises from above 0 (1 client), to %d clients or 1e7 "
		                "requests a second at most, in 1 to %d points", text, BENCH_MAX_CLIENTS, SWEEP_MAX);
	sweep->n = (uint32_t)n;
	return PSR_OK;
}

/* Runs one load. */
static int run_point(struct sweep_point *point, struct bench_result *result, const struct sweep *sweep,
                     const struct bench_plan *plan, const struct bench_load *base, struct psr_error *err)
{
	struct bench_load load = *base;
	int code;

	if (sweep->is_rate)
		load.rate = point->load;
	else
		load.n_clients = (int64_t)point->load;
	if (load.n_threads > load.n_clients)
		load.n_threads = load.n_clients;
	code = bench_run(result, plan, &load, NULL, err);
	if (code != PSR_OK)
		return code;
	point->frames_per_s = bench_rate(result);
	point->mean_ms = histogram_mean(&result->measure.latency) / 1e6;
	point->ms.p50 = (double)histogram_percentile(&result->measure.latency, 0.5) / 1e6;
	point->ms.p99 = (double)histogram_percentile(&result->measure.latency, 0.99) / 1e6;
	point->n_failed = measure_failed(&result->measure) + result->n_lost;
	point->n_unfinished = result->measure.n_unfinished;
	return PSR_OK;
}

static int find_knee(const struct sweep_points *points)
{
	int best = -1;
	double most = 0;

	for (uint32_t i = 0; i < points->n; i++) {
		const struct sweep_point *point = &points->point[i];
		const double power = point->mean_ms > 0 ? point->frames_per_s / point->mean_ms : 0;

		if (power > most) {
			most = power;
			best = (int)i;
		}
	}
	return best;
}

int sweep_run(struct sweep_points *points, const struct sweep *sweep, const struct bench_plan *plan,
              const struct bench_load *load, void (*on_point)(const struct sweep *, const struct sweep_point *),
              struct psr_error *err)
{
	struct bench_result *result = calloc(1, sizeof *result);
	int code = result != NULL ? PSR_OK : psr_fail(err, PSR_ERR_MEMORY, "no memory");
	double before = 0;

	points->n = 0;
	for (uint32_t i = 0; code == PSR_OK && i < sweep->n; i++) {
		const double part = sweep->n > 1 ? (double)i / (sweep->n - 1) : 1;
		double at = sweep->low * pow(sweep->high / sweep->low, part);
		struct sweep_point *point = &points->point[points->n];

		if (!sweep->is_rate)
			at = round(at);
		if (at == before)
			continue;
		before = at;
		*point = (struct sweep_point){ .load = at };
		code = run_point(point, result, sweep, plan, load, err);
		bench_result_fini(result);
		if (code != PSR_OK)
			break;
		points->n++;
		if (on_point != NULL)
			on_point(sweep, point);
	}
	free(result);
	points->knee = find_knee(points);
	return code;
}

/* ---- the greatest load ---- */

int slo_parse(struct slo *slo, const char *text, struct psr_error *err)
{
	static const struct { const char *name; double value; } parts[] = {
		{ "p50=", 0.5 }, { "p90=", 0.9 }, { "p99=", 0.99 }, { "p99.9=", 0.999 }, { "max=", 1 },
	}, units[] = { { "us", 1e3 }, { "ms", 1e6 }, { "s", 1e9 } };
	const char *at = NULL;
	double time = 0;

	for (size_t i = 0; i < sizeof parts / sizeof parts[0] && at == NULL; i++)
		if (strncmp(text, parts[i].name, strlen(parts[i].name)) == 0) {
			at = text + strlen(parts[i].name);
			slo->part = parts[i].value;
		}
	slo->limit_ns = 0;
	if (at != NULL && read_number(&time, &at) && time > 0)
		for (size_t i = 0; i < sizeof units / sizeof units[0]; i++)
			if (strcmp(at, units[i].name) == 0 && time * units[i].value < (double)HISTOGRAM_MAX)
				slo->limit_ns = (uint64_t)(time * units[i].value);
	if (slo->limit_ns == 0)
		return psr_fail(err, PSR_ERR_ARG, "--slo takes p50, p90, p99, p99.9 or max and a time, as in p99=50ms, not '%.60s'",
		                text);
	snprintf(slo->text, sizeof slo->text, "%.39s", text);
	return PSR_OK;
}

struct search {
	const struct slo *slo;
	const struct sweep *sweep;
	const struct bench_plan *plan;
	const struct bench_load *load;
	void (*on_point)(const struct sweep *, const struct sweep_point *);
	struct sweep_points *points;
	struct bench_result *result;
};

static int probe(int *is_good, struct search *search, double at, struct psr_error *err)
{
	struct sweep_point *point = &search->points->point[search->points->n];
	int code;

	*point = (struct sweep_point){ .load = at };
	code = run_point(point, search->result, search->sweep, search->plan, search->load, err);
	if (code == PSR_OK) {
		const struct measure *measure = &search->result->measure;

		*is_good = measure->latency.n > 0 && point->n_failed == 0 && point->n_unfinished == 0
		           && histogram_percentile(&measure->latency, search->slo->part) <= search->slo->limit_ns;
		point->is_good = *is_good;
		search->points->n++;
		if (search->on_point != NULL)
			search->on_point(search->sweep, point);
	}
	bench_result_fini(search->result);
	return code;
}

int slo_search(double *best, struct sweep_points *points, const struct slo *slo, const struct sweep *sweep,
               const struct bench_plan *plan, const struct bench_load *load,
               void (*on_point)(const struct sweep *, const struct sweep_point *), struct psr_error *err)
{
	struct search search = { slo, sweep, plan, load, on_point, points, calloc(1, sizeof *search.result) };
	double good = 0, bad = 0, at = sweep->low;
	int code = search.result != NULL ? PSR_OK : psr_fail(err, PSR_ERR_MEMORY, "no memory");

	points->n = 0;
	points->knee = -1;
	while (code == PSR_OK && points->n < SWEEP_MAX) {
		int is_good = 0;

		code = probe(&is_good, &search, at, err);
		*(is_good ? &good : &bad) = at;
		if (good == 0 || (bad == 0 && at == sweep->high))
			break;
		if (bad > 0 && (bad / good <= CLOSE_ENOUGH || (!sweep->is_rate && bad - good <= 1)))
			break;
		at = bad > 0 ? sqrt(good * bad) : fmin(2 * at, sweep->high);
		if (!sweep->is_rate)
			at = fmin(fmax(round(at), good + 1), bad > 0 ? bad - 1 : at);
	}
	free(search.result);
	*best = good;
	return code;
}

/* ---- printing ---- */

void sweep_print_head(const struct sweep *sweep)
{
	printf("%10s %10s %9s %9s %9s %7s\n", sweep->is_rate ? "rate" : "clients", "frames/s", "p50 ms", "p99 ms", "mean ms",
	       "failed");
}

void sweep_print_point(const struct sweep *sweep, const struct sweep_point *point)
{
	printf(sweep->is_rate ? "%10.1f" : "%10.0f", point->load);
	printf(" %10.1f %9.2f %9.2f %9.2f %7" PRIu64 "\n", point->frames_per_s, point->ms.p50, point->ms.p99,
	       point->mean_ms, point->n_failed + point->n_unfinished);
	fflush(stdout);
}

void sweep_print_knee(const struct sweep *sweep, const struct sweep_points *points)
{
	if (points->knee >= 0)
		printf("knee: %s %g, where frames/s by mean latency are most\n", sweep->is_rate ? "rate" : "clients",
		       points->point[points->knee].load);
}

cJSON *sweep_json(const struct sweep *sweep, const struct sweep_points *points, const char *what)
{
	cJSON *json = cJSON_CreateObject(), *list;

	cJSON_AddStringToObject(json, "what", what);
	cJSON_AddStringToObject(json, "sweep", sweep->is_rate ? "rate" : "clients");
	if (points->knee >= 0)
		json_add_number(json, "knee", points->point[points->knee].load);
	list = cJSON_AddArrayToObject(json, "points");
	for (uint32_t i = 0; i < points->n; i++) {
		const struct sweep_point *point = &points->point[i];
		cJSON *item = cJSON_CreateObject();

		json_add_number(item, "load", point->load);
		json_add_number(item, "frames_per_s", point->frames_per_s);
		json_add_number(item, "p50_ms", point->ms.p50);
		json_add_number(item, "p99_ms", point->ms.p99);
		json_add_number(item, "mean_ms", point->mean_ms);
		cJSON_AddNumberToObject(item, "failed", (double)point->n_failed);
		cJSON_AddNumberToObject(item, "unfinished", (double)point->n_unfinished);
		cJSON_AddItemToArray(list, item);
	}
	return json;
}
