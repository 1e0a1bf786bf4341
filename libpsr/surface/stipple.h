/* How far one sees through surfaces that let a part of the light through (BLEND materials): for rays these have holes in
 * proportion. */
#ifndef PSR_SURFACE_STIPPLE_H
#define PSR_SURFACE_STIPPLE_H

/* Cells of the pattern in pixels: much smaller than what rays are asked for, so that many rays to any place meet both
 * cells that are open and cells that are not; and no simple part of a pixel. */
#define STIPPLE_PIXELS 0.37

/* Whether a surface of this opacity, 0..1, is open at place p. Space is cut into cubes of this side, each of which
 * has a threshold: neighbours' are far apart, so that surfaces of any slope are open in proportion all over. 0 and
 * less are open everywhere, 1 and more nowhere. */
int stipple_is_open(float opacity, const double p[3], double cell);

#endif
