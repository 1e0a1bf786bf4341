/* Surfaces that let a part of the light through (BLEND materials) as ones with holes in proportion. */
#ifndef PSR_SURFACE_STIPPLE_H
#define PSR_SURFACE_STIPPLE_H

/* Cells of the pattern in pixels of the level that is sampled. With 2 a picture between two levels, whose pixels are up
 * to two steps wide, closes more of it: at magnification 0.66 panes of 0.25, 0.5 and 0.75 were drawn as by 0.45, 0.76
 * and 0.97, with 3 as by 0.39, 0.66 and 0.92. */
#define STIPPLE_PIXELS 3.0

/* Whether a surface of this opacity, 0..1, is open at place p. Space is cut into cubes of this side, each of which
 * has a threshold: neighbours' are far apart, so that surfaces of any slope are open in proportion all over. 0 and
 * less are open everywhere, 1 and more nowhere. */
int stipple_is_open(float opacity, const double p[3], double cell);

#endif
