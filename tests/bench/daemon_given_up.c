/* Frames that are given up: how long until their threads are free, beside what the machine alone takes. */
#include "daemon.h"

#include <limits.h>
#include <pthread.h>
#include <stdatomic.h>
#include <unistd.h>
#include "base/clock.h"
#include "base/random.h"
#include "base/stats.h"
#include "report.h"

#define SMALL 256
#define PASSES 4
#define REST_NS 110000000 /* in a view, refining begins 0.1 s after the request */
#define MOST_TRIALS 2000

struct trials {
	double ms[MOST_TRIALS], processor_ms[MOST_TRIALS];
	size_t n;
};

/* From now on until the daemon has counted the frame that was given up; 0: none was running. */
static void wait_until_free(struct trials *to, struct link *watch, const struct daemon_server *server, uint64_t counted)
{
	const double used_s = daemon_processor_s(server);
	const uint64_t start_ns = clock_ns();

	while (link_stat(watch, PSR_STAT_DRAW_US) == counted) {
		if (clock_ns() - start_ns > 1000000000)
			return;
		usleep(100); /* who asks all the time takes the processors from those who are to end */
	}
	if (to->n == MOST_TRIALS)
		return;
	to->ms[to->n] = (double)(clock_ns() - start_ns) * 1e-6;
	to->processor_ms[to->n++] = (daemon_processor_s(server) - used_s) * 1e3;
}

enum way { WAY_CANCEL, WAY_SUPERSEDE, WAY_HANG_UP, N_WAYS };

/* A plain frame is finished when it is superseded, a refined one is not. */
static void try_once(struct trials *to, enum way way, struct link *links, const struct daemon_server *server,
                     double after_ms)
{
	struct link *given = &links[0], *watch = &links[1];
	const uint32_t id = link_ask(given);
	const uint64_t start_ns = clock_ns();
	uint64_t counted;

	while (way == WAY_SUPERSEDE && (given->last_id != id || clock_ns() - start_ns < REST_NS)
	       && clock_ns() - start_ns < 1000000000)
		links_run(given, 1, 0.001);
	links_run(given, 1, after_ms * 1e-3);
	if (given->n_open == 0)
		return;
	counted = link_stat(watch, PSR_STAT_DRAW_US);
	if (way == WAY_CANCEL)
		link_cancel(given, id);
	else if (way == WAY_SUPERSEDE)
		link_ask(given);
	else
		link_close(given);
	wait_until_free(to, watch, server, counted);
	if (way == WAY_SUPERSEDE)
		link_cancel(given, given->next_id - 1);
	if (way != WAY_HANG_UP)
		links_finish(given, 1, 1);
}

static void open_given(struct link *link, const struct daemon_server *server, const struct scene_film *film,
                       enum way way)
{
	link_connect(link, server, film);
	link_frame(link, film->picture.width, film->picture.height);
	link->frame.pass_limit = PASSES;
	link->view = way == WAY_SUPERSEDE;
}

static double median_reply_ms(struct link *watch)
{
	double ms[101];

	for (int i = 0; i < 101; i++) {
		const uint64_t start_ns = clock_ns();

		link_stat(watch, PSR_STAT_DRAW_US);
		ms[i] = (double)(clock_ns() - start_ns) * 1e-6;
	}
	return stats_median(ms, 101);
}

/* ---- the machine's own part of it ---- */

struct spinner {
	pthread_t thread;
	atomic_uint *asked;  /* counts questions; ENDED: no more */
	atomic_uint answered;
};
#define ENDED UINT_MAX

static void *spin(void *userdata)
{
	struct spinner *spinner = userdata;
	unsigned asked;

	while ((asked = atomic_load(spinner->asked)) != ENDED)
		atomic_store(&spinner->answered, asked);
	return NULL;
}

/* Two threads do nothing but ask: how late they hear, p99. What takes processors from them takes them from psrd,
 * too. */
static double measure_floor(const struct daemon_bench *bench)
{
	struct spinner spinner[2];
	static double ms[MOST_TRIALS];
	atomic_uint asked = 0;
	const uint64_t start_ns = clock_ns();
	uint64_t seed = 1;
	size_t n = 0;

	for (int i = 0; i < 2; i++) {
		spinner[i] = (struct spinner){ .asked = &asked };
		if (pthread_create(&spinner[i].thread, NULL, spin, &spinner[i]) != 0)
			report_die("threads", "cannot be started");
	}
	while (n < MOST_TRIALS && (double)(clock_ns() - start_ns) * 1e-9 < N_WAYS * bench->seconds) {
		usleep((useconds_t)random_in(&seed, 0, 20000));
		const unsigned number = atomic_fetch_add(&asked, 1) + 1;
		const uint64_t asked_ns = clock_ns();

		while (atomic_load(&spinner[0].answered) != number || atomic_load(&spinner[1].answered) != number)
			usleep(100);
		ms[n++] = (double)(clock_ns() - asked_ns) * 1e-6;
	}
	atomic_store(&asked, ENDED);
	for (int i = 0; i < 2; i++)
		pthread_join(spinner[i].thread, NULL);
	stats_sort(ms, n);
	return stats_percentile(ms, n, 0.99);
}

static void print_trials(const struct daemon_bench *bench, struct trials *t)
{
	const double floor_ms = measure_floor(bench);

	stats_sort(t->ms, t->n);
	stats_sort(t->processor_ms, t->n);
	daemon_figure(bench, "until threads are free, p50", "ms", stats_percentile(t->ms, t->n, 0.5), DAEMON_NO_BOUND, 0);
	daemon_figure(bench, "until threads are free, p99", "ms", stats_percentile(t->ms, t->n, 0.99), DAEMON_AT_MOST, 2);
	daemon_figure(bench, "the same of threads that only ask, p99", "ms", floor_ms, DAEMON_NO_BOUND, 0);
	daemon_figure(bench, "p99 / that", "x", stats_percentile(t->ms, t->n, 0.99) / floor_ms, DAEMON_NO_BOUND, 0);
	daemon_figure(bench, "processor time meanwhile, p50", "ms", stats_percentile(t->processor_ms, t->n, 0.5),
	              DAEMON_NO_BOUND, 0);
	daemon_figure(bench, "processor time meanwhile, p99", "ms", stats_percentile(t->processor_ms, t->n, 0.99),
	              DAEMON_NO_BOUND, 0);
	daemon_figure(bench, "frames given up", "", (double)t->n, DAEMON_NO_BOUND, 0);
}

void daemon_given_up(struct daemon_bench *bench)
{
	static const char *const options[] = { NULL };
	static const char *const name[] = { "cancelled, p99", "superseded: its end, behind the newer, p99", "hung up, p99" };
	static struct trials all, one;
	struct daemon_server server;
	struct scene_film film;
	struct link links[2];
	uint64_t seed = 1;

	daemon_start(&server, bench, options);
	daemon_film(&film, bench, 1920, 1080);
	link_connect(&links[1], &server, &film);
	link_frame(&links[1], SMALL, SMALL);
	link_ask(&links[1]);
	links_finish(&links[1], 1, 10);
	daemon_figure(bench, "of that: the question whether", "ms", median_reply_ms(&links[1]), DAEMON_NO_BOUND, 0);
	/* Memory that is new takes as long as the system needs to clear it, several ms a huge page where a virtual machine's
	 * host has to find it first: a frame with all passes makes that of psrd's workers. */
	open_given(&links[0], &server, &film, WAY_CANCEL);
	link_ask(&links[0]);
	links_finish(&links[0], 1, 60);
	link_close(&links[0]);
	all.n = 0;
	for (enum way way = 0; way < N_WAYS && link_stat(&links[1], PSR_STAT_DRAW_US) > 0; way++) {
		const uint64_t start_ns = clock_ns();

		one.n = 0;
		links[0].fd = -1;
		while ((double)(clock_ns() - start_ns) * 1e-9 < bench->seconds) {
			if (links[0].fd < 0)
				open_given(&links[0], &server, &film, way);
			try_once(&one, way, links, &server, random_in(&seed, 0, 120));
		}
		link_close(&links[0]);
		/* What a newer frame superseded ends behind that, which has its threads at once. */
		for (size_t i = 0; way != WAY_SUPERSEDE && i < one.n && all.n < MOST_TRIALS; i++, all.n++) {
			all.ms[all.n] = one.ms[i];
			all.processor_ms[all.n] = one.processor_ms[i];
		}
		stats_sort(one.ms, one.n);
		daemon_figure(bench, name[way], "ms", stats_percentile(one.ms, one.n, 0.99), DAEMON_NO_BOUND, 0);
	}
	if (all.n > 0)
		print_trials(bench, &all);
	link_close(&links[1]);
	daemon_stop(&server);
}
