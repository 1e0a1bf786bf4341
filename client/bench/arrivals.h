/* When the requests of an open loop are due: at a constant rate, or at random (Poisson). Pure. */
#ifndef PSR_CLIENT_BENCH_ARRIVALS_H
#define PSR_CLIENT_BENCH_ARRIVALS_H

#include <stdint.h>

struct arrivals {
	uint64_t start_ns, random, n; /* n: how many have been */
	double rate, first, next;     /* a second; seconds from the start to the first and to the next */
	int is_poisson;
};

/* Begins at start_ns; the first is due `first` (0..1) of a period later, or at random. rate > 0. */
void arrivals_init(struct arrivals *arrivals, uint64_t start_ns, double rate, double first);
void arrivals_set_poisson(struct arrivals *arrivals, uint64_t seed);

uint64_t arrivals_due(const struct arrivals *arrivals); /* of the next one */
void arrivals_advance(struct arrivals *arrivals);       /* it has been */

#endif
