#include <assert.h>
#include <math.h>
#include "base/direction.h"
#include "base/vec.h"
#include "blend.h"
#include "material.h"
#include "model/blocks.h"
#include "surface.h"

/* The mean of opposite normals can be as long by quantisation alone. */
#define NO_NORMAL 0.03

struct sums {
	double weight, normal[3], base[3];
	double metallic, open;
	double dielectric, reflected; /* of what is not metal: weight, and that times F0 */
	double mirrored, width2;      /* of F0 over the channels, and of that times the lobe's squared width */
	double plain_width2;          /* of weight times squared width, where all reflect nothing */
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
	const double metallic = (double)look.metallic, rest = 1 - metallic, reflectance = (double)look.reflectance;
	const double width = (double)look.roughness * (double)look.roughness, width2 = width * width;
	sums->weight += weight;
	sums->metallic += weight * metallic;
	sums->open += weight * (double)look.open;
	sums->dielectric += weight * rest;
	sums->reflected += weight * rest * reflectance;
	sums->plain_width2 += weight * width2;
	for (int c = 0; c < 3; c++) {
		const double mirrored = weight * (rest * reflectance + metallic * (double)look.base[c]);

		sums->base[c] += weight * (double)look.base[c];
		sums->mirrored += mirrored;
		sums->width2 += mirrored * width2;
	}
}

uint64_t blend_attr(const uint64_t *attr, const float *weight, int n, const float facing[3])
{
	struct sums sums = { .weight = 0 };
	struct look look = { .unlit = is_mostly_unlit(attr, weight, n) };
	float normal[3] = { facing[0], facing[1], facing[2] };
	double length;

	for (int i = 0; i < n; i++)
		if (weight[i] > 0 && (int)PSR_ATTR_UNLIT(attr[i]) == look.unlit)
			add(&sums, attr[i], (double)weight[i]);
	length = v3d_normalize(sums.normal, sums.normal) / sums.weight;
	if (length > NO_NORMAL)
		v3f_set(normal, (float)sums.normal[0], (float)sums.normal[1], (float)sums.normal[2]);
	const double width2 = sums.mirrored > 0 ? sums.width2 / sums.mirrored : sums.plain_width2 / sums.weight;
	look.roughness = (float)material_widened(sqrt(sqrt(width2)), length < 1 ? (1 - length) / length : 0);
	for (int c = 0; c < 3; c++)
		look.base[c] = (float)(sums.base[c] / sums.weight);
	look.metallic = (float)(sums.metallic / sums.weight);
	look.open = (float)(sums.open / sums.weight);
	look.reflectance = sums.dielectric > 0 ? (float)(sums.reflected / sums.dielectric) : (float)MATERIAL_DIELECTRIC;
	surface_face(normal, facing);
	return material_encode(&look) | psr_direction_encode(normal);
}
