/* Access to single samples of blocks. */
#ifndef PSR_RENDER_BLOCK_H
#define PSR_RENDER_BLOCK_H

#include "base/direction.h"
#include "plan.h"

/* Index of a valid sample's depth and attributes. */
static inline size_t block_index(const struct psr_blocks *b, uint32_t block, uint32_t sample)
{
	const uint64_t below = b->mask[block] & ((UINT64_C(1) << sample) - 1);

	return (size_t)psr_blocks_attr_first(b, block) + (size_t)__builtin_popcountll(below);
}

/* The position of a valid sample in inner coordinates. */
static inline void block_position(const struct psr_blocks *b, uint32_t block, uint32_t sample, float p[3])
{
	const struct psr_projection *projection = &b->projection[b->block_projection[block]];
	const float dx = projection->spacing, dy = dx * 0.866025404f, scale = (float)(1u << psr_blocks_level(b, block));
	const uint32_t r = sample >> 3, c = sample & 7;
	struct psr_place place;

	psr_blocks_place(b, block, &place);
	const float x = ((float)place.col + scale * ((float)c + (float)(r & 1) * 0.5f)) * dx;
	const float y = ((float)place.row + scale * (float)r) * dy;
	const float z = psr_place_depth(&place, b->depth[block_index(b, block, sample)]);
	for (int a = 0; a < 3; a++)
		p[a] = x * projection->axis[0][a] + y * projection->axis[1][a] + z * projection->axis[2][a];
}

static inline uint64_t block_attr(const struct psr_blocks *b, uint32_t block, uint32_t sample)
{
	return b->attr[block_index(b, block, sample)];
}

/* Whether a normal faces away, as the warp decides; v: the vector to the eye, g: its product with the normal. */
static inline int faces_away(float g, const float v[3])
{
	return g < 0 && g * g > BACK_SINE * BACK_SINE * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

#endif
