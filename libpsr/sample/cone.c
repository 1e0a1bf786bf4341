#include "../base/vec.h"
#include "cone.h"

/* Normals and axis are rounded to floats: their product is off by some 2^-22. */
#define SLACK 0x1p-20f

static void facing(const struct ray_scene *scene, const struct lattice_sample *sample, float normal[3])
{
	v3f_scale(normal, ray_scene_normal(scene, sample->surface & ~LATTICE_BACK), (sample->surface & LATTICE_BACK) ? -1 : 1);
}

void cone_bound(const struct ray_scene *scene, const struct lattice_sample sample[PSR_BLOCK_SAMPLES], uint64_t mask,
                float axis[3], float *cosine)
{
	float sum[3] = { 0, 0, 0 }, normal[3];

	for (uint64_t left = mask; left != 0; left &= left - 1) {
		facing(scene, &sample[__builtin_ctzll(left)], normal);
		v3f_add(sum, sum, normal);
	}
	*cosine = -1;
	if (!(v3f_normalize(axis, sum) > 0.001f)) {
		v3f_set(axis, 0, 0, 1);
		return;
	}
	float least = 1;
	for (uint64_t left = mask; left != 0; left &= left - 1) {
		float c;

		facing(scene, &sample[__builtin_ctzll(left)], normal);
		c = v3f_dot(axis, normal);
		least = c < least ? c : least;
	}
	*cosine = least - SLACK > -1 ? least - SLACK : -1;
}
