/* Percentiles of measurements. */
#ifndef PSR_BASE_STATS_H
#define PSR_BASE_STATS_H

#include <stddef.h>

void stats_sort(double *v, size_t n);

/* Returns the least value that is not below this part (0..1) of all values; 0 if there are none. */
double stats_percentile(const double *sorted, size_t n, double part);

/* Sorts the values, n >= 1, and returns the median: the mean of the middle two of an even number. */
double stats_median(double *v, size_t n);

#endif
