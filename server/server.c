#define _GNU_SOURCE
#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "base/clock.h"
#include "server/net/accept.h"
#include "server/models/cache.h"
#include "server/net/conn.h"
#include "server/frames/frames.h"
#include "log.h"
#include "server/models/opener.h"
#include "simd/isa.h"
#include "server.h"

#define IO_THREADS 2

static const char ENDING[] = "the server is shutting down";

struct scan {
	struct server *server;
	struct loop_note note;
	struct catalogue_listing *listing;
	struct psr_error error;
	int code;
};

static uint64_t to_us(double seconds)
{
	return (uint64_t)(seconds * 1e6);
}

/* ---- the models folder ---- */

static void scan_job(void *userdata);

static void start_scan(struct server *server)
{
	struct scan *scan;

	if (server->is_scanning) {
		server->must_scan_again = 1;
		return;
	}
	scan = calloc(1, sizeof *scan);
	if (scan != NULL)
		scan->server = server;
	if (scan == NULL || psr_pool_submit(server->io, scan_job, scan) != PSR_OK) {
		free(scan);
		log_warn("no memory to read the models folder again");
		return;
	}
	server->is_scanning = 1;
}

static void on_scanned(void *userdata)
{
	struct scan *scan = userdata;
	struct server *server = scan->server;

	server->is_scanning = 0;
	if (scan->code != PSR_OK)
		log_warn("the models folder was not read again: %s", scan->error.text);
	else if (catalogue_adopt(&server->catalogue, scan->listing) != PSR_OK)
		log_warn("no memory to read the models folder again");
	else
		log_info("models folder read again: %zu models", server->catalogue.n);
	free(scan);
	if (server->must_scan_again) {
		server->must_scan_again = 0;
		start_scan(server);
	}
}

static void scan_job(void *userdata)
{
	struct scan *scan = userdata;

	scan->code = catalogue_scan(&scan->listing, scan->server->options->models, &scan->error);
	scan->note = (struct loop_note){ .fn = on_scanned, .userdata = scan };
	loop_post(&scan->server->loop, &scan->note);
}

/* ---- the end ---- */

static void start_draining(struct server *server)
{
	struct conn *next;

	if (server->is_draining) { /* asked twice: at once */
		server->drain_end_us = server->loop.now_us;
		loop_stop(&server->loop);
		return;
	}
	log_info("ending: %u connections, %u frames under way", server->n_conns, frames_running(server->frames));
	server->is_draining = 1;
	server->drain_end_us = server->loop.now_us + to_us(server->options->drain_timeout);
	accept_close(server);
	builder_destroy(server->builder);
	server->builder = NULL;
	opener_refuse_all(server->opener, PSR_ERR_CANCELLED, ENDING);
	for (struct conn *conn = server->conns; conn != NULL; conn = next) {
		next = conn->next;
		if (conn->state == CONN_HELLO)
			conn_close(conn);
		else
			frames_refuse_waiting(server->frames, conn, PSR_ERR_CANCELLED, ENDING);
	}
}

/* Who has no frame under way hears goodbye; when nobody is left, the loop ends. */
static void go_on_draining(struct server *server)
{
	struct conn *next;

	for (struct conn *conn = server->conns; conn != NULL; conn = next) {
		next = conn->next;
		if (conn->state == CONN_OPEN && conn->running == NULL) {
			conn_goodbye(conn, PSR_GOODBYE_SHUTDOWN, ENDING);
			conn_flush(conn);
		}
	}
	if (server->loop.now_us >= server->drain_end_us
	    || (server->conns == NULL && frames_running(server->frames) == 0 && !server->is_scanning
	        && !opener_is_working(server->opener)))
		loop_stop(&server->loop);
}

/* ---- events of the loop ---- */

static void on_signal(int number, void *userdata)
{
	struct server *server = userdata;

	if (number == SIGHUP && !server->is_draining)
		start_scan(server);
	else if (number == SIGCHLD && server->builder != NULL)
		builder_reap(server->builder);
	else if (number == SIGTERM || number == SIGINT)
		start_draining(server);
}

static void on_tick(void *userdata)
{
	struct server *server = userdata;
	struct conn *next;

	if (server->are_paused)
		accept_pause(server, 0);
	for (struct conn *conn = server->conns; conn != NULL; conn = next) {
		next = conn->next;
		conn_tick(conn, server->loop.now_us);
	}
}

static void on_batch_end(void *userdata)
{
	struct server *server = userdata;
	int must_tick;

	while (server->must_resume) {
		struct conn *next;

		server->must_resume = 0;
		for (struct conn *conn = server->conns; conn != NULL; conn = next) {
			next = conn->next;
			conn_resume(conn);
		}
	}
	if (server->is_draining)
		go_on_draining(server);
	while (server->dead != NULL) {
		struct conn *conn = server->dead;

		server->dead = conn->next;
		conn_destroy(conn);
	}
	must_tick = server->conns != NULL || server->are_paused || server->is_draining;
	if (must_tick != server->is_ticking) {
		server->is_ticking = must_tick;
		loop_set_ticking(&server->loop, must_tick);
	}
}

/* ---- life ---- */

static void destroy(struct server *server)
{
	accept_close(server);
	builder_destroy(server->builder);
	while (server->conns != NULL)
		conn_close(server->conns);
	psr_pool_destroy(server->pool);
	psr_pool_destroy(server->io);
	while (server->dead != NULL) {
		struct conn *conn = server->dead;

		server->dead = conn->next;
		conn_destroy(conn);
	}
	opener_destroy(server->opener);
	frames_destroy(server->frames);
	codec_destroy(server->codec);
	catalogue_fini(&server->catalogue);
	loop_fini(&server->loop);
	free(server);
}

/* A folder of .psr files alone needs no cache, unless somebody named one. */
static int needs_cache(const struct server *server)
{
	const struct catalogue *catalogue = &server->catalogue;
	int n_sources = 0;

	for (size_t i = 0; i < catalogue->n; i++)
		n_sources += catalogue->entry[i].file.is_source && catalogue->entry[i].file.reason == NULL;
	return n_sources > 0 || server->options->cache != server->options->cache_default;
}

static int start_parts(struct server *server, struct psr_error *err)
{
	const struct options *options = server->options;
	const struct builder_limits limits = {
		.max_builds = (int)options->max_builds, .threads = (int)options->threads,
		.memory_bytes = (uint64_t)options->build_memory, .cpu_seconds = (uint64_t)options->build_time,
	};
	struct catalogue_listing *listing;
	int code = catalogue_scan(&listing, options->models, err);

	if (code != PSR_OK)
		return code;
	catalogue_init(&server->catalogue, (uint64_t)options->max_memory);
	if (catalogue_adopt(&server->catalogue, listing) != PSR_OK
	    || psr_pool_create_for_jobs(&server->pool, (int)options->threads, NULL) != PSR_OK
	    || psr_pool_create_for_jobs(&server->io, IO_THREADS, NULL) != PSR_OK || codec_create(&server->codec) != PSR_OK
	    || frames_create(&server->frames, server) != PSR_OK || opener_create(&server->opener, server) != PSR_OK
	    || builder_create(&server->builder, &server->loop, &limits) != PSR_OK)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory, or no threads, to start with --threads %" PRId64,
		                options->threads);
	return needs_cache(server) ? cache_check(options->cache, err) : PSR_OK;
}

int server_start(struct server **out, struct options *options, struct psr_error *err)
{
	struct server *server = calloc(1, sizeof *server);
	const struct sigaction ignore = { .sa_handler = SIG_IGN };
	sigset_t signals;
	int code;

	if (server == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory");
	server->options = options;
	sigaction(SIGPIPE, &ignore, NULL);
	sigemptyset(&signals);
	sigaddset(&signals, SIGTERM);
	sigaddset(&signals, SIGINT);
	sigaddset(&signals, SIGHUP);
	sigaddset(&signals, SIGCHLD);
	accept_raise_descriptors(options);
	code = loop_init(&server->loop, &signals, err);
	server->loop.on_signal = on_signal;
	server->loop.on_tick = on_tick;
	server->loop.on_batch_end = on_batch_end;
	server->loop.userdata = server;
	server->stats.start_us = server->loop.now_us;
	if (code == PSR_OK)
		code = accept_open(server, err);
	if (code == PSR_OK)
		code = start_parts(server, err);
	if (code != PSR_OK) {
		destroy(server);
		return code;
	}
	*out = server;
	return PSR_OK;
}

int server_run(struct server *server, struct psr_error *err)
{
	int code;

	for (int i = 0; i < server->n_listeners; i++)
		printf("READY %s\n", server->listener[i].listener.name);
	fflush(stdout);
	log_info("serving %zu models with %d threads and %s", server->catalogue.n, psr_pool_threads(server->pool),
	         psr_isa_name(psr_isa_get()));
	code = loop_run(&server->loop, err);
	if (frames_running(server->frames) > 0 || opener_is_working(server->opener) || server->is_scanning) {
		/* Past the time that it had: what still draws or reads cannot be stopped, and nobody waits for it. */
		log_info("ended in the middle of %u frames", frames_running(server->frames));
		builder_destroy(server->builder);
		accept_close(server);
		fflush(NULL);
		_exit(psr_exit_status(code));
	}
	destroy(server);
	return code;
}

void server_fill_stats(const struct server *server, struct psr_msg_stats_reply *reply)
{
	const struct server_stats *stats = &server->stats;
	const struct psr_msg_stat all[] = {
		{ PSR_STAT_UPTIME_US, clock_ns() / 1000 - stats->start_us },
		{ PSR_STAT_CONNECTIONS, server->n_conns },
		{ PSR_STAT_CONNECTIONS_TOTAL, stats->connections_total },
		{ PSR_STAT_MODELS, server->catalogue.n_models },
		{ PSR_STAT_MODEL_BYTES, server->catalogue.bytes },
		{ PSR_STAT_FRAMES, stats->frames },
		{ PSR_STAT_FRAMES_FAILED, stats->frames_failed },
		{ PSR_STAT_FRAMES_WAITING, frames_waiting(server->frames) },
		{ PSR_STAT_BYTES_SENT, stats->bytes_sent },
		{ PSR_STAT_BYTES_RECEIVED, stats->bytes_received },
		{ PSR_STAT_FRAMES_SUPERSEDED, 0 },
		{ PSR_STAT_FRAMES_CANCELLED, stats->frames_cancelled },
		{ PSR_STAT_THREADS, (uint64_t)psr_pool_threads(server->pool) },
		{ PSR_STAT_DROPPED_PEERS, stats->dropped_peers },
	};

	memset(reply, 0, sizeof *reply);
	reply->n_stats = sizeof all / sizeof all[0];
	memcpy(reply->stat, all, sizeof all);
}
