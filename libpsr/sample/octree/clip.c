#include <string.h>
#include "of_mesh.h"
#include "base/vec.h"

/* Keeps what is on the side of a plane: sign * (x[axis] - at) >= 0. */
static void cut(struct clip *clip, int axis, double at, double sign)
{
	const struct clip in = *clip;

	clip->n = 0;
	for (int i = 0; i < in.n; i++) {
		const double *a = in.corner[i], *b = in.corner[(i + 1) % in.n];
		const double da = sign * (a[axis] - at), db = sign * (b[axis] - at);
		double *to;

		if (da >= 0.0)
			memcpy(clip->corner[clip->n++], a, sizeof in.corner[0]);
		if ((da >= 0.0) == (db >= 0.0))
			continue;
		to = clip->corner[clip->n++];
		for (int c = 0; c < 3; c++)
			to[c] = c == axis ? at : a[c] + (b[c] - a[c]) * (da / (da - db));
	}
}

void clip_triangle(struct clip *clip, const double corner[3][3])
{
	clip->n = 3;
	memcpy(clip->corner, corner, 3 * sizeof *corner);
	for (int axis = 0; axis < 3; axis++) {
		cut(clip, axis, 0.0, 1.0);
		cut(clip, axis, 1.0, -1.0);
	}
	if (clip->n < 3)
		clip->n = 0;
}

double clip_fan(const struct clip *clip, int i, double centroid[3])
{
	double a[3], b[3], n[3];

	v3d_sub(a, clip->corner[i + 1], clip->corner[0]);
	v3d_sub(b, clip->corner[i + 2], clip->corner[0]);
	v3d_cross(n, a, b);
	for (int c = 0; c < 3; c++)
		centroid[c] = clip->corner[0][c] + (a[c] + b[c]) / 3.0;
	return 0.5 * v3d_length(n);
}

int clip_is_next_ones(const struct clip *clip, unsigned is_last)
{
	for (int c = 0; c < 3; c++) {
		int n = 0;

		while (n < clip->n && clip->corner[n][c] == 1.0)
			n++;
		if (n == clip->n && !(is_last >> c & 1))
			return 1;
	}
	return 0;
}
