/* psr bench: workers, each with a thread and a connection of its own, ask for frames and measure them. */
#ifndef PSR_CLIENT_BENCH_BENCH_H
#define PSR_CLIENT_BENCH_BENCH_H

#include <pthread.h>
#include <stdint.h>
#include "client/scene/quality.h"
#include "client/scene/view.h"

#define BENCH_MAX_CLIENTS 1024
#define BENCH_MAX_SAMPLES (1u << 24) /* of all workers together; a worker whose share is full stops early */

struct bench_options {
	const char *server;
	int64_t n_clients, seconds, n_inflight, timeout;
	struct scene_wish scene;
	struct view_wish view;
	struct quality_wish quality;
	struct psr_msg_frame frame; /* all fields but the camera */
};

/* Warm workers wait here for the last one; then all start, or none if one failed. */
struct bench_gate {
	pthread_mutex_t lock;
	pthread_cond_t changed;
	int64_t n_ready;
	int state; /* 0 closed, 1 measure, -1 go home */
};

struct bench_worker {
	const struct bench_options *options;
	struct bench_gate *gate;
	int64_t index;
	pthread_t thread;
	struct psr_client *client;
	struct psr_msg_frame frame;
	struct scene *scene;
	struct psr_camera start; /* where the camera begins its flight around its target */
	double up[3];
	uint64_t n_asked;
	/* results */
	uint32_t *sample_us; /* latency of each frame that was requested within the time; bench_run() frees it */
	size_t n_samples, samples_capacity;
	uint64_t n_frames, n_bytes; /* frames that arrived within the time, and their bytes */
	uint64_t n_failed, elapsed_ns;
	int setup_code;             /* PSR_OK, or why the worker did not measure */
	struct psr_error first_error; /* code 0: none */
};

void *bench_worker_run(void *worker);

struct bench_result {
	double frames_per_s, mb_per_s;
	uint64_t n_frames, n_samples, n_failed;
	double p50_ms, p90_ms, p99_ms, max_ms; /* 0 without samples */
};

/* Runs all workers for the given time. Reports workers that failed on standard error. */
int bench_run(struct bench_result *result, const struct bench_options *options, struct psr_error *err);

#endif
