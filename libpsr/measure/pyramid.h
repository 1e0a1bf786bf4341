/* An image at all sizes, in linear light: the truth's own textures. */
#ifndef PSR_MEASURE_PYRAMID_H
#define PSR_MEASURE_PYRAMID_H

#include "psr/mesh.h"

/* What the codes of an image mean. COLOR: sRGB; COVERED: the same, weighted by alpha, which multiplies the result;
 * DATA: linear; NORMAL: 0..255 is -1..1. Alpha is linear. */
enum pyramid_kind { PYRAMID_COLOR, PYRAMID_COVERED, PYRAMID_DATA, PYRAMID_NORMAL, PYRAMID_KINDS };

#define PYRAMID_LEVELS 32

struct pyramid {
	const struct psr_image *image; /* level 0; NULL: not in use */
	enum pyramid_kind kind;
	int n_levels;
	struct pyramid_level {
		uint32_t width, height;
		float (*texel)[4]; /* NULL in level 0 */
	} level[PYRAMID_LEVELS];
};

/* The image must outlive the pyramid. Each level is half as large as the one below, the mean of the areas under its
 * texels. MEMORY; pyramid_fini() then, too. */
int pyramid_init(struct pyramid *pyramid, const struct psr_image *image, enum pyramid_kind kind);
void pyramid_fini(struct pyramid *pyramid);

/* Computes the mean around (s, t) over the parallelogram of the two axes, {ds, dt} each: up to PYRAMID_TAPS trilinear
 * taps along the longer one. Axes of 0: as magnified, bilinear or nearest. All are finite. */
#define PYRAMID_TAPS 16
void pyramid_mean(const struct pyramid *pyramid, const struct psr_texture *texture, const double st[2],
                  const double axes[2][2], float out[4]);

#endif
