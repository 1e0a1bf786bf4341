/* No ray slips through between kept rectangles: steps of dpoint_simplify(). */
#ifndef PSR_DPOINT_SEAL_H
#define PSR_DPOINT_SEAL_H

#include "rectangle.h"

/* Quadrics over neighbouring places end at slightly different heights, so a slanted ray may pass over one and under
 * the other. Each cell is looked at along 17 rays to each of 9 places; one of two sides from both, along 33; one of a
 * saddle, where curvatures are exact, along four flat ones more. Where one gets through, which nothing stops until six
 * times options->height behind the place, candidates that were left out are kept, those first that are over most such
 * cells; where it still does, the face is tiled if it may be (lean.h), or there is a flat point in the cell's own plane.
 * Planes of neighbouring cells meet at their sides, so these leave no gap. Clouds are left as they are: their cells do
 * not meet. is_tiled: of tile_faces(), whose cells are left as they are; NULL: no face may be tiled.
 * Adds to surface, choice, cover and is_tiled. MEMORY, CANCELLED. */
int seal(struct dpoint_surface *surface, struct dpoint_choice *choice, struct dpoint_cover *cover,
         uint8_t *is_tiled, const struct dpoint_cover_options *options, const struct dpoint_work *work);

/* Keeps candidates that were left out, such that each open cell (is_open, by cell) that one of them covers gets one:
 * first who covers most of them. MEMORY. */
int keep_over_open(struct dpoint_choice *choice, const struct dpoint_cover *cover, const uint8_t *is_open);

/* Keeps the candidates `before` to n - 1, which were added after the choice. MEMORY. */
int keep_added(struct dpoint_choice *choice, size_t before, size_t n);

#endif
