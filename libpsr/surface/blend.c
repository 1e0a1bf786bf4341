#include <assert.h>
#include "base/direction.h"
#include "base/vec.h"
#include "blend.h"
#include "material.h"
#include "model/blocks.h"
#include "surface.h"

/* The mean of opposite normals can be as long by quantisation alone. */
#define NO_NORMAL 0.03

struct sums {
	double weight, normal[3], diffuse[3];
	double reflected[3];  /* of specular / (exponent + 2), to which a lobe's light is in proportion */
	double light, spread; /* sums of that over the channels, and of that times the lobe's variance */
	double plain_spread;  /* of weight times variance, where all reflect nothing */
};

static int is_mostly_unlit(const uint64_t *attr, const float *weight, int n)
{
	double lit = 0, unlit = 0;

	for (int i = 0; i < n; i++) {
		assert(weight[i] >= 0 && weight[i] - weight[i] == 0);
		*(PSR_ATTR_UNLIT(attr[i]) ? &unlit : &lit) += (double)weight[i];
	}
	assert(lit + unlit > 0);
	return unlit > lit;
}

static void add(struct sums *sums, uint64_t attr, double weight)
{
	const float *normal = psr_direction_table()[PSR_ATTR_NORMAL(attr)];
	struct look look;
	double unit[3];

	material_decode(&look, attr);
	v3d_set(unit, (double)normal[0], (double)normal[1], (double)normal[2]);
	v3d_normalize(unit, unit); /* in double: a float's rounding would widen the sharpest lobes */
	v3d_add_scaled(sums->normal, sums->normal, weight, unit);
	sums->weight += weight;
	sums->plain_spread += weight / look.exponent;
	for (int c = 0; c < 3; c++) {
		double reflected = weight * (double)look.specular[c] / (look.exponent + 2);

		sums->diffuse[c] += weight * (double)look.diffuse[c];
		sums->reflected[c] += reflected;
		sums->light += reflected;
		sums->spread += reflected / look.exponent;
	}
}

uint64_t blend_attr(const uint64_t *attr, const float *weight, int n, const float facing[3])
{
	struct sums sums = { .weight = 0 };
	struct look look = { .unlit = is_mostly_unlit(attr, weight, n) };
	float normal[3] = { facing[0], facing[1], facing[2] };
	double length, variance;

	for (int i = 0; i < n; i++)
		if (weight[i] > 0 && (int)PSR_ATTR_UNLIT(attr[i]) == look.unlit)
			add(&sums, attr[i], (double)weight[i]);
	variance = sums.light > 0 ? sums.spread / sums.light : sums.plain_spread / sums.weight;
	length = v3d_normalize(sums.normal, sums.normal) / sums.weight;
	if (length > NO_NORMAL)
		v3f_set(normal, (float)sums.normal[0], (float)sums.normal[1], (float)sums.normal[2]);
	look.exponent = material_widened(1 / variance, length < 1 ? (1 - length) / length : 0);
	for (int c = 0; c < 3; c++) {
		look.diffuse[c] = (float)(sums.diffuse[c] / sums.weight);
		look.specular[c] = (float)(sums.reflected[c] / sums.weight * (look.exponent + 2));
	}
	surface_face(normal, facing);
	return material_encode(&look) | psr_direction_encode(normal);
}
