#include "base/vec.h"
#include "cone.h"
#include "render/render.h"

/* Normals and axis are rounded to floats: their product is off by some 2^-22. */
#define SLACK 0x1p-20

/* A smaller value is rounding of doubles. */
#define OUTSIDE 0x1p-48

struct cap {
	double axis[3], cosine;
};

static void normal_at(const float (*normal)[3], int i, double v[3])
{
	v3d_set(v, (double)normal[i][0], (double)normal[i][1], (double)normal[i][2]);
}

static void cap_of_two(struct cap *cap, const double a[3], const double b[3])
{
	v3d_add(cap->axis, a, b);
	v3d_normalize(cap->axis, cap->axis);
	cap->cosine = v3d_dot(cap->axis, a);
}

/* Finds the circle through three points of the sphere, or two if some coincide. */
static void cap_of_three(struct cap *cap, const double a[3], const double b[3], const double c[3])
{
	double ab[3], ac[3];

	v3d_sub(ab, b, a);
	v3d_sub(ac, c, a);
	v3d_cross(cap->axis, ab, ac);
	if (v3d_normalize(cap->axis, cap->axis) == 0) {
		cap_of_two(cap, a, v3d_dot(ab, ab) > v3d_dot(ac, ac) ? b : c);
		return;
	}
	cap->cosine = v3d_dot(cap->axis, a);
	if (cap->cosine < 0) {
		v3d_scale(cap->axis, cap->axis, -1);
		cap->cosine = -cap->cosine;
	}
}

static int is_outside(const struct cap *cap, const double v[3])
{
	return v3d_dot(cap->axis, v) < cap->cosine - OUTSIDE;
}

/* [G] 6.4: two or three of the normals bound the smallest cap. Welzl's rule: a normal outside of the cap of all earlier
 * ones is on the rim of the cap that holds it, too. */
static void smallest_cap(struct cap *cap, const float (*normal)[3], int n)
{
	double a[3], b[3], c[3];

	normal_at(normal, 0, cap->axis);
	cap->cosine = v3d_dot(cap->axis, cap->axis);
	for (int i = 1; i < n; i++) {
		normal_at(normal, i, a);
		if (!is_outside(cap, a))
			continue;
		v3d_set(cap->axis, a[0], a[1], a[2]);
		cap->cosine = v3d_dot(a, a);
		for (int j = 0; j < i; j++) {
			normal_at(normal, j, b);
			if (!is_outside(cap, b))
				continue;
			cap_of_two(cap, a, b);
			for (int k = 0; k < j; k++) {
				normal_at(normal, k, c);
				if (is_outside(cap, c))
					cap_of_three(cap, a, b, c);
			}
		}
	}
}

static double least_cosine(const float (*normal)[3], int n, const double axis[3])
{
	double least = 1;

	for (int i = 0; i < n; i++) {
		double c = 0;

		for (int k = 0; k < 3; k++)
			c += axis[k] * (double)normal[i][k];
		least = c < least ? c : least;
	}
	return least;
}

void cone_bound(const float (*normal)[3], int n, float axis[3], float *cosine)
{
	struct cap cap;
	double least = -1;

	if (n > 0) {
		smallest_cap(&cap, normal, n);
		v3f_set(axis, (float)cap.axis[0], (float)cap.axis[1], (float)cap.axis[2]);
		v3d_set(cap.axis, (double)axis[0], (double)axis[1], (double)axis[2]);
		least = least_cosine(normal, n, cap.axis) - SLACK;
	}
	if (!(least > 0)) {
		v3f_set(axis, 0, 0, 1);
		least = -1;
	}
	*cosine = (float)least;
}

void cone_pack(const float (*normal)[3], int n, int8_t axis[3], uint8_t *sine)
{
	float bound[3], cosine, greatest = 0;
	double unit[3], least = -1;

	cone_bound(normal, n, bound, &cosine);
	for (int k = 0; k < 3; k++)
		greatest = fmaxf(greatest, fabsf(bound[k]));
	for (int k = 0; k < 3; k++) {
		unit[k] = rint((double)bound[k] / (double)greatest * 127);
		axis[k] = (int8_t)unit[k];
	}
	v3d_normalize(unit, unit);
	if (cosine > 0)
		least = least_cosine(normal, n, unit) - SLACK;
	*sine = least > 0 ? (uint8_t)ceil(sqrt(1 - least * least) * 255) : PSR_CONE_ANY;
}

int cone_culls(const struct psr_blocks *blocks, uint32_t block, const float eye[3], int is_perspective)
{
	float g = 0, length2 = 0, axis2 = 0, center[3], radius, r;

	if (blocks->cone_sine == NULL || blocks->cone_sine[block] == PSR_CONE_ANY
	    || (blocks->flags[block] & PSR_BLOCK_TWO_SIDED) != 0)
		return 0;
	const float axis[3] = { blocks->cone_x[block], blocks->cone_y[block], blocks->cone_z[block] };

	psr_blocks_sphere(blocks, block, center, &radius);
	r = is_perspective ? radius : 0;
	for (int k = 0; k < 3; k++) {
		float d = is_perspective ? center[k] - eye[k] : -eye[k];

		g += d * axis[k];
		length2 += d * d;
		axis2 += axis[k] * axis[k];
	}
	return g / sqrtf(axis2) >
	       ((float)blocks->cone_sine[block] / 255 + BACK_SINE) * sqrtf(length2) + r * (1 + BACK_SINE);
}
