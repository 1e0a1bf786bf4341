#include <stdlib.h>
#include <string.h>
#include "bench.h"

static int compare(const void *a, const void *b)
{
	uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;

	return (x > y) - (x < y);
}

/* The least sample that `percent` of all do not exceed. */
static double percentile_ms(const uint32_t *sorted, size_t n, size_t percent)
{
	return n == 0 ? 0 : sorted[(n * percent + 99) / 100 - 1] / 1e3;
}

int bench_sum(struct bench_result *result, const struct bench_worker *workers, int64_t n, struct psr_error *err)
{
	size_t n_samples = 0;
	uint32_t *all;

	memset(result, 0, sizeof *result);
	for (int64_t i = 0; i < n; i++)
		n_samples += workers[i].n_samples;
	all = malloc((n_samples + 1) * sizeof *all);
	if (all == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %zu samples", n_samples);
	for (int64_t i = 0; i < n; i++) {
		const struct bench_worker *worker = &workers[i];
		double seconds = (double)worker->elapsed_ns / 1e9;

		if (worker->n_samples > 0)
			memcpy(all + result->n_samples, worker->sample_us, worker->n_samples * sizeof *all);
		result->n_samples += worker->n_samples;
		result->n_frames += worker->n_frames;
		result->n_failed += worker->n_failed;
		if (seconds > 0) {
			result->frames_per_s += (double)worker->n_frames / seconds;
			result->mb_per_s += (double)worker->n_bytes / 1e6 / seconds;
		}
	}
	qsort(all, n_samples, sizeof *all, compare);
	result->p50_ms = percentile_ms(all, n_samples, 50);
	result->p90_ms = percentile_ms(all, n_samples, 90);
	result->p99_ms = percentile_ms(all, n_samples, 99);
	result->max_ms = percentile_ms(all, n_samples, 100);
	free(all);
	return PSR_OK;
}
