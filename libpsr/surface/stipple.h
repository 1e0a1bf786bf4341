/* BLEND materials for rays: surfaces with holes in proportion to their transparency. */
#ifndef PSR_SURFACE_STIPPLE_H
#define PSR_SURFACE_STIPPLE_H

/* Cells of the pattern in pixels: so small that many rays to any place meet open and solid cells, and no simple part of
 * a pixel. */
#define STIPPLE_PIXELS 0.37

/* Returns whether a surface of this opacity is open at p: at 0 and less everywhere, at 1 and more nowhere. Space is cut
 * into cubes of this side, each with a threshold. Neighbouring cubes have thresholds far apart, so that surfaces of any
 * slope are open evenly. */
int stipple_is_open(float opacity, const double p[3], double cell);

#endif
