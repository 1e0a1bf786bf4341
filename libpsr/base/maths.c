#include "maths.h"

#define HALF_PI 1.57079632679489661923

/* Taylor series on [0, pi/4]; the first omitted terms are below 1e-17. */
static double sin_series(double a)
{
	double q = a * a, term = a, sum = a;

	for (int i = 3; i <= 17; i += 2) {
		term = -term * q / ((i - 1) * i);
		sum += term;
	}
	return sum;
}

static double cos_series(double a)
{
	double q = a * a, term = 1, sum = 1;

	for (int i = 2; i <= 18; i += 2) {
		term = -term * q / ((i - 1) * i);
		sum += term;
	}
	return sum;
}

void psr_sincos(double a, double *s, double *c)
{
	int mirrored = a > HALF_PI;

	if (mirrored)
		a = 2 * HALF_PI - a;
	if (a <= HALF_PI / 2) {
		*s = sin_series(a);
		*c = cos_series(a);
	} else {
		*s = cos_series(HALF_PI - a);
		*c = sin_series(HALF_PI - a);
	}
	if (mirrored)
		*c = -*c;
}
