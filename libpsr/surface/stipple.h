/* BLEND materials as surfaces with holes in proportion to their transparency. */
#ifndef PSR_SURFACE_STIPPLE_H
#define PSR_SURFACE_STIPPLE_H

/* Cells of the pattern in pixels of the level. Smaller ones close in pictures between two levels: at magnification
 * 0.66 panes of 0.25, 0.5 and 0.75 measure 0.45, 0.76 and 0.97 with 2, and 0.39, 0.66 and 0.92 with 3. */
#define STIPPLE_PIXELS 3.0

/* Whether a surface of this opacity is open at p: at 0 and less everywhere, at 1 and more nowhere. Space is cut into
 * cubes of this side, each with a threshold; neighbours' are far apart, so that surfaces of any slope are open evenly.
 * */
int stipple_is_open(float opacity, const double p[3], double cell);

#endif
