#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include "base/clock.h"
#include "worker.h"

#define SECOND UINT64_C(1000000000)
#define OTHER_FILES 64 /* descriptors beside the connections */

struct run {
	struct bench_result *result;
	struct worker *worker;
	uint32_t n_workers, n_started;
	struct worker_gate gate;
	struct worker_row *row; /* scratch */
	uint64_t row_ns;        /* when the last row ended */
	void (*on_row)(const struct measure_row *row);
};

static int reserve_files(const struct bench_load *load, struct psr_error *err)
{
	const rlim_t wanted = (rlim_t)(load->n_clients + 2 * load->n_threads + OTHER_FILES);
	struct rlimit limit;

	if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= wanted)
		return PSR_OK;
	limit.rlim_cur = wanted;
	if (wanted <= limit.rlim_max && setrlimit(RLIMIT_NOFILE, &limit) == 0)
		return PSR_OK;
	return psr_fail(err, PSR_ERR_LIMIT, "--clients %" PRId64 ": the system gives this program %" PRIu64
	                " file descriptors at most; `ulimit -n` raises that", load->n_clients, (uint64_t)limit.rlim_max);
}

static int start(struct run *run, const struct bench_plan *plan, const struct bench_load *load, struct psr_error *err)
{
	for (uint32_t i = 0; i < run->n_workers; i++) {
		struct worker *worker = &run->worker[i];
		int code;

		worker->epoll = worker->timer = -1;
		worker->plan = plan;
		worker->load = load;
		worker->gate = &run->gate;
		worker->index = i;
		code = worker_init(worker, err);
		run->n_started++;
		if (code != PSR_OK)
			return code;
	}
	return PSR_OK;
}

/* Waits until all threads are ready, and opens the gate, or sends them home. */
static int open_gate(struct run *run, const struct bench_load *load, const struct bench_plan *plan,
                     struct psr_error *err)
{
	struct worker_gate *gate = &run->gate;
	int code = PSR_OK;
	uint32_t n = 0;

	for (; n < run->n_workers && code == PSR_OK; n++)
		if (pthread_create(&run->worker[n].thread, NULL, worker_run, &run->worker[n]) != 0) {
			code = psr_fail(err, PSR_ERR_MEMORY, "the system has no room for %" PRId64 " threads", load->n_threads);
			break;
		}
	run->n_workers = n; /* that are to be joined */
	pthread_mutex_lock(&gate->lock);
	while (gate->n_ready < n)
		pthread_cond_wait(&gate->changed, &gate->lock);
	for (uint32_t i = 0; i < n && code == PSR_OK; i++)
		if (run->worker[i].error.code != PSR_OK)
			code = psr_fail(err, run->worker[i].error.code, "%s", run->worker[i].error.text);
	gate->start_ns = clock_ns();
	gate->begin_ns = gate->start_ns + (uint64_t)(load->warmup * 1e9);
	gate->end_ns = load->n_frames > 0 ? UINT64_MAX : gate->begin_ns + (uint64_t)(load->seconds * 1e9);
	if (plan->request != NULL)
		gate->end_ns = gate->begin_ns + plan->request[plan->n_requests - 1].due_ns + 1;
	gate->state = code == PSR_OK ? 1 : -1;
	pthread_cond_broadcast(&gate->changed);
	pthread_mutex_unlock(&gate->lock);
	return code;
}

/* Takes what the threads counted since the last row. */
static int take_row(struct run *run, uint64_t now_ns, struct psr_error *err)
{
	struct bench_result *result = run->result;
	struct worker_row *sum = run->row;
	struct measure_row *grown = result->row, *row;
	const size_t n = result->n_rows;

	memset(sum, 0, sizeof *sum);
	if ((n & (n - 1)) == 0)
		grown = realloc(grown, (n == 0 ? 1 : 2 * n) * sizeof *grown);
	if (grown == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %zu rows", n);
	result->row = grown;
	row = &grown[result->n_rows++];
	*row = (struct measure_row){ .seconds = (double)(now_ns - run->gate.begin_ns) / 1e9,
		                         .length_s = (double)(now_ns - run->row_ns) / 1e9 };
	run->row_ns = now_ns;
	for (uint32_t i = 0; i < run->n_workers; i++) {
		struct worker *worker = &run->worker[i];

		pthread_mutex_lock(&worker->lock);
		histogram_merge(&sum->latency, &worker->row.latency);
		row->n_drawn += worker->row.n_drawn;
		row->n_bytes += worker->row.n_bytes;
		row->n_superseded += worker->row.n_superseded;
		row->n_failed += worker->row.n_failed;
		memset(&worker->row, 0, sizeof worker->row);
		pthread_mutex_unlock(&worker->lock);
		row->n_waiting += atomic_load(&worker->n_waiting);
	}
	row->p50_ns = histogram_percentile(&sum->latency, 0.5);
	row->p99_ns = histogram_percentile(&sum->latency, 0.99);
	row->max_ns = sum->latency.max;
	result->n_drawn += row->n_drawn;
	result->n_bytes += row->n_bytes;
	if (run->on_row != NULL)
		run->on_row(row);
	return PSR_OK;
}

/* A row for each second that is measured, until all threads are over. */
static int watch(struct run *run, struct psr_error *err)
{
	struct worker_gate *gate = &run->gate;
	int is_over = 0, code = PSR_OK;

	run->row_ns = gate->begin_ns;
	while (!is_over) {
		const uint64_t next_ns = run->row_ns + SECOND;
		struct timespec until = { (time_t)(next_ns / SECOND), (long)(next_ns % SECOND) };
		uint64_t now_ns, end_ns;

		pthread_mutex_lock(&gate->lock);
		while (gate->n_over < run->n_workers && clock_ns() < next_ns)
			pthread_cond_timedwait(&gate->changed, &gate->lock, &until);
		is_over = gate->n_over == run->n_workers;
		pthread_mutex_unlock(&gate->lock);
		now_ns = clock_ns();
		end_ns = atomic_load(&gate->end_ns);
		if (is_over && run->row_ns < end_ns && now_ns > end_ns && run->result->load.n_frames == 0)
			now_ns = end_ns;
		if (code == PSR_OK && now_ns > run->row_ns && (run->result->load.n_frames > 0 || run->row_ns < end_ns))
			code = take_row(run, now_ns < end_ns || run->result->load.n_frames > 0 ? now_ns : end_ns, err);
		else
			run->row_ns = now_ns > run->row_ns ? now_ns : run->row_ns;
	}
	return code;
}

static int gather_kept(struct bench_result *result, const struct run *run, struct psr_error *err)
{
	size_t n = 0;

	for (uint32_t i = 0; i < run->n_workers; i++)
		n += run->worker[i].n_kept;
	result->kept = malloc((n + 1) * sizeof *result->kept);
	if (result->kept == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %zu answers", n);
	for (uint32_t i = 0; i < run->n_workers; i++) {
		if (run->worker[i].n_kept > 0)
			memcpy(result->kept + result->n_kept, run->worker[i].kept, run->worker[i].n_kept * sizeof *result->kept);
		result->n_kept += run->worker[i].n_kept;
	}
	return PSR_OK;
}

static int sum_up(struct run *run, struct psr_error *err)
{
	struct bench_result *result = run->result;
	uint64_t *n_drawn = calloc((size_t)result->load.n_clients, sizeof *n_drawn);
	uint64_t last_ns = run->gate.end_ns;

	if (n_drawn == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %" PRId64 " clients", result->load.n_clients);
	if (result->load.n_frames > 0)
		last_ns = 0;
	for (uint32_t i = 0; i < run->n_workers; i++) {
		struct worker *worker = &run->worker[i];

		measure_merge(&result->measure, &worker->total);
		result->processor_s += (double)worker->used_ns / 1e9;
		result->n_lost += worker->n_lost;
		if (result->first_error.code == PSR_OK)
			result->first_error = worker->error;
		if (result->load.n_frames > 0 && worker->last_ns > last_ns)
			last_ns = worker->last_ns;
		for (uint32_t k = 0; k < worker->n_clients; k++)
			n_drawn[worker->client[k].conn.index] = worker->client[k].n_drawn;
	}
	result->seconds = last_ns > run->gate.begin_ns ? (double)(last_ns - run->gate.begin_ns) / 1e9 : 0;
	result->fairness = measure_fairness(n_drawn, (size_t)result->load.n_clients);
	free(n_drawn);
	return gather_kept(result, run, err);
}

int bench_run(struct bench_result *result, const struct bench_plan *plan, const struct bench_load *load,
              void (*on_row)(const struct measure_row *row), struct psr_error *err)
{
	struct run run = { .result = result, .n_workers = (uint32_t)load->n_threads, .on_row = on_row,
		               .gate = { .lock = PTHREAD_MUTEX_INITIALIZER } };
	pthread_condattr_t monotonic;
	int code = reserve_files(load, err);

	memset(result, 0, sizeof *result);
	result->load = *load;
	if (code != PSR_OK)
		return code;
	pthread_condattr_init(&monotonic);
	pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
	pthread_cond_init(&run.gate.changed, &monotonic);
	pthread_condattr_destroy(&monotonic);
	run.worker = calloc(run.n_workers, sizeof *run.worker);
	run.row = calloc(1, sizeof *run.row);
	if (run.worker == NULL || run.row == NULL)
		code = psr_fail(err, PSR_ERR_MEMORY, "no memory for %" PRId64 " threads", load->n_threads);
	if (code == PSR_OK)
		code = start(&run, plan, load, err);
	if (code == PSR_OK) {
		code = open_gate(&run, load, plan, err);
		if (code == PSR_OK)
			code = watch(&run, err);
		for (uint32_t i = 0; i < run.n_workers; i++)
			pthread_join(run.worker[i].thread, NULL);
	}
	if (code == PSR_OK)
		code = sum_up(&run, err);
	for (uint32_t i = 0; run.worker != NULL && i < run.n_started; i++)
		worker_fini(&run.worker[i]);
	free(run.worker);
	free(run.row);
	pthread_cond_destroy(&run.gate.changed);
	return code;
}

void bench_result_fini(struct bench_result *result)
{
	free(result->row);
	free(result->kept);
	memset(result, 0, sizeof *result);
}

double bench_rate(const struct bench_result *result)
{
	return result->seconds > 0 ? (double)result->n_drawn / result->seconds : 0;
}
