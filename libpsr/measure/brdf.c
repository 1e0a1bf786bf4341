#include <math.h>
#include "base/vec.h"
#include "brdf.h"

#define PI 3.14159265358979323846
#define LEAST_ALPHA 1e-3 /* smoother mirrors would show lights of no size as nothing */
#define LEAST_COSINE 1e-4

static double fifth(double x)
{
	return x * x * x * x * x;
}

/* G / (4 nl nv). */
static double visibility(double nl, double nv, double alpha)
{
	const double a2 = alpha * alpha;

	return 0.5 / (nl * sqrt(nv * nv * (1 - a2) + a2) + nv * sqrt(nl * nl * (1 - a2) + a2));
}

/* Blinn's half-way form, which the MTL format writes down. */
static void reflect_phong(const struct brdf *brdf, double nl, double nh, double out[3])
{
	const double shine = brdf->exponent > 0 ? pow(fmax(nh, 0), brdf->exponent) : 1;

	for (int c = 0; c < 3; c++)
		out[c] = brdf->diffuse[c] * nl + brdf->phong[c] * shine;
}

void brdf_reflect(const struct brdf *brdf, const double n[3], const double v[3], const double l[3], double out[3])
{
	const double nl = v3d_dot(n, l), nv = fmax(v3d_dot(n, v), LEAST_COSINE), alpha = fmax(brdf->alpha, LEAST_ALPHA);
	double h[3];

	v3d_set(out, 0, 0, 0);
	if (!(nl > 0))
		return;
	v3d_add(h, v, l);
	v3d_normalize(h, h);
	const double nh = v3d_dot(n, h), vh = fmin(fmax(v3d_dot(v, h), 0), 1);
	/* 1 - nh^2 by the cross product: the difference would lose a narrow lobe's digits. */
	double across[3];
	v3d_cross(across, n, h);
	const double spread = v3d_dot(across, across) + nh * nh * alpha * alpha;
	const double lobe = nh > 0 ? alpha * alpha / (PI * spread * spread) : 0;
	const double shine = PI * lobe * visibility(nl, nv, alpha) * nl, schlick = fifth(1 - vh);

	if (brdf->is_phong) {
		reflect_phong(brdf, nl, nh, out);
		return;
	}
	for (int c = 0; c < 3; c++) {
		const double f = brdf->f0[c] + (1 - brdf->f0[c]) * schlick;

		out[c] = (1 - brdf->layer[c]) * (1 - schlick) * brdf->diffuse[c] * nl + f * shine;
	}
}

#define SIDE 16 /* directions of a table's entry are a grid of SIDE x SIDE */

static double roughness_of(int i)
{
	return (double)i / (BRDF_STEPS - 1);
}

static double cosine_of(int i)
{
	return fmax((double)i / (BRDF_STEPS - 1), 0.01);
}

/* Finds the half-way vector of (u, w), 0..1, as an eye in the plane of x and z sees microfacets (Heitz 2018), of the
 * half with y >= 0: the other half is the same. */
static void half_way(const double v[3], double alpha, double u, double w, double h[3])
{
	double eye[3] = { alpha * v[0], 0, v[2] };
	const double angle = PI * (w - 0.5), y = sqrt(u) * cos(angle);

	v3d_normalize(eye, eye);
	const double bend = (1 + eye[2]) / 2, x = (1 - bend) * sqrt(1 - y * y) + bend * sqrt(u) * sin(angle);
	const double z = sqrt(fmax(0, 1 - x * x - y * y));
	v3d_set(h, alpha * (z * eye[0] - x * eye[2]), alpha * y, fmax(0, z * eye[2] + x * eye[0]));
	v3d_normalize(h, h);
}

/* The weight of a half-way vector is f * G / G1(v), where 2 * nv / G1 is the sum below. */
static void integrate_specular(double nv, double alpha, float out[2])
{
	const double v[3] = { sqrt(1 - nv * nv), 0, nv }, a2 = alpha * alpha;
	double sum[2] = { 0, 0 };

	for (int i = 0; i < SIDE * SIDE; i++) {
		double h[3];

		half_way(v, alpha, (i / SIDE + 0.5) / SIDE, (i % SIDE + 0.5) / SIDE, h);
		const double vh = v3d_dot(v, h), nl = 2 * vh * h[2] - v[2], schlick = fifth(1 - fmin(vh, 1));
		if (!(nl > 0))
			continue;
		const double weight = 2 * nl * visibility(nl, nv, alpha) * (nv + sqrt(a2 + (1 - a2) * nv * nv));
		sum[0] += weight * (1 - schlick);
		sum[1] += weight * schlick;
	}
	out[0] = (float)(sum[0] / (SIDE * SIDE));
	out[1] = (float)(sum[1] / (SIDE * SIDE));
}

static double integrate_beneath(double nv)
{
	const double v[3] = { sqrt(1 - nv * nv), 0, nv };
	double sum = 0;

	for (int i = 0; i < SIDE * SIDE; i++) {
		const double u = (i / SIDE + 0.5) / SIDE, angle = 2 * PI * (i % SIDE + 0.5) / SIDE;
		double h[3] = { sqrt(u) * cos(angle), sqrt(u) * sin(angle), sqrt(1 - u) };

		v3d_add(h, h, v);
		v3d_normalize(h, h);
		sum += fifth(1 - fmin(v3d_dot(v, h), 1));
	}
	return sum / (SIDE * SIDE);
}

void brdf_albedo_init(struct brdf_albedo *albedo)
{
	for (int i = 0; i < BRDF_STEPS; i++) {
		const double nv = cosine_of(i);

		albedo->beneath[i] = (float)integrate_beneath(nv);
		for (int r = 0; r < BRDF_STEPS; r++)
			integrate_specular(nv, fmax(roughness_of(r) * roughness_of(r), LEAST_ALPHA), albedo->specular[r][i]);
	}
}

static double lerp(double a, double b, double t)
{
	return a + t * (b - a);
}

/* Splits 0..1 into a step of the tables and the rest. */
static int step_of(double x, double *rest)
{
	const double at = fmin(fmax(x, 0), 1) * (BRDF_STEPS - 1);
	const int i = at < BRDF_STEPS - 2 ? (int)at : BRDF_STEPS - 2;

	*rest = at - i;
	return i;
}

void brdf_ambient(const struct brdf_albedo *albedo, const struct brdf *brdf, double nv, double out[3])
{
	double tr, tv, part[2];
	const int r = step_of(sqrt(brdf->alpha), &tr), i = step_of(nv, &tv);
	const double beneath = lerp((double)albedo->beneath[i], (double)albedo->beneath[i + 1], tv);

	for (int k = 0; k < 2; k++) {
		const float (*row)[2] = albedo->specular[r], (*next)[2] = albedo->specular[r + 1];

		part[k] = lerp(lerp((double)row[i][k], (double)row[i + 1][k], tv),
		               lerp((double)next[i][k], (double)next[i + 1][k], tv), tr);
	}
	for (int c = 0; c < 3; c++) {
		out[c] = brdf->diffuse[c];
		if (!brdf->is_phong)
			out[c] = out[c] * (1 - brdf->layer[c]) * (1 - beneath) + brdf->f0[c] * part[0] + part[1];
	}
}
