/* How a place reflects light: what frames compute, in double. glTF's own model: GGX's distribution of facets, Smith's
 * shadowing of these (height-correlated), and Schlick's Fresnel, over Lambert. */
#ifndef PSR_SURFACE_LOBE_H
#define PSR_SURFACE_LOBE_H

#include "material.h"

/* Computes what is scattered of light from ahead, and F0, what is mirrored. */
void lobe_colors(double diffuse[3], double f0[3], const struct look *look);

/* Computes the light that goes to the eye of light 1 from a direction. Normal n, to_light and to_eye have unit length.
 *
 * With N.L > 0, w = roughness^2, H between light and eye, m metallic, f the reflectance and x = (1 - H.V)^5 it is
 *
 *     base (1 - m) (1 - f) (1 - x) N.L + pi D V (F0 (1 - x) + x) N.L,  F0 = f (1 - m) + base m
 *     D = w^2 / (pi (1 - (1 - w^2) (N.H)^2)^2)
 *     V = 1 / 2 / (N.L sqrt(w^2 + (1 - w^2) (N.V)^2) + N.V sqrt(w^2 + (1 - w^2) (N.L)^2))
 *
 * so white scatters all light from ahead. A look without metal and reflectance has x = 0. N.V is at least 1e-3, w^2 at
 * least 4e-6. */
void lobe_reflect(double light[3], const struct look *look, const double n[3], const double to_light[3],
                  const double to_eye[3]);

/* Computes the light that goes to the eye of ambient light 1, as far as the place is open: what is scattered, and S F0
 * + (1 - F0) G of what is mirrored, the lobe's integral over all lights. With v = N.V, w as above, s = 1 - roughness:
 *
 *     S = 1 / (1 + w (0.42 + 1.05 v - 1.87 v^2) + w^2 (-0.45 + 1.83 v + 1.17 v^2))
 *     G = s (1 - v)^3 (0.27 + 0.8 s^2 (1 - v)^2)
 *
 * fit the integral within 0.12, 0.02 in the mean square. It is below 1, since facets hide light from each other. */
void lobe_ambient(double light[3], const struct look *look, const double n[3], const double to_eye[3]);

#endif
