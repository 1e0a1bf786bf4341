/* Guesses the kind of an image's content, and combines images. */
#ifndef PSR_IMPORT_IMAGE_IMAGE_KIND_H
#define PSR_IMPORT_IMAGE_IMAGE_KIND_H

#include "psr/mesh.h"

/* Returns whether nearly all pixels are vectors of about unit length that point outwards, as a normal map's are and a
 * height map's are not. */
int image_is_normal_map(const struct psr_image *image);

/* Returns whether nearly all pixels are either transparent or opaque, and some are of each kind. */
int image_is_cutout(const struct psr_image *image);

/* Makes an image of the larger width and height of both, with the color of `base` (white if NULL) and the alpha of
 * `base` times that of `opacity`: its alpha if it is not constant 255, else its red. Returns 0 without memory. */
int image_with_opacity(struct psr_image *out, const struct psr_image *base, const struct psr_image *opacity);

/* Makes an image from the red of both: blue is metallic, green roughness; 255 for a missing image. */
int image_metallic_roughness(struct psr_image *out, const struct psr_image *metallic,
                             const struct psr_image *roughness);

#endif
