/* The command line and configuration of psrd: one table, documented in docs/man/psrd.1. */
#ifndef PSRD_OPTIONS_H
#define PSRD_OPTIONS_H

#include <stdint.h>
#include "psr/error.h"

#define OPTIONS_LISTEN_DEFAULT "127.0.0.1:7447"
#define OPTIONS_MAX_LISTEN 16

struct options {
	const char *listen[OPTIONS_MAX_LISTEN]; /* at least one after parsing */
	int n_listen;
	const char *models, *cache, *config, *isa;
	int64_t threads;
	int64_t resolution, max_resolution; /* at which psrd builds sources, pixels; the first is not above the second */
	int64_t max_clients, max_open, max_handles, max_builds;
	int64_t max_pending, max_pending_per_address; /* connections before HELLO; the second is not above the first */
	int64_t max_pixels;
	int64_t max_memory, max_queue, build_memory, build_file_size, cache_size; /* bytes; cache 0: no limit */
	double handshake_timeout, idle_timeout, slow_timeout, drain_timeout; /* seconds; idle_timeout 0: never */
	double frame_timeout; /* processor seconds */
	int64_t build_time, build_wall_time; /* processor seconds; seconds */
	int verbose, version;
	char *cache_default, *config_text; /* freed by options_fini() */
};

/* Reads defaults, then the configuration file if --config names one, then the command line, which wins. `options` must
 * stay where it is. Returns PSR_OK, 1 if --help or --version has been answered on standard output, or an error: ARG,
 * NOT_FOUND, IO. Call options_fini() after every outcome. */
int options_parse(struct options *options, int argc, char **argv, struct psr_error *err);
void options_fini(struct options *options);

#endif
