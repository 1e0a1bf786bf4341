/* Loads one after another: a row of them, or a search for the greatest one that a server carries. */
#ifndef PSR_CLIENT_BENCH_SWEEP_H
#define PSR_CLIENT_BENCH_SWEEP_H

#include <cjson/cJSON.h>
#include "bench.h"

#define SWEEP_MAX 64

struct sweep {
	int is_rate;       /* 1: of requests a second, an open loop; 0: of clients */
	double low, high;
	uint32_t n;        /* points, at equal ratios; clients are rounded */
};

/* "clients=1..64", "rate=10..1000", either followed by "/N" for N points; 7 otherwise. ARG. */
int sweep_parse(struct sweep *sweep, const char *text, struct psr_error *err);

struct sweep_point {
	double load;       /* clients, or requests a second */
	double frames_per_s, mean_ms;
	struct { double p50, p99; } ms;
	uint64_t n_failed, n_unfinished;
	int is_good;       /* of a search: it held the limit */
};

struct sweep_points {
	struct sweep_point point[SWEEP_MAX];
	uint32_t n;
	int knee;          /* the point with the most frames/s for its mean latency (Kleinrock's power); -1: none */
};

/* Runs all points, and calls on_point after each. The errors of bench_run(). */
int sweep_run(struct sweep_points *points, const struct sweep *sweep, const struct bench_plan *plan,
              const struct bench_load *load, void (*on_point)(const struct sweep *, const struct sweep_point *),
              struct psr_error *err);

struct slo { double part; uint64_t limit_ns; char text[40]; };

/* "p99=50ms": p50, p90, p99, p99.9 or max; a time in us, ms or s. ARG. */
int slo_parse(struct slo *slo, const char *text, struct psr_error *err);

/* Finds the greatest load of the sweep's range that holds the limit, to 5 %: from `low` upwards by doubling, then by
 * halves. It holds if the percentile does, and nothing failed or is unfinished. *best: 0 if even `low` does
 * not hold. */
int slo_search(double *best, struct sweep_points *points, const struct slo *slo, const struct sweep *sweep,
               const struct bench_plan *plan, const struct bench_load *load,
               void (*on_point)(const struct sweep *, const struct sweep_point *), struct psr_error *err);

void sweep_print_head(const struct sweep *sweep);
void sweep_print_point(const struct sweep *sweep, const struct sweep_point *point);
void sweep_print_knee(const struct sweep *sweep, const struct sweep_points *points);
cJSON *sweep_json(const struct sweep *sweep, const struct sweep_points *points, const char *what);

#endif
