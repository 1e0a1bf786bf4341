#include <math.h>
#include "scan.h"

int scan_grow(struct octree_scan *scan, unsigned streams, uint64_t n)
{
	return (!(streams >> OCTREE_INTENSITY & 1) || leaves_grow(&scan->intensity, n))
	       && (!(streams >> OCTREE_CLASS & 1) || leaves_grow(&scan->class, n))
	       && (!(streams >> OCTREE_RETURNS & 1) || leaves_grow(&scan->returns, n))
	       && (!(streams >> OCTREE_TIME & 1) || leaves_grow(&scan->time, n));
}

void scan_of_point(struct scan_record *scan, const struct octree_point *point, const double time[2])
{
	const double range = time[1] - time[0];

	*scan = (struct scan_record){ .intensity = point->intensity, .class = point->class, .returns = point->returns };
	/* A source that changes between its readings has others. */
	if (range > 0 && point->time >= time[0] && point->time <= time[1])
		scan->time = (uint32_t)floor((point->time - time[0]) / range * UINT32_MAX + 0.5);
}

void scan_put(struct octree_scan *scan, uint64_t leaf, const struct scan_sum *sum, uint64_t n)
{
	if (scan->intensity != NULL)
		scan->intensity[leaf] = (uint16_t)((sum->intensity + n / 2) / n);
	if (scan->class != NULL)
		scan->class[leaf] = sum->first.class;
	if (scan->returns != NULL)
		scan->returns[leaf] = sum->first.returns;
	if (scan->time != NULL)
		scan->time[leaf] = sum->first.time;
}

/* Frees an array that has nothing but zeros. */
#define give_up_zeros(array, n)                                  \
	do {                                                          \
		uint64_t i_ = 0;                                          \
                                                                  \
		while (*(array) != NULL && i_ < (n) && (*(array))[i_] == 0) \
			i_++;                                                 \
		if (i_ == (n)) {                                          \
			free(*(array));                                       \
			*(array) = NULL;                                      \
		}                                                         \
	} while (0)

int scan_end(struct octree *tree, const double time[2])
{
	struct octree_scan *scan = &tree->scan;

	give_up_zeros(&scan->intensity, tree->n_leaves);
	give_up_zeros(&scan->class, tree->n_leaves);
	give_up_zeros(&scan->returns, tree->n_leaves);
	/* One time of all points may be any but 0, which files have that know none. */
	if (scan->time != NULL && !(time[0] <= time[1] && (time[0] < time[1] || time[0] != 0))) {
		free(scan->time);
		scan->time = NULL;
	}
	if (scan->time == NULL)
		return 1;
	scan->time_scale = malloc(sizeof *scan->time_scale);
	if (scan->time_scale == NULL)
		return 0;
	(*scan->time_scale)[0] = time[0];
	(*scan->time_scale)[1] = (time[1] - time[0]) / UINT32_MAX;
	return 1;
}
