#include <assert.h>
#include "../base/maths.h"
#include "../base/vec.h"
#include "projection.h"
#include "psr/direction.h"

static int is_known(double (*direction)[3], int n, const double wanted[3])
{
	for (int i = 0; i < n; i++)
		if (v3d_dot(direction[i], wanted) > 1 - 1e-9)
			return 1;
	return 0;
}

/* Coarse corners before fine ones. */
static int add_corners(double (*direction)[3], int n, int level)
{
	for (unsigned i = 0; i < 8u << 2 * level; i++) {
		double corner[3][3];

		psr_direction_corners(level, i, corner);
		for (int k = 0; k < 3; k++)
			if (!is_known(direction, n, corner[k]))
				v3d_set(direction[n++], corner[k][0], corner[k][1], corner[k][2]);
	}
	return n;
}

void projection_list(struct psr_projection list[MOST_PROJECTIONS], double ds, double tolerance)
{
	double direction[MOST_PROJECTIONS][3], sine, cosine;
	int n = 0;

	psr_sincos(tolerance, &sine, &cosine);
	for (; n < PSR_PROJECTIONS; n++)
		psr_direction_center(1, (unsigned)n, direction[n]);
	for (int level = 0; level < 4; level++)
		n = add_corners(direction, n, level);
	assert(n == MOST_PROJECTIONS);
	for (int i = 0; i < n; i++) {
		double frame[3][3];

		psr_direction_frame(direction[i], frame);
		for (int k = 0; k < 9; k++)
			list[i].axis[k / 3][k % 3] = (float)frame[k / 3][k % 3];
		list[i].spacing = (float)(ds * cosine);
	}
}
