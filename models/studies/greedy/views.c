#include "base/maths.h"
#include "base/vec.h"
#include "parts.h"
#include "base/direction.h"

static int is_known(double (*direction)[3], int n, const double wanted[3])
{
	for (int i = 0; i < n; i++)
		if (v3d_dot(direction[i], wanted) > 1 - 1e-9)
			return 1;
	return 0;
}

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

/* Each is followed by its opposite, as the first two of [G] 5.2 are; views far apart come first. */
static int add_centers(double (*direction)[3])
{
	int n = 0;

	for (unsigned child = 0; child < 4; child++) {
		for (unsigned octant = 0; octant < 4; octant++) {
			psr_direction_center(1, 4 * octant + child, direction[n++]);
			psr_direction_center(1, 4 * (7 - octant) + child, direction[n++]);
		}
	}
	return n;
}

/* The four (0, +-a, +-b) and their cyclic permutations. */
static int add_rectangles(double (*direction)[3], int n, double a, double b)
{
	for (int axis = 0; axis < 3; axis++) {
		for (int signs = 0; signs < 4; signs++, n++) {
			direction[n][axis] = 0;
			direction[n][(axis + 1) % 3] = (signs & 1) != 0 ? -a : a;
			direction[n][(axis + 2) % 3] = (signs & 2) != 0 ? -b : b;
			v3d_normalize(direction[n], direction[n]);
		}
	}
	return n;
}

static int add_icosahedral(double (*direction)[3])
{
	const double golden = 1.6180339887498949;
	int n = add_rectangles(direction, 0, 1, golden);

	for (int signs = 0; signs < 8; signs++, n++) {
		v3d_set(direction[n], (signs & 1) != 0 ? -1 : 1, (signs & 2) != 0 ? -1 : 1, (signs & 4) != 0 ? -1 : 1);
		v3d_normalize(direction[n], direction[n]);
	}
	return add_rectangles(direction, n, golden, 1 / golden);
}

void greedy_make_views(struct greedy *greedy)
{
	double direction[GREEDY_MOST_VIEWS][3], sine, cosine;
	int n = 0;

	psr_sincos(greedy->options.tolerance, &sine, &cosine);
	if (greedy->options.directions == GREEDY_ICOSAHEDRAL) {
		n = add_icosahedral(direction);
	} else {
		n = add_centers(direction);
	}
	if (greedy->options.directions == GREEDY_CORNERS) {
		for (int level = 0; level < 3; level++)
			n = add_corners(direction, n, level);
		greedy->n_scouts = -n;
		n = add_corners(direction, n, 3);
		greedy->n_scouts += n;
	}
	greedy->n_views = n;
	for (int i = 0; i < n; i++) {
		double frame[3][3];

		psr_direction_basis(direction[i], frame);
		for (int k = 0; k < 9; k++)
			greedy->view[i].projection.axis[k / 3][k % 3] = (float)frame[k / 3][k % 3];
		greedy->view[i].projection.spacing = (float)(greedy->ds * cosine);
	}
}
