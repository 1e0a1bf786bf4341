#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "bench.h"
#include "psr.h"

static int parse(struct bench_options *options, int *json, int argc, char **argv, struct psr_error *err)
{
	const struct psr_opt opts[] = {
		PSR_OPT_SERVER(options->server),
		{ "model", 'm', PSR_OPT_STRING, &options->model, "NAME", "The model, by its name in `psr list`.", 0, 0, NULL,
		  NULL },
		{ "clients", 'c', PSR_OPT_INT, &options->n_clients, "N", "Connections, each with a camera of its own.", 1,
		  BENCH_MAX_CLIENTS, NULL, NULL },
		{ "seconds", 't', PSR_OPT_INT, &options->seconds, "S", "How long to measure; warming up comes before.", 1,
		  86400, NULL, NULL },
		{ "size", 0, PSR_OPT_SIZE, options->size, "WxH", "Pixels.", 0, 0, NULL, NULL },
		{ "codec", 0, PSR_OPT_STRING, &options->codec_text, "CODEC", "jpeg:Q (quality of 1 to 100), lossless, or raw.",
		  0, 0, NULL, NULL },
		{ "inflight", 0, PSR_OPT_INT, &options->n_inflight, "K", "Requests that each connection keeps under way.", 1,
		  PSR_WIRE_MAX_OPEN, NULL, NULL },
		{ "json", 0, PSR_OPT_FLAG, json, NULL, "Print one object instead of the lines.", 0, 0, NULL, NULL },
		PSR_OPT_TIMEOUT(options->timeout),
		{ NULL, 0, PSR_OPT_FLAG, NULL, NULL, NULL, 0, 0, NULL, NULL },
	};
	const struct psr_cli cli = {
		"psr bench --model NAME [--server ADDR] [--clients N] [--seconds S] [--size WxH] [--json]",
		"Loads a server: N connections whose cameras fly around the model, each asking for the next frame when one has "
		"come. Latency is from sending a request to the decoded picture.",
		opts,
		PSR_EXIT_CODES,
	};
	uint32_t w, h;
	int code = psr_cli_parse(&cli, argc, argv, NULL, err);

	if (code != PSR_OK)
		return code;
	w = options->size[0];
	h = options->size[1];
	if (options->model == NULL)
		return psr_fail(err, PSR_ERR_ARG, "--model NAME is missing; `psr list` shows the names");
	if (w == 0 || h == 0)
		return psr_fail(err, PSR_ERR_ARG, "--size: a picture of %ux%u has no pixels", w, h);
	if (w > PSR_WIRE_MAX_SIDE || h > PSR_WIRE_MAX_SIDE || (uint64_t)w * h > PSR_WIRE_MAX_PIXELS)
		return psr_fail(err, PSR_ERR_LIMIT, "--size: %ux%u is too large; a side has at most %d pixels, a picture %u", w,
		                h, PSR_WIRE_MAX_SIDE, PSR_WIRE_MAX_PIXELS);
	return psr_codec_parse(&options->codec, &options->quality, options->codec_text, err);
}

static void stop_all(struct bench_worker *workers, int64_t n_started, int64_t n)
{
	for (int64_t i = 0; i < n_started; i++)
		pthread_join(workers[i].thread, NULL);
	for (int64_t i = 0; i < n; i++)
		free(workers[i].scene);
}

/* Starts all, waits until they are warm, lets them measure, waits for the end. */
static int run(struct bench_worker *workers, const struct bench_options *options, struct psr_error *err)
{
	struct bench_gate gate = { .lock = PTHREAD_MUTEX_INITIALIZER, .changed = PTHREAD_COND_INITIALIZER };
	int64_t n = options->n_clients, n_started = 0;
	int code = PSR_OK;

	for (; n_started < n && code == PSR_OK; n_started++) {
		struct bench_worker *worker = &workers[n_started];

		worker->options = options;
		worker->gate = &gate;
		worker->index = n_started;
		worker->scene = calloc(1, sizeof *worker->scene);
		if (worker->scene == NULL || pthread_create(&worker->thread, NULL, bench_worker_run, worker) != 0) {
			code = psr_fail(err, PSR_ERR_MEMORY, "the system has no room for %" PRId64 " clients", n);
			break;
		}
	}
	pthread_mutex_lock(&gate.lock);
	while (gate.n_ready < n_started)
		pthread_cond_wait(&gate.changed, &gate.lock);
	for (int64_t i = 0; i < n_started && code == PSR_OK; i++)
		if (workers[i].setup_code != PSR_OK)
			code = psr_fail(err, workers[i].setup_code, "%s", workers[i].first_error.text);
	gate.state = code == PSR_OK ? 1 : -1;
	pthread_cond_broadcast(&gate.changed);
	pthread_mutex_unlock(&gate.lock);
	stop_all(workers, n_started, n);
	return code;
}

static int print_result(const struct bench_options *options, const struct bench_result *r, int as_json,
                        struct psr_error *err)
{
	const double size[2] = { options->size[0], options->size[1] };
	cJSON *json, *latency;

	if (!as_json) {
		printf("%s %ux%u %s, %" PRId64 " clients, %" PRId64 " under way each, %" PRId64 " s\n", options->model,
		       options->size[0], options->size[1], options->codec_text, options->n_clients, options->n_inflight,
		       options->seconds);
		printf("frames/s  %10.1f\n", r->frames_per_s);
		printf("MB/s      %10.2f\n", r->mb_per_s);
		printf("latency   %10.2f ms p50, %.2f p90, %.2f p99, %.2f max (%" PRIu64 " frames)\n", r->p50_ms, r->p90_ms,
		       r->p99_ms, r->max_ms, r->n_samples);
		printf("failed    %10" PRIu64 "\n", r->n_failed);
		return psr_flush_output(err);
	}
	json = cJSON_CreateObject();
	cJSON_AddStringToObject(json, "model", options->model);
	cJSON_AddItemToObject(json, "size", cJSON_CreateDoubleArray(size, 2));
	cJSON_AddStringToObject(json, "codec", options->codec_text);
	cJSON_AddNumberToObject(json, "clients", (double)options->n_clients);
	cJSON_AddNumberToObject(json, "inflight", (double)options->n_inflight);
	cJSON_AddNumberToObject(json, "seconds", (double)options->seconds);
	cJSON_AddNumberToObject(json, "frames", (double)r->n_frames);
	cJSON_AddNumberToObject(json, "frames_per_s", r->frames_per_s);
	cJSON_AddNumberToObject(json, "mb_per_s", r->mb_per_s);
	cJSON_AddNumberToObject(json, "failed", (double)r->n_failed);
	latency = cJSON_AddObjectToObject(json, "latency_ms");
	cJSON_AddNumberToObject(latency, "p50", r->p50_ms);
	cJSON_AddNumberToObject(latency, "p90", r->p90_ms);
	cJSON_AddNumberToObject(latency, "p99", r->p99_ms);
	cJSON_AddNumberToObject(latency, "max", r->max_ms);
	return psr_print_json(json, err);
}

int psr_bench_main(int argc, char **argv)
{
	struct bench_options options = { .server = psr_default_server(),
		                             .codec_text = "jpeg:85",
		                             .n_clients = 4,
		                             .seconds = 5,
		                             .n_inflight = 1,
		                             .timeout = PSR_DEFAULT_TIMEOUT,
		                             .size = { 512, 512 } };
	struct bench_worker *workers = NULL;
	struct bench_result result;
	struct psr_error err;
	int json = 0, code = parse(&options, &json, argc, argv, &err);

	if (code > 0)
		return 0;
	if (code == PSR_OK) {
		workers = calloc((size_t)options.n_clients, sizeof *workers);
		code = workers != NULL ? run(workers, &options, &err) : psr_fail(&err, PSR_ERR_MEMORY, "no memory");
	}
	if (code == PSR_OK)
		code = bench_sum(&result, workers, options.n_clients, &err);
	if (code == PSR_OK)
		code = print_result(&options, &result, json, &err);
	for (int64_t i = 0; workers != NULL && i < options.n_clients; i++) {
		if (code == PSR_OK && workers[i].first_error.code != PSR_OK)
			fprintf(stderr, "psr bench: client %" PRId64 ": %s\n", i + 1, workers[i].first_error.text);
		free(workers[i].sample_us);
	}
	free(workers);
	if (code != PSR_OK)
		return psr_cli_fail("psr bench", &err);
	return result.n_failed > 0;
}
