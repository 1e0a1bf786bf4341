#include "../base/vec.h"
#include "cone.h"

/* Normals and axis are rounded to floats: their product is off by some 2^-22. */
#define SLACK 0x1p-20f

void cone_bound(const float (*normal)[3], int n, float axis[3], float *cosine)
{
	float sum[3] = { 0, 0, 0 }, least = 1;

	for (int i = 0; i < n; i++)
		v3f_add(sum, sum, normal[i]);
	*cosine = -1;
	if (!(v3f_normalize(axis, sum) > 0.001f)) {
		v3f_set(axis, 0, 0, 1);
		return;
	}
	for (int i = 0; i < n; i++) {
		float c = v3f_dot(axis, normal[i]);

		least = c < least ? c : least;
	}
	*cosine = least - SLACK > -1 ? least - SLACK : -1;
}
