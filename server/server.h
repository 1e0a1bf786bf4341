/* Everything that the daemon holds, and its life: start, serve, drain, end. The parts know each other through it. */
#ifndef PSRD_SERVER_H
#define PSRD_SERVER_H

#include "server/models/builder.h"
#include "server/models/catalogue.h"
#include "server/frames/codec.h"
#include "server/net/listen.h"
#include "server/net/loop.h"
#include "options.h"
#include "base/pool.h"
#include "proto/proto.h"

#define SERVER_SPARE_CLIENTS 16 /* connections beyond --max-clients that are told so */

struct conn;
struct opener;
struct frames;
struct server;

struct server_listener {
	struct listener listener;
	struct loop_source source;
	struct server *server;
};

struct server_stats {
	uint64_t start_us, connections_total, frames, frames_failed, frames_cancelled;
	uint64_t bytes_sent, bytes_received, dropped_peers;
};

struct server {
	struct options *options;
	struct loop loop;
	struct server_listener listener[OPTIONS_MAX_LISTEN];
	int n_listeners, are_paused; /* paused: out of descriptors until the next tick */
	struct psr_pool *pool;       /* frames: draws and encodes */
	struct psr_pool *io;         /* reads models and folders, hashes sources */
	struct codec *codec;
	struct catalogue catalogue;
	struct builder *builder;
	struct opener *opener;
	struct frames *frames;
	struct conn *conns, *dead;   /* dead: closed in this batch, freed at its end */
	unsigned n_conns;
	uint64_t n_numbers;          /* connections are numbered for the log */
	int is_draining, is_scanning, must_scan_again, is_ticking;
	int must_resume;             /* a connection has this flag */
	uint64_t drain_end_us;
	struct server_stats stats;
	struct psr_msg_scene scene;  /* scratch of the session: 80 KiB */
};

/* Opens the listeners, reads the folder, starts the threads. On failure everything is closed again. */
int server_start(struct server **out, struct options *options, struct psr_error *err);

/* Prints READY lines and serves until a signal ends it. The server is gone afterwards. */
int server_run(struct server *server, struct psr_error *err);

void server_fill_stats(const struct server *server, struct psr_msg_stats_reply *reply);

#endif
