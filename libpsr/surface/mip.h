/* Mip maps of images in linear light. */
#ifndef PSR_SURFACE_MIP_H
#define PSR_SURFACE_MIP_H

#include <stdint.h>
#include "psr/mesh.h"

enum mip_kind {
	MIP_COLOR,   /* RGB sRGB-coded; A linear, a channel of its own */
	MIP_COVERED, /* RGB sRGB-coded, multiplied by A, which is linear */
	MIP_LINEAR,  /* four linear channels */
	MIP_NORMAL,  /* RGB: -1..1, scaled to unit length; the means of many are shorter. The fourth channel is 0 */
};

#define MIP_KINDS 4
#define MIP_LEVELS 32

/* Level 0 is the image, decoded texel by texel; level k + 1 has half of the texels of level k along each side, rounded
 * down, at least one; the last is a single texel. Each texel is the exact mean over its area, of odd sides, too: all
 * levels have the same mean, and wrap at the same places. From level 1 on 16 bits a channel: 8/3 bytes a texel of the
 * image. */
struct mip {
	const struct psr_image *image;
	enum mip_kind kind;
	int n_levels;
	struct mip_level {
		uint32_t width, height;
		const uint16_t *texel; /* NULL in level 0 */
	} level[MIP_LEVELS];
	uint16_t *memory;
};

/* Makes the levels; the image must outlive them. MEMORY; call mip_fini() even then. */
int mip_init(struct mip *mip, const struct psr_image *image, enum mip_kind kind);
void mip_fini(struct mip *mip);

/* Four bytes of an image. */
void mip_decode(enum mip_kind kind, const uint8_t *texel, float out[4]);

/* Returns a texel of a level: x < width, y < height. */
static inline void mip_texel(const struct mip *mip, int level, uint32_t x, uint32_t y, float out[4])
{
	size_t at = 4 * ((size_t)y * mip->level[level].width + x);
	float zero = mip->kind == MIP_NORMAL ? 32768 : 0, step = mip->kind == MIP_NORMAL ? 1.0f / 32767 : 1.0f / 65535;

	if (level == 0)
		mip_decode(mip->kind, mip->image->rgba + at, out);
	for (int c = 0; level > 0 && c < 4; c++)
		out[c] = ((float)mip->level[level].texel[at + (size_t)c] - zero) * step;
}

#endif
