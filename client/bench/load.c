#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/stats.h"
#include "bench.h"

/* Starts all workers, waits until they are warm, lets them measure, waits for the end. */
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
		if (pthread_create(&worker->thread, NULL, bench_worker_run, worker) != 0) {
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
	for (int64_t i = 0; i < n_started; i++)
		pthread_join(workers[i].thread, NULL);
	return code;
}

/* Sorts the samples of all workers together. */
static int sum(struct bench_result *result, const struct bench_worker *workers, int64_t n, struct psr_error *err)
{
	size_t n_samples = 0;
	double *all;

	memset(result, 0, sizeof *result);
	for (int64_t i = 0; i < n; i++)
		n_samples += workers[i].n_samples;
	all = malloc((n_samples + 1) * sizeof *all);
	if (all == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %zu samples", n_samples);
	for (int64_t i = 0; i < n; i++) {
		const struct bench_worker *worker = &workers[i];
		double seconds = (double)worker->elapsed_ns / 1e9;

		for (size_t k = 0; k < worker->n_samples; k++)
			all[result->n_samples + k] = worker->sample_us[k] / 1e3;
		result->n_samples += worker->n_samples;
		result->n_frames += worker->n_frames;
		result->n_failed += worker->n_failed;
		if (seconds > 0) {
			result->frames_per_s += (double)worker->n_frames / seconds;
			result->mb_per_s += (double)worker->n_bytes / 1e6 / seconds;
		}
	}
	stats_sort(all, n_samples);
	result->p50_ms = stats_percentile(all, n_samples, 0.5);
	result->p90_ms = stats_percentile(all, n_samples, 0.9);
	result->p99_ms = stats_percentile(all, n_samples, 0.99);
	result->max_ms = stats_percentile(all, n_samples, 1);
	free(all);
	return PSR_OK;
}

int bench_run(struct bench_result *result, const struct bench_options *options, struct psr_error *err)
{
	int64_t n = options->n_clients;
	struct bench_worker *workers = calloc((size_t)n, sizeof *workers);
	int code = workers != NULL ? run(workers, options, err) : psr_fail(err, PSR_ERR_MEMORY, "no memory");

	if (code == PSR_OK)
		code = sum(result, workers, n, err);
	for (int64_t i = 0; workers != NULL && i < n; i++) {
		if (code == PSR_OK && workers[i].first_error.code != PSR_OK)
			fprintf(stderr, "psr bench: client %" PRId64 ": %s\n", i + 1, workers[i].first_error.text);
		free(workers[i].sample_us);
	}
	free(workers);
	return code;
}
