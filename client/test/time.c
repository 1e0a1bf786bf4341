#include <stdlib.h>
#include "base/stats.h"
#include "run.h"

/* Draws the first picture of the request. PSR_OK, or the error of the frame. */
static int draw_once(double *ms, const struct request *request, const struct run *run, struct psr_error *err)
{
	struct psr_event event;
	uint64_t ns = 0;
	struct sent sent;
	int code = request_send(request, 0, &sent, err), is_final = 0, is_told = 1;

	if (code != PSR_OK)
		return code;
	while (!is_final) {
		code = psr_client_wait(run->client, run->timeout_ms, &event, err);
		if (code < 0)
			return code;
		if (code == 0)
			return psr_fail(err, PSR_ERR_CONNECTION, "the server says nothing for %d s; --timeout waits longer",
			                run->timeout_ms / 1000);
		if (event.id != sent.frame && event.id != sent.scene) /* of a picture whose scene failed */
			continue;
		if (event.type == PSR_EVENT_FAILED)
			return psr_fail(err, event.error.code, "%.400s", event.error.text);
		is_told &= run_add_time(&ns, &event);
		is_final = event.end->is_final;
	}
	*ms = (double)ns / 1e6;
	return is_told ? PSR_OK : psr_fail(err, PSR_ERR_UNSUPPORTED, "the server does not tell how long it drew");
}

/* Turn by turn, so that what else the machine does is shared by both. A round before the first draws them warm. */
static int compare_times(double p50[2], const struct request request[2], const struct run *run, int64_t n,
                         struct psr_error *err)
{
	double *ms = malloc(2 * (size_t)n * sizeof *ms), ignored;
	int code = PSR_OK;

	if (ms == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %lld times", (long long)n);
	for (int64_t i = -1; i < n && code == PSR_OK; i++)
		for (int r = 0; r < 2 && code == PSR_OK; r++)
			code = draw_once(i < 0 ? &ignored : &ms[r * n + i], &request[r], run, err);
	for (int r = 0; r < 2 && code == PSR_OK; r++)
		p50[r] = stats_median(ms + r * n, (size_t)n);
	free(ms);
	return code;
}

static int time_test(const struct run *run, uint32_t i, struct psr_error *err)
{
	struct results *results = run->results;
	const struct suite_test *const test[2] = { &results->suite->test[i],
		                                       &results->suite->test[results->suite->test[i].expect.of_test] };
	const struct expect *expect = &test[0]->expect;
	struct result *result = &results->of[results->first[i]];
	struct request request[2] = { { .test = NULL }, { .test = NULL } };
	double p50[2];
	int code = request_open(&request[0], run, test[0], err);

	if (code == PSR_OK)
		code = request_open(&request[1], run, test[1], err);
	if (code == PSR_OK)
		code = compare_times(p50, request, run, expect->n_draws, err);
	request_close(&request[0], run);
	request_close(&request[1], run);
	if (code == PSR_OK && !(p50[0] <= expect->ratio * p50[1]))
		result_fail(result, "its time is %.3g of that of %s (%.3g ms and %.3g ms, p50 of %lld), at most %.3g is needed",
		            p50[0] / p50[1], test[1]->name, p50[0], p50[1], (long long)expect->n_draws, expect->ratio);
	if (code == PSR_OK || run_is_over(code))
		return code;
	result_fail(result, "its time: %.400s", err->text);
	return PSR_OK;
}

int time_tests(const struct run *run, struct psr_error *err)
{
	const struct results *results = run->results;
	int code = PSR_OK;

	for (uint32_t i = 0; i < results->suite->n_tests && code == PSR_OK; i++)
		if (results->is_chosen[i] && results->suite->test[i].expect.of != NULL)
			code = time_test(run, i, err);
	return code;
}
