/* What is counted of the answers to a load. */
#ifndef PSR_CLIENT_BENCH_MEASURE_H
#define PSR_CLIENT_BENCH_MEASURE_H

#include "conn.h"
#include "base/histogram.h"

#define MEASURE_STAGES (PSR_WIRE_REPORT_CORES + 1) /* by enum psr_wire_report_id */
#define MEASURE_CODES (-PSR_ERR_INTERNAL + 1)      /* by the negative of enum psr_err */

struct measure {
	struct histogram latency; /* from the intended time to the last byte; unfinished requests: so far */
	struct histogram waited;  /* from the intended time until it was sent, of requests that had to wait for others */
	struct histogram first;   /* from the intended time to the first byte */
	struct histogram decode;
	struct histogram stage[MEASURE_STAGES]; /* as the server reports them */
	struct histogram server; /* queue and total of a frame together: latency by the server's clock */
	uint64_t n_budgets, n_within; /* pictures with a budget of time or error; of these: kept */
	uint64_t n_bytes, n_superseded, n_unfinished, n_failed[MEASURE_CODES];
	char first_failure[256]; /* what the server said of a failed request, the first of a thread; "": nothing */
};

/* Adds the answer to a request; now_ns: when its last bytes were read. */
void measure_add(struct measure *measure, const struct conn_request *request, const struct conn_answer *answer,
                 uint64_t now_ns);
void measure_merge(struct measure *to, const struct measure *from);
uint64_t measure_failed(const struct measure *measure); /* of all codes, CANCELLED among them */

const char *measure_stage_name(unsigned id); /* NULL: it is none */

/* A second of a load, or the rest of one. */
struct measure_row {
	double seconds, length_s; /* since the load is measured; how long it was */
	uint64_t n_drawn, n_bytes, n_superseded, n_failed, n_waiting;
	uint64_t p50_ns, p99_ns, max_ns; /* of the requests answered in it */
};

/* Jain's index of how evenly n clients were served: 1 if all got the same, 1/n if one got all; 1 without frames. */
double measure_fairness(const uint64_t *n_drawn, size_t n);

#endif
