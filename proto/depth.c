#include <math.h>
#include "proto.h"

#define STEPS 65534.0 /* between both ends of the range */
#define NOTHING 65535

struct psr_depth_range psr_depth_range_of(const struct psr_msg_frame *frame)
{
	return (struct psr_depth_range){ .min = frame->depth_min, .max = frame->depth_max,
		                             .is_linear = frame->camera.kind == PSR_CAMERA_ORTHOGRAPHIC };
}

/* A step is added as a half and cut off, so that no rounding mode matters; comparisons come last, so that both ends are
 * exact. Inlined once for each kind, which leaves plain loops. */
static inline void quantise(uint16_t *q, const float *z, size_t n, const struct psr_depth_range *range, int is_inverse)
{
	const double min = range->min, max = range->max;
	const double first = is_inverse ? 1 / min : min, k = STEPS / (is_inverse ? first - 1 / max : max - min);

	for (size_t i = 0; i < n; i++) {
		const double d = (double)z[i];
		double t = (is_inverse ? first - 1 / d : d - first) * k + 0.5;

		t = d > min ? t : 0;
		t = d < max ? t : STEPS;
		q[i] = (uint16_t)(z[i] == INFINITY ? NOTHING : (int)t);
	}
}

void psr_depth_quantise(uint16_t *q, const float *z, size_t n, const struct psr_depth_range *range)
{
	if (range->is_linear)
		quantise(q, z, n, range, 0);
	else
		quantise(q, z, n, range, 1);
}

void psr_depth_restore(float *z, const uint16_t *q, size_t n, const struct psr_depth_range *range)
{
	const double min = range->min, max = range->max;

	for (size_t i = 0; i < n; i++) {
		const double t = q[i] / STEPS;
		double d = range->is_linear ? min + (max - min) * t : 1 / ((1 - t) / min + t / max);

		d = q[i] == 0 ? min : q[i] == NOTHING - 1 ? max : d;
		z[i] = q[i] == NOTHING ? INFINITY : (float)d;
	}
}
