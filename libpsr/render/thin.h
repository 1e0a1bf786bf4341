/* Thin: things that are narrower than a sample's cell, such as needles and wires, cover a pixel in part. */
#ifndef PSR_RENDER_THIN_H
#define PSR_RENDER_THIN_H

#include "sheer_tile.h"

/* Finds the veil of each opacity, see simd/veil.h. */
void thin_tabulate(float bits[PSR_OPAQUE + 1]);

/* Finds the light of the thin things in a tile that shows no layer yet. The nearest lends its colour to all behind
 * it. */
void thin_draw(struct sheer_tile *l, const struct sheer_drawing *d, const struct sheer_area *area,
               const struct warp_target *target, const struct sheer_entries *entries);

#endif
