/* What the pool's scheduling costs, and what it gives: loops, hand-overs between flows, shares, and the time of a small
 * frame beside large ones. Prints what it compares with in the same run. */
#include <semaphore.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdio.h>
#include <unistd.h>
#include "base/clock.h"
#include "base/pool.h"
#include "base/stats.h"

#define US UINT64_C(1000)
#define N_LOOPS 2000
#define N_FRAMES 200

static void work_for(uint64_t ns)
{
	const uint64_t start = clock_ns();

	while (clock_ns() - start < ns)
		;
}

/* --- loops -------------------------------------------------------------------------------------------------------- */

struct lone {
	struct psr_pool *pool;
	uint64_t index_ns;
	sem_t done;
};

static void one_index(int i, void *userdata)
{
	const struct lone *lone = userdata;

	(void)i;
	if (lone->index_ns > 0)
		work_for(lone->index_ns);
}

static double loop_us(struct lone *lone, struct psr_pool *pool, int n)
{
	static double us[N_LOOPS];

	for (int k = 0; k < N_LOOPS; k++) {
		const uint64_t start = clock_ns();

		psr_pool_for(pool, n, one_index, lone);
		us[k] = (double)(clock_ns() - start) / 1e3;
	}
	return stats_median(us, N_LOOPS);
}

static void time_loops(void *userdata)
{
	static const int n[] = { 2, 16, 256 };
	struct lone *lone = userdata;

	for (size_t k = 0; k < sizeof n / sizeof n[0]; k++) {
		const double alone = loop_us(lone, NULL, n[k]);
		const double pooled = loop_us(lone, lone->pool, n[k]);

		printf("  %3d indices of %2.0f us: %8.2f us, by the caller alone %8.2f us, ratio %.2f\n", n[k],
		       (double)lone->index_ns / 1e3, pooled, alone, pooled / alone);
	}
	sem_post(&lone->done);
}

static void bench_loops(struct psr_pool *pool)
{
	struct lone lone = { .pool = pool };
	const struct pool_job job = { .fn = time_loops, .userdata = &lone };

	printf("A lone job's loops, median:\n");
	sem_init(&lone.done, 0, 0);
	for (lone.index_ns = 0; lone.index_ns <= 20 * US; lone.index_ns += 10 * US) {
		if (psr_pool_submit(pool, &job) != PSR_OK)
			return;
		sem_wait(&lone.done);
	}
	sem_destroy(&lone.done);
}

/* --- flows -------------------------------------------------------------------------------------------------------- */

/* Draws frames of 12 loops until it is told to end, or once. */
struct load {
	struct psr_pool *pool;
	struct pool_flow *flow;
	enum pool_class class;
	uint64_t index_ns;
	int n_indices;
	atomic_int must_end;
	atomic_ullong n_done; /* indices */
	sem_t done;
};

static void load_index(int i, void *userdata)
{
	struct load *load = userdata;

	(void)i;
	if (atomic_load_explicit(&load->must_end, memory_order_relaxed))
		return;
	work_for(load->index_ns);
	atomic_fetch_add_explicit(&load->n_done, 1, memory_order_relaxed);
}

static void draw_one(void *userdata)
{
	struct load *load = userdata;

	for (int k = 0; k < 12; k++) {
		psr_pool_for(load->pool, load->n_indices, load_index, load);
		work_for(5 * US);
	}
	sem_post(&load->done);
}

static void draw_many(void *userdata)
{
	struct load *load = userdata;

	while (!atomic_load(&load->must_end))
		psr_pool_for(load->pool, load->n_indices, load_index, load);
	sem_post(&load->done);
}

static int begin(struct load *load, void (*fn)(void *userdata))
{
	return psr_pool_submit(load->pool, &(struct pool_job){ load->flow, load->class, fn, load, 0 });
}

static int open_load(struct load *load, struct psr_pool *pool, enum pool_class class, uint64_t index_ns, int n_indices)
{
	*load = (struct load){ .pool = pool, .class = class, .index_ns = index_ns, .n_indices = n_indices };
	sem_init(&load->done, 0, 0);
	return pool_flow_create(&load->flow, pool);
}

static void close_load(struct load *load)
{
	pool_flow_destroy(load->flow);
	sem_destroy(&load->done);
}

static void end(struct load *load)
{
	atomic_store(&load->must_end, 1);
	sem_wait(&load->done);
}

/* Times of small frames: median and 99 %. */
static void small_frames(struct load *small, double *median, double *high)
{
	static double ms[N_FRAMES];

	for (int k = 0; k < N_FRAMES; k++) {
		const uint64_t start = clock_ns();

		if (begin(small, draw_one) != PSR_OK)
			return;
		sem_wait(&small->done);
		ms[k] = (double)(clock_ns() - start) / 1e6;
		usleep(2000);
	}
	*median = stats_median(ms, N_FRAMES);
	*high = stats_percentile(ms, N_FRAMES, 0.99);
}

static void beside(struct psr_pool *pool, const char *what, enum pool_class class, uint64_t index_ns, double alone)
{
	struct load small, large[2];
	double median = 0, high = 0;

	if (open_load(&small, pool, POOL_MOVING, 10 * US, 16) != PSR_OK)
		return;
	for (int i = 0; i < 2; i++)
		if (open_load(&large[i], pool, class, index_ns, 1000) != PSR_OK || begin(&large[i], draw_many) != PSR_OK)
			return;
	small_frames(&small, &median, &high);
	for (int i = 0; i < 2; i++)
		end(&large[i]);
	printf("  beside two %s, indices of %4.1f ms: %6.2f ms, 99 %% %6.2f ms; of the median alone %.1f and %.1f\n", what,
	       (double)index_ns / 1e6, median, high, median / alone, high / alone);
	close_load(&small);
	for (int i = 0; i < 2; i++)
		close_load(&large[i]);
}

static void bench_latency(struct psr_pool *pool)
{
	struct load small;
	double median = 0, high = 0;

	if (open_load(&small, pool, POOL_MOVING, 10 * US, 16) != PSR_OK)
		return;
	small_frames(&small, &median, &high);
	close_load(&small);
	printf("A frame of 12 loops, 2 ms of work in all:\n  alone: %.2f ms, 99 %% %.2f ms\n", median, high);
	for (uint64_t index_ns = 200 * US; index_ns <= 5000 * US; index_ns *= 5) {
		beside(pool, "that refine", POOL_REFINING, index_ns, median);
		beside(pool, "that move  ", POOL_MOVING, index_ns, median);
	}
}

/* Work done and time held by n flows in 2 s. */
static void bench_shares(struct psr_pool *pool, int n, const uint64_t *index_ns, const char *what)
{
	struct load load[8];
	uint64_t used[8], work = 0, least = UINT64_MAX, most = 0;

	for (int i = 0; i < n; i++)
		if (open_load(&load[i], pool, POOL_MOVING, index_ns[i], 64) != PSR_OK || begin(&load[i], draw_many) != PSR_OK)
			return;
	usleep(2000000);
	for (int i = 0; i < n; i++) {
		used[i] = pool_flow_used_ns(load[i].flow);
		work += atomic_load(&load[i].n_done) * index_ns[i];
		least = used[i] < least ? used[i] : least;
		most = used[i] > most ? used[i] : most;
	}
	for (int i = 0; i < n; i++) {
		end(&load[i]);
		close_load(&load[i]);
	}
	printf("  %s: work done %.3f of the cores' time, least share by greatest %.3f\n", what,
	       (double)work / 2e9 / psr_pool_threads(pool), (double)least / (double)most);
}

int main(void)
{
	static const uint64_t alike[] = { 20 * US, 20 * US, 20 * US, 20 * US, 20 * US, 20 * US };
	static const uint64_t mixed[] = { 20 * US, 200 * US, 2000 * US, 20000 * US };
	struct psr_pool *pool = NULL;

	if (psr_pool_create_for_jobs(&pool, 0, NULL) != PSR_OK)
		return 1;
	printf("%d cores\n", psr_pool_threads(pool));
	bench_loops(pool);
	bench_latency(pool);
	printf("Flows in 2 s:\n");
	bench_shares(pool, 1, alike, "one, indices of 20 us");
	bench_shares(pool, 6, alike, "six, indices of 20 us");
	bench_shares(pool, 4, mixed, "four, indices of 20 us, 200 us, 2 ms and 20 ms");
	psr_pool_destroy(pool);
	return 0;
}
