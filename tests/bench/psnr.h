/* How near a picture comes to the truth: for benchmarks that warp. */
#ifndef TESTS_BENCH_PSNR_H
#define TESTS_BENCH_PSNR_H

#include <math.h>
#include <stdlib.h>
#include "compare/compare.h"
#include "psr/frame.h"
#include "report.h"

/* dB, over the pixels where the truth has a surface. */
static inline double psnr(const struct psr_frame *truth, const uint8_t *rgb)
{
	const size_t n = (size_t)truth->width * truth->height;
	uint8_t *covered = report_alloc(n, 1);

	for (size_t i = 0; i < n; i++)
		covered[i] = truth->depth[i] < INFINITY;
	const double db = compare_psnr(rgb, truth->rgb, covered, n);

	free(covered);
	return db;
}

#endif
