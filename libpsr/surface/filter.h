/* The elliptical weighted average of [G] 5.1: a Gaussian over the texels under an ellipse ([Heckbert89]). */
#ifndef PSR_SURFACE_FILTER_H
#define PSR_SURFACE_FILTER_H

#include "mip.h"
#include "psr/mesh.h"

/* The mean of the image around st, both in 0..1 over the image and finite. The ellipse is what the unit circle becomes
 * under `axes` (d(s,t) = axes * d(x,y)): the support of a Gaussian that has fallen to exp(-2) there, less that value,
 * so that no texel enters with a jump. It is widened by the variance of the bilinear interpolation between texels.
 *
 * It is taken on the last level of the mip map where the shorter semi-axis is at least 1.5 texels, less the variance
 * that averaging within texels has added already, so that the level does not show. Of an ellipse more than 8 times as
 * long as it is wide the shorter axis counts as an eighth of the longer one, so that 250 texels are enough, or 600
 * where sides are not powers of two. Where it is below 1.5 texels of the image it counts as that; where the longer one
 * is below 1, the result goes over to the bilinear, or nearest, value of the point.
 *
 * Returns the share of the ellipse in the variance of the filter, 0..1: how much of the differences under it are
 * within the ellipse, and not between texels that are farther apart than it is wide. */
double filter_look_up(const struct mip *mip, const struct psr_texture *texture, const double st[2],
                      const double axes[2][2], float out[4]);

/* The image at a point, bilinear or nearest; st finite. */
void filter_point(const struct psr_image *image, enum mip_kind kind, const struct psr_texture *texture,
                  const double st[2], float out[4]);

#endif
