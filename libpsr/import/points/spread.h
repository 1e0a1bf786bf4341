/* Part of a file's points, in runs that are evenly spread over it. */
#ifndef PSR_IMPORT_POINTS_SPREAD_H
#define PSR_IMPORT_POINTS_SPREAD_H

#include <stdint.h>

#define SPREAD_RUN 512 /* points */

/* Returns how many runs there are for each that is read, so that at most `most` of n points and a run more are. */
static inline uint64_t spread_step(uint64_t n, uint64_t most)
{
	return most == 0 || n <= most ? 1 : n / most + (n % most != 0);
}

/* Returns the point behind the one before `next`. */
static inline uint64_t spread_next(uint64_t step, uint64_t next)
{
	return step == 1 || next % SPREAD_RUN != 0 ? next : next + (step - 1) * SPREAD_RUN;
}

#endif
