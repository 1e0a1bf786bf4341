/* Guesses of what an image holds, and images made of others. */
#ifndef PSR_IMPORT_IMAGE_IMAGE_KIND_H
#define PSR_IMPORT_IMAGE_IMAGE_KIND_H

#include "psr/mesh.h"

/* Whether nearly all pixels are vectors of about unit length that point outwards, unlike a height map's. */
int image_is_normal_map(const struct psr_image *image);

/* Whether nearly all pixels are either transparent or opaque, with both present. */
int image_is_cutout(const struct psr_image *image);

/* Makes an image of the larger width and height of both, with the color of `base` (white if NULL) and the alpha of
 * `base` times that of `opacity`: its alpha if it is not constant 255, else its red. Returns 0 without memory. */
int image_with_opacity(struct psr_image *out, const struct psr_image *base, const struct psr_image *opacity);

/* As above, from the red of both: blue is metallic, green roughness; 255 for a missing image. */
int image_metallic_roughness(struct psr_image *out, const struct psr_image *metallic,
                             const struct psr_image *roughness);

#endif
