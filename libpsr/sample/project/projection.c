#include <math.h>
#include "base/direction.h"
#include "base/maths.h"
#include "base/vec.h"
#include "projection.h"

/* Turned a little: built things have normals along the axes and halfway between, as far from one direction as from the
 * next. */
static const double TURN[3][3] = {
	{ 0.9744706, -0.1910647, 0.1184155 },
	{ 0.2079117, 0.9657151, -0.1552459 },
	{ -0.0846937, 0.1759021, 0.9807574 },
};

static int add_pair(double direction[N_PROJECTIONS][3], int n, double x, double y, double z)
{
	v3d_set(direction[n], x, y, z);
	v3d_set(direction[n + 1], -x, -y, -z);
	return n + 2;
}

static int list_directions(double direction[N_PROJECTIONS][3])
{
	const double golden = (1 + sqrt(5.0)) / 2;
	int n = 0;

	for (int sign = -1; sign <= 1; sign += 2) {
		n = add_pair(direction, n, 0, 1, sign * golden);
		n = add_pair(direction, n, 0, golden, sign / golden);
		n = add_pair(direction, n, sign * golden, 0, 1);
		n = add_pair(direction, n, sign / golden, 0, golden);
		n = add_pair(direction, n, 1, sign * golden, 0);
		n = add_pair(direction, n, golden, sign / golden, 0);
		n = add_pair(direction, n, sign, 1, 1);
		n = add_pair(direction, n, sign, 1, -1);
	}
	return n;
}

void projection_list(struct psr_projection list[N_PROJECTIONS], double ds, double tolerance)
{
	double direction[N_PROJECTIONS][3], turn[3][3], sine, cosine;
	int n = list_directions(direction);

	/* TURN's rows are rounded: this makes them orthonormal. */
	v3d_normalize(turn[0], TURN[0]);
	v3d_cross(turn[2], turn[0], TURN[1]);
	v3d_normalize(turn[2], turn[2]);
	v3d_cross(turn[1], turn[2], turn[0]);
	psr_sincos(tolerance, &sine, &cosine);
	for (int i = 0; i < n; i++) {
		double basis[3][3], turned[3];

		m3d_apply(turned, (const double(*)[3])turn, direction[i]);
		v3d_normalize(turned, turned);
		psr_direction_basis(turned, basis);
		for (int k = 0; k < 9; k++)
			list[i].axis[k / 3][k % 3] = (float)basis[k / 3][k % 3];
		list[i].spacing = (float)(ds * cosine);
	}
}
