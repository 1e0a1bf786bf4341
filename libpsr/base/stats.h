/* Percentiles of measurements. */
#ifndef PSR_BASE_STATS_H
#define PSR_BASE_STATS_H

#include <stddef.h>

void stats_sort(double *v, size_t n);

/* The least value that this part (0..1) of all do not exceed; 0 of none. */
double stats_percentile(const double *sorted, size_t n, double part);

/* Sorts them; n >= 1. The mean of the middle two of an even number. */
double stats_median(double *v, size_t n);

#endif
