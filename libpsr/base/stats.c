#include <math.h>
#include <stdlib.h>
#include "stats.h"

static int compare(const void *a, const void *b)
{
	double x = *(const double *)a, y = *(const double *)b;

	return (x > y) - (x < y);
}

void stats_sort(double *v, size_t n)
{
	if (n > 0)
		qsort(v, n, sizeof *v, compare);
}

double stats_percentile(const double *sorted, size_t n, double part)
{
	size_t rank = (size_t)ceil(part * (double)n);

	return n == 0 ? 0 : sorted[rank > 0 ? rank - 1 : 0];
}

double stats_median(double *v, size_t n)
{
	stats_sort(v, n);
	return (v[(n - 1) / 2] + v[n / 2]) / 2;
}
