/* Memory under readers that do not read; processor time beside the picture. */
#include "daemon.h"

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>
#include "base/clock.h"
#include "base/stats.h"
#include "report.h"
#include "server/frames/codec.h"

#define DEAF 64
#define DEAF_SIDE 4096
#define GIB (UINT64_C(1) << 30)
#define TINY 64
#define ROUND 500 /* frames */
#define MOST_ROUNDS 200
#define REQUEST_BYTES 176 /* of a FRAME message */
#define MOST_ANSWER_BYTES (1 << 20)

/* ---- 7: memory ---- */

void daemon_memory(struct daemon_bench *bench)
{
	static const char *const options[] = { "--max-memory", "1g", NULL };
	static struct link deaf[DEAF];
	struct daemon_server server;
	struct scene_film film, large;
	struct link small;

	daemon_start(&server, bench, options);
	if (server.minor < 2) { /* which holds 31 GB */
		daemon_stop(&server);
		return;
	}
	const double empty = daemon_peak_bytes(&server);
	daemon_film(&film, bench, 256, 256);
	daemon_film(&large, bench, DEAF_SIDE, DEAF_SIDE);
	link_connect(&small, &server, &film);
	link_frame(&small, 256, 256);
	for (int i = 0; i < DEAF; i++) {
		link_connect(&deaf[i], &server, &large);
		link_frame(&deaf[i], DEAF_SIDE, DEAF_SIDE);
		deaf[i].frame.planes |= 1u << PSR_PLANE_DEPTH;
		deaf[i].frame.color_codec = PSR_CODEC_RAW;
		deaf[i].frame.color_quality = 0;
		deaf[i].frame.depth_format = PSR_WIRE_DEPTH_F32;
		link_ask(&deaf[i]);
	}
	small.n_wanted = 1;
	links_run(&small, 1, 4 * bench->seconds);
	const double peak = daemon_peak_bytes(&server);
	daemon_figure(bench, "peak memory - empty / --max-memory", "x", (peak - empty) / GIB, DAEMON_AT_MOST, 1);
	daemon_figure(bench, "peak memory", "MiB", peak / 1048576, DAEMON_NO_BOUND, 0);
	daemon_figure(bench, "empty program", "MiB", empty / 1048576, DAEMON_NO_BOUND, 0);
	daemon_figure(bench, "256x256 of another client", "1/s", small.n_done / (4 * bench->seconds), DAEMON_AT_LEAST, 1);
	daemon_figure(bench, "256x256 of another client, p99", "ms", link_percentile(&small, 0.99), DAEMON_NO_BOUND, 0);
	for (int i = 0; i < DEAF; i++)
		link_close(&deaf[i]);
	link_close(&small);
	daemon_stop(&server);
}

/* ---- 8: beside the picture ---- */

/* The same frames by one thread without a daemon. */
struct bare {
	struct psr_renderer *renderer;
	struct codec *codec;
	struct psr_frame frame;
	const struct scene_film *film;
	struct psr_msg_frame request;
};

static void drop(struct outq_chunk *first, void *userdata)
{
	size_t *n_bytes = userdata;

	for (const struct outq_chunk *chunk = first; chunk != NULL; chunk = chunk->next)
		*n_bytes += chunk->size;
	outq_chunks_destroy(first);
}

/* Returns the bytes of the answer. */
static size_t draw_bare(struct bare *bare, int i)
{
	size_t n_bytes = 0;
	static const uint8_t background[3];
	const struct codec_answer answer = { .id = 1, .request = &bare->request, .scale = 1, .background = background,
		                                 .emit = drop, .userdata = &n_bytes };
	struct codec_result result;
	struct psr_settings settings;
	struct psr_scene scene;
	struct psr_error err;

	scene_film_frame(&scene, bare->film, i % SCENE_FRAMES);
	psr_settings_default(&settings, TINY, TINY);
	if (psr_render(bare->renderer, &scene, &settings, NULL, &bare->frame, &err) != PSR_OK
	    || codec_encode(&result, bare->codec, NULL, &answer, &bare->frame, &err) != PSR_OK)
		report_die("psr_render", err.text);
	return n_bytes;
}

/* Microseconds a frame. */
static double time_bare(struct bare *bare)
{
	const uint64_t start_ns = clock_thread_ns();

	for (int i = 0; i < ROUND; i++)
		draw_bare(bare, i);
	return (double)(clock_thread_ns() - start_ns) * 1e-3 / ROUND;
}

static void run_frames(struct link *link, unsigned n)
{
	links_forget(link, 1);
	while (link->n_done < n && !link->is_lost)
		links_run(link, 1, 0.001);
}

static double time_daemon(const struct daemon_server *server, struct link *link)
{
	run_frames(link, 10);
	const double start_s = daemon_processor_s(server);
	run_frames(link, ROUND);
	return (daemon_processor_s(server) - start_s) * 1e6 / link->n_done;
}

/* The trace has begun, or its program has ended. */
static void wait_for_trace(const struct daemon_server *server, pid_t tracer)
{
	char path[64];

	snprintf(path, sizeof path, "/proc/%d/status", (int)server->pid);
	while (daemon_field(path, "TracerPid:") == 0 && waitpid(tracer, NULL, WNOHANG | WNOWAIT) == 0)
		usleep(1000);
}

/* System calls a frame, as strace counts them; 0 without strace. */
static double count_calls(const struct daemon_server *server, struct link *link)
{
	char path[64], number[16], line[256];
	double calls = 0;
	FILE *file;

	snprintf(path, sizeof path, "/tmp/psr-bench-strace-%d", (int)getpid());
	snprintf(number, sizeof number, "%d", (int)server->pid);
	const pid_t pid = fork();
	if (pid == 0) {
		freopen("/dev/null", "w", stderr);
		execlp("strace", "strace", "-c", "-f", "-o", path, "-p", number, (char *)NULL);
		_exit(127);
	}
	wait_for_trace(server, pid);
	run_frames(link, ROUND);
	const double n = link->n_done;
	kill(pid, SIGINT);
	waitpid(pid, NULL, 0);
	file = fopen(path, "r");
	while (file != NULL && fgets(line, sizeof line, file) != NULL)
		if (strstr(line, " total") != NULL)
			sscanf(line, "%*s %*s %*s %lf", &calls);
	if (file != NULL)
		fclose(file);
	unlink(path);
	return calls / n;
}

static void bare_init(struct bare *bare, const struct scene_film *film, const struct psr_msg_frame *request)
{
	*bare = (struct bare){ .film = film, .request = *request };
	bare->frame = (struct psr_frame){ .width = TINY, .height = TINY, .rgb = report_alloc(TINY * TINY, 3) };
	if (psr_renderer_create(&bare->renderer, NULL) != PSR_OK || codec_create(&bare->codec) != PSR_OK)
		report_die("psr", "cannot be started");
}

static void bare_fini(struct bare *bare)
{
	codec_destroy(bare->codec);
	psr_renderer_destroy(bare->renderer);
	free(bare->frame.rgb);
}

/* ---- the least that a server can be ---- */

/* Waits for a request, draws, sends an answer of as many bytes, and knows nothing else: no protocol, no other client, no
 * thread. What it takes beyond drawing is the system's. */
struct least {
	struct daemon_server server; /* its process alone */
	int fd;
};

static void serve_least(struct bare *bare, int fd)
{
	static uint8_t request[REQUEST_BYTES], answer[MOST_ANSWER_BYTES];
	struct epoll_event event = { .events = EPOLLIN };
	const int epoll = epoll_create1(0);

	if (epoll < 0 || epoll_ctl(epoll, EPOLL_CTL_ADD, fd, &event) != 0)
		_exit(1);
	for (int i = 0;; i++) {
		if (epoll_wait(epoll, &event, 1, -1) != 1 || recv(fd, request, sizeof request, 0) != sizeof request)
			_exit(0);
		const size_t n_bytes = draw_bare(bare, i);

		memcpy(answer, &n_bytes, sizeof n_bytes);
		if (n_bytes < sizeof n_bytes || n_bytes > sizeof answer
		    || send(fd, answer, n_bytes, MSG_NOSIGNAL) != (ssize_t)n_bytes)
			_exit(1);
	}
}

static void least_start(struct least *least, struct bare *bare)
{
	int pair[2];

	if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) != 0)
		report_die("socketpair", "failed");
	fflush(NULL);
	least->server.pid = fork();
	if (least->server.pid == 0) {
		close(pair[0]);
		serve_least(bare, pair[1]);
	}
	close(pair[1]);
	least->fd = pair[0];
}

static void least_stop(struct least *least)
{
	close(least->fd);
	waitpid(least->server.pid, NULL, 0);
}

/* Microseconds a frame of its process. */
static double time_least(struct least *least)
{
	static uint8_t request[REQUEST_BYTES], answer[MOST_ANSWER_BYTES];
	const double start_s = daemon_processor_s(&least->server);

	for (int i = 0; i < ROUND; i++) {
		size_t n_wanted = sizeof n_wanted, n = 0;

		if (send(least->fd, request, sizeof request, MSG_NOSIGNAL) != sizeof request)
			report_die("the least server", "has ended");
		while (n < n_wanted) {
			const ssize_t got = recv(least->fd, answer + n, sizeof answer - n, 0);

			if (got <= 0)
				report_die("the least server", "has ended");
			n += (size_t)got;
			if (n >= sizeof n_wanted)
				memcpy(&n_wanted, answer, sizeof n_wanted);
		}
	}
	return (daemon_processor_s(&least->server) - start_s) * 1e6 / ROUND;
}

/* By turns, so that all see the same machine. Returns the median of what the daemon takes beyond the bare frames. */
static double measure_beyond(const struct daemon_bench *bench, const struct daemon_server *server, struct link *link)
{
	double bare_us[MOST_ROUNDS], beyond_us[MOST_ROUNDS], least_us[MOST_ROUNDS];
	const double start = clock_seconds();
	struct least least;
	struct bare bare;
	size_t n = 0;

	bare_init(&bare, link->film, &link->frame);
	least_start(&least, &bare);
	time_bare(&bare);
	time_least(&least);
	while (n < MOST_ROUNDS && (n < 3 || clock_seconds() - start < bench->seconds)) {
		bare_us[n] = time_bare(&bare);
		beyond_us[n] = time_daemon(server, link) - bare_us[n];
		least_us[n] = time_least(&least) - bare_us[n];
		n++;
	}
	least_stop(&least);
	bare_fini(&bare);
	daemon_figure(bench, "psr_render() and encoding alone", "us", stats_median(bare_us, n), DAEMON_NO_BOUND, 0);
	daemon_figure(bench, "a loop of epoll, recv, these, send", "us", stats_median(least_us, n), DAEMON_NO_BOUND, 0);
	return stats_median(beyond_us, n);
}

static void measure_with(const struct daemon_bench *bench, const char *const *options, const char *name,
                         enum daemon_bound kind)
{
	struct daemon_server server;
	struct scene_film film;
	struct link link;

	daemon_start(&server, bench, options);
	daemon_film(&film, bench, TINY, TINY);
	link_connect(&link, &server, &film);
	link_frame(&link, TINY, TINY);
	link.n_wanted = 1;
	daemon_figure(bench, name, "us", measure_beyond(bench, &server, &link), kind, 40);
	if (kind != DAEMON_NO_BOUND) {
		const double before = daemon_switches(&server);

		run_frames(&link, ROUND);
		const double switches = (daemon_switches(&server) - before) / link.n_done, calls = count_calls(&server, &link);
		daemon_figure(bench, "context switches a frame", "", switches, DAEMON_NO_BOUND, 0);
		if (calls > 0)
			daemon_figure(bench, "system calls a frame (strace)", "", calls, DAEMON_NO_BOUND, 0);
	}
	link_close(&link);
	daemon_stop(&server);
}

void daemon_overhead(struct daemon_bench *bench)
{
	static const char *const two[] = { NULL }, *const one[] = { "--threads", "1", NULL };

	measure_with(bench, two, "psrd beyond render and encoding", DAEMON_AT_MOST);
	measure_with(bench, one, "the same, psrd with one thread", DAEMON_NO_BOUND);
}
