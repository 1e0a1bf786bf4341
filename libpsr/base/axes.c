#include <math.h>
#include "axes.h"

/* Rotates rows p and q of the symmetric m (and v) so that m[p][q] becomes 0 (Jacobi). */
static void rotate(double m[3][3], double v[3][3], int p, int q)
{
	double theta, t, c, s;

	if (m[p][q] == 0.0)
		return;
	theta = (m[q][q] - m[p][p]) / (2.0 * m[p][q]);
	t = (theta >= 0.0 ? 1.0 : -1.0) / (fabs(theta) + sqrt(theta * theta + 1.0));
	c = 1.0 / sqrt(t * t + 1.0);
	s = t * c;
	for (int i = 0; i < 3; i++) {
		double a = m[i][p], b = m[i][q];

		m[i][p] = c * a - s * b;
		m[i][q] = s * a + c * b;
	}
	for (int i = 0; i < 3; i++) {
		double a = m[p][i], b = m[q][i];

		m[p][i] = c * a - s * b;
		m[q][i] = s * a + c * b;
		a = v[p][i];
		b = v[q][i];
		v[p][i] = c * a - s * b;
		v[q][i] = s * a + c * b;
	}
}

/* Off-diagonal elements shrink quadratically: three sweeps nearly always suffice, and below 1e-12 of the trace they
 * turn no axis by a float's precision. */
void axes_find(double m[3][3], double v[3][3])
{
	const double least = 1e-12 * (m[0][0] + m[1][1] + m[2][2]);

	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			v[i][j] = i == j;
	for (int sweep = 0; sweep < 8; sweep++) {
		if (fabs(m[0][1]) <= least && fabs(m[0][2]) <= least && fabs(m[1][2]) <= least)
			return;
		rotate(m, v, 0, 1);
		rotate(m, v, 0, 2);
		rotate(m, v, 1, 2);
	}
}
