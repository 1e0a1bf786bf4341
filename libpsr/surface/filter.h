/* The elliptical weighted average of [G] 5.1: a Gaussian over the texels under an ellipse ([Heckbert89]). */
#ifndef PSR_SURFACE_FILTER_H
#define PSR_SURFACE_FILTER_H

#include "mip.h"
#include "psr/mesh.h"

/* Computes the mean of the image around st (0..1 over the image, finite). `axes` turns the unit circle into the ellipse
 * (d(s,t) = axes * d(x,y)) that supports a Gaussian; its value at the rim, exp(-2), is subtracted, so that texels enter
 * without a jump. The variance of bilinear interpolation widens the ellipse.
 *
 * The filter reads the last mip level where the shorter semi-axis has at least 1.5 texels, less the variance that
 * averaging within texels has added, so that the level does not show. The shorter axis counts as at least an eighth of
 * the longer one, so that 250 texels are enough, 600 where sides are not powers of two, and as at least 1.5 texels of
 * the image. Where the longer axis is below 1, the result goes over to the bilinear, or nearest, value of the point.
 *
 * Returns the ellipse's share of the filter's variance, 0..1: the rest is between texels that are farther apart than
 * the ellipse is wide. */
double filter_look_up(const struct mip *mip, const struct psr_texture *texture, const double st[2],
                      const double axes[2][2], float out[4]);

/* Computes the image at a point, bilinear or nearest; st finite. */
void filter_point(const struct psr_image *image, enum mip_kind kind, const struct psr_texture *texture,
                  const double st[2], float out[4]);

#endif
