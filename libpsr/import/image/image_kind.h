/* What an image is good for, and images made of others. */
#ifndef PSR_IMPORT_IMAGE_IMAGE_KIND_H
#define PSR_IMPORT_IMAGE_IMAGE_KIND_H

#include "psr/mesh.h"

/* Nearly all pixels are vectors of about unit length that point out of the surface; a height map's are not. */
int image_is_normal_map(const struct psr_image *image);

/* Nearly all pixels are either transparent or opaque, and there are both. */
int image_is_cutout(const struct psr_image *image);

/* A new image, of the larger width and height of both: the color of `base` (white if NULL), and alpha from `opacity`:
 * its alpha if that says anything, else its red, times the alpha of `base`. 0 without memory. */
int image_with_opacity(struct psr_image *out, const struct psr_image *base, const struct psr_image *opacity);

/* The same of the red of both: blue is metallic, green roughness; 255 where there is no image. */
int image_metallic_roughness(struct psr_image *out, const struct psr_image *metallic,
                             const struct psr_image *roughness);

#endif
