#define _GNU_SOURCE
#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "log.h"
#include "simd/isa.h"
#include "server.h"
#include "server/models/cache.h"
#include "server/models/rescan.h"
#include "server/net/accept.h"
#include "server/session/session.h"

#define IO_THREADS 2
#define LEND_NS 500000 /* the loop draws a small frame itself for so long, about as long as it writes in a turn */

struct server {
	struct options *options;
	struct loop loop;
	struct acceptor acceptor;
	struct conns conns;
	struct conn_user conn_user;
	struct psr_pool *pool;       /* draws and encodes frames */
	struct psr_pool *io;         /* reads models and folders, hashes sources */
	struct codec *codec;
	struct catalogue catalogue;
	struct rescan rescan;
	struct builder *builder;
	struct opener *opener;
	struct residence *residence;
	struct frames *frames;
	struct sessions sessions;
	int is_draining, is_ticking;
	uint64_t drain_end_us;
};

static uint64_t to_us(double seconds)
{
	return (uint64_t)(seconds * 1e6);
}

/* ---- the end ---- */

static void start_draining(struct server *server)
{
	struct conn *next;

	if (server->is_draining) { /* the second signal: end at once */
		server->drain_end_us = server->loop.now_us;
		loop_stop(&server->loop);
		return;
	}
	log_info("ending: %u connections, %u running frames", server->conns.n, frames_running(server->frames));
	server->is_draining = server->conns.is_draining = 1;
	server->drain_end_us = server->loop.now_us + to_us(server->options->drain_timeout);
	accept_close(&server->acceptor);
	builder_destroy(server->builder);
	server->builder = server->sessions.builder = NULL;
	opener_stop(server->opener, PSR_ERR_CANCELLED, CONN_SHUTDOWN);
	frames_stop(server->frames, PSR_ERR_CANCELLED);
	for (struct conn *conn = server->conns.first; conn != NULL; conn = next) {
		struct session *session = conn->session;

		next = conn->next;
		if (session == NULL) {
			conn_close(conn);
			continue;
		}
		sessions_refuse(session, PSR_ERR_CANCELLED, CONN_SHUTDOWN);
	}
}

static int is_reading(const struct server *server)
{
	return opener_is_working(server->opener) || residence_is_working(server->residence) || server->sessions.reads != NULL;
}

/* Sends GOODBYE to clients without a running frame; the loop ends with the last client. */
static void go_on_draining(struct server *server)
{
	struct conn *next;

	for (struct conn *conn = server->conns.first; conn != NULL; conn = next) {
		const struct session *session = conn->session;

		next = conn->next;
		if (conn->state == CONN_OPEN && session->flow.schedule.n_requests == 0) {
			conn_goodbye(conn, PSR_GOODBYE_SHUTDOWN, CONN_SHUTDOWN);
			conn_flush(conn);
		}
	}
	if (server->loop.now_us >= server->drain_end_us
	    || (server->conns.first == NULL && frames_running(server->frames) == 0 && !server->rescan.is_running
	        && !is_reading(server)))
		loop_stop(&server->loop);
}

/* ---- events of the loop ---- */

static void on_signal(int number, void *userdata)
{
	struct server *server = userdata;

	if (number == SIGHUP && !server->is_draining)
		rescan_start(&server->rescan);
	else if (number == SIGCHLD && server->builder != NULL)
		builder_reap(server->builder);
	else if (number == SIGTERM || number == SIGINT)
		start_draining(server);
}

static void on_tick(void *userdata)
{
	struct server *server = userdata;

	accept_wake(&server->acceptor);
	conns_tick(&server->conns);
	if (server->builder != NULL) {
		builder_tick(server->builder);
		opener_tick(server->opener);
	}
}

static void on_batch_end(void *userdata)
{
	struct server *server = userdata;
	int must_tick;

	if (server->loop.wake_us != 0 && server->loop.now_us >= server->loop.wake_us)
		frames_pump(server->frames);
	catalogue_try_claims(&server->catalogue); /* frames and queues may have freed some room */
	if (server->is_draining)
		go_on_draining(server);
	conns_end_batch(&server->conns);
	psr_pool_lend(server->pool, LEND_NS);
	must_tick = server->conns.first != NULL || server->acceptor.is_resting || server->is_draining
	            || builder_is_running(server->builder);
	if (must_tick != server->is_ticking) {
		server->is_ticking = must_tick;
		loop_set_ticking(&server->loop, must_tick);
	}
}

/* ---- life ---- */

static void destroy(struct server *server)
{
	accept_close(&server->acceptor);
	builder_destroy(server->builder);
	while (server->conns.first != NULL)
		conn_close(server->conns.first);
	conns_end_batch(&server->conns); /* stops frames under way */
	psr_pool_destroy(server->pool);  /* waits for them before their data goes */
	psr_pool_destroy(server->io);
	fetches_fini(&server->sessions);
	server->catalogue.io = NULL;
	opener_destroy(server->opener);
	residence_destroy(server->residence);
	frames_destroy(server->frames);
	codec_destroy(server->codec);
	catalogue_fini(&server->catalogue);
	loop_fini(&server->loop);
	free(server);
}

/* A folder of .psr files alone needs no cache, unless an option names one. */
static int needs_cache(const struct server *server)
{
	return catalogue_has_sources(&server->catalogue) || server->options->cache != server->options->cache_default;
}

/* ---- the memory of models and queues ---- */

static uint64_t kept_bytes(void *userdata)
{
	const struct server *server = userdata;

	return server->catalogue.bytes + server->catalogue.reserved + server->conns.bytes_input;
}

static uint64_t queued_bytes(void *userdata)
{
	const struct server *server = userdata;

	return server->conns.bytes_queued;
}

static void make_room(uint64_t bytes, void *userdata)
{
	struct server *server = userdata;

	catalogue_make_room(&server->catalogue, bytes);
}

static uint64_t others_held(uint64_t wanted, void *userdata)
{
	struct server *server = userdata;

	frames_free_idle(server->frames, wanted);
	return frames_bytes(server->frames) + server->conns.bytes_queued + server->conns.bytes_input;
}

static int create_parts(struct server *server)
{
	const struct options *options = server->options;
	const struct builder_limits limits = {
		.max_builds = (int)options->max_builds, .threads = (int)options->threads,
		.memory_bytes = (uint64_t)options->build_memory, .cpu_seconds = (uint64_t)options->build_time,
		.wall_seconds = (uint64_t)options->build_wall_time, .file_bytes = (uint64_t)options->build_file_size,
	};

	if (psr_pool_create_for_jobs(&server->pool, (int)options->threads, NULL) != PSR_OK
	    || psr_pool_create_for_jobs(&server->io, IO_THREADS, NULL) != PSR_OK || codec_create(&server->codec) != PSR_OK
	    || builder_create(&server->builder, &server->loop, &limits) != PSR_OK)
		return PSR_ERR_MEMORY;
	psr_pool_keep_apart(server->pool);
	server->catalogue.io = server->io;
	server->rescan = (struct rescan){
		.loop = &server->loop, .io = server->io, .catalogue = &server->catalogue, .models = options->models,
	};
	server->catalogue.others = (struct catalogue_others){ others_held, server };
	if (opener_create(&server->opener, &(struct opener_parts){
	        .loop = &server->loop, .io = server->io, .catalogue = &server->catalogue, .builder = server->builder,
	        .models = options->models, .cache = options->cache, .max_cache = (uint64_t)options->cache_size,
	        .resolution = (uint32_t)options->resolution, .max_resolution = (uint32_t)options->max_resolution,
	        .user = &sessions_opener_user, .on_rebuilt = residence_on_rebuilt }) != PSR_OK
	    || residence_create(&server->residence, &(struct residence_parts){
	        .loop = &server->loop, .io = server->io, .catalogue = &server->catalogue, .opener = server->opener,
	        .cache = options->cache }) != PSR_OK
	    || frames_create(&server->frames, &(struct frames_parts){
	        .loop = &server->loop, .pool = server->pool, .io = server->io, .codec = server->codec,
	        .residence = server->residence, .max_pixels = options->max_pixels,
	        .max_queue = (uint64_t)options->max_queue, .max_memory = (uint64_t)options->max_memory,
	        .timeout_ns = (uint64_t)(options->frame_timeout * 1e9),
	        .memory = { kept_bytes, queued_bytes, make_room, server }, .on_end = sessions_on_frame_end }) != PSR_OK)
		return PSR_ERR_MEMORY;
	server->sessions = (struct sessions){
		.options = options, .conns = &server->conns, .catalogue = &server->catalogue, .opener = server->opener,
		.builder = server->builder, .frames = server->frames, .pool = server->pool, .io = server->io, .start_us = server->loop.now_us,
	};
	return PSR_OK;
}

static void trim_job(void *userdata)
{
	const struct options *options = userdata;

	cache_trim(options->cache, (uint64_t)options->cache_size, NULL, 0);
}

static int start_parts(struct server *server, struct psr_error *err)
{
	const struct options *options = server->options;
	struct catalogue_listing *listing;
	int code = catalogue_scan(&listing, options->models, err);

	if (code != PSR_OK)
		return code;
	catalogue_init(&server->catalogue, (uint64_t)options->max_memory);
	catalogue_adopt(&server->catalogue, listing);
	if (create_parts(server) != PSR_OK)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory, or no threads, to start with --threads %" PRId64,
		                options->threads);
	if (!needs_cache(server))
		return PSR_OK;
	const struct pool_job trim = { .fn = trim_job, .userdata = server->options };

	code = cache_check(options->cache, err);
	if (code == PSR_OK && psr_pool_submit(server->io, &trim) != PSR_OK)
		log_warn("no memory to look at the size of the cache");
	return code;
}

/* From here on connections can arrive; they wait in the listeners' backlog until the loop runs. */
static int open_doors(struct server *server, struct psr_error *err)
{
	const struct options *options = server->options;
	const struct conn_limits limits = {
		.max_clients = (unsigned)options->max_clients, .max_queue = (uint64_t)options->max_queue,
		.max_pending = (unsigned)options->max_pending,
		.max_pending_per_origin = (unsigned)options->max_pending_per_address,
		.handshake_us = to_us(options->handshake_timeout), .idle_us = to_us(options->idle_timeout),
		.slow_us = to_us(options->slow_timeout),
	};

	sessions_conn_user(&server->conn_user, &server->sessions);
	conns_init(&server->conns, &server->loop, &limits, &server->conn_user);
	return accept_open(&server->acceptor, &server->conns, options->listen, options->n_listen, err);
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
	accept_raise_descriptors(&options->max_clients, &options->max_pending);
	code = loop_init(&server->loop, &signals, err);
	server->loop.on_signal = on_signal;
	server->loop.on_tick = on_tick;
	server->loop.on_batch_end = on_batch_end;
	server->loop.userdata = server;
	if (code == PSR_OK)
		code = open_doors(server, err);
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

	for (int i = 0; i < server->acceptor.n; i++)
		printf("READY %s\n", server->acceptor.listener[i].listener.name);
	fflush(stdout);
	log_info("serving %zu models with %d threads and %s", server->catalogue.n, psr_pool_threads(server->pool),
	         psr_isa_name(psr_isa_get()));
	code = loop_run(&server->loop, err);
	if (frames_running(server->frames) > 0 || is_reading(server) || server->rescan.is_running) {
		/* The drain time is over. Jobs that still draw or read cannot be stopped, and psrd does not wait for them. */
		log_info("ended in the middle of %u frames", frames_running(server->frames));
		builder_destroy(server->builder);
		accept_close(&server->acceptor);
		fflush(NULL);
		_exit(psr_exit_status(code));
	}
	destroy(server);
	return code;
}
