#include "histogram.h"
#include <math.h>

#define BUCKETS (UINT64_C(1) << HISTOGRAM_BITS) /* of an octave; smaller times have a bucket each */

size_t histogram_bucket(uint64_t ns)
{
	unsigned shift;

	if (ns < BUCKETS)
		return ns;
	if (ns > HISTOGRAM_MAX)
		ns = HISTOGRAM_MAX;
	shift = 63 - (unsigned)__builtin_clzll(ns) - HISTOGRAM_BITS;
	return (size_t)(shift * BUCKETS + (ns >> shift));
}

uint64_t histogram_value(size_t bucket)
{
	const unsigned shift = bucket < 2 * BUCKETS ? 0 : (unsigned)(bucket / BUCKETS) - 1;

	return ((bucket - shift * BUCKETS) << shift) + ((UINT64_C(1) << shift) >> 1);
}

void histogram_add(struct histogram *histogram, uint64_t ns)
{
	if (histogram->n == 0 || ns < histogram->min)
		histogram->min = ns;
	if (ns > histogram->max)
		histogram->max = ns;
	histogram->n++;
	histogram->sum += (double)ns;
	histogram->count[histogram_bucket(ns)]++;
}

void histogram_merge(struct histogram *to, const struct histogram *from)
{
	if (from->n == 0)
		return;
	if (to->n == 0 || from->min < to->min)
		to->min = from->min;
	if (from->max > to->max)
		to->max = from->max;
	to->n += from->n;
	to->sum += from->sum;
	for (size_t i = 0; i < HISTOGRAM_BUCKETS; i++)
		to->count[i] += from->count[i];
}

uint64_t histogram_percentile(const struct histogram *histogram, double part)
{
	const double rank = ceil(part * (double)histogram->n);
	const uint64_t wanted = rank < 1 ? 1 : rank < (double)histogram->n ? (uint64_t)rank : histogram->n;
	uint64_t passed = 0;
	size_t i = 0;

	if (histogram->n == 0)
		return 0;
	if (wanted == histogram->n)
		return histogram->max;
	while (passed + histogram->count[i] < wanted)
		passed += histogram->count[i++];
	passed = histogram_value(i);
	return passed < histogram->min ? histogram->min : passed > histogram->max ? histogram->max : passed;
}

double histogram_mean(const struct histogram *histogram)
{
	return histogram->n > 0 ? histogram->sum / (double)histogram->n : 0;
}
