/* What a laser scan tells of its points, on the way to leaves. */
#ifndef PSR_OCTREE_BUILD_SCAN_H
#define PSR_OCTREE_BUILD_SCAN_H

#include <stdlib.h>
#include "build.h"
#include "runs.h"

/* Of the points of a leaf. */
struct scan_sum {
	uint64_t intensity;
	struct scan_record first;
	int has_first;
};

/* Gives an array of leaves room for n. 0 without memory: the array is as it was. */
#define leaves_grow(array, n)                                          \
	({                                                                  \
		void *grown_ = realloc(*(array), (n) * sizeof **(array));       \
                                                                        \
		if (grown_ != NULL)                                             \
			*(array) = grown_;                                          \
		grown_ != NULL;                                                 \
	})

int scan_grow(struct octree_scan *scan, unsigned streams, uint64_t n); /* 0 without memory */

/* Fills all but `record`. time: the least and the greatest of all points. */
void scan_of_point(struct scan_record *scan, const struct octree_point *point, const double time[2]);

/* Adds a point, in the order of the source. */
static inline void scan_add(struct scan_sum *sum, const struct scan_record *record)
{
	sum->intensity += record->intensity;
	if (!sum->has_first)
		sum->first = *record;
	sum->has_first = 1;
}

void scan_put(struct octree_scan *scan, uint64_t leaf, const struct scan_sum *sum, uint64_t n); /* n: its points */

/* Gives up streams of zeros, and makes the scale of times. 0 without memory. */
int scan_end(struct octree *tree, const double time[2]);

#endif
