/* A cube prepared for the warp; all variants use it. */
#ifndef PSR_SIMD_CUBE_H
#define PSR_SIMD_CUBE_H

#ifdef __BMI2__
#include <immintrin.h>
#endif
#include "warp.h"

struct warp_cube {
	double origin[3]; /* its middle */
	const struct warp_octants *octants;
	const uint16_t *normal; /* of its leaves, and their offsets; NULL: none, and the cube is not mixed */
	const uint8_t *offset;
	const uint8_t (*color)[3]; /* NULL: gray */
	uint64_t n_ahead;          /* leaves of the tree from its first one on: vectors may read those of later cubes */
	uint64_t mask;
	uint32_t id;
};

/* Places the codes of a cube's children at its octants. */
static inline uint64_t warp_cube_mask(uint64_t children, unsigned code)
{
#ifdef __BMI2__
	return _pdep_u64(children, _pdep_u64(code, UINT64_C(0x0101010101010101)) * 0xff);
#else
	uint64_t mask = 0;

	for (unsigned i = 0; i < 8; i++)
		if (code >> i & 1) {
			mask |= (children & 0xff) << 8 * i;
			children >>= 8;
		}
	return mask;
#endif
}

static inline void warp_cube_make(struct warp_cube *out, const struct warp_instance *in, uint32_t slot)
{
	const struct warp_cubes *to = in->cubes;
	const struct psr_cubes *cubes = to->model;
	const uint32_t cube = slot - in->first_slot;
	const struct psr_cube_level *level = psr_cubes_level(cubes, cube);
	const struct octree *tree = level->tree;
	const uint32_t code = psr_cubes_code(cubes, level, cube), leaf = psr_cubes_leaf(cubes, level, cube);
	double center[3];

	psr_cubes_center(cubes, level, cube, center);
	for (int a = 0; a < 3; a++)
		out->origin[a] = to->origin[a]
		                 + ((to->axis[a][0] * center[0] + to->axis[a][1] * center[1]) + to->axis[a][2] * center[2]);
	out->octants = &to->level[level - cubes->level];
	out->normal = tree->normal != NULL ? tree->normal + leaf : NULL;
	out->offset = tree->offset != NULL && tree->normal != NULL ? tree->offset + leaf : NULL;
	out->color = tree->color != NULL ? (const uint8_t(*)[3])tree->color + leaf : NULL;
	out->n_ahead = tree->n_leaves - leaf;
	out->mask = warp_cube_mask(psr_cubes_children(tree, code), tree->code[code]);
	out->id = slot * PSR_BLOCK_SAMPLES;
}

/* Components of a normal, 511 times as long. */
static inline void warp_normal(float n[3], uint32_t tens)
{
	for (int k = 0; k < 3; k++)
		n[k] = (float)((int32_t)(tens << (22 - 10 * k)) >> 22);
}

/* How far axis a of a leaf is from its middle; offset: three at most in magnitude. */
static inline float warp_offset(const struct warp_octants *octants, int a, const float n[3], float offset)
{
	return ((n[0] * octants->along[a][0] + n[1] * octants->along[a][1]) + n[2] * octants->along[a][2]) * offset;
}

#define WARP_OFFSET_MIDDLE (OCTREE_OFFSETS - 1) /* an offset is twice its step less this */

#endif
