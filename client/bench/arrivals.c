#include "arrivals.h"
#include <math.h>
#include "base/random.h"

/* Seconds between two events that do not know of each other. */
static double gap(struct arrivals *arrivals)
{
	return -log(1 - random_in(&arrivals->random, 0, 1)) / arrivals->rate;
}

void arrivals_init(struct arrivals *arrivals, uint64_t start_ns, double rate, double first)
{
	*arrivals = (struct arrivals){ .start_ns = start_ns, .rate = rate, .first = first / rate, .next = first / rate };
}

void arrivals_set_poisson(struct arrivals *arrivals, uint64_t seed)
{
	arrivals->is_poisson = 1;
	arrivals->random = seed;
	arrivals->next = gap(arrivals);
}

uint64_t arrivals_due(const struct arrivals *arrivals)
{
	return arrivals->start_ns + (uint64_t)(arrivals->next * 1e9);
}

/* Constant gaps are multiplied, not summed: no error grows. */
void arrivals_advance(struct arrivals *arrivals)
{
	arrivals->n++;
	if (arrivals->is_poisson)
		arrivals->next += gap(arrivals);
	else
		arrivals->next = arrivals->first + (double)arrivals->n / arrivals->rate;
}
