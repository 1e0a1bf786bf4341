/* psr bench: many connections to a server from a few threads, and what they measure. */
#ifndef PSR_CLIENT_BENCH_BENCH_H
#define PSR_CLIENT_BENCH_BENCH_H

#include "measure.h"
#include "plan.h"

#define BENCH_MAX_CLIENTS 100000
#define BENCH_MAX_THREADS 256
#define BENCH_DRAIN_NS UINT64_C(5000000000) /* for what is under way at the end, unless n_frames are asked for */

struct bench_load { /* how a plan's requests are offered */
	const char *server;
	int64_t n_clients, n_threads;
	int64_t n_inflight;    /* closed loop: each client's requests under way */
	double rate;           /* open loop: requests a second of all clients; 0: closed */
	int is_poisson, is_view, is_decoded;
	double warmup, seconds;
	int64_t n_frames;      /* 0: `seconds` decide; else the load ends with so many requests */
	int64_t timeout;       /* seconds */
	int64_t keep;          /* every so many-th answer is kept in bench_result; 0: none */
};

struct bench_kept { /* an answer */
	uint64_t due_ns, latency_ns, bytes, hash, k; /* due_ns: since measuring began; hash: of the colour; k: of
	                                              * bench_plan_camera() */
	uint32_t client, kind;
	enum conn_outcome outcome;
	int code; /* FAILED: enum psr_err */
	uint16_t pass;
	struct psr_msg_settings settings; /* it was drawn with */
	uint8_t has_hash;
};

struct bench_result {
	struct bench_load load;
	struct measure measure;   /* of requests that were due while it measured */
	double seconds;           /* it measured */
	uint64_t n_drawn, n_bytes; /* arrived while it measured */
	double fairness;          /* Jain's index */
	double processor_s;       /* that this program's threads worked meanwhile */
	struct psr_error first_error; /* of a connection that was lost; code 0: none was */
	uint64_t n_lost;          /* connections */
	struct measure_row *row;  /* one a second */
	size_t n_rows;
	struct bench_kept *kept;
	size_t n_kept;
};

/* Opens all connections, then loads the server. on_row (may be NULL) is called each second. bench_result_fini() is due
 * also after an error. CONNECTION, LIMIT (file descriptors), MEMORY, and what the server refuses. */
int bench_run(struct bench_result *result, const struct bench_plan *plan, const struct bench_load *load,
              void (*on_row)(const struct measure_row *row), struct psr_error *err);
void bench_result_fini(struct bench_result *result);

/* Returns frames (or requests) that arrived a second. */
double bench_rate(const struct bench_result *result);

#endif
