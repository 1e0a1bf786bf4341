#include <stdlib.h>
#include <string.h>
#include "base/stats.h"
#include "bench.h"

int bench_sum(struct bench_result *result, const struct bench_worker *workers, int64_t n, struct psr_error *err)
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
