/* Counts of times in buckets of bounded relative width, after HDR Histogram: one of 37 KB holds any number of times. */
#ifndef PSR_BASE_HISTOGRAM_H
#define PSR_BASE_HISTOGRAM_H

#include <stddef.h>
#include <stdint.h>

#define HISTOGRAM_BITS 7   /* 128 buckets for each power of two */
#define HISTOGRAM_OCTAVES 42
#define HISTOGRAM_BUCKETS ((HISTOGRAM_OCTAVES - HISTOGRAM_BITS + 1) << HISTOGRAM_BITS)
#define HISTOGRAM_MAX ((UINT64_C(1) << HISTOGRAM_OCTAVES) - 1) /* 73 minutes of nanoseconds; greater ones count as it */
#define HISTOGRAM_ERROR (1.0 / 256) /* of a percentile, at most: a bucket reports its middle */

struct histogram { /* zeroed at first */
	uint64_t n, min, max; /* min and max are exact; 0 without times */
	double sum;
	uint64_t count[HISTOGRAM_BUCKETS];
};

void histogram_add(struct histogram *histogram, uint64_t ns);
void histogram_merge(struct histogram *to, const struct histogram *from);

/* The least time that is not below this part (0..1) of all times, off by HISTOGRAM_ERROR of itself at most; 0 without
 * times. */
uint64_t histogram_percentile(const struct histogram *histogram, double part);
double histogram_mean(const struct histogram *histogram); /* exact; 0 without times */

/* The middle of a bucket, and the bucket of a time: 0..HISTOGRAM_BUCKETS - 1. */
uint64_t histogram_value(size_t bucket);
size_t histogram_bucket(uint64_t ns);

#endif
